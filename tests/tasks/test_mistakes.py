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
        (["+scenario=8", "evaluator=serial", "evaluator.workers=2"],
         "evaluator.workers: the chosen evaluator has no such setting; evaluator=auto and evaluator=ray have it"),
        (["+scenario=8", "engine.threads=2"], "engine=mujoco has it"),
        (["task=compare", "task.bye=free_run"], "task.bye: this verb has no such setting"),
        (["task=explian", "--help"], "task=explian: no such choice; did you mean explain"),
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
        (["task=export"], "model=: which model file?"),
        (["task=export", "model=nowhere.yaml"], "nowhere.yaml: no such file"),
        (["task=export", "model=nowhere.yaml", "to=sdf"], "to=sdf: no such choice; "),
        (["task=robot"], "task=robot looks at one file: urdf=FILE.urdf or mjcf=FILE.xml"),
        (["task=robot", "urdf=nowhere.urdf"], "nowhere.urdf: no such file"),
        (["task=robot", "mjcf=nowhere.xml"], "nowhere.xml: no such file"),
        (["task=robot", "urdf=a.urdf", "task.output=../x.yaml"], "expected the name of a file that ends in .yaml"),
        (["task=view", "log=/dev/zero"], "/dev/zero: not an ordinary file"),
        (["+scenario=-1"], "scenario=-1: no such choice; there are: 1, 2"),
        (["+scenario=8", "--foo"], "unrecognized arguments: --foo; settings are written key=value"),
        (["task=trial", "+hidden=" + "[" * 3000 + "]" * 3000], "nested too deep"),
        (["+scenario=8", "seed=${oc.env:NOT_THERE}"], "Environment variable 'NOT_THERE' not found"),
        (["+scenario=8", "seed=1e400"], "seed: Value 'inf'"),
        (["+scenario=8", "noise=nan"], "noise=nan: must be a share"),
        (["+scenario=8", "noise=-1"], "noise=-1.0: must be a share"),
        (["+scenario=8", "budget.population=1000000000"], "budget.population=1000000000: must be from 0 to 100 000"),
        (["+scenario=8", "budget.steps=1000000000000"], "budget.steps=1000000000000: must be from 0 to 1 000 000"),
        (["+scenario=8", "budget.generations=-3"], "budget.generations=-3: must be from 0"),
        (["+scenario=8", "metric.header=5000"], "metric.header=5000: longer than a trial; must be at most budget.steps (1000)"),
        (["+scenario=8", "evaluator.workers=100000"], "evaluator.workers=100000: this machine has"),
        (["+scenario=8", "evaluator.workers=-1"], "evaluator.workers=-1: must be from 0"),
        (["+scenario=8", "evaluator=serial", "evaluator.chunk=99999999"], "evaluator.chunk=99999999: must be from 0"),
        (["+scenario=8", "plugins=3"], "plugins: "),
        (["+scenario=8", "robot.urdf=x.urdf"], "the chosen robot has no such setting; robot=mjcf and robot=urdf have it"),
        (["task=improve", "task.without=[gremlin]", "measured=x.mcap"], "no effect named 'gremlin'"),
        (["task=explain", "task.without=[gremlin@knee]", "measured=x.mcap"], "no effect named 'gremlin'"),
        (["task=trial", "task.excitations=['steps:seconds=1e300']"], "1e+300 s must lie between 0.1 and 600 s"),
        (["task=trial", "task.excitations=['steps:seed=-1']"], "seed -1 must be a whole number from 0"),
        (["task=import", "measured=/dev/zero", "task.mapping=/dev/zero"], "/dev/zero: not an ordinary file"),
        (["task=trial", "+hidden=" + "x" * 5000], "no effect named"),
        (["task=workbench", "task.port=99999"], "task.port=99999: must be from 0 to 65 535"),
        (["task=workbench", "measured=nowhere.mcap"], "measured=nowhere.mcap: no such file"),
        (["task=workbench", "log=nowhere"], "log=nowhere: no such run"),
        (["task=workbench", "model=nowhere.yaml"], "nowhere.yaml: no such file"),
        (["task=workbench", "log=a", "measured=b"], "log= follows a recovery, measured= compares a model with a log"),
    ],
)  # fmt: skip
def test_one_line_and_a_status(cli, arguments, said):
    outcome = cli(*arguments)
    assert outcome.status == 2
    lines = [line for line in outcome.err.splitlines() if line.strip()]
    assert len(lines) == 1, outcome.err
    assert lines[0].startswith("ee_dist: ")
    assert said in lines[0]
    assert len(lines[0]) <= 700
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


@pytest.mark.parametrize(("body", "said"), [
    ("return None", "broken"), ("raise KeyError('mine')", "KeyError"), ("import sys; sys.exit(0)", "SystemExit"),
    ("return 3", "not a Robot"),
])  # fmt: skip
def test_a_transform_that_fails_is_one_line(body, said):
    """Whatever a user's own effect does, it ends as an error of effects that names it."""
    from dataclasses import replace

    from ee_dist.effects.catalogue import CATALOGUE, EffectError, _registry, apply, term
    from ee_dist.robots.quadruped import quadruped

    name = "motor_weak"
    known = CATALOGUE[name]
    space: dict[str, object] = {}
    exec(f"def transform(robot, target, values):\n    {body}", space)
    _registry[name] = replace(known, transform=space["transform"])
    try:
        with pytest.raises(EffectError) as caught:
            apply(quadruped(), [term(name, "knee_front_left", loss=0.5)])
    finally:
        _registry[name] = known
    assert name in str(caught.value)
    assert "\n" not in str(caught.value)
    assert said in str(caught.value) or body == "return None"


@pytest.mark.parametrize("line", ["raise ValueError('mine')", "import sys; sys.exit(0)", "(", "x = [" * 500])
def test_a_plugin_that_fails_is_one_line(cli, tmp_path, line):
    plugin = tmp_path / "mine.py"
    plugin.write_text(f"first = 1\n{line}\n")
    outcome = cli("+scenario=8", f"plugins=[{plugin}]")
    assert outcome.status == 2
    (said,) = outcome.err.strip().splitlines()
    assert f"{plugin}, line 2" in said
    assert not list(outcome.folder.rglob("*.mcap*"))


def test_an_error_that_nobody_foresaw_is_one_line_and_its_trace_is_kept(cli, monkeypatch):
    def fail(*_: object) -> None:
        raise ZeroDivisionError("a line\nand another")

    monkeypatch.setattr("ee_dist.tasks.view.run", fail)
    outcome = cli("task=view", "log=x.mcap", "hydra.run.dir=out")
    assert outcome.status == 1
    (line,) = outcome.err.strip().splitlines()
    assert "ZeroDivisionError: a line and another; this is a defect of ee_dist" in line
    assert "in fail" in (outcome.folder / "out" / "error.txt").read_text()


def test_an_end_from_within_is_not_taken_for_success(cli, monkeypatch):
    monkeypatch.setattr("ee_dist.tasks.view.run", lambda *_: exit(0))
    outcome = cli("task=view", "log=x.mcap")
    assert outcome.status == 2
    assert "sys.exit(0) was called in the middle of the run" in outcome.err
