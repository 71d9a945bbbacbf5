"""Columns called by a limb and a number, as FR_0_target: the joints of each limb are counted from the base on."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements.proposal.by_limb import called_by_limbs
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import LIKELY, Hints

LEGS = ("FR_hip_joint", "FR_knee_joint", "RL_hip_joint", "RL_knee_joint")
T = np.arange(500) / 100


def angles(t: np.ndarray) -> np.ndarray:
    """Of the joints in the order of LEGS, rad."""
    return np.stack([0.3 * np.sin(1.7 * t), 0.5 * np.cos(2.3 * t), 0.2 * np.sin(3.1 * t + 1), 0.4 * np.sin(t)], axis=1)


def frame(first: int, order: tuple[int, ...] = (0, 1, 2, 3)) -> pd.DataFrame:
    """Columns of RL before those of FR, so that no order of columns is that of the joints."""
    table = {"time_s": T}
    for k in (2, 3, 0, 1):
        name = f"{LEGS[k][:2]}_{first + k % 2}"
        table[f"{name}_target"] = np.degrees(angles(T)[:, order[k]])
        table[f"{name}_actual"] = np.degrees(angles(T - 0.05)[:, order[k]])
        table[f"{name}_error"] = table[f"{name}_actual"] - table[f"{name}_target"]
    return pd.DataFrame(table)


@pytest.mark.parametrize("first", [0, 1])
def test_a_limb_and_a_number_name_a_joint(tmp_path: Path, first: int) -> None:
    file = logs.written(tmp_path, frame(first))
    _, proposal = logs.proposed(tmp_path, file, LEGS)
    assert not proposal.questions
    found = {c.name: ((c.entry or {})["column"], c.sure) for c in proposal.choices if c.name.startswith("position")}
    assert found == {f"position_{j}": (f"{j[:2]}_{first + k % 2}_actual", LIKELY) for k, j in enumerate(LEGS)}
    log, _ = logs.imported(tmp_path, file, LEGS)
    assert np.allclose(log.sensors[:, :4], angles(T - 0.05))
    assert np.allclose(log.commands, angles(T))


@pytest.mark.parametrize(
    "columns",
    [
        [f"{j[:2]}_{n}_actual" for j in LEGS[::2] for n in (2, 3)],
        [f"FR_{n}_actual" for n in range(4)],
        ["FR_0_actual", "FR_1_actual", "RL_0_actual"],
        [f"leg{k}_{n}_actual" for k in (0, 1) for n in (0, 1)],
    ],
)
def test_other_counts_name_none(columns: list[str]) -> None:
    assert called_by_limbs(columns, LEGS) == {}


def test_words_for_what_was_asked_and_measured_share_out_columns_in_an_order_that_was_said(tmp_path: Path) -> None:
    robot, _ = logs.proposed(tmp_path, logs.written(tmp_path, frame(0)), LEGS)
    said = (LEGS[2], LEGS[3], LEGS[0], LEGS[1])
    proposal = proposal_for([tmp_path / "log.csv"], robot, Hints(joints=said))
    assert not proposal.questions
    found = {c.name: (c.entry or {}).get("column") for c in proposal.choices}
    columns = [f"{j[:2]}_{k % 2}" for k, j in enumerate(LEGS)]
    assert [found[f"position_{j}"] for j in LEGS] == [f"{c}_actual" for c in columns]
    assert [found[j] for j in LEGS] == [f"{c}_target" for c in columns]


def test_another_clock_of_the_same_rows_that_lasts_otherwise_is_told(tmp_path: Path) -> None:
    table = frame(0)
    for name, other, told in (
        ("hw_timestamp", 0.5 * T + 7.0, True),
        ("hw_timestamp", 1e6 * T, False),
        ("loop_time", 0.0 * T, False),
        ("stamp_sec", np.floor(T + 0.9), False),
    ):
        file = logs.written(tmp_path, table.assign(**{name: other}))
        _, report = logs.imported(tmp_path, file, LEGS)
        said = [s for s in report.suspicious if s.startswith("time:")]
        assert bool(said) == told, said
        assert not told or f"'{name}' of the same rows 2.495 s (0.5 times as long)" in said[0]
