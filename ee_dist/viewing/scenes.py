"""A recording as a scene of rerun, whatever kind of system it is of."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from ee_dist.networks.model import GeneNetwork
from ee_dist.recording.records import RunRecord
from ee_dist.robots.model import Robot
from ee_dist.viewing.network_scene import write_network_rrd
from ee_dist.viewing.rerun_scene import write_rrd

SCENES: dict[type, Callable[[RunRecord, str | Path], None]] = {Robot: write_rrd, GeneNetwork: write_network_rrd}


def write_scene(run: RunRecord, path: str | Path) -> None:
    """Write the scene of its kind as an ``.rrd`` with its blueprint. Raises OSError where it cannot be written."""
    SCENES[type(run.robot)](run, path)
