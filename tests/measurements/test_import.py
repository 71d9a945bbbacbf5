"""Tables to sensor logs: units, uneven time, estimated speeds, wrapped counters, released drives."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file, import_files
from ee_dist.measurements.mapping import Mapping
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.report import describe
from ee_dist.measurements.sampling import LowPass, decimated, held, linear, smoothed
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.servo_pendulum import servo_pendulum

STAGE = linear_stage()
PENDULUM = servo_pendulum(time_step_s=0.002)


def stage_mapping(**changes: object) -> Mapping:
    data: dict[str, object] = {
        "time": {"column": "t", "unit": "s"},
        "sensors": {"position": {"column": "x", "unit": "m"}},
        "commands": {"carriage": {"column": "r", "unit": "m"}},
    }
    return mapping_of(data | changes, Path("map.yaml"))


def stage_table(rows: int = 400, dt: float = 0.001) -> pd.DataFrame:
    t = np.arange(rows) * dt
    return pd.DataFrame({"t": t, "x": 0.1 * np.sin(5 * t), "r": 0.1 * np.sin(5 * t + 0.01), "u": np.cos(5 * t)})


def test_an_even_record_at_the_robots_rate_is_taken_sample_by_sample(tmp_path: Path) -> None:
    table = stage_table()
    table.to_csv(tmp_path / "a.csv", index=False)
    record, report = import_file(tmp_path / "a.csv", stage_mapping(), STAGE)
    assert np.array_equal(record.log.sensors[:, 0], table["x"])
    assert not report.resampled
    assert report.rate_hz == pytest.approx(1000)
    assert record.log.joints is not None
    assert record.name == "a"
    assert "400 rows" in describe([report])


def test_parquet_gives_the_same_numbers_as_csv(tmp_path: Path) -> None:
    table = stage_table()
    table.to_csv(tmp_path / "a.csv", index=False)
    table.to_parquet(tmp_path / "a.parquet")
    logs = [import_file(tmp_path / f"a.{k}", stage_mapping(), STAGE)[0].log for k in ("csv", "parquet")]
    assert np.array_equal(logs[0].sensors, logs[1].sensors)
    assert np.array_equal(logs[0].commands, logs[1].commands)


def test_units_signs_and_scales(tmp_path: Path) -> None:
    table = stage_table()
    table["t"] *= 1000
    table["x"] *= -1000
    table.to_csv(tmp_path / "a.csv", index=False)
    mapping = stage_mapping(
        time={"column": "t", "unit": "ms"},
        sensors={"position": {"column": "x", "unit": "mm", "sign": -1}},
        torques={"carriage": {"column": "u", "scale": 35.0, "unit": "N"}},
    )
    log = import_file(tmp_path / "a.csv", mapping, STAGE)[0].log
    assert log.sensors[:, 0] == pytest.approx(stage_table()["x"].to_numpy(), abs=1e-12)
    assert log.torques is not None
    assert log.torques[0, 0] == pytest.approx(35.0)


def test_uneven_time_is_brought_to_an_even_grid(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    t = np.cumsum(rng.uniform(0.003, 0.007, 500))
    table = pd.DataFrame({"t": t, "x": 0.1 * np.sin(3 * t), "r": np.round(t, 1)})
    table.to_csv(tmp_path / "a.csv", index=False)
    record, report = import_file(tmp_path / "a.csv", stage_mapping(), STAGE)
    at = record.log.times_s + t[0]
    assert report.resampled
    assert not report.even
    assert np.diff(record.log.times_s) == pytest.approx(0.001)
    assert record.log.sensors[:, 0] == pytest.approx(0.1 * np.sin(3 * at), abs=1e-4)
    # A command is held until the next: no value between those sent.
    assert set(np.round(record.log.commands[:, 0], 9)) <= set(np.round(table["r"], 9))


def test_speed_is_estimated_by_the_stated_filter(tmp_path: Path) -> None:
    t = np.arange(3000) * 0.002
    table = pd.DataFrame({"t": t, "q": np.sin(4 * t), "g": np.sin(4 * t)})
    table.to_csv(tmp_path / "a.csv", index=False)
    mapping = mapping_of(
        {
            "time": "t",
            "sensors": {"position": {"column": "q", "unit": "rad"}, "speed": {"speed_of": "position", "cutoff_hz": 20}},
            "commands": {"servo": {"column": "g", "unit": "rad"}},
        },
        Path("map.yaml"),
    )
    record, report = import_file(tmp_path / "a.csv", mapping, PENDULUM)
    assert record.log.channel("speed")[200:-200] == pytest.approx(4 * np.cos(4 * t)[200:-200], abs=2e-3)
    assert any("Butterworth low-pass, order 4, 20 Hz" in d for d in report.done)


def test_recordings_with_a_header(tmp_path: Path) -> None:
    rows = [
        {"t": 0.002 * k, "q": 0.01 * k, "w": 5.0, "g": 1.0, "on": k < 50, "load": 65536 - 100 if k % 2 else 100}
        for k in range(100)
    ]
    (tmp_path / "a.json").write_text(json.dumps({"kp": 100, "shape": "ramp", "entries": rows}))
    mapping = mapping_of(
        {
            "time": "t",
            "trial": "kp {kp} {shape}",
            "sensors": {"position": {"column": "q", "unit": "rad"}, "speed": {"column": "w", "unit": "rad/s"}},
            "commands": {"servo": {"column": "g", "unit": "rad"}},
            "torques": {"servo": {"column": "load", "signed_bits": 16, "scale": 0.001, "unit": "N.m"}},
            "enabled": {"column": "on"},
            "settings": [{"effect": "position_gain", "target": "servo", "factor": {"header": "kp", "scale": 0.0025}}],
        },
        Path("map.yaml"),
    )
    record, report = import_file(tmp_path / "a.json", mapping, PENDULUM)
    assert record.name == "kp 100 ramp"
    assert record.log.torques is not None
    assert sorted(set(np.round(record.log.torques[:, 0], 6))) == [-0.1, 0.1]
    assert np.isnan(record.log.commands[50:]).all()
    assert np.isfinite(record.log.commands[:50]).all()
    assert dict(record.believed[0].values) == {"factor": 0.25}
    assert any("16-bit counter" in d for d in report.done)


def test_gaps_are_filled_only_where_asked(tmp_path: Path) -> None:
    table = stage_table()
    table.loc[10:12, "x"] = np.nan
    table.to_csv(tmp_path / "a.csv", index=False)
    mapping = stage_mapping(sensors={"position": {"column": "x", "unit": "m", "gaps": "interpolate"}})
    record, report = import_file(tmp_path / "a.csv", mapping, STAGE)
    assert record.log.sensors[11, 0] == pytest.approx(0.1 * np.sin(5 * 0.011), abs=1e-5)
    assert any("3 empty cells" in d for d in report.done)


@pytest.mark.parametrize(("first", "last"), [(100, 159), (0, 29), (370, None)])
def test_a_long_run_of_empty_cells_is_no_measurement(tmp_path: Path, first: int, last: int | None) -> None:
    table = stage_table()
    table.loc[first:last, "x"] = np.nan
    empty = np.isnan(table["x"].to_numpy())
    table.to_csv(tmp_path / "a.csv", index=False)
    mapping = stage_mapping(sensors={"position": {"column": "x", "unit": "m", "gaps": "interpolate"}})
    record, report = import_file(tmp_path / "a.csv", mapping, STAGE)
    assert record.log.filled is not None
    assert np.array_equal(np.asarray(record.log.filled, dtype=bool), empty), "only what was read is compared"
    (said,) = [line for line in report.suspicious if "one after another" in line]
    assert f"position: {empty.sum()} empty cells one after another from row {first + 2}" in said


def test_filters_have_no_phase() -> None:
    t = np.arange(4000) * 0.001
    wave = np.sin(2 * np.pi * 3 * t)
    assert LowPass(50)(wave, 0.001)[300:-300] == pytest.approx(wave[300:-300], abs=2e-3)
    kept = decimated(wave, 10)
    # 0.05 dB of ripple, twice: 1.2 %
    assert kept[30:-30] == pytest.approx(wave[9::10][30:-30], abs=0.012)
    assert len(kept) == 400


def test_held_linear_and_smoothed() -> None:
    t, v = np.array([0.0, 1.0, 2.0]), np.array([0.0, 10.0, 20.0])
    assert held(np.array([0.5, 1.0, 1.9]), t, v).tolist() == [0.0, 10.0, 10.0]
    assert held(np.array([0.95]), t, v, lead_s=0.1).tolist() == [10.0]
    assert linear(np.array([0.5]), t, v).tolist() == [5.0]
    assert smoothed(np.ones(50), 0.01, 0.1) == pytest.approx(np.ones(50))


def test_gains_and_loads_of_single_trials_come_from_columns_and_names(tmp_path: Path) -> None:
    for name, kp in (("light", 100), ("heavy_1", 200), ("heavy_2", 200)):
        stage_table().assign(kp=kp).to_csv(tmp_path / f"{name}.csv", index=False)
    mapping = stage_mapping(
        settings=[
            {"effect": "position_gain", "target": "carriage", "factor": {"column": "kp", "scale": 0.01}},
            {"effect": "part_mass", "target": "carriage", "change": 0.5, "trials": ["heavy_*"]},
        ]
    )
    files = [tmp_path / f"{n}.csv" for n in ("light", "heavy_1", "heavy_2")]
    found = {r.name: {t.effect: t.values[0][1] for t in r.believed} for r, _ in import_files(files, mapping, STAGE)}
    heavy = {"position_gain": 2.0, "part_mass": 0.5}
    assert found == {"light": {"position_gain": 1.0}, "heavy_1": heavy, "heavy_2": heavy}

    wrong = stage_mapping(settings=[{"effect": "part_mass", "target": "carriage", "change": 0.5, "trials": "heavi_1"}])
    with pytest.raises(MeasurementError, match=r"settings\[0\]: trials: no trial is named 'heavi_1'; .*heavy_1"):
        import_files(files, wrong, STAGE)
    stage_table().assign(kp=np.arange(400)).to_csv(tmp_path / "light.csv", index=False)
    with pytest.raises(MeasurementError, match=r"column 'kp' for position_gain changes within the trial \(0 to 399\)"):
        import_files(files, mapping, STAGE)


@pytest.mark.parametrize(("rows", "off"), [(1, 0.02), (2, -0.05), (0, 0.0005)])
def test_first_readings_of_another_moment_are_left_out(tmp_path: Path, rows: int, off: float) -> None:
    """0.5 m/s is the fastest that the stage goes: 0.02 m in a row is no motion, half a millimetre is."""
    table = stage_table()
    table.loc[: max(rows, 1) - 1, "x"] += off
    table.to_csv(tmp_path / "a.csv", index=False)
    record, report = import_file(tmp_path / "a.csv", stage_mapping(), STAGE)
    assert len(record.log) == len(table) - rows
    assert record.log.sensors[0, 0] == pytest.approx(table["x"][rows])
    assert any("left out: to the next a joint would go" in d for d in report.done) == bool(rows)


def test_a_joint_that_moves_at_the_beginning_alone_was_in_motion(tmp_path: Path) -> None:
    table = stage_table(4000)
    table["x"] = 0.1 * np.minimum(np.arange(4000) / 30, 1.0)
    table.to_csv(tmp_path / "a.csv", index=False)
    record, _ = import_file(tmp_path / "a.csv", stage_mapping(), STAGE)
    assert len(record.log) == 4000
