"""compare, explain, improve and reveal on the command line, by every way of comparing: the same keys, the same names.

The robots are measured by ``task=trial``, and, where the force of a motor is wanted, by a log that an import wrote.
"""

from __future__ import annotations

import html
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from scene_texts import text_of

from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.effects.catalogue import apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.robots.servo_pendulum import servo_pendulum

QUICK = ("engine=mujoco", "evaluator=serial")
SUSPECTS = "task.only=[coulomb_friction,viscous_friction]"
HIDDEN = "coulomb_friction@servo"
WAYS = ("open_loop", "free_run", "force_balance")
VERDICTS = ("effect", "nothing_missing", "unexplained")


def run(cli, *arguments):
    outcome = cli(*arguments)
    assert outcome.status == 0, outcome.err
    return outcome.runs()[0], outcome


@pytest.fixture(scope="module")
def record(tmp_path_factory) -> Path:
    """Two motions of a pendulum with dry friction as a logger keeps them: angle, target and the motor's torque."""
    folder = tmp_path_factory.mktemp("pendulum")
    robot = servo_pendulum()
    faulty = apply(robot, (term("coulomb_friction", "servo", torque_nm=0.06),))
    t = np.arange(0, 2, robot.time_step_s)
    rise = np.minimum(1.0, t / 0.4) ** 2
    rng = np.random.default_rng(0)
    drive = robot.drives[0]
    for k, (a, b) in enumerate(((4.3, 9.7), (6.1, 2.9))):
        sent = (rise * (0.7 * np.sin(a * t) + 0.3 * np.sin(b * t)))[:, None]
        (log,) = OneJointEngine().rollout([Rollout(faulty, Commands(sent), len(t), pose=True)])
        angle, speed = log.sensors[:, 0], log.sensors[:, 1]
        asked = np.clip(drive.kp * (sent[:, 0] - angle), -drive.torque_limit, drive.torque_limit)
        motor = asked - drive.torque_limit / drive.speed_limit * speed
        columns = {"t": t, "angle": angle + 5e-4 * rng.standard_normal(len(t)),
                   "speed": speed + 5e-3 * rng.standard_normal(len(t)), "target": sent[:, 0],
                   "motor": motor + 2e-3 * rng.standard_normal(len(t))}  # fmt: skip
        pd.DataFrame(columns).to_csv(folder / f"run{k + 1}.csv", index=False, float_format="%.8g")
    mapping = {
        "robot": {"robot": "servo_pendulum"}, "format": "csv", "time": {"column": "t", "unit": "s"},
        "sensors": {"position": {"column": "angle", "unit": "rad"}, "speed": {"column": "speed", "unit": "rad/s"}},
        "commands": {"servo": {"column": "target", "unit": "rad"}},
        "torques": {"servo": {"column": "motor", "unit": "N.m"}},
    }  # fmt: skip
    (folder / "mapping.yaml").write_text(yaml.safe_dump(mapping))
    return folder


@pytest.fixture
def imported(cli, record) -> Path:
    done = record / "measured.mcap"
    if not done.is_file():
        found, _ = run(cli, "task=import", f"measured={record}", f"task.mapping={record / 'mapping.yaml'}")
        (found / "measured.mcap").rename(done)
    return done


def told_alike(folder: Path, said) -> list[str]:
    """The headline and what comes below it: in summary, terminal, page and (where there is one) scene the same words."""
    summary = json.loads((folder / "summary.json").read_text())
    first = summary["words"][:3]
    assert first[0] == summary["headline"]
    assert first[1].split(": model ")[1] and "noise floor" in first[1], "the errors"
    assert first[2].startswith("How sure: ")
    plain = " ".join(said.out.split())
    page = html.unescape((folder / "report.html").read_text(encoding="utf-8"))
    scenes = [" ".join(text_of(scene)) for scene in folder.glob("*.rrd")]
    following = said.out.strip().splitlines()[-1]
    assert following.startswith("Next: python -m ee_dist task="), "the last line is the next command"
    assert following in summary["words"]
    for line in (*first, following.removeprefix("Next: ")):
        assert line in plain and line in page and all(line in text for text in scenes)
    return first


