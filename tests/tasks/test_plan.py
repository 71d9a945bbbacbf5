"""task=plan on the command line: a trial leaves two explanations tied, the planned one tells them apart."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
import yaml

from ee_dist.discrepancy.plan import Parting, PlannedTrial, ranked
from ee_dist.recording.reader import read_run
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.config import Config
from ee_dist.tasks.explained import explained
from ee_dist.tasks.plan import another_seed, nothing_tied
from ee_dist.tasks.results.plan_page import UNITS, account_of, of_plan, plan_page
from ee_dist.trials.excitation import parse
from ee_dist.trials.family import Limits

QUICK = ("engine=mujoco", "evaluator=serial")
SUSPECTS = "task.only=[part_mass,command_gain]"
HIDDEN = "hidden=[{effect: part_mass, target: arm, change: 0.25}]"


@pytest.fixture
def run(cli):
    def call(*arguments: str):
        outcome = cli(*arguments)
        assert outcome.status == 0, outcome.err
        return outcome.runs()[0], outcome

    return call


def tied(folder: Path) -> list[str]:
    best = json.loads((folder / "summary.json").read_text())["candidates"][0]
    return [best["name"], *best["tied_with"]]


def test_the_planned_trial_tells_apart_what_one_trial_left_tied(run, cli):
    """At small angles a heavier pendulum and a drive that turns too little are one law. The whole chain, each by its own line."""
    first, _ = run("task=trial", "robot=servo_pendulum", "task.excitations=['sway:seconds=2,amplitude=0.03,seed=1']",
                   "task.noise=0.001", HIDDEN, "engine=mujoco")  # fmt: skip
    before, outcome = run("task=explain", f"measured={first}", SUSPECTS, "task.rerun=false", *QUICK)
    assert set(tied(before)) == {"part_mass@arm", "command_gain@servo"}
    told = next(line for line in outcome.out.splitlines() if "task=plan" in line)
    typed = told.split(": ", 1)[1]
    line = shlex.split(typed)
    assert line[:3] == ["python", "-m", "ee_dist"] and f"<code>{typed}</code>" in (before / "report.html").read_text()

    assert line[3] == "task=plan" and (outcome.folder / line[4].removeprefix("task.explained=")).samefile(before)

    plan, outcome = run("task=plan", f"task.explained={before}", "task.seconds=2", "task.draws=1", "evaluator=serial")
    found = json.loads((plan / "summary.json").read_text())
    assert found["engine"] == "mujoco", "as the run that it goes on from"
    assert found["enough"] and found["best"]["enough"] and not found["alike"]
    assert found["reading_s"] == 0.004
    assert [t["separation"] for t in found["trials"]] == sorted(
        (t["separation"] for t in found["trials"]), reverse=True
    )
    assert found["headline"] in (plan / "report.html").read_text() and found["headline"][:40] in outcome.out

    # The same file of commands as the trial that the line makes.
    line = shlex.join(found["command"])
    assert line in outcome.out and " task.noise=0.001 " in line, "numbers need no quotes"
    assert " seed=1 " in line, "the first trial has that of 0"
    second, _ = run(*shlex.split(line)[3:], HIDDEN)
    sent = pd.read_csv(plan / found["csv"])
    assert list(sent.columns) == ["time_s", "servo_command (rad)"]
    log = read_run(second / "trial.mcap").trials[0].log
    assert np.allclose(sent.to_numpy(), np.column_stack([log.times_s, log.commands]), atol=1e-6)
    assert len(log) == 500 and np.abs(log.commands).max() <= 0.5 * 2 * np.pi

    both = f"measured=[{first / 'trial.mcap'},{second / 'trial.mcap'}]"
    after, _ = run("task=explain", both, SUSPECTS, "task.rerun=false", *QUICK)
    assert tied(after) == ["part_mass@arm"]
    assert "task=plan" not in (after / "report.html").read_text(), "nothing is left to plan for"

    # A run that tells it needs no plan, unless a suspicion is named.
    outcome = cli("task=plan", f"task.explained={after}")
    assert outcome.status == 2 and "nothing is tied with part_mass@arm" in outcome.err
    few = (
        f"task.explained={after}",
        "task.seconds=1",
        "task.kinds=[multisine,rest]",
        "task.draws=1",
        "evaluator=serial",
    )
    asked, _ = run("task=plan", "task.suspects=[backlash@servo]", *few)
    one = json.loads((asked / "summary.json").read_text())
    assert [e["name"] for e in one["explanations"]] == ["part_mass@arm", "part_mass@arm and backlash@servo"]
    assert parse(one["command"][-1].split('"')[1]).kind == "multisine"

    # The log of a real robot: what was sent, and what came back beside it.
    seen = sent.assign(**{"servo_position (rad)": log.sensors[:, 0], "servo_speed (rad/s)": log.sensors[:, 1]})
    seen.to_csv(plan / "recorded.csv", index=False)
    taken, _ = run("task=import", "robot=servo_pendulum", f"measured={plan / 'recorded.csv'}")
    back = read_run(taken / "measured.mcap").trials[0].log
    assert np.allclose(back.commands, log.commands, atol=1e-6)


def test_who_has_a_real_robot_is_not_sent_to_a_simulated_one():
    robot, best = servo_pendulum(), parse("sway:seconds=2,amplitude=0.5,seed=1")
    found = SimpleNamespace(
        best=SimpleNamespace(excitation=best, separation=60.0), closest=(0, 1), enough=True, trials=[best], alike=[],
        all_told=True,
    )  # fmt: skip
    tied_ones = [("part_mass@arm", ()), ("command_gain@servo", ())]
    real, simulated = (
        account_of(robot, found, tied_ones, "python -m ee_dist task=trial", True, real=r) for r in (True, False)
    )
    assert real.first[-1] == "Next: send plan.csv to the robot, and import its log beside the others (task=import)."
    assert not any("Next:" in line for line in simulated.first), "the command follows"
    assert real.headline == simulated.headline
    assert UNITS in real.lines


def test_what_no_trial_tells_apart_stands_in_the_first_line_and_leaves_the_question_open():
    trials = tuple(
        PlannedTrial(parse(f"sway:seconds=2,amplitude=0.5,seed={k}"), 0.0, (20.2, 19.7, 0.07)) for k in range(12)
    )
    found, robot = ranked(3, trials), servo_pendulum()
    tied_ones = [("zero_offset@servo", ()), ("offset_torque@servo", ()), ("friction_asymmetry@servo", ())]
    told = account_of(robot, found, tied_ones, "python -m ee_dist task=trial", True)
    assert told.headline.endswith(
        "No trial within these limits tells offset torque at servo from friction asymmetry at servo."
    )
    assert "(19.7 standard deviations, 4 are enough)" in told.headline and not told.good
    assert "the two most similar that can be told apart decide" in told.sure
    summary = of_plan(found, tied_ones, Path(), [], Limits(2.0, 0.5), told)
    assert summary["best"]["enough"] and not summary["enough"] and len(summary["alike"]) == 1
    curves = np.array([np.linspace(0, 1, 50)] * 3)
    page = plan_page(robot, found, tied_ones, Parting(0, 0.1, 0.3, np.linspace(0, 1, 50), curves), told, [])
    assert page.tone == "open" and page.tiles[0][1].endswith("the two most similar that can be told apart")
    assert page.sections[0].caption.endswith(
        "Shown are 1 of 12, of each motion and size the best; summary.json has all."
    )
    drawn = [(curve.line.color, curve.line.dash) for curve in page.proof.figure.data if curve.showlegend is None]
    assert len({dash for _, dash in drawn}) == 3 and drawn[0][1] == "solid"
    widths = [curve.line.width for curve in page.proof.figure.data if curve.showlegend is None]
    assert widths == sorted(widths, reverse=True), "a thick curve hides a thin one that was drawn before"


def test_the_next_trial_has_another_noise_than_those_at_hand(tmp_path):
    """Trials of one seed have the same noise, sample by sample. A log beside which nothing says its seed is passed over."""
    files = []
    for name, text in (("a", '{"seed": 1}'), ("b", '{"seed": 2}'), ("c", "[1"), ("d", "[]"), ("e", None)):
        (tmp_path / name).mkdir()
        files.append(tmp_path / name / "trial.mcap")
        if text is not None:
            (tmp_path / name / "summary.json").write_text(text)
    assert another_seed(files, 0) == 3
    assert another_seed(files[:1], 0) == 2
    assert another_seed(files[2:], 0) == 1
    assert another_seed(files, 7) == 8


def test_a_log_of_30_hz_is_planned_for_at_30_hz(run, cli):
    """As a hobby arm is logged: the plan says what a trial comes to that is read as seldom as the one before."""
    first, _ = run("task=trial", "robot=servo_pendulum", "task.excitations=['sway:seconds=4,amplitude=0.03,seed=1']",
                   "task.noise=0.001", HIDDEN, "engine=mujoco")  # fmt: skip
    log = read_run(first / "trial.mcap").trials[0].log
    rows = np.round(np.arange(0, len(log), 1 / 30 / 0.004)).astype(int)
    seen = {"time_s": log.times_s, "servo_command (rad)": log.commands[:, 0],
            "servo_position (rad)": log.sensors[:, 0], "servo_speed (rad/s)": log.sensors[:, 1]}  # fmt: skip
    pd.DataFrame(seen).iloc[rows].to_csv(first / "slow.csv", index=False)
    taken, _ = run("task=import", "robot=servo_pendulum", f"measured={first / 'slow.csv'}")
    before, _ = run("task=explain", f"measured={taken}", SUSPECTS, "task.rerun=false", *QUICK)
    few = ("task.suspects=[backlash@servo]", "task.kinds=[sway,multisine]", "task.draws=1", "evaluator=serial")
    plan, outcome = run("task=plan", f"task.explained={before}", "task.seconds=3", *few)
    found = json.loads((plan / "summary.json").read_text())
    assert found["reading_s"] == pytest.approx(1 / 30, abs=0.003)
    said = f"read every {1000 * found['reading_s']:.3g} ms"
    assert any(said in line for line in found["words"])
    assert said in (plan / "report.html").read_text() and "Predicted of sensors" in outcome.out
    outcome = cli("task=plan", f"task.explained={before}", "task.seconds=1", *few)
    assert outcome.status == 2 and "readings" in outcome.err and "at least 60" in outcome.err


def test_a_run_of_improve_gives_its_model_and_that_with_what_was_tied_in_its_place(tmp_path):
    """Each effect of the model exchanged for each that was tied with it when it was added; not those that went again."""

    def entry(effect: str, **values: float) -> dict[str, object]:
        return {"effect": effect, "target": "servo", "values": values}

    viscous, dry = entry("viscous_friction", damping_nm_s_rad=0.01), entry("coulomb_friction", torque_nm=0.02)
    slow, gone = entry("command_delay", delay_s=0.01), entry("deadband", half_width_rad=0.1)
    ladder = [
        {"added": [], "alternatives": []},
        {"added": [gone], "alternatives": [entry("backlash", gap_rad=0.1)]},
        {"added": [dry], "alternatives": [entry("load_friction", share=0.1), viscous]},
        {"added": [viscous], "alternatives": []},
    ]
    summary = {"task": "improve", "verdict": "explained", "way": "open_loop", "engine": "mujoco", "ladder": ladder}
    (tmp_path / "summary.json").write_text(json.dumps(summary | {"model_terms": [slow, dry, viscous]}))
    found = explained(str(tmp_path), Config(measured="trial.mcap"))
    assert [(name, [t.effect for t in terms]) for name, terms in found.explanations] == [
        ("coulomb_friction@servo", ["command_delay", "coulomb_friction", "viscous_friction"]),
        ("load_friction@servo", ["command_delay", "load_friction", "viscous_friction"]),
    ]
    assert found.config.engine.name == "mujoco" and found.config.measured == "trial.mcap"
    twin = {**entry("motor_weak", loss=0.2), "in_place_of": {"effect": viscous["effect"], "target": "servo"}}
    twins = [{**twin, "terms": [slow, dry, entry("motor_weak", loss=0.2)]}]
    (tmp_path / "summary.json").write_text(json.dumps(summary | {"model_terms": [slow, dry, viscous], "twins": twins}))
    last = explained(str(tmp_path), Config(measured="trial.mcap")).explanations[-1]
    assert (last[0], [t.effect for t in last[1]]) == (
        "motor_weak@servo", ["command_delay", "coulomb_friction", "motor_weak"]
    )  # fmt: skip


def test_what_is_tied_as_a_family_is_told_apart_too(tmp_path):
    """All that a step added exchanged for all of a family; of a tie whose values were not kept nobody says that there is none."""
    shared = {"effect": "viscous_friction", "target": "all_joints", "values": {"damping_nm_s_rad": 0.3}}
    joints = ("turn", "shoulder", "elbow")
    slow = [{"effect": "speed_limit", "target": j, "values": {"loss": 0.3}} for j in joints]
    family = {**slow[0], "name": "speed_limit@each of 3 joints", "terms": slow}
    ties = ["speed_limit@each of 3 joints", "viscous_friction@each of 3 joints"]
    step = {"name": "viscous_friction@all_joints", "added": [shared], "alternatives": [family], "tied_with": ties}
    summary = {
        "task": "improve",
        "verdict": "explained",
        "way": "open_loop",
        "engine": "mujoco",
        "model_terms": [shared],
    }

    def found(**changed):
        (tmp_path / "summary.json").write_text(json.dumps({**summary, "ladder": [{**step, **changed}]}))
        return explained(str(tmp_path), Config(measured="trial.mcap"))

    assert [(name, [t.name for t in terms]) for name, terms in found().explanations] == [
        ("viscous_friction@all_joints", ["viscous_friction@all_joints"]),
        ("speed_limit@each of 3 joints", [f"speed_limit@{j}" for j in joints]),
    ]
    assert not found().by_name
    (tmp_path / "summary.json").write_text(
        json.dumps({**summary, "model_terms": slow, "ladder": [{**step, "name": family["name"], "added": slow, "alternatives": [
            {**shared, "name": "viscous_friction@all_joints", "terms": [shared]}]}]})
    )  # fmt: skip
    exchanged = explained(str(tmp_path), Config(measured="trial.mcap")).explanations[1]
    assert [t.name for t in exchanged[1]] == ["viscous_friction@all_joints"]
    named = found(alternatives=[])
    assert len(named.explanations) == 1 and named.by_name == ("speed_limit@each of 3 joints",)
    assert "no further trial" not in nothing_tied(
        named
    ) and "task.only=[speed_limit] and the effect itself" in nothing_tied(named)


def test_a_plan_looks_at_the_trials_that_its_run_looked_at(tmp_path) -> None:
    """Names of trials are those of the run's own log: another log has its own."""
    (tmp_path / "config").mkdir()
    asked = {"measured": "a.mcap", "model": None, "plugins": [], "trials": ["slow"], "held_out": ["fast"]}
    (tmp_path / "config" / "config.yaml").write_text(yaml.safe_dump(asked))
    (tmp_path / "config" / "hydra.yaml").write_text(yaml.safe_dump({"hydra": {"runtime": {"cwd": str(tmp_path)}}}))
    summary = {
        "task": "improve",
        "verdict": "explained",
        "way": "open_loop",
        "engine": "mujoco",
        "ladder": [],
        "model_terms": [],
    }
    (tmp_path / "summary.json").write_text(json.dumps(summary))
    same, other = (explained(str(tmp_path), Config(measured=m)).config for m in (None, "b.mcap"))
    assert (same.measured, same.trials, same.held_out) == ([str(tmp_path / "a.mcap")], ["slow"], ["fast"])
    assert (other.measured, other.trials, other.held_out) == ("b.mcap", None, None)
