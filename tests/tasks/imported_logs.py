"""Files of a robot, imported without a mapping, as the verbs take them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from ee_dist.tasks.config import Config, EngineConfig, EvaluatorConfig, RobotConfig
from ee_dist.tasks.import_ import Options, run


def imported_logs(description: Path, files: Sequence[Path], out: Path) -> Config:
    """What compares the recording that an import of ``files`` leaves in ``out``, of the robot of a ``description``."""
    found = Config(
        robot=RobotConfig(name="urdf", drives=str(description)),
        engine=EngineConfig("mujoco", 1),
        evaluator=EvaluatorConfig("serial"),
        measured=[str(f) for f in files],
    )
    run(found, Options(), out)
    return replace(found, measured=str(out / "measured.mcap"))
