"""What people who know nothing yet are told: every verb on one screen, every setting with its meaning."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import fields

import numpy as np
import pytest

from ee_dist.effects import term
from ee_dist.engines.contract import EngineError
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.compose import TASKS, USED_BY, check_used, config_folder, task_module
from ee_dist.tasks.config import ConfigError, known_settings
from ee_dist.tasks.help import VERBS, options_with, settings_in
from ee_dist.tasks.summary import package_version

SCREEN = (24, 80)


@pytest.mark.parametrize("asked", [["--help"], ["-h"], ["--help", "+scenario=8"]])
def test_all_verbs_with_an_example_fit_one_screen(cli, asked):
    outcome = cli(*asked)
    assert (outcome.status, outcome.err) == (0, "")
    lines = outcome.out.splitlines()
    assert len(lines) < SCREEN[0]
    assert max(map(len, lines)) < SCREEN[1]
    assert set(VERBS) == set(TASKS)
    for verb in VERBS.values():
        assert any(line.strip().startswith(verb.example) and line.endswith(verb.does) for line in lines)
    for word in ("budget=quick", "-m +scenario=1,5,9", "docs/tutorial.md", "task=explain --help"):
        assert word in outcome.out
    assert not list(outcome.folder.iterdir()), "who asks gets an answer, not a folder"


@pytest.mark.parametrize("name", TASKS)
def test_a_verb_tells_each_of_its_settings_with_default_and_meaning(cli, name):
    outcome = cli(f"task={name}", "--help")
    assert outcome.status == 0
    lines = outcome.out.splitlines()
    assert max(map(len, lines)) <= 100
    module = task_module(name)
    own = [f"task.{f.name}" for f in fields(module.Options) if f.name != "name"]
    for key in [*own, *VERBS[name].shared]:
        (at,) = [k for k, line in enumerate(lines) if line.strip().startswith(f"{key}=")]
        assert lines[at + 1].startswith("      "), f"{key} has no meaning: write a comment above it in conf/"
    for group in VERBS[name].groups:
        assert f"{group}=" in outcome.out
    assert all(name in known_settings() for name in VERBS[name].shared)


@pytest.mark.parametrize("name", USED_BY)
def test_a_verb_is_refused_just_those_settings_that_its_help_does_not_have(name):
    having = {v for v, verb in VERBS.items() if name in (*verb.groups, *(s.partition(".")[0] for s in verb.shared))}
    assert having == set(USED_BY[name][0])


@pytest.mark.parametrize(("group", "chosen"), [("robot", "robot=quadruped"), ("scenario", "+scenario=8")])
def test_no_verb_offers_what_it_refuses(group, chosen):
    for name, verb in VERBS.items():
        try:
            check_used([chosen], name)
        except ConfigError:
            assert group not in verb.groups, name
        else:
            assert group in verb.groups, name


def test_every_setting_of_every_choice_has_a_meaning():
    for path in sorted(config_folder().glob("*/*.yaml")):
        if path.parent.name in ("scenario", "task"):
            continue
        for setting in settings_in(path, path.parent.name):
            assert setting.meaning or setting.key.endswith(".name"), f"{path}: {setting.key}"


def test_version_is_ours(cli):
    assert cli("--version").out == f"ee_dist {package_version()}\n"


def test_choices_that_have_a_setting():
    assert options_with("evaluator.workers") == ["evaluator=auto", "evaluator=ray"]
    assert options_with("budget.steps") == ["budget=gene_network", "budget=paper", "budget=quick"]
    assert options_with("seed") == []


class Diverging:
    """An engine whose rollouts end in numbers that are none."""

    name = "test engine"

    def rollout(self, rollouts):
        from ee_dist.trials.log import SensorLog

        robot, rows = rollouts[0].model, 3
        nothing = np.full((rows, len(robot.sensors)), np.nan)
        return [SensorLog(np.arange(rows) * 0.1, nothing, np.zeros((rows, 1)), robot.sensor_names,
                          tuple(s.unit for s in robot.sensors), robot.motor_names)]  # fmt: skip


@pytest.mark.parametrize(
    ("hidden", "said"),
    [((), "with nothing hidden, these commands make"), ((term("motor_weak", "servo", loss=0.5),), "the hidden change")],
)
def test_an_unstable_trial_is_blamed_on_what_there_is(hidden, said):
    robot = servo_pendulum()
    hidden = tuple(term(t.effect, robot.motor_names[0], **dict(t.values)) for t in hidden)
    body = PhysicalRobot(Diverging(), robot, hidden, np.random.SeedSequence(0))
    with pytest.raises(EngineError, match=said):
        body.trial(None, 3)


def test_who_reads_only_its_beginning_made_no_mistake():
    """As ``| head`` does it: the reader is gone before anything is printed."""
    asked = subprocess.Popen(
        [sys.executable, "-m", "ee_dist", "--help"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert asked.stdout is not None
    asked.stdout.close()
    asked.stdout = None
    _, err = asked.communicate(timeout=60)
    assert (asked.returncode, err) == (0, "")
