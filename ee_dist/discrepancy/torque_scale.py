"""The strength of all motors: where only motion was measured, masses, rotors, friction and torques that are all larger by
one factor move alike.

A mass that nobody would get so wrong may be a torque that is: of motors whose data sheet is of another voltage, say."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.effects.catalogue import Hypothesis, Term, find, term
from ee_dist.effects.groups import groups
from ee_dist.robots.instruments import measures_torques
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

MASS, STRENGTH, WEAK = "part_mass", "motor_strength", "motor_weak"
SELDOM_OFF = 0.3
"""Share by which a mass off a scale or a drawing seldom is,"""
ALL_OFF = 0.1
"""and all of them by one factor."""
SCALED = ("N.m", "N.m.s/rad", "N.m/rad", "kg.m^2", "kg")
"""Units of what is larger with the torques,"""
TORQUES = {"N.m", "N"}
"""those of torques and forces themselves,"""
FACTORS = ("position_gain", "speed_gain", "rotor_factor")
"""and factors on such values."""


def other_scale(
    problem: Problem, current: Current, own: int, pool: Sequence[Candidate]
) -> Iterator[tuple[Model, Array]]:
    """The model with the strength of all motors in the place of each mass, of those beyond its first ``own`` parts, that is
    far off, or of all masses, and where this leads if all follow by one factor. Nothing where torques were measured, which say
    how large they are themselves, nor where all gains were guessed at, which say it too once they are fitted, nor where
    ``pool`` is of less than half of the kinds of effects that there are: who asks for some wants these."""
    if torques_compared(problem) or {*problem.robot.motor_names} <= {*problem.robot.assumed_joints("kp")}:
        return
    terms, parts = current.hypothesis, current.parts
    least = [ALL_OFF if c.members(problem.robot) else SELDOM_OFF for c in parts]
    far = [k for k in range(own, len(parts)) if terms[k].effect == MASS and abs(_change(terms[k])) > least[k]]
    if not far or {STRENGTH, WEAK} & {t.effect for t in terms}:
        return
    if 2 * len({c.effect for c in pool}) < len({c.effect for c in pool_of(problem)}):
        return
    joints = find(STRENGTH).targets(problem.robot)
    # Of the only motor that there is, weaker than described, people know the fault.
    weak = next((w for w in pool if w.effect.name == WEAK), None) if len(joints) == 1 else None
    for c in pool_of(problem, only=[STRENGTH]):
        if len(c.members(problem.robot) or (c.target,)) != len(joints):
            continue
        for k in far:
            factor = 1.0 / (1.0 + _change(terms[k]))
            stay = [i for i in range(len(parts)) if i != k]
            new = [_scaled(problem.robot, terms[i], factor) if i >= own else terms[i] for i in stay]
            comes, values = (weak, {"loss": 1.0 - factor}) if weak and factor < 1 else (c, {"change": factor - 1.0})
            model = Model((*(parts[i] for i in stay), comes))
            u = [*(parts[i].shares(dict(t.values)) for i, t in zip(stay, new, strict=True)), comes.shares(values)]
            yield model, np.clip(np.concatenate(u), model.lower, model.upper)
        return


def torques_compared(problem: Problem) -> bool:
    """Whether some of what is compared is a torque or a force, which says how large all of them are."""
    return bool({*problem.layout.units} & TORQUES)


def _change(t: Term) -> float:
    return float(t.values[0][1])


def of_masses(robot: Robot, terms: Hypothesis) -> bool:
    """Whether a model says how strong all its motors are, or their controllers, and nothing was measured that says how large a
    torque is: what it tells of torques then goes with the masses."""
    if measures_torques(robot):
        return False
    told: dict[str, set[str]] = {}
    for t in terms:
        told.setdefault(t.effect, set()).update(groups(robot).get(t.target, (t.target,)))
    for d in robot.drives:
        says = {"torque": ("command_gain", STRENGTH, WEAK), "none": ()}.get(d.command, ("position_gain", STRENGTH))
        if d.command != "none" and not any(d.joint in told.get(name, ()) for name in says):
            return False
    return any(d.command != "none" for d in robot.drives)


def without_masses(robot: Robot, model: Model, u: Array, gone: Sequence[int]) -> Array | None:
    """Where a fit begins without the masses that are parts number ``gone`` of a model: with all else that goes with torques
    smaller by their factor, which is the same motion where that is all that there is. None where other parts go, too."""
    terms = model.hypothesis(u)
    if any(terms[k].effect != MASS for k in gone):
        return None
    factor = 1.0 / float(np.mean([1.0 + _change(terms[k]) for k in gone]))
    stay = [k for k in range(len(terms)) if k not in gone]
    values = [model.parts[k].shares(dict(_scaled(robot, terms[k], factor).values)) for k in stay]
    left = Model(tuple(model.parts[k] for k in stay))
    return np.clip(np.concatenate([*values, np.zeros(0)]), left.lower, left.upper)


def _scaled(robot: Robot, t: Term, factor: float) -> Term:
    """A term with all of what it is on top of larger by a factor, where that goes with torques, as far as its ranges go: a fit
    begins there."""
    drive = next((d for d in robot.drives if d.joint == t.target), None)
    values = {}
    for p, (name, value) in zip(find(t.effect).parameters, t.values, strict=True):
        by_torque = t.effect == STRENGTH or (
            t.effect == "command_gain" and drive is not None and drive.command == "torque"
        )
        if t.effect == MASS or by_torque:
            value = (1.0 + value) * factor - 1.0
        elif t.effect == WEAK:
            value = 1.0 - (1.0 - value) * factor
        elif t.effect in FACTORS:
            value *= factor
        elif p.unit in SCALED:
            described = float(getattr(drive, p.on_top, 0.0)) if p.on_top and drive is not None else 0.0
            value = (described + value) * factor - described
        values[name] = min(max(value, p.lower), p.upper)
    return term(t.effect, t.target, **values)