@pytest.mark.parametrize("by", WAYS)
def test_every_verb_by_every_way(cli, imported, by):
    way, log = f"task.by={by}", f"measured={imported}"
    found, said = run(cli, "task=compare", log, way, *QUICK)
    compared = json.loads((found / "summary.json").read_text())
    assert compared["way"] == by and compared["error"] > 1.5 * compared["noise_floor"]
    assert (found / "compare.rrd").is_file() and (found / "report.html").stat().st_size > 100_000
    last = said.out.strip().splitlines()[-1]
    assert "task=explain" in last and way in last, "the same way again"
    first = told_alike(found, said)
    assert compared["left"] and first[0].startswith("The model is off, most of all at ")

    found, said = run(cli, "task=explain", log, way, SUSPECTS, "task.rerun=false", *QUICK)
    explained = json.loads((found / "summary.json").read_text())
    assert f"{explained['wall_s']:.0f} s. Digest " in said.out and explained["wall_s"] > 0
    assert explained["verdict"] == "effect" and explained["candidates"][0]["name"] == HIDDEN
    assert explained["candidates"][0]["values"]["torque_nm"] == pytest.approx(0.06, rel=0.15)
    assert not (found / "explain.rrd").exists(), "a scene that was refused"
    headline, errors, _ = told_alike(found, said)
    assert headline.startswith("Missing") and "coulomb friction at servo (torque 0.0" in headline
    assert "improved model" in errors

    # What effect=auto finds by this way tests/discrepancy tells, in less time.
    found, said = run(cli, "task=improve", f"effect={HIDDEN}", log, way, "task.rerun=false", *QUICK)
    improved = json.loads((found / "summary.json").read_text())
    headline, errors, sure = told_alike(found, said)
    assert headline.startswith("Added: coulomb friction at servo (torque 0.0") and "improved model" in errors
    assert "95 % intervals" in sure and ": torque 0.0" in sure
    assert [t["effect"] for t in improved["model_terms"]] == ["coulomb_friction"]
    assert improved["ladder"][-1]["error_heldout"] < 0.5 * improved["ladder"][0]["error_heldout"]
    low, high = improved["parameters"][0]["interval"]
    assert low < improved["parameters"][0]["value"] < high

    found, _ = run(cli, "task=compare", log, way, f"model={found / 'model.yaml'}", "task.rerun=false", *QUICK)
    again = json.loads((found / "summary.json").read_text())
    assert again["error"] < 0.5 * compared["error"]
    assert again["model_terms"] == improved["model_terms"]
    told = [line for line in said.out.splitlines() if line.endswith(" on data held out")]
    assert len(told) == len(improved["ladder"]) - 1


@pytest.mark.parametrize("by", WAYS)
def test_what_is_held_out_from_all_of_it_decides_nothing_and_has_the_last_word(cli, imported, by):
    fit = ("task=improve", f"effect={HIDDEN}", f"task.by={by}", "task.rerun=false", f"measured={imported}", *QUICK)
    found, said = run(cli, *fit, "held_out=[run2]")
    improved = json.loads((found / "summary.json").read_text())
    told_alike(found, said)
    alone, _ = run(cli, *fit, "trials=[run1]")
    same = json.loads((alone / "summary.json").read_text())
    assert same["model_terms"] == improved["model_terms"] and same["ladder"] == improved["ladder"]
    assert same["last_word"] is None

    word = improved["last_word"]
    assert [t["name"] for t in word["trials"]] == ["run2"] and word["error_after"] < 0.5 * word["error_before"]
    # Each step tells what it is to these trials too, in the line that is said when it is taken, table, page and scene.
    first, last = word["steps"]
    assert first["error"] == word["error_before"] and last["error"] == pytest.approx(word["error_after"], rel=0.3)
    (line,) = (line for line in said.out.splitlines() if line.endswith(" on trials that were held out from all of it"))
    assert "windows of the fitted motions, held out in turn; " in line and "on data held out" not in said.out
    off = line.rpartition("; ")[2].removesuffix(" on trials that were held out from all of it")
    assert "held out in turn" in " ".join(said.out.split()) and said.out.count(off) > 1
    page = (found / "report.html").read_text(encoding="utf-8")
    assert "told at each step, and no step was chosen by it" in page
    elsewhere = [line for line in improved["words"] if line.startswith("Held out from all of it: ")]
    assert bool(elsewhere) is (by != "force_balance") and all(line in html.unescape(page) for line in elsewhere)
    assert "Held out from all of it" in page and "Held out from all of it (2. run2): model " in improved["words"][1]

    # The command to type next shows these trials with the model that was found; without it they are as they were before.
    words = shlex.split(said.out.strip().splitlines()[-1].removeprefix("Next: python -m ee_dist "))
    assert "trials=run2" in words
    for model, key in (([], "error_before"), ([f"model={found / 'model.yaml'}"], "error_after")):
        asked = [w for w in words if not w.startswith(("model=", "measured="))]
        compared, _ = run(cli, *asked, *model, f"measured={imported}", "task.rerun=false")
        content = json.loads((compared / "summary.json").read_text())
        assert len(content["trials"]) == 1
        if by == "free_run":
            # A led robot is searched and judged by windows, and compared run through: that is told too.
            (whole,) = (line for line in elsewhere if "run through without starting anew: " in line)
            says = "improved model" if model else "model"
            told = re.search(rf"\b{says} ([^,]+?)(,|\.$)", whole)
            assert told and f"mean absolute position error {told[1]}" in content["words"][0].lower()
        else:
            assert content["error"] == pytest.approx(word[key], rel=1e-6)


