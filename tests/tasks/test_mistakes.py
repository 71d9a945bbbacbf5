"""A user's mistake: one clear line that names what would be right, a status that is not 0, nothing left behind."""

from __future__ import annotations

import shlex
import shutil
import sys
from pathlib import Path

import pytest

# Under every import mode of pytest.
sys.path.insert(0, str(Path(__file__).parent))

import one_job
import wrong_files
from mistakes import TABLE, WHOLE

from ee_dist.tasks.compose import TASKS


@pytest.fixture(scope="module")
def files(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Every row finds here what it names."""
    folder = tmp_path_factory.mktemp("wrong")
    wrong_files.write(folder)
    return folder


# What is no mistake would begin hours of work: a row that does not come back fails.
pytestmark = pytest.mark.timeout(60)


def check(status: int, err: str, said: str) -> None:
    assert status == 2, err
    lines = [line for line in err.splitlines() if line.strip()]
    assert len(lines) == 1, err
    assert lines[0].startswith("ee_dist: ")
    assert said in lines[0]
    assert len(lines[0]) <= 700


@pytest.mark.parametrize(("line", "said"), TABLE, ids=[line for line, _ in TABLE])
def test_one_line_and_a_status(files, monkeypatch, line, said):
    monkeypatch.chdir(files)
    before = wrong_files.written(files)
    try:
        status, err = one_job.run(*shlex.split(line))
        check(status, err, said)
        assert wrong_files.written(files) == before, "a mistake left files behind"
    finally:
        # The rows after one that fails are judged by themselves.
        for path in files.iterdir():
            if path.name not in before:
                shutil.rmtree(path) if path.is_dir() else path.unlink()


HOSTILE = (
    (["task=trial", "+hidden=" + "[" * 3000 + "]" * 3000], "nested too deep"),
    (["task=trial", "+hidden=" + "x" * 5000], "no effect named 'xxx"),
    (["+scenario=8", "seed=-1", "hydra.run.dir=" + "n" * 300], "File name too long; choose a folder"),
    ([], "which scenario? add one, such as +scenario=8"),
)


@pytest.mark.parametrize(("arguments", "said"), [*((shlex.split(line), said) for line, said in WHOLE), *HOSTILE])
def test_the_whole_program_too(cli, arguments, said):
    outcome = cli(*arguments)
    check(outcome.status, outcome.err, said)
    assert "Traceback" not in outcome.out
    assert not [p for p in outcome.folder.rglob("*") if p.is_file()], "a mistake left files behind"


def test_the_table_is_long_enough_and_has_every_verb():
    lines = [line for line, _ in (*TABLE, *WHOLE)]
    assert len(set(lines)) >= 200
    verbs = {word.removeprefix("task=") for line in lines for word in line.split() if word.startswith("task=")}
    assert verbs >= set(TASKS) - {"recover"}


@pytest.mark.parametrize(("plugin", "said"), [
    ("shape", "it gave an array of shape (3,); expected a number for each of its 1 joints"), ("law", "ZeroDivisionError"),
    ("nothing", "it gave nothing"), ("text", "could not convert"), ("nan", "unstable"),
])  # fmt: skip
def test_a_drive_law_that_fails_is_one_line(files, monkeypatch, tmp_path, plugin, said):
    monkeypatch.chdir(files)
    status, err = one_job.run(
        "task=trial", "robot=servo_pendulum", "engine=mujoco", "task.excitations=['sway:seconds=0.2']", f"plugins=[{plugin}.py]",
        f"+hidden=[{{effect: my_{plugin}, target: servo, much: 0.5}}]", f"hydra.run.dir={tmp_path}/out",
    )  # fmt: skip
    check(status, err, said)
    assert not (tmp_path / "out" / "trial.mcap").exists()


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

    from ee_dist.effects.catalogue import CATALOGUE, apply, registered, term
    from ee_dist.effects.effect import EffectError
    from ee_dist.robots.quadruped import quadruped

    name = "motor_weak"
    known = CATALOGUE[name]
    space: dict[str, object] = {}
    exec(f"def transform(robot, target, values):\n    {body}", space)
    registered[name] = replace(known, transform=space["transform"])
    try:
        with pytest.raises(EffectError) as caught:
            apply(quadruped(), [term(name, "knee_front_left", loss=0.5)])
    finally:
        registered[name] = known
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
