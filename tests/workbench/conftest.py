"""A servo pendulum with dry friction that its model does not have, tried once for all tests of the workbench."""

from __future__ import annotations

import contextlib
import io
import sys
from pathlib import Path

import pytest

# Under every import mode of pytest.
sys.path.insert(0, str(Path(__file__).parent))

from ee_dist.tasks import trial
from ee_dist.tasks.config import Config, EngineConfig, RobotConfig

PLAN = ["multisine:seconds=2,amplitude=0.5,seed=1"]


@pytest.fixture(scope="session")
def recording(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tried")
    config = Config(
        robot=RobotConfig(name="servo_pendulum"), engine=EngineConfig("mujoco"), hidden="coulomb_friction@servo"
    )
    with contextlib.redirect_stdout(io.StringIO()):
        trial.run(config, trial.Options(excitations=PLAN, repeats=1, noise=0.002), folder)
    return folder / "trial.mcap"