@pytest.mark.parametrize("by", WAYS)
def test_an_explanation_is_held_against_what_was_held_out_from_all_of_it(cli, imported, by):
    """What takes most off windows of one motion may do nothing for another: who held one out is told."""
    ask = ("task=explain", SUSPECTS, f"task.by={by}", f"measured={imported}", *QUICK)
    found, said = run(cli, *ask, "held_out=[run2]")
    told_alike(found, said)
    explained = json.loads((found / "summary.json").read_text())
    word = explained["last_word"]
    assert [t["name"] for t in word["trials"]] == ["run2"] and word["error_after"] < 0.5 * word["error_before"]
    page = (found / "report.html").read_text(encoding="utf-8")
    text = "Held out from all of it (2. run2): model "
    assert text in explained["words"][1] and text in page and "Held out from all of it:" in said.out
    alone, _ = run(cli, *ask, "trials=[run1]")
    same = json.loads((alone / "summary.json").read_text())
    assert same["last_word"] is None and same["candidates"] == explained["candidates"]


def test_auto_takes_the_first_way_that_the_channels_allow(cli, imported):
    found, said = run(cli, "task=compare", f"measured={imported}", "task.rerun=false", *QUICK)
    assert json.loads((found / "summary.json").read_text())["way"] == "free_run"
    assert "By free_run: of a real robot, positions and commands were recorded" in said.out


def test_a_log_of_torques_without_commands_is_compared_and_explained(cli, record, tmp_path):
    """What arms led by a controller of their own record: where they were and what their motors gave."""
    mapping = yaml.safe_load((record / "mapping.yaml").read_text())
    del mapping["commands"]
    (tmp_path / "mapping.yaml").write_text(yaml.safe_dump(mapping))
    found, _ = run(cli, "task=import", f"measured={record}", f"task.mapping={tmp_path / 'mapping.yaml'}")
    log = f"measured={found / 'measured.mcap'}"
    explained, said = run(cli, "task=explain", log, SUSPECTS, *QUICK)
    content = json.loads((explained / "summary.json").read_text())
    assert content["way"] == "force_balance" and content["candidates"][0]["name"] == HIDDEN
    told_alike(explained, said)
    outcome = cli("task=compare", log, "task.by=open_loop", *QUICK)
    assert outcome.status == 2 and outcome.err.count("\n") == 1 and "holds no commands" in outcome.err
    outcome = cli("task=improve", "effect=auto", log, "task.calibrate=true", *QUICK)
    assert outcome.status == 2 and outcome.err.count("\n") == 1 and "import it with its commands" in outcome.err


def test_what_no_effect_explains_alone_leads_on_to_improve(cli, imported):
    """Several may be off together, which explain does not try."""
    useless = "task.only=[sensor_noise@position]"
    found, said = run(cli, "task=explain", f"measured={imported}", useless, "task.by=open_loop", *QUICK)
    assert json.loads((found / "summary.json").read_text())["verdict"] == "unexplained"
    assert "several may be off together" in " ".join(said.out.split())
    assert "Next: python -m ee_dist task=improve" in said.out and "effect=auto" in said.out


