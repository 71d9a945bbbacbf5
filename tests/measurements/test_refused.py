"""Mappings and files whose numbers cannot be meant: refused in one line that names the cure."""

from __future__ import annotations

import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import mapping_of, read_mapping
from ee_dist.measurements.readers import Options, read
from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.robots.model import Robot
from ee_dist.robots.servo_pendulum import servo_pendulum


def pendulum() -> Robot:
    robot = servo_pendulum(time_step_s=0.005)
    return replace(robot, joints=tuple(replace(j, lower=-2.5, upper=2.5) for j in robot.joints))


def table(rows: int = 1115) -> pd.DataFrame:
    t = np.arange(rows) * 0.005
    return pd.DataFrame({"t": t, "q": np.sin(3 * t), "w": 3 * np.cos(3 * t), "g": np.sin(3 * t + 0.03)})


def needed(frame: pd.DataFrame) -> np.ndarray:
    """Torque (T,) in N.m that the pendulum needs for its swing, of ``table``."""
    q, speed, acceleration = (np.array(x)[:, None] for x in (frame["q"], frame["w"], -9 * frame["q"]))
    return joint_torques(pendulum(), q, speed, acceleration)[:, 0]


GOOD: dict[str, Any] = {
    "time": {"column": "t", "unit": "s"},
    "sensors": {"position": {"column": "q", "unit": "rad"}, "speed": {"column": "w", "unit": "rad/s"}},
    "commands": {"servo": {"column": "g", "unit": "rad"}},
}


@pytest.mark.parametrize("name", ["run.csv", "set/meta/info.json"])
def test_a_pipe_is_not_waited_for(tmp_path: Path, name: str) -> None:
    pipe = tmp_path / name
    pipe.parent.mkdir(parents=True, exist_ok=True)
    os.mkfifo(pipe)
    with pytest.raises(MeasurementError, match="not an ordinary file"):
        read(tmp_path / name.partition("/")[0], Options(kind="lerobot" if "/" in name else None))


def q(**changes: Any) -> dict[str, Any]:
    return {"sensors": GOOD["sensors"] | {"position": {"column": "q", "unit": "rad"} | changes}}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        (
            {"commands": {"servo": {"column": "g", "unit": "rad", "lead_s": float("nan")}}},
            "lead_s: nan; expected a finite",
        ),
        (
            {"commands": {"servo": {"column": "g", "unit": "rad", "lead_s": 300}}},
            "lead_s: 300 s; expected seconds, at most 60",
        ),
        (q(scale=0), "scale: 0 makes every value the same"),
        (q(scale=float("inf")), "scale: inf; expected a finite number"),
        (q(offset=True), "offset: cannot be True; expected a number"),
        (q(signed_bits=-3), "signed_bits: expected the width of a counter"),
        (q(signed_bits=1.5), "signed_bits: cannot be 1.5; expected a whole number"),
        (q(smooth_s=-1), "smooth_s: expected 0 or more"),
        (q(unwrap="yes"), "unwrap: cannot be 'yes'; expected true or false"),
        ({"rate_hz": float("nan")}, "rate_hz: nan; expected a finite"),
        ({"rate_hz": 1e9}, "rate_hz: expected a positive number of at most 1e6"),
        ({"header": "no"}, "header: expected true or false"),
        ({"decimal": "comma"}, "decimal: expected ',' or '.'"),
        ({"separator": "; "}, "separator: expected one sign"),
        ({"split": "often"}, "split: expected {column: NAME} or 'restarts'"),
        ({"settings": {"effect": "x"}}, "settings: expected a list of effects"),
        ({"time": {"column": "t", "unit": "s", "offset": 3}}, "a time has no sign and no offset"),
        ({"time": {"rate_hz": 0}}, "rate_hz: expected a positive number"),
        ({"tables": {"a": {"file": "a.csv"}, "b": {}}}, "tables: b: file: expected a name such as '{trial}_b.csv'"),
        (
            {"sensors": GOOD["sensors"] | {"speed": {"column": "q", "unit": "rad/s"}}},
            "column 'q' is sensors position and also",
        ),
        (
            {"commands": {"servo": {"column": "q", "unit": "rad"}}},
            "column 'q' is sensors position and also commands servo",
        ),
        (
            {"sensors": GOOD["sensors"] | {"speed": {"speed_of": "position", "cutoff_hz": -5}}},
            "cutoff_hz: expected a positive",
        ),
        ({"sensors": GOOD["sensors"] | {"speed": {"speed_of": "position", "order": 50}}}, "order: expected 1 to 12"),
        (
            {"time": {"column": "t", "unit": "ms"}},
            r"1115 rows cover 0.005\d+ s.* would keep 2; .*not in 'ms', say unit: 's'",
        ),
        ({"time": {"column": "t", "unit": "s", "scale": 1000}}, "a row every 5 s; .*say unit: 'ms'"),
        (q(unit="deg"), "moves by 0.035 rad if it is in 'deg'.*say unit: rad; .*sure: true"),
        (q(scale=57.29577951308232), "reaches 57.3 rad, the joint only 2.5.*say unit: deg"),
        (
            {"sensors": GOOD["sensors"] | {"speed": {"column": "w", "unit": "deg/s"}}},
            "0.0175 times the change of its position",
        ),
        ({"commands": {"servo": {"column": "g", "unit": "deg"}}}, "servo: its commands are 0.0175 times its positions"),
        (
            {"torques": {"servo": {"column": "g", "unit": "N.m"}}},
            "column 'g' is commands servo and torques servo, but with unit 'rad' and 'N.m'; it is one signal",
        ),
        (
            {"torques": {"servo": {"column": "milli", "unit": "N.m"}}},
            "torque of servo: is 9.. times what the motion needs .* say unit: mN.m, .*sure: true",
        ),
        ({"torques": {"servo": {"column": "g2", "unit": "A"}}}, "a current is a torque only through the motor's gain"),
        ({"torques": {"other": {"column": "g2", "unit": "N.m"}}}, "torques: servo_pendulum has no 'other'"),
    ],
)
def test_wrong_numbers_are_refused(tmp_path: Path, changes: dict[str, Any], message: str) -> None:
    frame = table()
    frame["g2"] = frame["g"]
    frame["milli"] = 1000 * needed(frame)
    frame.to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(MeasurementError, match=message) as caught:
        import_file(tmp_path / "a.csv", mapping_of(GOOD | changes, Path("map.yaml")), pendulum())
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(("sign", "said"), [(1, []), (-1, ["runs against what the motion needs"])])
def test_a_torque_of_the_other_sign_is_told(tmp_path: Path, sign: int, said: list[str]) -> None:
    frame = table()
    frame["tau"] = sign * needed(frame)
    frame.to_csv(tmp_path / "a.csv", index=False)
    told = mapping_of(GOOD | {"torques": {"servo": {"column": "tau", "unit": "N.m"}}}, Path("m"))
    _, report = import_file(tmp_path / "a.csv", told, pendulum())
    found = [s for s in report.suspicious if "torque" in s]
    assert len(found) == len(said)
    assert all(word in note for word, note in zip(said, found, strict=True))


