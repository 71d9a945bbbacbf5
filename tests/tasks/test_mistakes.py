"""A user's mistake: one clear line that names what would be right, a status that is not 0, nothing left behind."""

from __future__ import annotations

import pytest


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["+scenario=14"], "scenario=14: no such choice; there are: 1, 2, 3"),
        (["+scenario=8", "seed=abc"], "seed: Value 'abc'"),
        (["+scenario=8", "seed=-1"], "seed=-1: must be a whole number"),
        (["+scenario=8", "budget=papr"], "budget=papr: no such choice; there are: paper, quick"),
        (["+scenario=8", "engine=mujuco"], "engine=mujuco: no such choice; there are: mujoco, pybullet"),
        (["+scenario=8", "ray.address=127.0.0.1:1"], "ray.address=127.0.0.1:1: no Ray cluster answers there"),
        (["+scenario=8", "ray.address=nonsense"], "neither 'auto' nor host:port"),
        (["+scenario=8", "hydra.run.dir=/dev/null/x"], "choose a folder with hydra.run.dir"),
        (["+scenario=8", "metric.header=3"], "header (3) must be at least window (10)"),
        (["+scenario=8", "+metric.heder=3"], "metric.heder: no such setting; did you mean header?"),
        (["+scenario=8", "sed=1"], "sed: no such setting; did you mean seed"),
        (["+scenario=8", "evaluator.wrkers=2"], "evaluator.wrkers: no such setting; did you mean evaluator.workers"),
        (["scenario=8"], "add it with a plus sign: +scenario=8"),
        (["+scenario=8", "+sed=1"], "sed: no such setting; did you mean seed?"),
        (["+scenario.sev=1"], "scenario.sev: no such setting"),
        (["+scenario=8", "budget.population=7"], "population must be an even number"),
        (["+scenario=8", "noise=2"], "noise=2.0: must be a share"),
        (["task=recovr"], "task=recovr: no such choice"),
        ([], "which scenario? add one, such as +scenario=8"),
        (["+scenario=8", "scenario.changes=[{effect: motor_week, target: knee_front_left}]"], "did you mean motor_weak"),
        (["+scenario=8", "scenario.changes=[{effect: motor_weak, target: knee}]"], "motor_weak cannot act on 'knee'"),
        (["+scenario=8", "scenario.changes=[{effect: motor_weak, target: knee_front_left, loss: 7}]"], "[0, 1]"),
        (["+scenario=8", "plugins=[nowhere.py]"], "no such file of effects: "),
        (["task=view"], "log=: which log?"),
        (["task=import", "measured=nowhere.csv"], "nowhere.csv: no such file"),
        (["task=import", "measured=nowhere.bag"], "nowhere.bag: no such file"),
        (["task=import", "measured=nowhere.npz"], "nowhere.npz: no such file"),
        (["task=import", "measured=."], "no file to import in this folder; expected .csv, "),
        (["task=import", "measured=a.csv", "task.unit=degrees"], "task.unit=degrees: no such choice; did you mean deg"),
        (["task=import", "measured=a.csv", "task.gains=[0]"], "task.gains: expected numbers in N.m per A, none of them 0"),
        (["task=import", "measured=a.csv", "task.rate_hz=-5"], "task.rate_hz=-5"),
        (["task=import", "measured=a.csv", "task.joints=[nee]", "task.mapping=m.yaml"], "is for an import without a mapping"),
        (["task=view", "log=nowhere.mcap"], "nowhere.mcap"),
    ],
)  # fmt: skip
def test_one_line_and_a_status(cli, arguments, said):
    outcome = cli(*arguments)
    assert outcome.status == 2
    lines = [line for line in outcome.err.splitlines() if line.strip()]
    assert len(lines) == 1, outcome.err
    assert lines[0].startswith("ee_dist: ")
    assert said in lines[0]
    assert "Traceback" not in outcome.out
    assert not [p for p in outcome.folder.rglob("*") if p.is_file()], "a mistake left files behind"


def test_a_foreign_file_is_not_a_run(cli, tmp_path):
    foreign = tmp_path / "note.mcap"
    foreign.write_text("this is a shopping list")
    outcome = cli("task=view", f"log={foreign}")
    assert outcome.status == 2
    assert str(foreign) in outcome.err
    assert len(outcome.err.strip().splitlines()) == 1


def test_help_explains_the_verbs_with_examples(cli):
    outcome = cli("--help")
    assert outcome.status == 0
    for word in ("+scenario=8", "budget=quick", "task=view", "-m +scenario=1,5,9"):
        assert word in outcome.out