@pytest.mark.parametrize("by", WAYS)
def test_a_sealed_trial_is_explained_improved_and_revealed(cli, by):
    plan = "task.excitations=['multisine:seconds=1.6,amplitude=0.2,seed=1','steps:seconds=1.6,amplitude=0.15,seed=2']"
    hidden = "+hidden=[{effect: load_friction, target: servo, share: 0.3}]"
    # What a balance of forces needs: the currents of the motors, and readings that can be differentiated twice.
    read = ("task.motor_torque=true", "task.noise=0.0001") if by == "force_balance" else ("task.noise=0.0005",)
    tried, _ = run(cli, "task=trial", "robot=servo_pendulum", "engine=mujoco", hidden, plan, *read)
    log, way, only = f"measured={tried}", f"task.by={by}", "task.only=[load_friction,parallel_spring]"
    explained, _ = run(cli, "task=explain", log, way, only, "task.rerun=false", *QUICK)
    shown, told = run(cli, "task=reveal", f"log={tried}", f"task.explained={explained}")
    assert json.loads((shown / "summary.json").read_text())["right"] is True
    assert "The truth: load friction at servo (share 30 %)" in told.out and "Right." in told.out
    if by != "open_loop":
        return  # A model is scored by what its summary says, which has the same keys by every way.
    improved, _ = run(cli, "task=improve", "effect=auto", log, way, only, "task.rerun=false", *QUICK)
    shown, _ = run(cli, "task=reveal", f"log={tried}", f"task.explained={improved}")
    content = json.loads((shown / "summary.json").read_text())
    assert content["right"] is True and content["missed"] == content["invented"] == []
    nothing, _ = run(cli, "task=improve", "effect=none", log, way, "task.rerun=false", *QUICK)
    shown, told = run(cli, "task=reveal", f"log={tried}", f"task.explained={nothing}")
    content = json.loads((shown / "summary.json").read_text())
    assert content["right"] is False and content["missed"] == [{"effect": "load_friction", "target": "servo"}]
    assert "Named: nothing. Not right." in told.out


def test_a_model_that_is_at_its_torque_limit_says_so_in_the_terminal_the_report_and_the_summary(cli, tmp_path):
    plan = "task.excitations=['multisine:seconds=1.6,amplitude=0.4,seed=1']"
    tried, _ = run(cli, "task=trial", "robot=servo_pendulum", "engine=mujoco", plan, "task.noise=0.0005")
    weak = tmp_path / "weak.yaml"
    weak.write_text("robot: servo_pendulum\neffects:\n  - {effect: torque_limit, target: servo, loss: 0.9}\n")
    found, said = run(cli, "task=compare", f"measured={tried}", f"model={weak}", "task.rerun=false", *QUICK)
    (line,) = (w for w in json.loads((found / "summary.json").read_text())["words"] if "at its torque limit" in w)
    assert line.startswith("servo (0.0") and line in " ".join(said.out.split())
    assert line in html.unescape((found / "report.html").read_text())
    other, said = run(cli, "task=compare", f"measured={tried}", "task.rerun=false", *QUICK)
    assert "torque limit" not in said.out + (other / "summary.json").read_text()


def test_a_model_is_calibrated_on_an_untouched_robot_and_its_calibration_holds_one_way(cli):
    plan = "task.excitations=['multisine:seconds=1.6,amplitude=0.2,seed=1','steps:seconds=1.6,amplitude=0.15,seed=2']"
    tried, _ = run(cli, "task=trial", "robot=servo_pendulum", "engine=mujoco", plan, "task.noise=0.0005")
    log, only = f"measured={tried}", "task.only=[coulomb_friction,parallel_spring]"
    found, _ = run(cli, "task=improve", "effect=auto", log, only, "task.calibrate=true", "task.rerun=false", *QUICK)
    beside = yaml.safe_load((found / "model.calibration.yaml").read_text())
    assert beside["way"] == "open_loop" and beside["gained"] >= 0
    assert json.loads((found / "summary.json").read_text())["calibrated_away"] == []
    model = f"model={found / 'model.yaml'}"
    explained, _ = run(cli, "task=explain", log, model, only, "task.rerun=false", *QUICK)
    summary = json.loads((explained / "summary.json").read_text())
    assert summary["verdict"] == "nothing_missing"
    assert "what calibration left" in summary["noise_floor_source"]
    wrong = cli("task=compare", log, model, "task.by=free_run", *QUICK)
    assert wrong.status == 2 and "the model was calibrated with task.by=open_loop" in wrong.err
    wrong = cli("task=improve", "effect=auto", log, "task.calibrate=true", "task.by=free_run", *QUICK)
    assert wrong.status == 2 and "use task.by=open_loop" in wrong.err
    assert len(wrong.err.strip().splitlines()) == 1