def test_what_was_refused_passes_once_it_is_said_to_be_sure(tmp_path: Path) -> None:
    table().to_csv(tmp_path / "a.csv", index=False)
    sensors = {"position": {"column": "q", "unit": "deg", "sure": True}, "speed": {"column": "w", "unit": "deg/s"}}
    mapping = mapping_of(GOOD | {"sensors": sensors, "commands": {"servo": {"column": "g", "unit": "deg"}}}, Path("m"))
    record, report = import_file(tmp_path / "a.csv", mapping, pendulum())
    assert float(np.abs(record.log.sensors[:, 0]).max()) < 0.02
    assert any("say unit: rad" in s for s in report.suspicious)


@pytest.mark.parametrize(
    ("row", "value", "message"),
    [
        (1114, 1e12, "row 1116, column 't': time jumps by 1e[+]12 s"),
        (500, 1e12, "row 503, column 't': time runs backwards"),
        (0, -1e25, "row 3, column 't': time jumps by"),
        (0, -1e300, "row 2, column 't' is -1e[+]300, which nothing measures; drop the row"),
        (1114, "inf", "row 1116, column 't' is inf"),
    ],
)
def test_absurd_time_stamps_take_no_memory(tmp_path: Path, row: int, value: Any, message: str) -> None:
    frame = table().astype(object)
    frame.loc[row, "t"] = value
    frame.to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(MeasurementError, match=message):
        import_file(tmp_path / "a.csv", mapping_of(GOOD, Path("map.yaml")), pendulum())


def test_several_trials_in_one_file_are_hinted_at(tmp_path: Path) -> None:
    pd.concat([table(200), table(200)]).to_csv(tmp_path / "a.csv", index=False)
    with pytest.raises(MeasurementError, match=r"row 202.*several trials in one file[?] add 'split: restarts'"):
        import_file(tmp_path / "a.csv", mapping_of(GOOD, Path("map.yaml")), pendulum())


YAML = "robot: servo_pendulum\ntime: t\nsensors: {position: {column: q, unit: rad, scale: %s}}\ncommands: {}\n"


@pytest.mark.parametrize("text", ["1e-3", "1E-3", "+1e-3", ".1e-2", "1.0e-3", "0.001"])
def test_yaml_reads_numbers_as_they_are_written(tmp_path: Path, text: str) -> None:
    (tmp_path / "map.yaml").write_text(YAML % text)
    column = read_mapping(tmp_path / "map.yaml").sensors["position"]
    assert column.scale == 0.001  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (YAML % ".nan", "scale: nan; expected a finite number"),
        (YAML % "1" + "robot: again\n", r"the key 'robot' stands twice \(line 5\)"),
        ("sensors: " + "[" * 3000, "nested deeper than 64 levels"),
        ("a: &a [1,1]\nb: &b [*a,*a]\nc: &c [*b,*b]\nsensors: *c\n", "unknown key 'a'"),
        ("sensors: &a {position: *a}\n", "nested deeper than 64 levels"),
    ],
)
def test_yaml_that_cannot_be_meant(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "map.yaml").write_text(text)
    with pytest.raises(MeasurementError, match=message) as caught:
        read_mapping(tmp_path / "map.yaml")
    assert len(str(caught.value)) < 600
