"""A run and its recording, made once; how they are made is in ``viewing_samples.py``."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

# Under every import mode of pytest; a module called conftest could be another folder's.
sys.path.insert(0, str(Path(__file__).parent))

from viewing_samples import sample_run

from ee_dist.recording.records import RunRecord
from ee_dist.viewing.rerun_scene import write_rrd


@pytest.fixture(scope="session")
def run() -> RunRecord:
    return sample_run()


@pytest.fixture(scope="session")
def rrd(run: RunRecord, tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scene") / "run.rrd"
    write_rrd(run, path)
    return path
