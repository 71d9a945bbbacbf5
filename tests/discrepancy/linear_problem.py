"""A problem whose answer is known, with no simulation: a way of comparing in a few lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Layout, Problem, Series
from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.trials.log import Array, SensorLog

ROBOT = quadruped_lab()
SEGMENTS, PER = 20, 40
WEAK, JAM, GAIN = "motor_weak@knee_front_left", "joint_jam@hip_rear_left", "command_gain@hip_front_left"
HIDDEN = (term("motor_weak", "knee_front_left", loss=0.4), term("joint_jam", "hip_rear_left", loss=0.3))


def idle_log(rows: int, seed: int = 0) -> SensorLog:
    """Some commands, and sensors that say nothing."""
    commands = np.random.default_rng([4, seed]).uniform(-0.1, 0.1, (rows, len(ROBOT.drives)))
    units = tuple(x.unit for x in ROBOT.sensors)
    zeros = np.zeros((rows, len(ROBOT.sensors)))
    return SensorLog(np.arange(rows) * 0.01, zeros, commands, ROBOT.sensor_names, units, ROBOT.motor_names)


class Linear(Problem):
    """A problem in which each (effect, joint) adds its own random pattern, in proportion to its first value.

    ``motions``: trials, each of other commands, that the segments are shared out to.
    """

    way = "linear"
    error_definition = "root mean square"

    def __init__(self, hidden: Hypothesis, seed: int = 0, extra: float = 0.0, motions: int = 1) -> None:
        self.robot = ROBOT
        n = SEGMENTS * PER
        names = ["trial"] if motions == 1 else [f"trial {k}" for k in range(motions)]
        self.measured = tuple(MeasuredTrial(name, idle_log(n, k)) for k, name in enumerate(names))
        self.layout = Layout(
            segments=tuple(f"{names[k * motions // SEGMENTS]}@{k}s" for k in range(SEGMENTS)),
            trial_of_segment=np.arange(SEGMENTS) * motions // SEGMENTS,
            segment_of=np.repeat(np.arange(SEGMENTS), PER),
            channel_of=np.arange(n) % 2,
            time_s=(np.arange(n) % (n // motions)) * 0.01,
            reading=np.ones(n, dtype=bool),
            floor=np.ones(n),
            known=np.zeros(n),
            channels=("a", "b"),
            units=("rad", "rad"),
            joint_of_channel=(0, 1),
        )
        rng = np.random.default_rng(seed)
        self.data = rng.standard_normal(n) + self.shift(hidden) + extra * np.sin(np.arange(n) / 25.0)

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = np.zeros(SEGMENTS * PER)
        for t in hypothesis:
            key = [sum(map(ord, t.effect)), sum(map(ord, t.target)) % 9973]
            pattern = np.random.default_rng(key).standard_normal(len(total))
            total = total + 3.0 * (t.values[0][1] if t.values else 1.0) * pattern
        return total

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        rows = np.stack([self.data - self.shift(h) for h in hypotheses])
        return rows if trials is None else np.where(np.isin(self.trial_of, trials), rows, 0.0)

    def noise_floor(self) -> tuple[float, str]:
        return 1.0, "known"

    def raw(self, residual: Array) -> Array:
        return residual

    def series(self, hypothesis: Hypothesis) -> list[Series]:
        shift, out = self.shift(hypothesis), []
        for k in range(len(self.measured)):
            for c, unit in enumerate(self.layout.units):
                own = (self.trial_of == k) & (self.channel_of == c)
                out.append(Series(k, c, unit, self.layout.time_s[own], self.data[own], shift[own]))
        return out


class StandIn(Linear):
    """A gain stands in for a weak motor at a knee and for a jam at a hip, but for a little: it comes first, and goes."""

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = super().shift(tuple(t for t in hypothesis if t.effect != "command_gain"))
        for t in hypothesis:
            if t.effect == "command_gain":
                own = super().shift((Term(t.effect, t.target, (("change", 0.3),)),))
                total = total + t.values[0][1] / 0.3 * (super().shift(HIDDEN) + own)
        return total
