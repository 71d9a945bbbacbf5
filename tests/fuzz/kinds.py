"""A small whole file of some kind, what reads it, and what a reader may raise."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hydra.errors import HydraException
from omegaconf.errors import OmegaConfBaseException

from ee_dist.effects.effect import EffectError
from ee_dist.engines.contract import EngineError
from ee_dist.engines.drivers import DriverError
from ee_dist.recording.errors import RecordingError
from ee_dist.robots.model import RobotError
from ee_dist.tasks.config import ConfigError
from ee_dist.trials.excitation import ExcitationError
from ee_dist.trials.hardware import HardwareError
from ee_dist.trials.log import LogError

OURS = (
    RobotError, EffectError, RecordingError, LogError, ConfigError, HardwareError, EngineError, DriverError, ExcitationError,
)  # fmt: skip
"""What a reader may raise for a file that is not as it should be: each is told in one line."""
COMMAND_LINE = (*OURS, HydraException, OmegaConfBaseException)
"""Of the command line the program makes one line out of these too."""
Files = dict[str, bytes]


@dataclass(frozen=True)
class Sample:
    """``files`` by their path in a folder, of which ``main`` is what ``readers`` get; ``damaged`` those that may be damaged."""

    files: Files
    main: str
    readers: tuple[Callable[[Path], Any], ...]
    damaged: tuple[str, ...] = ()
    allowed: tuple[type[BaseException], ...] = OURS

    def targets(self) -> tuple[str, ...]:
        return self.damaged or (self.main,)


def made(write: Callable[[Path], Any]) -> Files:
    """All files that ``write`` makes in a folder."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        write(folder)
        return {str(p.relative_to(folder)): p.read_bytes() for p in sorted(folder.rglob("*")) if p.is_file()}