def test_a_calibration_on_a_robot_with_a_fault_says_what_it_hides(cli):
    plan = "task.excitations=['multisine:seconds=2.4,amplitude=0.6,seed=1,fixture=stand']"
    hidden = "hidden=[{effect: zero_offset, target: knee_front_right, offset_rad: 0.1}]"
    tried, _ = run(cli, "task=trial", "robot=quadruped_lab", "engine=mujoco", plan, "task.noise=0.005", hidden)
    only = "task.only=[zero_offset,coulomb_friction]"
    found, told = run(cli, "task=improve", "effect=auto", f"measured={tried}", only, "task.calibrate=true",
                      "task.rerun=false", *QUICK)  # fmt: skip
    (odd,) = json.loads((found / "summary.json").read_text())["calibrated_away"]
    assert (odd["effect"], odd["target"], odd["joint"]) == ("zero_offset", "knee_front_right", "knee_front_right")
    assert len(odd["like"]) == 7 and odd["times"] > 4
    line = "Calibrated away at knee front right: zero offset 0."
    for text in (told.out, (found / "report.html").read_text(), (found / "model.yaml").read_text()):
        assert line in " ".join(text.replace("#", " ").split())


@pytest.mark.parametrize("by", WAYS)
@pytest.mark.parametrize(("verb", "setting", "said"), [
    ("explain", "task.without=[coulomb_frictoin]", "did you mean coulomb_friction"),
    ("explain", "task.only=[coulomb_friction@servoo]", "servo"),
    ("improve", "task.without=[warp_drive]", "no effect named 'warp_drive'"),
    ("improve", "task.most=0", "task.most=0: must be 1 or more"),
    ("improve", "effect=coulomb_friction@knee", "coulomb_friction cannot act on 'knee'"),
    ("compare", "evaluator.workers=2", "evaluator.workers: the chosen evaluator has no such setting"),
])  # fmt: skip
def test_settings_are_honoured_or_refused_by_every_way(cli, imported, by, verb, setting, said):
    own = () if setting.startswith("effect=") or verb != "improve" else ("effect=auto",)
    outcome = cli(f"task={verb}", f"measured={imported}", f"task.by={by}", *own, *QUICK, setting)
    assert outcome.status == 2 and said in outcome.err, outcome.err
    assert len(outcome.err.strip().splitlines()) == 1
    assert not list(outcome.folder.rglob("*.json")), "a mistake left files behind"


def test_a_choice_among_candidates_is_for_auto(cli, imported):
    outcome = cli("task=improve", f"effect={HIDDEN}", f"measured={imported}", "task.without=[backlash]", *QUICK)
    assert outcome.status == 2 and "task.without: chooses among what effect=auto may add" in outcome.err


def test_another_way_is_told_with_the_nearest_name(cli, imported):
    outcome = cli("task=compare", f"measured={imported}", "task.by=free_rum", *QUICK)
    assert outcome.status == 2 and "did you mean free_run" in outcome.err


def test_an_effect_that_was_left_out_is_not_named(cli, imported):
    found, _ = run(cli, "task=explain", f"measured={imported}", "task.by=force_balance", SUSPECTS,
                   "task.without=[coulomb_friction]", "task.rerun=false", *QUICK)  # fmt: skip
    names = [c["name"] for c in json.loads((found / "summary.json").read_text())["candidates"]]
    assert names and not [n for n in names if n.startswith("coulomb")]


def test_a_log_is_looked_at(cli, imported):
    copy = imported.with_name("copy.mcap")
    copy.write_bytes(imported.read_bytes())
    outcome = cli("task=view", f"log={copy}", "task.open=false")
    assert outcome.status == 0, outcome.err
    assert "rerun recording:" in outcome.out


@pytest.mark.parametrize(("verb", "by"), [("explain", "free_run"), ("improve", "open_loop")])
def test_one_digest_of_a_search_wherever_its_models_are_simulated(cli, imported, verb, by):
    asked = [f"task={verb}", f"measured={imported}", f"task.by={by}", "task.only=[coulomb_friction]", "engine=mujoco"]
    asked += ["effect=auto", "task.most=1"] if verb == "improve" else []
    here, elsewhere = (
        ["evaluator=serial"],
        ["evaluator=ray", "evaluator.workers=2", "evaluator.chunk=3", "evaluator.cache=false"],
    )
    digests = [json.loads((run(cli, *asked, *extra)[0] / "summary.json").read_text()) for extra in (here, elsewhere)]
    assert "friction" in digests[0]["headline"], "something was found, and fitted"
    assert len({d["result_digest"] for d in digests}) == 1


def test_what_may_decide_everything_is_said_before_a_search(cli, imported, monkeypatch):
    monkeypatch.setattr(ForceBalance, "doubts", property(lambda _: "the torques are odd."))
    for asked in (["task=explain"], ["task=improve", "effect=coulomb_friction@servo"]):
        _, said = run(cli, *asked, f"measured={imported}", "task.by=force_balance", *QUICK)
        assert said.out.index("Before anything is believed: the torques are odd.") < said.out.index("noise floor")
