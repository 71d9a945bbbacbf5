"""Files that mean harm, or are merely broken: one line, nothing expanded, nothing executed, in bounded memory."""

from __future__ import annotations

import json
import tracemalloc
from pathlib import Path
from typing import Any

import pytest

from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import RobotError
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.serial import robot_to_dict

BOMB = '<!DOCTYPE r [<!ENTITY a0 "ha">' + "".join(
    f'<!ENTITY a{k + 1} "{f"&a{k};" * 10}">' for k in range(12)
) + ']><robot name="&a12;"><link name="a"/></robot>'  # fmt: skip
OUTSIDE = '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"><link name="a"/></robot>'


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (BOMB, "document type"),
        (OUTSIDE, "document type"),
        (OUTSIDE.replace("<robot", "<mujoco").replace("</robot", "</mujoco"), "document type"),
        ("<robot>" + "<link>" * 500, "more than 200 elements within one another"),
        ("\x00\x01\x02", "not well-formed XML"),
        ("", "not well-formed XML"),
        ('<?xml version="1.0" encoding="nonsense"?><robot/>', "not well-formed XML"),
        ("<sdf/>", "<sdf>"),
        ("<robot/>", "no <link> in it"),
    ],
)
@pytest.mark.parametrize("suffix", [".urdf", ".xml"])
def test_a_hostile_file_is_one_line(tmp_path: Path, text: str, message: str, suffix: str) -> None:
    file = tmp_path / f"robot{suffix}"
    file.write_text(text)
    tracemalloc.start()
    try:
        with pytest.raises(RobotError, match=message) as caught:
            load_robot(file)
        most = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert most < 50e6, "a bomb would take gigabytes; what is imported on the way counts too"
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


def test_a_document_type_in_another_encoding_is_seen_too(tmp_path: Path) -> None:
    file = tmp_path / "robot.urdf"
    file.write_bytes(BOMB.encode("utf-16"))
    with pytest.raises(RobotError, match="document type"):
        load_robot(file)


def test_a_file_too_large_is_not_read(tmp_path: Path) -> None:
    file = tmp_path / "robot.urdf"
    with file.open("wb") as out:
        out.truncate(60_000_000)
    with pytest.raises(RobotError, match="60 MB"):
        load_robot(file)


def broken(change: Any) -> dict[str, Any]:
    data = json.loads(json.dumps(robot_to_dict(quadruped())))
    change(data["robot"])
    return data


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: r["joints"][0].update(parent=r["joints"][0]["child"]), "the joints form a loop"),
        (lambda r: r["joints"][0].update(parent="nobody"), "no part named 'nobody'"),
        (lambda r: r["joints"][1].update(child=r["joints"][0]["child"]), "hangs on two joints"),
        (lambda r: r["parts"][1].update(mass_kg=-1.0), "mass_kg: -1; expected 0 to 1e"),
        (lambda r: r["parts"][1].update(mass_kg=1e308), "mass_kg: 1e.308; expected 0 to 1e"),
        (lambda r: r["parts"][1].update(mass_kg="nan"), "mass_kg: nan"),
        (lambda r: r["joints"][0].update(lower=2.0, upper=-2.0), "nothing can move there"),
        (lambda r: r["drives"][0].update(torque_limit=-3.0), "torque_limit: -3; expected more than 0"),
        (lambda r: r["drives"][0].update(delay_s=1e9), r"delay_s: 1e\+09; expected 0 to 2"),
        (lambda r: r["drives"][0].update(command="sing"), "command: 'sing'; expected one of position"),
        (lambda r: r["drives"][0].update(joint="nobody"), "no moving joint named 'nobody'"),
        (lambda r: r["sensors"][0].update(dropout=1.5), "dropout: 1.5; expected 0 to 1"),
        (lambda r: r["wiring"].update(source=[99] * 8), "wiring"),
        (lambda r: r["world"].update(gravity_m_s2="inf"), "gravity_m_s2: inf"),
        (lambda r: r.update(time_step_s=0.0), "seconds, not milliseconds"),
        (lambda r: r.update(parts=[]), "no part in it"),
    ],
)
def test_a_robot_written_out_that_cannot_be_is_refused(tmp_path: Path, change: Any, message: str) -> None:
    file = tmp_path / "robot.json"
    file.write_text(json.dumps(broken(change)))
    with pytest.raises(RobotError, match=message) as caught:
        load_robot(file)
    assert "\n" not in str(caught.value)
    assert "robot.json" in str(caught.value)


def test_yaml_is_data_and_runs_nothing(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    file.write_text(f"!!python/object/apply:pathlib.Path.touch [!!python/object:pathlib.Path [{tmp_path / 'made'}]]")
    with pytest.raises(RobotError, match="not YAML"):
        load_robot(file)
    assert not (tmp_path / "made").exists()
    file.write_text("robot: servo_pendulum\ngain: 1e400")
    with pytest.raises(RobotError, match="kp: inf; expected 0 to"):
        load_robot(file)


def test_aliases_that_grow_without_end_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "robot.yaml"
    levels = ["a0: &a0 [1, 1]", *(f"a{k}: &a{k} [{', '.join([f'*a{k - 1}'] * 9)}]" for k in range(1, 20))]
    file.write_text("\n".join(levels))
    with pytest.raises(RobotError, match=r"stands? for more than"):
        load_robot(file)
    file.write_text("urdf: &a [*a]")
    with pytest.raises(RobotError, match=r"nested (without end|deeper than)"):
        load_robot(file)
    file.write_text("[" * 5000)
    with pytest.raises(RobotError, match=r"not YAML|nested deeper"):
        load_robot(file)
