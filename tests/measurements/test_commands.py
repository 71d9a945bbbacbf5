"""What drives obey: positions, speeds or torques; and logs in which nobody kept it."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping import Mapping
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.proposal.commands import OWN_COURSE
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints
from ee_dist.robots.model import Drive, Robot
from ee_dist.robots.servo_pendulum import servo_pendulum

T = np.arange(800) * 0.005
Q = 0.6 * np.sin(3 * T) + 0.2 * np.sin(7.3 * T)


def robot(kind: str) -> Robot:
    """A pendulum whose drive obeys commands of a kind."""
    pendulum = servo_pendulum(time_step_s=0.005)
    (drive,) = pendulum.drives
    if any(f.name == "command" for f in fields(Drive)):
        return replace(pendulum, drives=(replace(drive, command=kind),))

    @dataclass(frozen=True)
    class Told(Drive):
        command: str = kind

    return replace(pendulum, drives=(Told(**{f.name: getattr(drive, f.name) for f in fields(drive)}),))


def mapping(**changes: Any) -> Mapping:
    data: dict[str, Any] = {
        "time": {"column": "t", "unit": "s"},
        "sensors": {"position": {"column": "q", "unit": "rad"}, "speed": {"speed_of": "position"}},
    }
    return mapping_of(data | changes, Path("map.yaml"))


@pytest.fixture
def file(tmp_path: Path) -> Path:
    w = np.gradient(Q, T)
    frame = pd.DataFrame(
        {
            "t": T,
            "q": Q,
            "w_cmd": 180 / np.pi * np.gradient(Q, T),
            "tau_cmd": 1e3 * np.sin(T),
            "tau": np.sin(T) + 0.01 * w,
        }
    )
    frame.to_csv(tmp_path / "a.csv", index=False)
    return tmp_path / "a.csv"


def test_commands_of_torque_and_of_speed(file: Path) -> None:
    told = mapping(commands={"servo": {"column": "tau_cmd", "unit": "mN.m"}})
    assert import_file(file, told, robot("torque"))[0].log.commands[:, 0] == pytest.approx(np.sin(T))
    told = mapping(commands={"servo": {"column": "w_cmd", "unit": "deg/s"}})
    assert import_file(file, told, robot("speed"))[0].log.commands[:, 0] == pytest.approx(np.gradient(Q, T))


@pytest.mark.parametrize(
    ("kind", "unit", "wanted"),
    [("position", "N.m", "angle"), ("torque", "rad", "torque"), ("speed", "rad", "angular speed")],
)
def test_a_command_of_another_kind_is_refused(file: Path, kind: str, unit: str, wanted: str) -> None:
    with pytest.raises(MeasurementError, match=f"command of servo: unit '{unit}' .* expected one of {wanted}"):
        import_file(file, mapping(commands={"servo": {"column": "tau_cmd", "unit": unit}}), robot(kind))


def test_logs_without_commands(file: Path) -> None:
    """Measured torques are what was asked for where drives obey torques; elsewhere nobody knows it, which is said."""
    told = mapping(torques={"servo": {"column": "tau", "unit": "N.m"}})
    record, report = import_file(file, told, robot("torque"))
    assert record.log.torques is not None
    assert np.array_equal(record.log.commands, record.log.torques)
    record, report = import_file(file, told, robot("position"))
    assert np.isnan(record.log.commands).all()
    assert any("no commands were recorded" in d for d in report.done)
    with pytest.raises(MeasurementError, match="commands: no column for joint 'servo'"):
        import_file(file, mapping(), robot("position"))


@pytest.mark.parametrize(("kind", "column"), [("torque", "tau_cmd"), ("speed", "w_cmd")])
def test_commands_are_proposed_by_what_the_drives_obey(file: Path, kind: str, column: str) -> None:
    proposal = proposal_for([file], robot(kind), Hints())
    (found,) = [c for c in proposal.choices if c.group == "commands"]
    assert found.column == column


def test_a_currents_gain(file: Path) -> None:
    """Amperes become torques by a scale; a unit of current alone is answered with how."""
    told = mapping(torques={"servo": {"column": "tau", "unit": "N.m", "scale": 0.35}})
    assert import_file(file, told, robot("torque"))[0].log.commands[0, 0] == pytest.approx(
        0.35 * 0.01 * np.gradient(Q, T)[0]
    )
    with pytest.raises(MeasurementError, match=r"write 'unit: N.m, scale: GAIN' with the N.m of one A"):
        import_file(file, mapping(torques={"servo": {"column": "tau", "unit": "A"}}), robot("torque"))


@pytest.mark.parametrize("called", ["goal_pwm", "pwm_servo_motor"])
def test_a_motor_that_was_led_by_its_voltage(tmp_path: Path, called: str) -> None:
    """What it was led by is no torque yet: it is said how it becomes one."""
    file = tmp_path / "log.csv"
    table = {"time_s": T, "position_rad": np.sin(T), "current_a": np.cos(3 * T), called: 300 * np.cos(3 * T)}
    pd.DataFrame(table).to_csv(file, index=False)
    found = proposal_for([file], robot("torque"), Hints())
    said = [n for n in found.notes + found.questions if f"{called} is a voltage or duty cycle" in n]
    assert len(said) == 1
    assert "'scale:' the torque at rest" in said[0]


@pytest.mark.parametrize(("demanded", "told"), [("position_demand", True), ("position_filtered", False)])
def test_a_course_that_drives_make_of_their_goals_is_told(tmp_path: Path, demanded: str, told: bool) -> None:
    """Steps are asked for; the drive makes gentle courses of them, which the joint follows far more closely."""
    goals = np.repeat(np.random.default_rng(1).uniform(-0.5, 0.5, 8), 100)
    course = np.convolve(np.pad(goals, (40, 0), mode="edge"), np.ones(41) / 41, mode="valid")
    read = course + 1e-4 * np.sin(50 * T)
    frame = pd.DataFrame({"time_s": T, "target_position": goals, "actual_position": read, demanded: course})
    frame.to_csv(tmp_path / "a.csv", index=False)
    proposal = proposal_for([tmp_path / "a.csv"], robot("position"), Hints(unit="rad"))
    notes = [n for n in proposal.notes if OWN_COURSE in n]
    assert [n.startswith(f"the positions follow {demanded} by 0 ms") for n in notes] == [True] * told
    (asked,) = [c for c in proposal.choices if c.group == "commands"]
    assert asked.entry["column"] == "target_position"
