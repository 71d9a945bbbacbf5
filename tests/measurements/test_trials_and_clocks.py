"""Several trials in a file, several files in a trial, and clocks that have to be matched."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.alignment import match
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping import Mapping
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.robots.servo_pendulum import servo_pendulum

ROBOT = servo_pendulum(time_step_s=0.005)


def motion(t: np.ndarray, seed: int = 0) -> np.ndarray:
    rng = np.random.default_rng(seed)
    return sum(a * np.sin(w * t + p) for a, w, p in rng.uniform((0.1, 1, 0), (0.4, 9, 6), (5, 3)))


def whole(rows: int = 800, seed: int = 0) -> pd.DataFrame:
    t = np.arange(rows) * 0.005
    q = motion(t, seed)
    return pd.DataFrame({"t": t, "q": q, "w": np.gradient(q, t), "g": motion(t + 0.02, seed)})


def mapping(**changes: Any) -> Mapping:
    data: dict[str, Any] = {
        "time": {"column": "t", "unit": "s"},
        "sensors": {"position": {"column": "q", "unit": "rad"}, "speed": {"column": "w", "unit": "rad/s"}},
        "commands": {"servo": {"column": "g", "unit": "rad"}},
    }
    return mapping_of(data | changes, Path("map.yaml"))


def test_trials_by_a_column_and_by_restarts(tmp_path: Path) -> None:
    parts = [whole(300, k).assign(episode=k) for k in range(3)]
    pd.concat(parts).to_csv(tmp_path / "a.csv", index=False)
    for split in ({"column": "episode"}, "restarts"):
        found = import_files([tmp_path / "a.csv"], mapping(split=split), ROBOT)
        assert [len(r.log) for r, _ in found] == [300, 300, 300]
        assert [r.index for r, _ in found] == [0, 1, 2]
        assert np.array_equal(found[1][0].log.sensors[:, 0], parts[1]["q"])
    assert [r.name for r, _ in found] == ["a 1", "a 2", "a 3"]


def test_rows_of_a_trial_stand_together(tmp_path: Path) -> None:
    pd.concat([whole(300, k).assign(episode=k % 2) for k in range(3)]).to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(MeasurementError, match=r"column 'episode' comes back to '0'"):
        import_files([tmp_path / "a.csv"], mapping(split={"column": "episode"}), ROBOT)
    with pytest.raises(MeasurementError, match=r"makes 900 trials of 900 rows"):
        import_files([tmp_path / "a.csv"], mapping(split={"column": "q"}), ROBOT)


def two_files(folder: Path, shift_s: float, epoch_s: float = 0.0, trial: str = "run1", unit: float = 1e3) -> None:
    frame = whole()
    frame[["t", "q", "w"]].assign(t=frame["t"] + epoch_s).to_csv(folder / f"{trial}_states.csv", index=False)
    sent = frame[["t", "g"]].iloc[::2]
    sent.assign(t=unit * (sent["t"] + epoch_s + shift_s)).to_csv(folder / f"{trial}_commands.csv", index=False)


def two_tables(named: str = "{trial}_", **clock: Any) -> Mapping:
    return mapping(
        tables={
            "states": {"file": f"{named}states.csv"},
            "commands": {"file": f"{named}commands.csv", "time": {"column": "t", "unit": "ms"}} | clock,
        },
        sensors={
            "position": {"table": "states", "column": "q", "unit": "rad"},
            "speed": {"table": "states", "column": "w", "unit": "rad/s"},
        },
        commands={"servo": {"table": "commands", "column": "g", "unit": "rad"}},
    )


def test_two_files_with_clocks_of_their_own(tmp_path: Path) -> None:
    """The offset between the clocks is found by the signals, to within the lag of the drive (20 ms here)."""
    for k, shift in enumerate((-37.2, 5.0, 812.4)):
        two_files(tmp_path, shift, trial=f"run{k}")
    found = import_files(sorted(tmp_path.glob("*.csv")), two_tables(), ROBOT)
    assert [r.name for r, _ in found] == ["run0", "run1", "run2"]
    for (record, report), shift in zip(found, (-37.2, 5.0, 812.4), strict=True):
        (said,) = [d for d in report.done if "fit best" in d]
        assert float(said.split()[1]) == pytest.approx(-shift, abs=0.03)
        lag = record.log.commands[100:-100, 0] - whole()["q"].to_numpy()[100 : 100 + len(record.log) - 200]
        assert float(np.abs(lag).max()) < 0.15


def test_a_stated_offset_and_a_common_epoch_are_taken_as_they_are(tmp_path: Path) -> None:
    two_files(tmp_path, 5.0)
    ((record, report),) = import_files(sorted(tmp_path.glob("*.csv")), two_tables(offset_s=-5.0), ROBOT)
    frame = whole()
    held = frame["g"].to_numpy()[::2].repeat(2)
    assert np.array_equal(record.log.commands[:, 0], held)
    assert np.array_equal(record.log.sensors[:, 0], frame["q"])
    other = tmp_path / "epoch"
    other.mkdir()
    two_files(other, 0.0, epoch_s=1.7e9)
    ((record, report),) = import_files(sorted(other.glob("*.csv")), two_tables(), ROBOT)
    assert any("one epoch" in d for d in report.done)
    assert record.log.commands[:, 0] == pytest.approx(held, abs=1e-9)


@pytest.mark.parametrize("named", ["", "{trial}/"])
@pytest.mark.parametrize("runs", [["run1"], ["run1", "run2"]])
def test_a_folder_for_each_trial(tmp_path: Path, named: str, runs: list[str]) -> None:
    for run in runs:
        (tmp_path / run).mkdir()
        two_files(tmp_path, 5.0, trial=f"{run}/")
        for file in (tmp_path / run).iterdir():
            file.rename(file.with_name(file.name.removeprefix("_")))
    found = import_files(sorted(tmp_path.glob("*/*.csv")), two_tables(named, offset_s=-5.0), ROBOT)
    assert [record.name for record, _ in found] == runs
    with pytest.raises(MeasurementError, match="its other half is missing"):
        import_files([tmp_path / "run1" / "states.csv"], two_tables(named), ROBOT)


def test_what_the_signals_do_not_tell_is_asked(tmp_path: Path) -> None:
    t = np.arange(800) * 0.005
    wave = np.sin(8 * t)
    pd.DataFrame({"t": t, "q": wave, "w": 8 * np.cos(8 * t)}).to_csv(tmp_path / "a_states.csv", index=False)
    pd.DataFrame({"t": 1e3 * t, "g": wave}).to_csv(tmp_path / "a_commands.csv", index=False)
    with pytest.raises(MeasurementError, match=r"the signals do not tell the offset .*say 'offset_s: SECONDS'"):
        import_files(sorted(tmp_path.glob("*.csv")), two_tables(), ROBOT)


def test_halves_that_are_missing_or_do_not_meet(tmp_path: Path) -> None:
    two_files(tmp_path, 100.0)
    files = sorted(tmp_path.glob("*.csv"))
    with pytest.raises(MeasurementError, match=r"its other half is missing: no run1_commands.csv beside it"):
        import_files([f for f in files if "states" in f.name], two_tables(), ROBOT)
    with pytest.raises(MeasurementError, match=r"share only 0 s of 3.995 s; are their clocks in the same unit"):
        import_files(files, two_tables(offset_s=0), ROBOT)
    with pytest.raises(MeasurementError, match=r"none of the 1 files is named like {trial}_states.csv"):
        import_files([tmp_path / "other.csv"], two_tables(), ROBOT)
    with pytest.raises(MeasurementError, match=r"sensors: position: which file[?] add 'table: states'"):
        mapping(tables={"states": {"file": "{trial}_states.csv"}})


def test_lags_are_found_to_a_fraction_of_a_sample() -> None:
    a_s, b_s = np.arange(0, 20, 0.01), np.arange(0, 15, 0.007)
    for shift in (-3.3333, 0.0, 4.4444):
        found = match(a_s, motion(a_s)[:, None], b_s, motion(b_s + shift)[:, None], held=False)
        assert found.offset_s == pytest.approx(shift, abs=2e-3)
        assert found.clear


def test_rows_without_a_time_have_a_rate(tmp_path: Path) -> None:
    whole().drop(columns="t").to_csv(tmp_path / "a.csv", index=False)
    ((record, _),) = import_files([tmp_path / "a.csv"], mapping(time={"rate_hz": 200}), ROBOT)
    assert np.array_equal(record.log.sensors[:, 0], whole()["q"])
    with pytest.raises(MeasurementError, match=r"missing key 'time'"):
        import_files([tmp_path / "a.csv"], mapping(time=None), ROBOT)
