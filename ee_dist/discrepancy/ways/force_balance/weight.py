"""Whether measured torques carry the robot's weight at all: many controllers compensate gravity and report the rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ee_dist.discrepancy.ways.force_balance.balance import Balance
from ee_dist.measurements.sampling import decimated
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

CARRIED = 0.2
"""Share of the model's weight below which measured torques carry none of it: masses are seldom that far off,"""
MOSTLY = 0.5
"""and of what it leaves over with its weight that it may leave at most without."""


def without_weight(model: Robot) -> Robot:
    return replace(model, world=replace(model.world, gravity_m_s2=0.0))


def weightless(models: Sequence[Robot], balances: Sequence[Balance], scale: Array) -> str:
    """A sentence where the torques are those of the model without its weight; empty where they carry it, or it has none to
    speak of. Friction that every description may lack, dry and viscous, is fitted at each joint before."""
    if all(m.world.gravity_m_s2 == 0 for m in models):
        return ""
    parts = []
    for model, balance in zip(models, balances, strict=True):
        floating = without_weight(model)
        found, without = balance(model), balance(floating)
        if found is None or without is None:
            return ""
        speed = decimated(balance.motion.of_judged(balance.motion.speed), balance.keep_every)[: len(found[1])]
        parts.append((without[1] / scale, (without[1] - found[1]) / scale, speed))
    left, weight, speed = (np.concatenate(p) for p in zip(*parts, strict=True))
    both = weighed = without_it = with_it = 0.0
    for j in range(left.shape[1]):
        rubbing = np.stack([np.sign(speed[:, j]), speed[:, j]], axis=1)
        pair = np.stack([left[:, j], weight[:, j]], axis=1)
        x, g = (pair - rubbing @ np.linalg.lstsq(rubbing, pair, rcond=None)[0]).T
        both, weighed = both + float(x @ g), weighed + float(g @ g)
        without_it, with_it = without_it + float(x @ x), with_it + float((x - g) @ (x - g))
    if not weighed or abs(both / weighed) > CARRIED or without_it > MOSTLY * with_it:
        return ""
    return (
        f"the measured torques do not carry the weight that the model has ({both / weighed:.2f} of it): is gravity left out of "
        "them, as by controllers that compensate it? 'gravity_m_s2: 0' in the robot's description says so."
    )
