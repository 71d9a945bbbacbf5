"""What an inertial unit says of the base: recognised by its name, refused in degrees that pass for radians, and no base is bolted
down that tilts."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import small_logs as logs
import yaml
from measurement_files import motion, robot_file

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.by_sensor import said_of_base
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.log import SensorLog


def tilting(folder: Path, name: str, roll: np.ndarray, free: bool = True) -> tuple[Path, Robot, Proposal]:
    m = motion()
    table: pd.DataFrame = logs.frame_of(m["t"], m["q"], m["g"])
    table[name] = roll
    described = robot_file(folder)
    if free:
        content = yaml.safe_load(described.read_text())
        content |= {"free_base": True, "sensors": [{"name": "tilt", "kind": "roll"}]}
        content["sensors"] += [
            {"name": f"position_{j}", "kind": "position", "target": j} for j in ("shoulder", "elbow")
        ]
        described.write_text(yaml.safe_dump(content))
    robot, _ = load_robot(described)
    file = logs.written(folder, table)
    return file, robot, proposal_for([file], robot, Hints())


def swing(largest: float) -> np.ndarray:
    return largest * np.sin(2 * np.pi * motion()["t"])


def log_of(folder: Path, file: Path, robot: Robot, proposal: Proposal) -> SensorLog:
    assert not proposal.questions, proposal.questions
    (folder / "mapping.yaml").write_text(as_yaml(proposal, str(folder / "chain.yaml"), file.name))
    ((record, _),) = import_files([file], read_mapping(folder / "mapping.yaml"), robot)
    return record.log


@pytest.mark.parametrize("name", ["imu_roll", "base_roll_rad", "body.orientation.roll"])
def test_a_column_called_after_the_tilt_is_found(tmp_path: Path, name: str) -> None:
    file, robot, proposal = tilting(tmp_path, name, swing(0.2))
    assert robot.sensors[0].unit == "rad"
    log = log_of(tmp_path, file, robot, proposal)
    assert log.channel("tilt") == pytest.approx(swing(0.2))


def test_a_base_that_turns_farther_than_it_can_is_in_degrees(tmp_path: Path) -> None:
    file, robot, proposal = tilting(tmp_path, "imu_roll", swing(14.0))
    with pytest.raises(MeasurementError, match=r"tilt: reaches 14 rad, a base only 3.142; .* say unit: .*deg"):
        log_of(tmp_path, file, robot, proposal)


@pytest.mark.parametrize(("roll", "said"), [(swing(0.2), True), (swing(0.01), False)])
def test_a_base_that_tilts_is_not_bolted_down(tmp_path: Path, roll: np.ndarray, said: bool) -> None:
    _, _, proposal = tilting(tmp_path, "imu_roll", roll, free=False)
    assert any("imu_roll says that the base tilts" in n for n in proposal.notes) == said


def test_a_tilt_that_a_free_base_has_no_sensor_of_is_told_with_what_to_write(tmp_path: Path) -> None:
    file, _, _ = tilting(tmp_path, "imu_roll", swing(0.2), free=False)
    described = tmp_path / "chain.yaml"
    content = yaml.safe_load(described.read_text()) | {"free_base": True}
    content.pop("sensors", None)
    wanted = "sensors: [joints, {name: roll, kind: roll}, {name: pitch, kind: pitch}]"
    said = []
    for sensors in ({}, yaml.safe_load(wanted)):
        described.write_text(yaml.safe_dump(content | sensors))
        robot, _ = load_robot(described)
        said.append([n for n in proposal_for([file], robot, Hints()).notes if "how the base is tilted" in n])
    assert len(said[0]) == 1 and said[0][0].startswith("imu_roll") and wanted in said[0][0]
    assert not said[1]


def test_what_is_said_of_the_base_is_no_position_of_a_joint() -> None:
    roll = Sensor("roll", "roll", "body", "rad")
    assert said_of_base("roll_rad", [roll], ["shoulder"]) and said_of_base("imu.roll", [roll], ["shoulder"])
    assert not said_of_base("roll_rad", [], ["shoulder"]), "the robot has no such sensor"
    assert not said_of_base("roll_rad", [roll], ["roll"]), "a joint is called so"
    assert not said_of_base("shoulder_roll_rad", [roll], ["shoulder_roll"])
