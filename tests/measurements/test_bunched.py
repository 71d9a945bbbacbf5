"""Stamps that come in bunches are told from rows that were lost: the first say nothing of the motion, the second do."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.bunched import pace_of
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file, import_files
from ee_dist.measurements.jumps import jumping
from ee_dist.measurements.mapping import Mapping
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.log import Array

ROBOT = servo_pendulum(time_step_s=0.005)
STEP_S = 0.005
EVEN_S = np.arange(3000) * STEP_S


def motion(at_s: Array, seed: int, noise: float = 0.0) -> Array:
    rng = np.random.default_rng(seed)
    shape = rng.uniform((0.1, 0.5, 0.0), (0.3, 6.0, 6.0), (2, 4, 3))
    joints = [sum(a * np.sin(w * at_s + p) for a, w, p in waves) for waves in shape]
    return np.stack(joints, axis=1) + noise * rng.standard_normal((len(at_s), 2))


def late(at_s: Array, seed: int) -> Array:
    """Stamps of rows of which one in thirty comes late, and those behind it with it."""
    rng = np.random.default_rng(seed)
    waits = np.where(rng.random(len(at_s)) < 0.03, rng.uniform(0.3, 2.5, len(at_s)) * STEP_S, 0.0)
    return np.maximum.accumulate(at_s + waits + np.abs(rng.normal(0, 2e-4, len(at_s)))) + 1e-7 * np.arange(len(at_s))


def in_fours(at_s: Array, seed: int) -> Array:
    rows = np.arange(len(at_s))
    return at_s[np.minimum(rows // 4 * 4 + 3, rows[-1])] + 1e-5 * (rows % 4)


def in_equal_pairs(at_s: Array, seed: int) -> Array:
    return at_s[np.arange(len(at_s)) // 2 * 2]


@pytest.mark.parametrize("noise", [0.0, 1e-3, 5e-3])
@pytest.mark.parametrize("stamped", [late, in_fours, in_equal_pairs])
def test_bunches_are_rows_at_an_even_pace(stamped: Any, noise: float) -> None:
    for seed in range(5):
        stamps = stamped(EVEN_S, seed)
        assert pace_of(stamps, motion(EVEN_S, seed, noise)) == pytest.approx(STEP_S, rel=2e-3)
        wrapped = np.mod(10 * motion(EVEN_S, seed, noise), 2 * np.pi)
        assert pace_of(stamps, wrapped) == pytest.approx(STEP_S, rel=2e-3)


def dropped(rng: np.random.Generator) -> Array:
    return EVEN_S[rng.random(len(EVEN_S)) > 0.05]


def now_and_then(rng: np.random.Generator) -> Array:
    return np.cumsum(rng.exponential(STEP_S, len(EVEN_S)))


def unsteady(rng: np.random.Generator) -> Array:
    return EVEN_S + rng.uniform(0, 0.9 * STEP_S, len(EVEN_S))


@pytest.mark.parametrize("noise", [0.0, 1e-3, 5e-3])
@pytest.mark.parametrize("read", [dropped, now_and_then, unsteady])
def test_stamps_that_positions_follow_are_kept(read: Any, noise: float) -> None:
    for seed in range(5):
        at_s = read(np.random.default_rng(seed))
        assert pace_of(at_s, motion(at_s, seed, noise)) is None


def test_what_rests_or_has_a_gap_tells_nothing() -> None:
    noise = 1e-3 * np.random.default_rng(0).standard_normal((len(EVEN_S), 2))
    assert pace_of(late(EVEN_S, 0), noise) is None
    with_gap = np.delete(EVEN_S, slice(1000, 1100))
    assert pace_of(late(with_gap, 0), motion(with_gap, 0)) is None
    assert pace_of(EVEN_S, motion(EVEN_S, 0)) is None
    assert pace_of(EVEN_S[:50], motion(EVEN_S[:50], 0)) is None


def mapping(**time: Any) -> Mapping:
    data: dict[str, Any] = {
        "time": {"column": "t", "unit": "s", **time},
        "sensors": {"position": {"column": "q", "unit": "rad"}, "speed": {"speed_of": "position"}},
        "commands": {"servo": {"column": "g", "unit": "rad"}},
    }
    return mapping_of(data, Path("map.yaml"))


def written(folder: Path, at_s: Array, stamps: Array) -> Path:
    q = 1.2 * np.sin(3 * at_s)
    pd.DataFrame({"t": stamps, "q": q, "g": q}).to_csv(folder / "a.csv", index=False)
    return folder / "a.csv"


def test_an_import_takes_them_so_and_says_it(tmp_path: Path) -> None:
    record, report = import_file(written(tmp_path, EVEN_S, in_fours(EVEN_S, 0)), mapping(), ROBOT)
    (line,) = [d for d in report.done if "bunches" in d]
    assert (
        "a.csv: stamps come in bunches (0.01 to 20 ms apart)" in line and "rows are taken 5 ms apart (200 Hz)" in line
    )
    assert jumping(ROBOT, [("a", record.log)]) == [] and not report.gaps
    assert len(record.log) == pytest.approx(len(EVEN_S), abs=5)
    _, report = import_file(tmp_path / "a.csv", mapping(sure=True), ROBOT)
    assert not any("bunches" in d for d in report.done) and not report.even


def test_rows_that_were_lost_among_bunches_are_told(tmp_path: Path) -> None:
    at_s = np.delete(EVEN_S, [k + n for k in (370, 900, 1410, 2350) for n in range(4)])
    _, report = import_file(written(tmp_path, at_s, late(at_s, 0)), mapping(), ROBOT)
    assert any("bunches" in d for d in report.done)
    (line,) = [s for s in report.suspicious if "lost" in s]
    assert "time: rows seem to be lost at 4 places, before row 372 first" in line


def test_of_two_files_with_one_clock_both_are_taken_so(tmp_path: Path) -> None:
    q, stamps = 1.2 * np.sin(3 * EVEN_S), late(EVEN_S, 0)
    pd.DataFrame({"t": stamps, "q": q}).to_csv(tmp_path / "a_states.csv", index=False)
    pd.DataFrame({"t": stamps, "g": q}).to_csv(tmp_path / "a_commands.csv", index=False)
    time = {"column": "t", "unit": "s"}
    data: dict[str, Any] = {
        "tables": {n: {"file": f"{{trial}}_{n}.csv", "time": time} for n in ("states", "commands")},
        "sensors": {
            "position": {"table": "states", "column": "q", "unit": "rad"},
            "speed": {"speed_of": "position"},
        },
        "commands": {"servo": {"table": "commands", "column": "g", "unit": "rad"}},
    }
    files = [tmp_path / "a_states.csv", tmp_path / "a_commands.csv"]
    ((record, report),) = import_files(files, mapping_of(data, Path("map.yaml")), ROBOT)
    assert any("bunches" in d for d in report.done)
    assert np.abs(record.log.commands[:, 0] - record.log.sensors[:, 0]).max() < 0.02


def test_times_that_stand_still_say_how_rows_are_taken_at_an_even_pace(tmp_path: Path) -> None:
    still = pd.DataFrame({"t": in_equal_pairs(EVEN_S, 0), "q": 0.0 * EVEN_S, "g": 0.0 * EVEN_S})
    still.to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(MeasurementError, match=r"stands still.*'time: \{rate_hz: 200.1"):
        import_file(tmp_path / "a.csv", mapping(), ROBOT)
