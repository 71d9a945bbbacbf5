"""Logs without a column for the time: what positions and speeds say of the rate is proposed, and all else is shown."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements.proposal.model import UNKNOWN
from ee_dist.measurements.proposal.write import rows


def log(folder: Path, rate_hz: float, unit: float = 1.0, speeds: bool = True) -> Path:
    t = np.arange(900) / rate_hz
    wave = lambda s: np.stack([0.5 * np.sin(1.7 * s) + 0.2 * np.sin(4.1 * s), 0.4 * np.cos(2.3 * s)], axis=1)  # noqa: E731
    found = {}
    for k, j in enumerate(samples.JOINTS):
        found |= {
            f"{j}_pos_{'rad' if unit == 1 else 'deg'}": unit * wave(t)[:, k],
            f"{j}_goal_rad": wave(t + 0.04)[:, k],
        }
        if speeds:
            found[f"{j}_vel"] = np.gradient(wave(t), t, axis=0)[:, k]
    return logs.written(folder, pd.DataFrame(found))


@pytest.mark.parametrize(("rate_hz", "unit"), [(100.0, 1.0), (250.0, 1.0), (100.0, 180 / np.pi)])
def test_the_rate_is_that_at_which_speeds_are_the_change_of_positions(
    tmp_path: Path, rate_hz: float, unit: float
) -> None:
    _, proposal = logs.proposed(tmp_path, log(tmp_path, rate_hz, unit))
    assert f"say task.rate_hz={rate_hz:g}" in proposal.questions[0] and len(proposal.questions) == 1
    (time,) = [c for c in proposal.choices if c.group == "time"]
    assert time.entry == {"rate_hz": rate_hz}
    assert {c.name for c in proposal.choices if c.sure != UNKNOWN} >= {
        *samples.JOINTS,
        "position_elbow",
        "velocity_elbow",
    }


def test_without_speeds_the_table_says_what_is_to_be_written(tmp_path: Path) -> None:
    _, proposal = logs.proposed(tmp_path, log(tmp_path, 100, speeds=False))
    assert "say task.rate_hz=ROWS_A_SECOND" in proposal.questions[0]
    assert next(r[0] for r in rows(proposal)) == "time" and len(rows(proposal)) >= 3
