"""Numbered columns of robots that branch: what rules an order out, and that what stays open is asked."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import LIKELY, SURE, UNKNOWN, Hints, Proposal
from ee_dist.measurements.proposal.orders import plausible
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.robots.describe import load_robot
from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.robots.listing import listings
from ee_dist.robots.model import Robot

LEGS = {"left_hip": "base", "left_knee": "left_hip", "right_hip": "base", "right_knee": "right_hip"}
TRUE = {"hip": (-0.6, 0.6), "knee": (-2.4, -0.6)}
WIDE = {"hip": (-3.0, 3.0), "knee": (-3.0, 3.0)}
LIMBS = ("left_hip", "left_knee", "right_hip", "right_knee")
LEVELS = ("left_hip", "right_hip", "left_knee", "right_knee")
T = np.arange(600) / 100


def robot_file(folder: Path, limits: dict[str, tuple[float, float]], order: tuple[str, ...] = LIMBS) -> Path:
    """Two legs that hang from a base, the joints of each named in an order of the file."""
    joints = ""
    for j in order:
        low, high = limits[j.split("_")[1]]
        joints += samples.JOINT.format(j, LEGS[j] if LEGS[j] == "base" else f"link_{LEGS[j]}", f"link_{j}").replace(
            'lower="-1.7" upper="1.7"', f'lower="{low}" upper="{high}"'
        )
    links = '<link name="base"/>' + "".join(samples.LINK.format(f"link_{j}") for j in LEGS)
    (folder / "legs.urdf").write_text(f'<robot name="legs">{links}{joints}</robot>')
    drives = "".join(f"  {j}: {{kp: 20, speed_limit: 8}}\n" for j in order)
    (folder / "legs.yaml").write_text(f"urdf: legs.urdf\ntime_step_s: 0.01\ndrives:\n{drives}")
    return folder / "legs.yaml"


def wave(t: np.ndarray) -> dict[str, np.ndarray]:
    """Hips about zero, knees bent."""
    return {
        "left_hip": 0.4 * np.sin(2.1 * t), "left_knee": -1.4 + 0.5 * np.sin(2.9 * t),
        "right_hip": 0.3 * np.cos(1.7 * t), "right_knee": -1.5 + 0.4 * np.cos(3.3 * t),
    }  # fmt: skip


def written(
    folder: Path, order: tuple[str, ...], scale: float = 1.0, named: bool = False, robot: Robot | None = None
) -> Path:
    """A log whose columns are numbered in an order; the positions ``named``, or torques of the ``robot`` beside them."""
    seen, asked, rows = wave(T - 0.05), wave(T), {"time": T}
    rows |= {f"pos_{j if named else k}": scale * seen[j] for k, j in enumerate(order)}
    rows |= {f"vel{k}": np.gradient(scale * seen[j], T) for k, j in enumerate(order)}
    rows |= {f"pos_des{k}": scale * asked[j] for k, j in enumerate(order)}
    if robot is not None:
        q = np.stack([seen[m] for m in robot.motor_names], axis=1)
        speed = np.gradient(q, T, axis=0)
        given = joint_torques(robot, q, speed, np.gradient(speed, T, axis=0))
        rows |= {f"tau{k}": given[:, robot.motor_names.index(j)] for k, j in enumerate(order)}
    pd.DataFrame(rows).to_csv(folder / "log.csv", index=False)
    return folder / "log.csv"


def proposed(file: Path, described: Path, hints: Hints = Hints()) -> Proposal:  # noqa: B008
    robot, _ = load_robot(described)
    return proposal_for([file], robot, replace(hints, written=listings(described)))


def columns_of(proposal: Proposal, group: str = "sensors") -> dict[str, str]:
    return {c.name: c.column for c in proposal.choices if c.group == group}


@pytest.mark.parametrize("scale", [1.0, 180 / np.pi])
@pytest.mark.parametrize(("order", "called", "other"), [(LIMBS, "limb by limb", "level by level"),
                                                        (LEVELS, "level by level", "limb by limb")])  # fmt: skip
def test_the_order_that_keeps_joints_within_their_limits_is_taken_and_said(
    tmp_path: Path, order: tuple[str, ...], called: str, other: str, scale: float
) -> None:
    described = robot_file(tmp_path, TRUE)
    found = proposed(written(tmp_path, order, scale), described)
    assert not found.questions
    columns = columns_of(found)
    assert columns == {f"position_{j}": f"pos_{k}" for k, j in enumerate(order)} | {
        f"velocity_{j}": f"vel{k}" for k, j in enumerate(order)
    }
    assert columns_of(found, "commands") == {j: f"pos_des{k}" for k, j in enumerate(order)}
    choice = next(c for c in found.choices if c.name == "position_left_knee")
    assert choice.sure == LIKELY
    assert f"by number, {called}: {other} would leave the joints' limits" in choice.why
    (note,) = (n for n in found.notes if called in n)
    assert f"{called} ({', '.join(order)})" in note and f"{other} pos_" in note and "task.joints=" in note


def test_orders_that_all_fit_are_asked_about_and_go_into_no_mapping(tmp_path: Path) -> None:
    described = robot_file(tmp_path, WIDE)
    file = written(tmp_path, LIMBS)
    found = proposed(file, described)
    (question,) = found.questions
    for order in (LIMBS, LEVELS):
        assert f"'task.joints=[{','.join(order)}]'" in question
    assert {c.sure for c in found.choices if c.group in ("sensors", "commands")} == {UNKNOWN}
    assert "pos_0," not in as_yaml(found, None, "log") and "???" in as_yaml(found, None, "log")
    assert not any("not used" in n for n in found.notes)
    chosen = proposed(file, described, Hints(joints=LIMBS))
    assert not chosen.questions and {c.sure for c in chosen.choices if c.group == "sensors"} == {SURE}
    assert columns_of(chosen)["position_left_knee"] == "pos_1"


def test_an_order_that_fits_no_unit_is_a_matter_of_order(tmp_path: Path) -> None:
    """Encoders that count the other way round leave stops in every order, yet hips get less far than knees."""
    limits = {"hip": (-0.6, 0.6), "knee": (0.6, 2.4)}
    found = proposed(written(tmp_path, LIMBS), robot_file(tmp_path, limits))
    assert not any("task.unit" in q for q in found.questions)
    assert columns_of(found)["position_left_knee"] == "pos_1"


def test_where_no_order_fits_the_unit_is_asked(tmp_path: Path) -> None:
    found = proposed(written(tmp_path, LIMBS, 1e4), robot_file(tmp_path, TRUE))
    assert any("task.joints=" in q for q in found.questions)
    assert any("task.unit=rad or deg" in q for q in found.questions), "a hinge has no metres"


def test_a_zero_that_is_a_little_off_rules_nothing_out(tmp_path: Path) -> None:
    limits = {"hip": (-0.39, 0.6), "knee": (-2.4, -0.85)}
    found = proposed(written(tmp_path, LIMBS), robot_file(tmp_path, limits))
    assert not found.questions and columns_of(found)["position_left_knee"] == "pos_1"


def test_measured_torques_tell_orders_apart_that_limits_do_not(tmp_path: Path) -> None:
    described = robot_file(tmp_path, WIDE)
    found = proposed(written(tmp_path, LIMBS, robot=load_robot(described)[0]), described)
    assert not found.questions
    assert columns_of(found)["position_left_knee"] == "pos_1" and columns_of(found, "torques")["left_knee"] == "tau1"
    choice = next(c for c in found.choices if c.name == "position_left_knee")
    assert "level by level would not go with the measured torques" in choice.why


def test_named_positions_tell_the_order_of_numbered_speeds_and_commands(tmp_path: Path) -> None:
    found = proposed(written(tmp_path, LIMBS, named=True), robot_file(tmp_path, WIDE))
    assert not found.questions
    assert (
        columns_of(found)["velocity_left_knee"] == "vel1" and columns_of(found, "commands")["left_knee"] == "pos_des1"
    )
    sure = {c.name: c.sure for c in found.choices}
    assert sure["position_left_knee"] == SURE and sure["velocity_left_knee"] == LIKELY


def test_numbered_columns_that_go_with_no_joint_ask_for_no_order(tmp_path: Path) -> None:
    described = robot_file(tmp_path, WIDE)
    frame = pd.read_csv(written(tmp_path, LIMBS, named=True))
    rng = np.random.default_rng(0)
    frame = frame.rename(
        columns={f"{what}{k}": f"{what}_{j}" for k, j in enumerate(LIMBS) for what in ("vel", "pos_des")}
    )
    frame = frame.assign(**{f"motor_speed{k}": rng.standard_normal(len(T)) for k in range(4)})
    frame.to_csv(tmp_path / "log.csv", index=False)
    found = proposed(tmp_path / "log.csv", described)
    assert not found.questions and columns_of(found)["velocity_left_knee"] == "vel_left_knee"


def test_files_that_say_nothing_of_joints_list_none(tmp_path: Path) -> None:
    (tmp_path / "list.yaml").write_text("- 1")
    (tmp_path / "far.yaml").write_text(f"urdf: {'x' * 5000}.urdf")
    (tmp_path / "torn.urdf").write_text("<robot")
    assert listings(*tmp_path.iterdir(), tmp_path / "nowhere.yaml", "urdf") == ()


def test_orders_of_a_robot(tmp_path: Path) -> None:
    mixed = ("right_hip", "left_hip", "right_knee", "left_knee")
    described = robot_file(tmp_path, TRUE, mixed)
    robot, _ = load_robot(described)
    assert robot.motor_names == mixed
    listed = (*listings(described), ("of another robot", ("wheel",)))
    assert [(o.names, o.called) for o in plausible(robot, listed)] == [
        (mixed, "level by level"),
        (("right_hip", "right_knee", "left_hip", "left_knee"), "limb by limb"),
    ]
    text = described.read_text().replace("  left_knee", "  passing", 1)
    described.write_text(
        text.replace("drives:\n", "drives:\n  left_knee: {kp: 20, speed_limit: 8}\n").split("  passing")[0]
    )
    assert plausible(robot, listings(described))[-1].called == "as legs.yaml lists them"


def test_a_chain_and_what_hangs_side_by_side_have_one_order(tmp_path: Path) -> None:
    chain, _ = load_robot(samples.robot_file(tmp_path, ("c", "a", "b")))
    assert [o.names for o in plausible(chain, (("as listed", ("a", "b", "c")),))] == [("c", "a", "b")]
