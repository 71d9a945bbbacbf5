"""Logs as controllers of arms write them (RTDE): targets beside readings, speeds of both, a pose of the tool, a joint at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import small_logs as logs
from measurement_files import JOINTS, motion

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.write import as_yaml


def log_of(folder: Path, degrees: bool = False) -> Path:
    """The first joint hardly moves."""
    m = motion()
    size = np.rad2deg(1.0) if degrees else 1.0
    still = np.array([0.02, 1.0])
    speeds = {k: np.gradient(m[k], m["t"], axis=0) for k in "qg"}
    table: dict[str, np.ndarray] = {"timestamp": m["t"] + 2100.0}
    for what, values in (
        ("target_q", m["g"]), ("target_qd", speeds["g"]), ("actual_q", m["q"]), ("actual_qd", speeds["q"])
    ):  # fmt: skip
        table |= {f"{what}_{k}": size * still[k] * values[:, k] for k in range(2)}
    table |= {f"actual_TCP_pose_{k}": 0.3 * m["q"][:, k % 2] + 0.1 * k for k in range(2)}
    return logs.written(folder, pd.DataFrame(table))


@pytest.mark.parametrize("degrees", [False, True])
def test_it_comes_in_by_itself(tmp_path: Path, degrees: bool) -> None:
    """Targets of the speeds are no commands, where the drives obey positions; a tool's pose is no joint; and one joint's small
    motion makes its unit no other than that of the rest."""
    m = motion()
    log, _ = logs.imported(tmp_path, log_of(tmp_path, degrees))
    scale = np.array([0.02, 1.0])
    assert log.commands == pytest.approx(m["g"] * scale, abs=1e-9)
    assert log.joints == pytest.approx(m["q"] * scale, abs=1e-9)
    for joint, k in zip(JOINTS, range(2), strict=True):
        speed = np.gradient(m["q"], m["t"], axis=0)[:, k] * scale[k]
        assert log.channel(f"velocity_{joint}") == pytest.approx(speed, abs=1e-9)


def test_a_time_that_is_too_coarse_is_named(tmp_path: Path) -> None:
    file = log_of(tmp_path)
    table = pd.read_csv(file)
    table["timestamp"] = np.floor(table["timestamp"] / 0.03) * 0.03
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, table))
    assert "'timestamp': time stands still" in proposal.questions[0] and "rows more" in proposal.questions[0]


def led(folder: Path, late_s: float, name: str = "log") -> Path:
    """Rows of 20 ms of a controller that goes on between them; the joints are ``late_s`` behind."""
    t = np.arange(0, 4, 0.02)
    way = lambda s: np.stack([0.5 * np.sin(1.7 * s) + 0.2 * np.sin(4.1 * s), 0.4 * np.cos(2.3 * s)], axis=1)  # noqa: E731
    file = folder / f"{name}.csv"
    logs.frame_of(t, way(t - late_s), way(t)).to_csv(file, index=False)
    return file


@pytest.mark.parametrize(("late_s", "lines"), [(0.001, True), (0.03, False)])
def test_points_between_which_a_controller_goes_on_are_not_held(tmp_path: Path, late_s: float, lines: bool) -> None:
    """No joint is ahead of a command that is held until the next comes."""
    log, report = logs.imported(tmp_path, led(tmp_path, late_s))
    between = log.commands[1::2]  # rows of 10 ms
    held = np.isclose(between, log.commands[:-1:2][: len(between)]).all()
    assert held != lines
    assert any("by straight lines" in d and "points between which" in d for d in report.done) == lines
    assert any("commands held" in d for d in report.done) != lines
    assert report.between == ("lines" if lines else "")


@pytest.mark.parametrize("stiff", [False, True])
def test_joints_that_follow_soon_at_even_speeds_are_led_evenly(tmp_path: Path, stiff: bool) -> None:
    """Joints a row late may be led by a drive that goes on between the rows, or jump to what a stiff one holds: speeds tell."""
    fine, row = np.arange(0, 4, 0.001), 20
    way = np.stack([0.5 * np.sin(1.7 * fine) + 0.2 * np.sin(4.1 * fine), 0.4 * np.cos(2.3 * fine)], axis=1)
    if stiff:
        held, seen = np.repeat(way[::row], row, axis=0), [way[0]]
        for asked in held[:-1]:
            seen.append(seen[-1] + (asked - seen[-1]) * 0.001 / 0.006)
        at = np.array(seen)
    else:
        late = np.maximum(fine - 0.018, 0.0)
        at = np.stack([np.interp(late, fine, c) for c in way.T], axis=1)
    frame = logs.frame_of(fine[::row], at[::row], way[::row])
    speeds = np.gradient(at, fine, axis=0)[::row]
    frame = frame.assign(**{f"{j}_vel_rad_s": speeds[:, k] for k, j in enumerate(logs.samples.JOINTS)})
    _, report = logs.imported(tmp_path, logs.written(tmp_path, frame))
    assert report.between == ("" if stiff else "lines")
    assert any("follow within a row at even speeds" in d for d in report.done) != stiff


def test_goals_that_stay_for_many_rows_are_held(tmp_path: Path) -> None:
    """Stairs have a rate nowhere but at their edges: joints that come to each a fifth of a second late are not ahead of them."""
    t, rng = np.arange(0, 10, 0.05), np.random.default_rng(0)
    asked = np.repeat(np.linspace(0, [0.5, -0.4], 20), 10, axis=0)
    seen = np.stack([np.interp(t - 0.25, t, c) for c in asked.T], axis=1) + rng.normal(scale=2e-4, size=asked.shape)
    file = logs.written(tmp_path, logs.frame_of(t, seen, asked))
    _, report = logs.imported(tmp_path, file)
    assert not any("by straight lines from" in d or "points between which" in d for d in report.done)
    assert any("commands held" in d for d in report.done)


def test_what_one_trial_shows_goes_for_all(tmp_path: Path) -> None:
    """A trial so slow, or short, that it does not tell is led by the same controller."""
    files = [led(tmp_path, 0.001, "quick"), led(tmp_path, 0.001, "slow")]
    slow = pd.read_csv(files[1])
    slow.iloc[:, 1:] = 0.3
    slow.to_csv(files[1], index=False)
    robot, proposal = logs.proposed(tmp_path, files[0])
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "log"))
    found = import_files(files, read_mapping(tmp_path / "mapping.yaml"), robot)
    assert all(any("points between which" in d for d in report.done) for _, report in found)


JOINTS_OF_THREE = ("pan", "lift", "elbow")


def three(folder: Path, name: str, late_s: tuple[float, ...], most: float) -> Path:
    """Three joints, each so late after a command that goes there and back once, or for as long as the trial takes."""
    t = np.arange(0, 8, 0.02)
    way = lambda s: most * (np.sin(2.3 * s) if most > 0.1 else np.exp(-((s - 4) ** 2)))  # noqa: E731
    positions = np.stack([way(t - s) for s in late_s], axis=1)
    file = folder / f"{name}.csv"
    logs.frame_of(t, positions, np.stack([way(t)] * 3, axis=1), joints=JOINTS_OF_THREE).to_csv(file, index=False)
    return file


@pytest.mark.parametrize("with_others", [True, False])
def test_a_trial_in_which_joints_hardly_move_and_disagree_decides_nothing(tmp_path: Path, with_others: bool) -> None:
    """The middle of 0, 90 ms late and as early is no lag of all."""
    files = [three(tmp_path, f"late_{k}", (0.11, 0.12, 0.1), 0.5) for k in range(2)]
    files.append(three(tmp_path, "still", (0.0, -0.09, 0.09), 0.05))
    robot, proposal = logs.proposed(tmp_path, files[0], joints=JOINTS_OF_THREE)
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "log"))
    found = import_files(files if with_others else files[-1:], read_mapping(tmp_path / "mapping.yaml"), robot)
    assert not any("points between which" in d for _, report in found for d in report.done)


def test_most_of_the_motion_decides_for_all_trials(tmp_path: Path) -> None:
    files = [three(tmp_path, "quick", (0.001, 0.002, 0.001), 0.5), three(tmp_path, "still", (0.11, 0.12, 0.1), 0.05)]
    robot, proposal = logs.proposed(tmp_path, files[0], joints=JOINTS_OF_THREE)
    (tmp_path / "mapping.yaml").write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "log"))
    found = import_files(files, read_mapping(tmp_path / "mapping.yaml"), robot)
    assert all(any("points between which" in d for d in report.done) for _, report in found)


@pytest.mark.parametrize(("said", "late_s"), [("held", 0.001), ("lines", 0.03)])
def test_a_person_may_say_what_commands_do_between_rows(tmp_path: Path, said: str, late_s: float) -> None:
    file = led(tmp_path, late_s)
    robot, proposal = logs.proposed(tmp_path, file)
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text(as_yaml(proposal, str(tmp_path / "chain.yaml"), "log") + f"commands_between: {said}\n")
    ((record, report),) = import_files([file], read_mapping(mapping), robot)
    held = np.isclose(record.log.commands[1::2], record.log.commands[:-1:2]).all()
    assert held == (said == "held")
    assert any("commands held" in d for d in report.done) == (said == "held") and report.between == said
    mapping.write_text(mapping.read_text().replace(f"commands_between: {said}", "commands_between: leapt"))
    with pytest.raises(MeasurementError, match="commands_between: expected 'held' or 'lines' or 'steps', not 'leapt'"):
        read_mapping(mapping)
