"""Proposed mappings: right, or asked for; never wrong in silence."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import measurement_files as samples
import numpy as np
import odd_files
import pandas as pd
import pytest

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.write import as_yaml, rows
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import CONTINUOUS_RAD

RIGHT, ASKED, WRONG = "right", "asked", "wrong"
FEWEST_RIGHT = 14


def outcome(case: odd_files.Case, folder: Path) -> tuple[str, str]:
    """What comes of a file: right, asked or wrong, and a word about it."""
    robot, truth = odd_files.robot(), odd_files.truth()
    files = case.write(folder)
    proposal = proposal_for(files, robot, case.hints)
    if proposal.questions:
        return ASKED, proposal.questions[0]
    (folder / "mapping.yaml").write_text(as_yaml(proposal, str(odd_files.ARM), "log.csv"))
    try:
        record, _ = import_files(files, read_mapping(folder / "mapping.yaml"), robot)[0]
    except MeasurementError as error:
        return ASKED, str(error)
    log = record.log
    rows = min(len(log), len(truth))
    for values, wanted, names in (
        (log.sensors, truth.sensors, robot.sensor_names),
        (log.commands, truth.commands, robot.motor_names),
    ):
        off = np.abs(values[:rows] - wanted[:rows]).max(axis=0) / np.ptp(wanted, axis=0)
        if not (off < 0.02).all():
            return WRONG, f"{names[int(np.nanargmax(off))]} is off by {np.nanmax(off):.2g} of its span"
    return RIGHT, ""


def test_no_wrong_guess_is_silent(tmp_path: Path) -> None:
    """Two dozen files: wrong guesses that nobody is told of are counted, and there must be none."""
    found = {}
    for k, case in enumerate(odd_files.cases()):
        (tmp_path / str(k)).mkdir()
        found[case.name] = (*outcome(case, tmp_path / str(k)), case.asks)
    said = "\n".join(f"{name}: {what} {why}" for name, (what, why, _) in found.items())
    assert not [n for n, (what, _, _) in found.items() if what == WRONG], said
    assert not [n for n, (what, _, asks) in found.items() if (what == ASKED) != asks], said
    assert sum(what == RIGHT for what, _, _ in found.values()) >= FEWEST_RIGHT, said
    assert len(found) >= 20


@pytest.mark.parametrize("name", list(samples.FORMATS))
def test_every_format_needs_no_mapping(tmp_path: Path, name: str) -> None:
    """The log of each format is the motion that was written, bit for bit, or to the format's single precision."""
    robot, _ = load_robot(samples.robot_file(tmp_path))
    path = samples.FORMATS[name][0](tmp_path)
    proposal = proposal_for([path], robot, Hints())
    assert not proposal.questions
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), path.name))
    ((record, report),) = import_files([path], read_mapping(tmp_path / "mapping.yaml"), robot)
    m = samples.motion()
    single = name == "lerobot"
    wanted = {k: v.astype(np.float32) if single else v for k, v in m.items()}
    assert np.array_equal(record.log.sensors[:, :2], wanted["q"])
    assert np.array_equal(record.log.commands, wanted["g"])
    assert not report.resampled
    if not single:
        assert np.array_equal(record.log.sensors[:, 2:], wanted["w"])


def test_two_files_with_their_own_clocks_and_lists_in_cells(tmp_path: Path) -> None:
    robot, _ = load_robot(samples.robot_file(tmp_path))
    m = samples.motion()
    folder = tmp_path / "runs"
    folder.mkdir()
    for trial in ("one", "two"):
        states = pd.DataFrame({"t_us": 1e6 * m["t"], "positions": [str(v.tolist()) for v in m["q"]]})
        states.to_csv(folder / f"{trial}_states.csv", index=False)
        sent = pd.DataFrame({"time": 12.0 + m["t"]} | {f"goal_{j}": m["g"][:, k] for k, j in enumerate(samples.JOINTS)})
        sent.to_csv(folder / f"{trial}_commands.csv", index=False)
    files = sorted(folder.iterdir())
    proposal = proposal_for(files, robot, Hints())
    assert not proposal.questions
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "runs"))
    found = import_files(files, read_mapping(tmp_path / "mapping.yaml"), robot)
    assert [r.name for r, _ in found] == ["one", "two"]
    for record, report in found:
        # What came before the first command is left out: the offset found takes up the 40 ms of lag.
        late = samples.ROWS - len(record.log)
        assert 0 <= late <= 6
        assert np.array_equal(record.log.sensors[:, 0], m["q"][late:, 0])
        (said,) = [d for d in report.done if "a lag of the drives is part of it" in d]
        assert float(said.split()[1]) == pytest.approx(-12.0 + 0.04, abs=0.02)


