"""Whether measured torques carry the robot's weight at all: many controllers compensate gravity and report the rest; and what one
joint reports may be no torque."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.discrepancy.ways.force_balance.balance import Balance
from ee_dist.effects import apply, term
from ee_dist.effects.catalogue import find
from ee_dist.measurements.sampling import decimated
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

CARRIED = 0.2
"""Share of the model's weight below which measured torques carry none of it: masses are seldom that far off,"""
MOSTLY = 0.5
"""and of what it leaves over with its weight that it may leave at most without."""
HEAVY = 0.1
"""Share of a joint's measured torque (root mean square) from which it carries weight by the model."""

TURNED = 0.5
"""Share of what is left upright, and of what is left without weight, that may be left of a base bolted on by another side."""


@dataclass(frozen=True)
class Weighed:
    """Of one joint, as squares of shares of its measured torque: ``weight`` that it carries by the model, ``both`` how much of
    that goes with what was measured, and what the model leaves over ``without`` its weight and ``with_it``."""

    weight: float
    both: float
    without: float
    with_it: float

    @property
    def share(self) -> float:
        """Of the model's weight that the measured torques carry."""
        return self.both / self.weight

    @property
    def left_out(self) -> bool:
        return abs(self.share) <= CARRIED and self.without <= MOSTLY * self.with_it


def without_weight(model: Robot) -> Robot:
    return replace(model, world=replace(model.world, gravity_m_s2=0.0))


def weightless(models: Sequence[Robot], balances: Sequence[Balance], scale: Array, names: Sequence[str]) -> str:
    """A sentence where the torques are those of the model without its weight, everywhere or at some of the judged joints, whose
    ``names`` (J,) and torques' ``scale`` (J,) these are; empty where they carry it, or it has none to speak of."""
    if all(m.world.gravity_m_s2 == 0 for m in models):
        return ""
    heavy = {n: w for n, w in _weighed(models, balances, scale, names).items() if w.weight > HEAVY**2}
    side = _side_that_fits(models, balances, scale) if heavy else ""
    if side:
        return (
            "the measured torques do not carry the weight that the model has, but would with its base bolted on by another side: "
            f"{side.replace('_', ' ')}. Is it described upright? 'effect=base_turned@{side}' turns it."
        )
    none = [n for n, w in heavy.items() if w.left_out]
    if not none:
        return ""
    if all(abs(w.share) <= CARRIED for w in heavy.values()):
        share = sum(w.both for w in heavy.values()) / sum(w.weight for w in heavy.values())
        return (
            f"the measured torques do not carry the weight that the model has ({share:.2f} of it): is gravity left out of "
            "them, as by controllers that compensate it? 'gravity_m_s2: 0' in the robot's description says so."
        )
    few = len(none) == 1
    shares = ", ".join(f"{heavy[n].share:.2f}" for n in none)
    column = "is its column no torque" if few else "are their columns no torques"
    return (
        f"the torques measured at {listed(none)} do not carry the weight that the model has there ({shares} of it), others do: "
        f"does a counterweight or a spring carry it, or {column}, or in another unit? What the mapping leaves out of the "
        "torques is not compared, and all else is."
    )


def _side_that_fits(models: Sequence[Robot], balances: Sequence[Balance], scale: Array) -> str:
    """By which side the base would have to be bolted on for the torques to fit much better than upright, or without any weight;
    empty for none."""

    def left(change: Callable[[Robot], Robot]) -> float:
        found = [balance(change(model)) for model, balance in zip(models, balances, strict=True)]
        return sum(math.inf if f is None else float(np.sum((f[1] / scale) ** 2)) for f in found)

    def turned(side: str) -> Callable[[Robot], Robot]:
        return lambda model: apply(model, (term("base_turned", side),))

    sides = {side: left(turned(side)) for side in find("base_turned").targets(models[0])}
    best = min(sides, key=lambda side: sides[side], default="")
    return best if best and sides[best] < TURNED * min(left(lambda m: m), left(without_weight)) else ""


def _weighed(
    models: Sequence[Robot], balances: Sequence[Balance], scale: Array, names: Sequence[str]
) -> dict[str, Weighed]:
    """By judged joint; none where a model leaves the finite numbers. Friction that every description may lack, dry and viscous,
    is fitted at each joint before."""
    parts = []
    for model, balance in zip(models, balances, strict=True):
        found, without = balance(model), balance(without_weight(model))
        if found is None or without is None:
            return {}
        speed = decimated(balance.motion.of_judged(balance.motion.speed), balance.keep_every)[: len(found[1])]
        parts.append((without[1] / scale, (without[1] - found[1]) / scale, speed))
    left, weight, speed = (np.concatenate(p) for p in zip(*parts, strict=True))
    out = {}
    for j, name in enumerate(names):
        rubbing = np.stack([np.sign(speed[:, j]), speed[:, j]], axis=1)
        pair = np.stack([left[:, j], weight[:, j]], axis=1)
        x, g = (pair - rubbing @ np.linalg.lstsq(rubbing, pair, rcond=None)[0]).T
        out[name] = Weighed(*(float(np.mean(a * b)) for a, b in ((g, g), (x, g), (x, x), (x - g, x - g))))
    return out
