"""A gain that a log states takes the place of one that the description only assumed, and is told; nobody's word is overruled."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping import Mapping
from ee_dist.measurements.mapping_file import mapping_of, read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.measurements.stated_gains import with_gains
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot


def robot_of(folder: Path, shoulder: str, elbow: str) -> Robot:
    described = samples.robot_file(folder)
    drives = f"drives:\n  shoulder: {{{shoulder}}}\n  elbow: {{{elbow}}}\n"
    described.write_text(described.read_text().split("drives:")[0] + drives)
    return load_robot(described)[0]


def proposed(folder: Path, robot: Robot, **constant: object) -> Proposal:
    m = samples.motion()
    rows = {"t": m["t"]} | {f"{k}{j}": m[k][:, j] for k in "qwg" for j in (0, 1)}
    pd.DataFrame(rows | constant).to_csv(folder / "log.csv", index=False)
    return proposal_for([folder / "log.csv"], robot, Hints())


def mapped(folder: Path, proposal: Proposal) -> Mapping:
    (folder / "mapping.yaml").write_text(as_yaml(proposal, None, "log"))
    return read_mapping(folder / "mapping.yaml")


ASSUMED = "kp: 240, kd: 8, assumed: [kp, kd, rotor_inertia]"


def test_assumed_gains_give_way_to_those_of_the_log(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, ASSUMED, ASSUMED.replace("240", "450"))
    found = proposed(tmp_path, robot, kp=20, kd=0.5)
    (note,) = (n for n in found.notes if "kp" in n and "not used" not in n)
    assert "the log states kp 20 and kd 0.5, where the description only assumes kp 240, 450 and kd 8" in note
    assert "write {kp: 20, kd: 0.5} at every drive of the description and take kp and kd off 'assumed'" in note
    assert not any(n.startswith("columns not used") for n in found.notes)
    made, remarks = with_gains(robot, mapped(tmp_path, found))
    assert [(d.kp, d.kd) for d in made.drives] == [(20.0, 0.5)] * 2
    assert made.assumed == (("shoulder", "rotor_inertia"), ("elbow", "rotor_inertia"))
    assert not remarks


def test_of_drives_only_those_that_were_assumed(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, ASSUMED, "kp: 30, kd: 1")
    found = proposed(tmp_path, robot, kp=20)
    assert any("write {kp: 20} at the drives of shoulder" in n for n in found.notes)
    assert any("kp is 20 in all trials: the description's gain is taken for it" in n for n in found.notes)
    made, _ = with_gains(robot, mapped(tmp_path, found))
    assert [(d.kp, d.kd) for d in made.drives] == [(20.0, 8.0), (30.0, 1.0)]


@pytest.mark.parametrize(
    ("drive", "kp", "said"),
    [
        ("kp: 30, kd: 1", 20, "kp is 20 in all trials: the description's gain is taken for it"),
        ("kp: 5, assumed: [kp]", 800, "too far off to be taken for the same unit; if it is, write 'kp: 800'"),
        (ASSUMED, np.linspace(10, 20, samples.ROWS), ""),
    ],
)
def test_what_somebody_vouches_for_and_what_cannot_be_a_gain_stay(
    tmp_path: Path, drive: str, kp: object, said: str
) -> None:
    robot = robot_of(tmp_path, drive, drive)
    found = proposed(tmp_path, robot, kp=kp)
    assert any(said in n for n in found.notes)
    assert "gains" not in found.head
    assert with_gains(robot, mapped(tmp_path, found))[0] is robot


@pytest.mark.parametrize(
    ("gains", "said"),
    [
        ({"elbo": {"kp": 2}}, "gains: chain has no driven joint 'elbo'; did you mean elbow"),
        ({"elbow": {"pk": 2}}, "gains: elbow: unknown key 'pk'; did you mean kp"),
        ({"elbow": {"kp": -2}}, "gains: elbow: kp: expected 0 or more, not -2"),
        ({"elbow": 2}, "gains: elbow: expected 'name: number', not 2"),
        ([2], "gains: expected 'name: {kp: number, kd: number}', not [2]"),
    ],
)
def test_gains_of_a_mapping_that_cannot_be(tmp_path: Path, gains: object, said: str) -> None:
    robot, _ = load_robot(samples.robot_file(tmp_path))
    with pytest.raises(MeasurementError) as error:
        with_gains(robot, mapping_of({"sensors": {}, "gains": gains}, tmp_path / "m.yaml"))
    assert said in str(error.value)


def test_gains_that_the_time_step_does_not_resolve_are_remarked(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, "kp: 0.1, speed_limit: 1000", "kp: 0.1, speed_limit: 1000")
    mapping = mapping_of({"sensors": {}, "gains": {"all_joints": {"kp": 200}}}, tmp_path / "m.yaml")
    (remark,) = with_gains(robot, mapping)[1]
    assert "too coarse for its controllers" in remark


def listed_gains(folder: Path, robot: Robot, order: tuple[int, int], **stated: object) -> Proposal:
    """Of a log whose positions, speeds and commands are lists, in an order of its columns, and whose gains are lists too."""
    m = samples.motion()
    places = list(order)
    np.savez(folder / "log.npz", time=m["t"], dof_pos=m["q"][:, places], dof_vel=m["w"][:, places],
             des_dof_pos=m["g"][:, places], **{k: np.asarray(v) for k, v in stated.items()})  # fmt: skip
    hints = Hints(joints=tuple(robot.motor_names[p] for p in places))
    return proposal_for([folder / "log.npz"], robot, hints)


def test_gains_in_a_list_are_those_of_the_joints_in_the_order_of_the_positions(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, ASSUMED, ASSUMED)
    found = listed_gains(tmp_path, robot, (1, 0), kp=[20.0, 30.0], kd=[0.5, 0.5])
    made, _ = with_gains(robot, mapped(tmp_path, found))
    assert [(d.kp, d.kd) for d in made.drives] == [(30.0, 0.5), (20.0, 0.5)]
    assert any("the log states kp 20, 30 and kd 0.5" in n for n in found.notes)


def test_gains_in_rows_of_a_list_are_read_and_told_once(tmp_path: Path) -> None:
    rows = np.ones((len(samples.motion()["t"]), 2))
    robot = robot_of(tmp_path, ASSUMED, ASSUMED)
    found = listed_gains(tmp_path, robot, (0, 1), kp=20.0 * rows, kd=0.5 * rows)
    assert found.head["gains"] == {"all_joints": {"kp": 20.0, "kd": 0.5}}
    (note,) = (n for n in found.notes if "kp" in n and "not used" not in n)
    assert "at every drive" in note
    vouched = robot_of(tmp_path, "kp: 20, kd: 1", "kp: 20, kd: 1")
    told = [n for n in listed_gains(tmp_path, vouched, (0, 1), kp=[20.0, 20.0]).notes if "kp" in n]
    assert told == [n for n in told if n.startswith("kp is 20 in all trials")] and len(told) == 1


def of_two_trials(folder: Path, robot: Robot, *kp: float) -> list[tuple[str, dict[str, float], str]]:
    """(target, factor by trial's gain, why) of the settings that two trials with such gains are proposed."""
    files = []
    for k, gain in enumerate(kp):
        proposed(folder, robot, kp=gain)
        files.append((folder / "log.csv").rename(folder / f"run{k}.csv"))
    found = [c for c in proposal_for(files, robot, Hints()).choices if c.group == "settings"]
    scales = [(c.name.split(" at ")[1], (c.entry or {})["factor"]["scale"], c.why) for c in found]
    return [(target, {g: g * scale for g in kp}, why) for target, scale, why in scales]


@pytest.mark.parametrize(
    ("drive", "kp", "at", "said"),
    [
        ("kp: 80, kd: 4", (40, 60, 80), 80, "the description's gain, 80, is one of these, and taken for the same unit"),
        ("kp: 70, kd: 4", (40, 120), 70, "the description's gain, 70, is between these"),
        (ASSUMED, (40, 120), 240, "the description only assumes 240, taken for the same unit"),
        ("kp: 240, kd: 8", (40, 120), 40, "the description's gain, 240, which need not be in one unit with it"),
        ("kp: 5, assumed: [kp]", (400, 800), 400, "is taken for that at 400: where it is that of another"),
    ],
)
def test_gains_that_differ_are_held_against_that_of_the_description(
    tmp_path: Path, drive: str, kp: tuple[float, ...], at: float, said: str
) -> None:
    ((target, factors, why),) = of_two_trials(tmp_path, robot_of(tmp_path, drive, drive), *kp)
    assert target == "all_joints" and factors == pytest.approx({k: k / at for k in kp})
    assert said in why


def test_gains_that_differ_are_held_against_that_of_each_drive(tmp_path: Path) -> None:
    shoulder, elbow = of_two_trials(tmp_path, robot_of(tmp_path, "kp: 80, kd: 4", "kp: 50, kd: 4"), 40, 80)
    assert shoulder[:2] == ("shoulder", pytest.approx({40: 0.5, 80: 1.0})) and "80, is one of these" in shoulder[2]
    assert elbow[:2] == ("elbow", pytest.approx({40: 0.8, 80: 1.6})) and "50, is between these" in elbow[2]


def gains_of_trials(folder: Path, robot: Robot, column: str, gains: tuple[float, ...]) -> Proposal:
    """Of a log for each of the ``gains``, which stand in a column of its own, with commands of the driven joints."""
    m = samples.motion()
    driven = [d.command != "none" for d in robot.drives]
    goals = {f"goal_{joint}_rad": m["g"][:, k] for k, joint in enumerate(robot.motor_names) if driven[k]}
    for k, gain in enumerate(gains):
        read = np.column_stack([m["q"], 0.3 * np.sin(3.1 * m["t"])])
        rows = {"time_s": m["t"]} | {f"position_{joint}_rad": read[:, j] for j, joint in enumerate(robot.motor_names)}
        pd.DataFrame(rows | goals | {column: gain}).to_csv(folder / f"run{k}.csv", index=False)
    return proposal_for([folder / f"run{k}.csv" for k in range(len(gains))], robot, Hints())


@pytest.mark.parametrize("column", ["kp", "shoulder_kp"])
def test_a_gain_beside_a_joint_that_nothing_drives_is_that_of_the_driven_one(tmp_path: Path, column: str) -> None:
    robot = robot_of(tmp_path, "kp: 2, kd: 0.5", "command: none, viscous: 0.001")
    found = gains_of_trials(tmp_path, robot, column, (1.0, 2.0, 3.0))
    (choice,) = (c for c in found.choices if c.group == "settings")
    factor = {"column": column, "scale": 0.5}
    assert choice.entry == {"effect": "position_gain", "target": "shoulder", "factor": factor}
    assert not any("kp" in note for note in found.notes), found.notes


def test_a_gain_of_several_driven_joints_is_no_gain_of_those_that_nothing_drives(tmp_path: Path) -> None:
    joints = ("shoulder", "elbow", "tail")
    path = samples.robot_file(tmp_path, joints)
    path.write_text(path.read_text().replace("tail: {kp: 20, speed_limit: 8}", "tail: {command: none}"))
    robot, _ = load_robot(path)
    found = gains_of_trials(tmp_path, robot, "kp", (10.0, 20.0))
    (choice,) = (c for c in found.choices if c.group == "settings")
    assert (choice.entry or {})["target"] == "driven_joints"
    (tmp_path / "mapping.yaml").write_text(as_yaml(found, str(path), "log"))
    files = [tmp_path / f"run{k}.csv" for k in (0, 1)]
    held = [record.believed for record, _ in import_files(files, read_mapping(tmp_path / "mapping.yaml"), robot)]
    assert [dict(terms[0].values)["factor"] for terms in held] == pytest.approx([0.5, 1.0])


def test_one_gain_of_all_trials_takes_the_place_of_the_assumed_ones_of_driven_joints_only(tmp_path: Path) -> None:
    robot = robot_of(tmp_path, ASSUMED, "command: none")
    found = gains_of_trials(tmp_path, robot, "kp", (200.0, 200.0))
    assert found.head["gains"] == {"shoulder": {"kp": 200.0}}
    assert not any("is taken for it" in note for note in found.notes), found.notes
