"""Fixtures of the recording tests; their samples are in ``recording_samples.py``."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import pytest

# Under every import mode of pytest; a module called conftest could be another folder's.
sys.path.insert(0, str(Path(__file__).parent))

from recording_samples import sample_run, write

from ee_dist.recording.records import RunRecord


@pytest.fixture
def run() -> RunRecord:
    return sample_run()


@pytest.fixture
def make_file(tmp_path: Path) -> Callable[[], Path]:
    """Writes the sample run and returns its path."""
    return lambda: write(tmp_path / "run.mcap", sample_run())