@pytest.mark.parametrize(
    ("other", "commands"), [("ee", "cmd"), ("measured", "cmd"), ("joint_states_ori", "joint_states_cmd")]
)
def test_commands_and_what_is_called_nothing_in_one_folder(tmp_path: Path, other: str, commands: str) -> None:
    """Two files with the same columns are one trial where one of them is called commands, whatever else both are called."""
    robot, _ = load_robot(samples.robot_file(tmp_path))
    m = samples.motion()
    folder = tmp_path / "run"
    folder.mkdir()
    for name, values in ((other, m["q"]), (commands, m["g"])):
        columns = {"time": m["t"]} | {j: values[:, k] for k, j in enumerate(samples.JOINTS)}
        pd.DataFrame(columns).to_csv(folder / f"{name}.csv", index=False)
    proposal = proposal_for(sorted(folder.iterdir()), robot, Hints())
    assert not proposal.questions
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "run"))
    ((record, _),) = import_files(sorted(folder.iterdir()), read_mapping(tmp_path / "mapping.yaml"), robot)
    assert record.name == "run"
    assert np.abs(record.log.sensors[:, 0] - m["q"][-len(record.log) :, 0]).max() < 1e-6
    # Each of two clocks that begin at 0 may be its logger's own: where the signals fit best, give or take the lag.
    away = np.abs(m["g"][:, 0, None] - record.log.commands[:, 0]).min(axis=0)
    assert np.abs(away).max() < 0.01


@pytest.mark.parametrize("seen", ["read", "measured"])
def test_columns_that_name_each_joint_as_the_robot_does_need_no_question(tmp_path: Path, seen: str) -> None:
    """In whatever order: nobody is asked which of two names that are the same is which."""
    robot, _ = load_robot(samples.robot_file(tmp_path))
    m = samples.motion()
    columns = {"time": m["t"]}
    for k, j in reversed(list(enumerate(samples.JOINTS))):
        columns |= {f"goal_{j}": m["g"][:, k], f"{seen}_{j}": m["q"][:, k], f"{seen}_{j}_velocity": m["w"][:, k]}
    pd.DataFrame(columns).to_csv(tmp_path / "log.csv", index=False)
    proposal = proposal_for([tmp_path / "log.csv"], robot, Hints())
    assert not proposal.questions
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "log.csv"))
    ((record, _),) = import_files([tmp_path / "log.csv"], read_mapping(tmp_path / "mapping.yaml"), robot)
    assert np.array_equal(record.log.sensors[:, :2], m["q"]) and np.array_equal(record.log.commands, m["g"])


SO101 = ("shoulder_pan", "shoulder_lift", "elbow_flex", "wrist_flex", "wrist_roll", "gripper")


def hobby_arm(folder: Path, scale: float, gripper: float) -> tuple[Path, np.ndarray, np.ndarray]:
    """A data set of a six-joint hobby arm; states and actions (T, 6) as they stand in it."""
    t = np.arange(300) / 30
    phases = np.linspace(0, 3, 6)
    wave = lambda s: scale * np.sin(1.3 * s[:, None] + phases) * (1 + 0.3 * np.sin(3.1 * s[:, None]))  # noqa: E731
    state, action = wave(t), wave(t + 0.07)
    for part in (state, action):
        part[:, 5] = gripper * (1 + part[:, 5] / (2 * scale)) / 2
    out = folder / "set"
    (out / "meta").mkdir(parents=True)
    (out / "data" / "chunk-000").mkdir(parents=True)
    feature = {"dtype": "float32", "shape": [6], "names": [f"{j}.pos" for j in SO101]}
    info = {"codebase_version": "v3.0", "robot_type": "so101_follower", "fps": 30,
            "features": {"observation.state": feature, "action": feature}}  # fmt: skip
    (out / "meta" / "info.json").write_text(json.dumps(info))
    lists = {"observation.state": list(state.astype(np.float32)), "action": list(action.astype(np.float32))}
    counts = {"timestamp": t.astype(np.float32), "frame_index": np.arange(300), "episode_index": np.arange(300) // 150}
    frame = pd.DataFrame(lists | counts)
    frame["frame_index"] %= 150
    frame.to_parquet(out / "data" / "chunk-000" / "file-000.parquet")
    return out, state, action


@pytest.mark.parametrize(
    ("scale", "unit", "factor"),
    [(85.0, None, None), (85.0, "deg", np.pi / 180), (85.0, "percent", 0.017), (105.0, None, np.pi / 180)],
)
def test_hobby_arms_of_lerobot(tmp_path: Path, scale: float, unit: str | None, factor: float | None) -> None:
    """Joints by their names, goal positions as commands; degrees and shares of the range are told apart or asked for."""
    robot, _ = load_robot(samples.robot_file(tmp_path, SO101))
    robot = replace(
        robot, joints=tuple(replace(j, lower=-2.5, upper=2.5) if unit != "percent" else j for j in robot.joints)
    )
    path, state, _ = hobby_arm(tmp_path, scale / 1.3, 100.0)
    proposal = proposal_for([path], robot, Hints(unit=unit))
    if factor is None:
        assert "degrees, or -100 to 100" in proposal.questions[0]
        assert "say task.unit=deg or task.unit=percent" in proposal.questions[0]
        return
    assert not proposal.questions
    assert any("range_min and range_max" in n for n in proposal.notes) == (unit == "percent")
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "set"))
    found = import_files([path], read_mapping(tmp_path / "mapping.yaml"), robot)
    assert [r.name for r, _ in found] == ["episode 0", "episode 1"]
    log = found[0][0].log
    at = np.arange(0, 149 / 30, 0.01)
    for k in range(5):
        wanted = factor * np.interp(at, np.arange(150) / 30, state[:150, k])
        assert log.sensors[: len(at), k] == pytest.approx(wanted, abs=1e-5)
    lower, upper = robot.joint("gripper").lower, robot.joint("gripper").upper
    assert log.sensors[0, 5] == pytest.approx(lower + (upper - lower) * state[0, 5] / 100, abs=1e-5)


