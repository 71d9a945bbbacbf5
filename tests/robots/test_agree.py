"""A model file's robot counts, what cannot be one robot is refused, and an edited source is noticed."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from ee_dist.robots.agree import SOURCES, agreed, changed_sources, differences, source_digests, sources_text
from ee_dist.robots.instruments import with_motor_torques
from ee_dist.robots.model import RobotError
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.noise import with_noise

ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.urdf"


def test_the_models_numbers_count_and_the_logs_noise_stays() -> None:
    recorded = with_noise(servo_pendulum(), 0.02)
    edited = servo_pendulum().with_drive("servo", kp=2.0).with_part("arm", mass_kg=0.3)
    robot, said = agreed(edited, recorded, "model.yaml")
    assert robot.drives[0].kp == 2.0
    assert [s.noise for s in robot.sensors] == [s.noise for s in recorded.sensors]
    assert len(said) == 2
    assert "part arm: mass_kg 0.3, in the log 0.49" in said
    assert said[1].startswith("drive servo: kp 2, in the log")
    assert differences(servo_pendulum(), recorded) == ()


def test_a_meter_of_motor_torque_in_the_log_is_no_other_robot() -> None:
    recorded = with_noise(with_motor_torques(servo_pendulum()), 0.001)
    robot, said = agreed(servo_pendulum(), recorded, "model.yaml")
    assert robot.sensor_names == recorded.sensor_names and said == ()
    assert [s.noise for s in robot.sensors] == [s.noise for s in recorded.sensors]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda r: replace(r, time_step_s=0.01), "the time step of servo_pendulum is not that of the log: 0.01 s"),
        (
            lambda r: replace(r, sensors=r.sensors[:1]),
            "the sensors of servo_pendulum are not those of the log: position;",
        ),
        (lambda r: r.with_drive("servo", command="torque"), "commands .*torque; the log has position"),
        (lambda r: r.with_sensor("speed", unit="deg/s"), "units of sensors"),
    ],
)
def test_what_cannot_be_one_robot_is_refused(change, message: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(RobotError, match=message):
        agreed(change(servo_pendulum()), servo_pendulum(), "model.yaml")


def test_parts_and_joints_that_one_lacks_are_named() -> None:
    other = replace(servo_pendulum(), parts=(*servo_pendulum().parts, replace(servo_pendulum().parts[0], name="hook")))
    assert differences(other, servo_pendulum()) == ("part hook: only in the model",)
    assert differences(servo_pendulum(), other) == ("part hook: only in the log",)
    faster = servo_pendulum().with_joint("servo", top_speed=3.0)
    assert differences(faster, servo_pendulum()) == (f"joint servo: top_speed 3, in the log {math.inf:g}",)


def test_an_edited_urdf_or_description_is_noticed(tmp_path: Path) -> None:
    urdf, description = tmp_path / "arm.urdf", tmp_path / "arm.yaml"
    urdf.write_bytes(ARM.read_bytes())
    description.write_text("urdf: arm.urdf\n")
    assert set(source_digests("arm.yaml", tmp_path)) == {str(urdf), str(description)}
    assert source_digests("servo_pendulum") == {}
    assert set(source_digests({"urdf": "arm.urdf"}, tmp_path)) == {str(urdf)}
    metadata = {SOURCES: sources_text("arm.yaml", tmp_path)}
    assert changed_sources(metadata) == ()
    urdf.write_text(urdf.read_text().replace("0.6", "0.7"))
    (line,) = changed_sources(metadata)
    assert line.startswith(f"{urdf} has changed since the import")
    urdf.unlink()
    assert changed_sources(metadata) == ()
    assert changed_sources({}) == ()
    assert changed_sources({SOURCES: "{"}) == ()


def test_by_how_much_a_log_lags_is_no_other_robot():
    assert differences(servo_pendulum().with_joint("servo", lag_s=0.2), servo_pendulum()) == ()
