"""A fourth way of comparing, written as docs/how_a_verdict_is_made.md says, has all verbs of the command line."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ee_dist.discrepancy.problem import Layout, Problem, Series, joints_of
from ee_dist.effects.catalogue import apply
from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.tasks.ways import WAYS, Way

QUICK = ("engine=mujoco", "evaluator=serial", "task.rerun=false")
PLAN = "task.excitations=['slow_sines:seconds=8,amplitude=0.15,seed=1','slow_sines:seconds=6,amplitude=0.1,seed=2']"


class Weights(Problem):
    """How far a slow joint lags behind its command: what holds it up against gravity. Nothing is simulated."""

    way, switches, families = "weights", False, frozenset({"body", "drive"})
    error_definition = "root mean square of the lag, in standard deviations of the readings"
    natural_name = "lag"

    def __init__(self, trials, robot):
        self.robot, self.measured, self.noise = robot, tuple(trials), robot.sensors[0].noise * 3
        rows = np.concatenate([np.arange(len(t.log)) for t in trials])
        trial = np.repeat(np.arange(len(trials)), [len(t.log) for t in trials])
        cut = rows // 100 + 1000 * trial
        names, segment = np.unique(cut, return_inverse=True)
        ones, joint = np.ones(len(rows)), joints_of(robot, [robot.sensors[0].target])
        self.layout = Layout(
            tuple(f"{trials[n // 1000].name}@{n % 1000 * 100 * robot.time_step_s:.1f}s" for n in names), names // 1000,
            segment, 0 * rows, rows * robot.time_step_s, ones > 0, ones, 0 * ones, (robot.sensors[0].name,), ("rad",), joint,
        )  # fmt: skip

    def said(self, hypothesis, trial):
        model = apply(self.robot, (*trial.setup, *hypothesis))
        q, drive = trial.log.commands, model.drives[0]
        load = joint_torques(model, q, 0 * q, 0 * q) - drive.offset_torque
        return (q - load / drive.kp / drive.strength - drive.zero_offset)[:, 0]

    def residuals(self, hypotheses, trials=None):
        off = [[(t.log.sensors[:, 0] - self.said(h, t)) / self.noise for t in self.measured] for h in hypotheses]
        rows = np.stack([np.concatenate(r) for r in off])
        return rows if trials is None else np.where(np.isin(self.trial_of, trials), rows, 0.0)

    def noise_floor(self):
        return 1.0, "the sensor's own, and what a slow motion still adds"

    def raw(self, residual):
        return residual * self.noise

    def series(self, hypothesis):
        return [
            Series(k, 0, "rad", t.log.times_s, t.log.sensors[:, 0], self.said(hypothesis, t))
            for k, t in enumerate(self.measured)
        ]


@pytest.fixture
def weights(monkeypatch):
    way = Way("weights", "slow motions were recorded", lambda measured, _: Weights(measured.trials, measured.robot))
    monkeypatch.setitem(WAYS, "weights", way)


def test_a_fourth_way_has_all_verbs(cli, weights):
    def run(*arguments):
        outcome = cli(*arguments)
        assert outcome.status == 0, outcome.err
        return outcome.runs()[0], json.loads((outcome.runs()[0] / "summary.json").read_text()), outcome.out

    hidden = "+hidden=[{effect: part_mass, target: arm, change: 0.4}]"
    tried, _, _ = run("task=trial", "robot=servo_pendulum", "engine=mujoco", hidden, PLAN, "task.noise=0.001")
    log, by, only = f"measured={tried}", "task.by=weights", "task.only=[part_mass,offset_torque,motor_gain]"
    _, compared, said = run("task=compare", log, by, *QUICK)
    assert compared["way"] == "weights" and "By weights: slow motions were recorded." in said
    explained, summary, _ = run("task=explain", log, by, only, *QUICK)
    assert summary["verdict"] == "effect"
    improved, summary, _ = run("task=improve", "effect=auto", log, by, only, *QUICK)
    assert summary["ladder"][-1]["error_heldout"] < 0.7 * compared["error"]
    for folder in (explained, improved):
        _, shown, _ = run("task=reveal", f"log={tried}", f"task.explained={folder}")
        assert shown["right"] is True, shown
