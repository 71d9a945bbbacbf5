"""Logs of minutes: what is computed together is limited by its memory, not by its number, and comes out bit for bit the same."""

from __future__ import annotations

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial, driver_of
from ee_dist.discrepancy.search import search as search_module
from ee_dist.discrepancy.search.candidates import candidates
from ee_dist.discrepancy.search.screen import screen
from ee_dist.discrepancy.search.search import BATCH, Search
from ee_dist.discrepancy.ways.open_loop import prediction
from ee_dist.discrepancy.ways.open_loop import problem as problem_module
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation import serial
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

ROBOT = with_noise(servo_pendulum(), 0.005)
POOL = candidates(
    ROBOT, only=["coulomb_friction", "viscous_friction", "sensor_noise", "sensor_dropout", "sensor_delay"]
)


class Watched(MuJoCoEngine):
    """Notes the robot-steps of each call."""

    def rollout(self, rollouts):
        self.called = [*getattr(self, "called", []), sum(r.steps for r in rollouts)]
        return super().rollout(rollouts)


def look(seconds: float) -> tuple[OpenLoop, Watched]:
    engine, motion = Watched(1), Excitation("multisine", seconds, 0.3, 1)
    driver = driver_of(motion, ROBOT)
    log = PhysicalRobot(engine, ROBOT, (), np.random.SeedSequence(0)).trial(driver, motion.steps(ROBOT))
    return OpenLoop([MeasuredTrial("m", log, driver)], ROBOT, SerialEvaluator(engine)), engine


def test_what_is_computed_together_is_limited_by_memory_and_changes_no_bit(monkeypatch) -> None:
    rows, sizes = round(2.0 / ROBOT.time_step_s), []
    whole = prediction.reports

    def reports(members, seeds=()):
        sizes.append(len(members) * max(1, len(seeds)) * len(members[0][1]) * len(members[0][2]))
        return whole(members, seeds)

    monkeypatch.setattr(prediction, "reports", reports)
    problem, _ = look(2.0)
    search = Search(problem)
    assert search.batch == BATCH and [b.stop - b.start for b in search.batches(500)] == [240, 240, 20]
    asked = [(c.term(u),) for c in POOL for u in c.probes((0.1, 0.6))]
    expected, promised = problem.residuals(asked), [s.promise for s in screen(search, POOL)]
    assert max(sizes) > 3 * prediction.DRAWS * rows

    # As if the log were so long that a tenth of this filled the memory.
    values = len(problem.segment_of)
    monkeypatch.setattr(serial, "MOST_AT_ONCE", 3 * rows)
    monkeypatch.setattr(problem_module, "TOGETHER", 4 * values)
    monkeypatch.setattr(prediction, "DRAWN", 2 * prediction.DRAWS * rows)
    monkeypatch.setattr(search_module, "VALUES", 5 * values)
    sizes.clear()
    again, engine = look(2.0)
    engine.called.clear()
    told: list[float] = []
    slow = Search(again, progress=lambda _, share, *__: told.append(share))
    assert [b.stop - b.start for b in slow.batches(14)] == [1, 2, 4, 5, 2]
    assert np.array_equal(again.residuals(asked), expected)
    assert [s.promise for s in screen(slow, POOL)] == promised
    assert max(sizes) <= 2 * prediction.DRAWS * rows and max(engine.called) <= 3 * rows
    assert told[0] < 0.1 and told[-1] == 1.0, "a word soon, and after every few of them"
