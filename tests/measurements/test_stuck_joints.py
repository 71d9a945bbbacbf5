"""A joint that is commanded and stands still: a remark, no question of units; and the columns of one family have one unit."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements import signals
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import mapping_of
from ee_dist.measurements.proposal.torque_scale import _in_thousandths
from ee_dist.measurements.report import Report
from ee_dist.measurements.standing import step_of, told_to_rest
from ee_dist.robots.describe import load_robot

JOINTS = ("shoulder", "elbow", "wrist")
T = np.arange(500) / 100


def frame(unit: float = 1.0, wrist: float = 1 / 700, joints: int = 3) -> pd.DataFrame:
    """Commands in times ``unit`` the positions; the last joint creeps by a share of what it is asked for."""
    asked = np.stack(
        [0.5 * np.sin(1.7 * T) + 0.2 * np.sin(4.1 * T), 0.4 * np.cos(2.3 * T), 0.5 * np.sin(2.9 * T)], axis=1
    )
    seen = np.stack([np.interp(T - 0.05, T, c) for c in asked.T], axis=1) * [1, 1, wrist]
    return logs.frame_of(
        T, seen[:, 3 - joints :], unit * asked[:, 3 - joints :], "{joint}_{what}", JOINTS[3 - joints :]
    )


@pytest.mark.parametrize("unit", [1.0, 180 / np.pi])
def test_it_is_a_remark_and_the_unit_is_that_of_the_others(tmp_path: Path, unit: float) -> None:
    log, report = logs.imported(tmp_path, logs.written(tmp_path, frame(unit)), JOINTS)
    assert any(s == "wrist does not move although it is commanded by 1 rad" for s in report.suspicious)
    assert np.ptp(log.commands[:, 2]) == pytest.approx(1.0, rel=0.01)


def mapped(tmp_path: Path, table: pd.DataFrame, joints: tuple[str, ...], **commands: str) -> list[str]:
    return reported(tmp_path, table, joints, **commands).suspicious


def reported(
    tmp_path: Path,
    table: pd.DataFrame,
    joints: tuple[str, ...],
    cutoffs: tuple[float, ...] = (20, 20, 20),
    **commands: str,
) -> Report:
    logs.written(tmp_path, table)
    robot, _ = load_robot(samples.robot_file(tmp_path, joints))
    sensors: dict[str, Any] = {f"position_{j}": {"column": f"{j}_pos", "unit": "rad"} for j in joints}
    sensors |= {
        f"velocity_{j}": {"speed_of": f"position_{j}", "cutoff_hz": hz} for j, hz in zip(joints, cutoffs, strict=False)
    }
    told = {j: {"column": f"{j}_goal", "unit": commands.get(j, "rad")} for j in joints}
    raw = {"time": {"column": "time", "unit": "s"}, "sensors": sensors, "commands": told}
    ((_, report),) = import_files([tmp_path / "log.csv"], mapping_of(raw, tmp_path / "map.yaml"), robot)
    return report


@pytest.mark.parametrize("share", [1 / 700, 1 / 57.3])
def test_whoever_wrote_the_mapping(tmp_path: Path, share: float) -> None:
    said = [s for s in mapped(tmp_path, frame(wrist=share), JOINTS) if "wrist" in s]
    assert said == ["wrist does not move although it is commanded by 1 rad"]


def test_a_unit_that_was_written_wrongly_at_one_joint_is_still_refused(tmp_path: Path) -> None:
    table = frame(wrist=1.0)
    table["wrist_pos"] *= 0.1
    table["wrist_goal"] *= 0.1
    with pytest.raises(MeasurementError, match=r"wrist: its commands are 0\.0175 times its positions"):
        mapped(tmp_path, table, JOINTS, wrist="deg")


def test_of_one_joint_alone_a_ratio_between_units_is_a_unit(tmp_path: Path) -> None:
    assert any("does not move" in s for s in mapped(tmp_path, frame(joints=1), JOINTS[2:]))
    with pytest.raises(MeasurementError, match="another unit"):
        mapped(tmp_path, frame(wrist=1 / 57.3, joints=1), JOINTS[2:])


def test_torques_of_one_family_have_one_unit() -> None:
    block = cast(Any, SimpleNamespace(units=(None, None, None)))
    relations = [signals.Relation(0.9, size) for size in (1.1, 0.8, 900.0)]
    assert not _in_thousandths(relations, [0, 1, 2], block), "at one joint alone it is friction"
    assert _in_thousandths([signals.Relation(0.9, s) for s in (1100.0, 800.0, 3.0)], [0, 1, 2], block)


def test_what_nobody_moved_is_one_line_and_nothing_to_suspect(tmp_path: Path) -> None:
    table = frame()
    table[[f"{j}_{what}" for j in JOINTS[1:] for what in ("pos", "goal")]] = [0.1, 0.1, -0.2, -0.2]
    _, report = logs.imported(tmp_path, logs.written(tmp_path, table), JOINTS)
    assert not report.suspicious and "not moved in this trial, as told: elbow, wrist" in report.done
    # One that is told to go is another matter, and so is a log in which nothing moves.
    table["wrist_goal"] = frame()["wrist_goal"]
    _, report = logs.imported(tmp_path, logs.written(tmp_path, table), JOINTS)
    assert any("position_wrist" in s and "stuck" in s for s in report.suspicious)
    assert not any("elbow" in s for s in report.suspicious)
    still = {"elbow": np.full(9, 0.1), "wrist": np.full(9, 0.2)}
    robot, _ = load_robot(samples.robot_file(tmp_path, JOINTS))
    assert not told_to_rest(robot, np.zeros((9, 3)), still)


@pytest.mark.parametrize("names", ["{joint}_{what}_deg", "{joint}_{what}"])
def test_what_rounding_left_of_a_goal_that_stays_tells_nothing_of_units(tmp_path: Path, names: str) -> None:
    """An encoder reads the sway of a held joint in its steps, and its goal follows that by a hundred thousandth of a degree."""
    asked = np.degrees(frame().filter(like="goal").to_numpy())
    sway = np.round(np.sin(1.7 * T) / 0.09) * 0.09 * 0.15
    step = 360 / 4096
    seen = np.round(np.stack([*(np.interp(T - 0.05, T, c) for c in asked[:, :2].T), sway], axis=1) / step) * step
    asked[:, 2] = 1e-4 * sway
    table = logs.frame_of(T, seen, asked, names, JOINTS)
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, table), JOINTS)
    assert not proposal.questions
    told = {c.name: c.entry for c in proposal.choices if c.group == "commands"}
    assert {(e or {}).get("unit") for e in told.values()} == {"deg"} and not any(
        "sign" in (e or {}) for e in told.values()
    )


@pytest.mark.parametrize(
    ("cutoffs", "said"),
    [
        ((20, 20, 20), ["speeds of 3 joints (shoulder, elbow, wrist): estimated from their positions"]),
        (
            (20, 10, 20),
            [
                "speeds of 2 joints (shoulder, wrist): estimated from their positions",
                "velocity_elbow: estimated from position_elbow",
            ],
        ),
    ],
)
def test_speeds_that_are_estimated_alike_are_one_line(
    tmp_path: Path, cutoffs: tuple[float, ...], said: list[str]
) -> None:
    report = reported(tmp_path, frame(wrist=1.0), JOINTS, cutoffs)
    lines = [d for d in report.done if "estimated from" in d]
    assert [d.partition(", to be seen and not compared: central differences behind")[0] for d in lines] == said
    assert all(f"order 4, {hz} Hz" in d for d, hz in zip(lines, cutoffs, strict=False))


def test_the_step_of_an_encoder_is_the_least_change_of_what_it_reads() -> None:
    assert step_of(np.array([0.0, 0.5, 0.25, np.nan, 0.25, 1.0])) == 0.25
    assert step_of(np.array([1.0, 1.0 + 1e-12, 1.0])) == 0.0 and step_of(np.full(4, np.nan)) == 0.0