def test_what_is_proposed_says_how_sure_it_is_and_why(tmp_path: Path) -> None:
    (tmp_path / "0").mkdir()
    case = odd_files.cases()[1]
    proposal = proposal_for(case.write(tmp_path / "0"), odd_files.robot(), case.hints)
    found = {channel: (columns, unit, sure, why) for channel, columns, unit, sure, why in rows(proposal)}
    columns, unit, sure, why = found["turn_position, shoulder_position, elbow_position"]
    assert (columns, unit, sure) == ("q0, q1, q2", "rad", "likely")
    assert "its change is qd0 to qd2" in why
    assert "by number" in why
    assert found["time"][:3] == ("t_us", "us", "sure")
    assert "follow it by" in found["command of turn, shoulder, elbow"][3]


def test_nothing_unknown_goes_without_a_question(tmp_path: Path) -> None:
    """Speeds whose name contradicts their numbers, torques of an absurd size: each is asked for by name."""
    m = odd_files.arrays()
    base = {"t": m["t"]} | odd_files.spread("q{}", m["q"]) | odd_files.spread("cmd{}", m["g"])
    lying = base | odd_files.spread("vel{} (rpm)", m["w"]) | odd_files.spread("tau{}", m["tau"])
    (question,) = proposal_for(odd_files.csv(lying)(tmp_path), odd_files.robot(), Hints()).questions
    assert "the name says rpm, but beside the positions it is rad/s" in question
    absurd = base | odd_files.spread("vel{}", m["w"]) | odd_files.spread("tau{} (Nm)", 60 * m["tau"])
    (question,) = proposal_for(odd_files.csv(absurd)(tmp_path), odd_files.robot(), Hints()).questions
    assert "times what the motion needs in N.m" in question
    # At one joint alone: friction may be that of a slow motion many times over, another unit it is not.
    for times, asked in ((40.0, False), (1000.0, True)):
        one = base | odd_files.spread("vel{}", m["w"]) | odd_files.spread("tau{} (Nm)", m["tau"] * [1.0, times, 1.0])
        questions = proposal_for(odd_files.csv(one)(tmp_path), odd_files.robot(), Hints()).questions
        assert any("what the motion needs in N.m at shoulder" in q for q in questions) == asked, times


@pytest.mark.parametrize(
    ("size", "question"),
    [(1.0, ""), (odd_files.DEG, "degrees, or many turns in rad"), (3e3, "degrees, or many turns in rad")],
)
def test_joints_that_turn_on_and_on_are_in_radians_or_it_is_asked(tmp_path: Path, size: float, question: str) -> None:
    """A continuous joint of a URDF has its stops a hundred turns away: a motion is small beside that in any unit."""
    arm = odd_files.robot()
    free = replace(arm, joints=tuple(replace(j, lower=-CONTINUOUS_RAD, upper=CONTINUOUS_RAD) for j in arm.joints))
    m = odd_files.arrays()
    table = {"t": m["t"]} | odd_files.spread("q{}", size * m["q"]) | odd_files.spread("cmd{}", size * m["g"])
    proposal = proposal_for(odd_files.csv(table | odd_files.spread("tau{}", m["tau"]))(tmp_path), free, Hints())
    if question:
        assert any(question in q for q in proposal.questions)
    else:
        found = {c.name: c.entry for c in proposal.choices}
        assert [found[f"{j}_position"]["unit"] for j in odd_files.JOINTS] == ["rad"] * 3


def test_a_joint_without_ends_has_no_range_that_percent_are_shares_of(tmp_path: Path) -> None:
    robot, _ = load_robot(samples.robot_file(tmp_path, SO101))
    roll = {"lower": -CONTINUOUS_RAD, "upper": CONTINUOUS_RAD}
    robot = replace(robot, joints=tuple(replace(j, **roll) if j.name == "wrist_roll" else j for j in robot.joints))
    path, _, _ = hobby_arm(tmp_path, 85.0 / 1.3, 100.0)
    proposal = proposal_for([path], robot, Hints(unit="percent"))
    assert any("wrist_roll, which has no limits" in q for q in proposal.questions)
