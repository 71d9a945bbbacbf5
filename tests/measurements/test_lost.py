"""Rows in which nothing was read are left out and told, and what robots do is not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.measurements.lost import without_lost
from ee_dist.measurements.readers import read
from ee_dist.measurements.table import Table
from ee_dist.trials.log import Array

T = np.arange(0, 10, 0.01)


def table(values: Array) -> Table:
    return Table(Path("a.csv"), {"time": T, **{f"q{k}": column for k, column in enumerate(values.T)}})


def motion(seed: int, joints: int = 6) -> Array:
    rng = np.random.default_rng(seed)
    waves = rng.uniform(-1, 1, joints) + 0.6 * np.sin(np.outer(T, rng.uniform(0.5, 4, joints)))
    return np.asarray(waves + 1e-3 * rng.standard_normal(waves.shape))


@pytest.mark.parametrize("number", [-np.pi, 0.0, 4095.0])
@pytest.mark.parametrize("seed", range(3))
def test_rows_at_one_number_are_left_out_and_told(number: float, seed: int) -> None:
    values = motion(seed) + (2.0 if number == 0.0 else 0.0)
    values[[300, 301, 302, 700]] = number
    found = without_lost(table(values))
    assert len(found) == len(T) - 4
    (note,) = found.notes
    assert note.startswith("4 of 1000 rows were not read") and "q0, q1, q2 and 3 more" in note and "row 301" in note
    assert found.line(300) == 304, "rows keep the numbers that the file's user sees"


@given(seed=st.integers(0, 10_000), steps=st.booleans(), coarse=st.sampled_from([0.0, 0.0015, 0.05]))
@settings(max_examples=60, deadline=None)
def test_motion_rest_and_steps_stay_as_they_are(seed: int, steps: bool, coarse: float) -> None:
    values = motion(seed)
    if steps:  # goals that are sent to all joints at once, and home again
        goal = np.zeros_like(values)
        goal[200:400], goal[600:620] = values[200], values[600]
        values = goal
    values = np.round(values / coarse) * coarse if coarse else values
    given_in = table(values)
    assert without_lost(given_in) is given_in


def test_all_joints_sent_home_and_back_for_longer_than_a_packet_are_no_loss() -> None:
    goal = np.tile([0.5, -0.3, 0.8, 1.0], (len(T), 1))
    goal[300:450] = 0.0
    given_in = table(goal)
    assert without_lost(given_in) is given_in


def test_feet_that_lose_the_floor_together_and_motors_told_nothing_are_no_loss() -> None:
    feet = np.where(np.sin(np.outer(T, [5.0, 5.0, 5.0, 5.1])) > -0.95, 1.0, -1.0)
    pulses = np.where(T[:, None] % 1.0 < 0.97, [0.3, -0.2, 0.4, -0.5], 0.0) * np.sign(np.sin(7 * T))[:, None]
    for values in (feet, pulses):
        given_in = table(values)
        assert without_lost(given_in) is given_in


def test_a_file_is_read_without_them(tmp_path: Path) -> None:
    values = motion(1, 3)
    values[500] = -np.pi
    lines = ["time,a,b,c", *(",".join(f"{x:.6f}" for x in (t, *row)) for t, row in zip(T, values, strict=True))]
    (tmp_path / "a.csv").write_text("\n".join(lines) + "\n")
    (recorded,) = read(tmp_path / "a.csv")
    assert len(recorded.tables[0]) == len(T) - 1
    assert "row 502" in recorded.tables[0].notes[0]


def test_rows_are_left_out_of_lists_in_cells_as_of_columns() -> None:
    values = motion(4)
    values[500] = -np.pi
    cells = [list(row) for row in values]
    found = without_lost(Table(Path("a.jsonl"), {"time": T, "q": cells, "name": ["arm"] * len(T)}))
    assert len(found) == len(T) - 1 and "q[0]" in found.notes[0]
