"""``lead_s`` of a column: what it tells was so before its time stamp, in any record and for any kind of column."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.trials.log import SensorLog

LEAD_S = 0.0255
ROWS, STEP_S = 400, 0.001


def imported(folder: Path, group: str, lead_s: float, uneven: bool) -> SensorLog:
    t = np.arange(ROWS) * STEP_S
    if uneven:
        t[1:] += 0.0003 * np.random.default_rng(0).uniform(-1, 1, ROWS - 1)
    waves = {"x": 0.1 * np.sin(5 * t), "r": 0.1 * np.cos(7 * t), "f": 20 * np.sin(11 * t)}
    pd.DataFrame({"t": t} | waves).to_csv(folder / "a.csv", index=False)
    lead = {"lead_s": lead_s} if lead_s else {}
    data = {
        "time": {"column": "t", "unit": "s"},
        "sensors": {"position": {"column": "x", "unit": "m"} | (lead if group == "sensors" else {})},
        "commands": {"carriage": {"column": "r", "unit": "m"} | (lead if group == "commands" else {})},
        "torques": {"carriage": {"column": "f", "unit": "N"} | (lead if group == "torques" else {})},
    }
    return import_file(folder / "a.csv", mapping_of(data, folder / "map.yaml"), linear_stage())[0].log


@pytest.mark.parametrize("uneven", [False, True])
@pytest.mark.parametrize(
    ("group", "wave", "apart"),
    [
        ("sensors", lambda t: 0.1 * np.sin(5 * t), 1e-5),
        ("commands", lambda t: 0.1 * np.cos(7 * t), 2e-3),
        ("torques", lambda t: 20 * np.sin(11 * t), 5e-3),
    ],
)
def test_a_lead_moves_a_column_of_an_even_record_as_of_any_other(
    tmp_path: Path, group: str, wave: object, apart: float, uneven: bool
) -> None:
    log = imported(tmp_path, group, LEAD_S, uneven)
    told = {"sensors": log.sensors, "commands": log.commands, "torques": log.torques}[group]
    assert told is not None and callable(wave)
    within = np.asarray(log.times_s) < (ROWS - 2) * STEP_S - LEAD_S
    assert told[within, 0] == pytest.approx(wave(log.times_s[within] - log.times_s[0] + LEAD_S), abs=apart)


def test_without_a_lead_an_even_record_is_as_it_was_read(tmp_path: Path) -> None:
    log = imported(tmp_path, "torques", 0.0, uneven=False)
    assert log.torques is not None
    assert np.array_equal(log.torques[:, 0], pd.read_csv(tmp_path / "a.csv")["f"])
