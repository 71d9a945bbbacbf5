"""Commands that are late by more than a row of the log, or by less: two valleys, with a ridge between them.

As the delay passes a whole number of rows, what moves at a reading is another command, and slopes on one side say nothing of the
other. What the wrong side leaves is then shared out among all that the joint has: its gain, its rotor, its friction. From the
right one all of these have to move back together, farther than slopes foretell; but only at this joint, so that a descent of its
own values alone tells, at the price of a few simulations. Its slopes are narrow: wide ones look back over the ridge.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import NARROWEST, follow_valley
from ee_dist.effects.catalogue import apply
from ee_dist.effects.effect import EffectError
from ee_dist.robots.ranges import drive_of
from ee_dist.trials.log import Array

DELAY = "command_delay"
BEYOND = 0.25
"""Rows beyond the nearest whole number of them, to begin from."""
NOISE = 1.05
"""Energy over the floor's up to which nothing is looked for any more: of all that is fitted, and of a joint's own channels."""


def over_rows(search: Search, fit: Fit, wanted: float, prior: float = 0.0) -> Fit:
    """The fit, or one of the same model of less energy than ``wanted``, with a joint's delay on the other side of the nearest
    whole number of rows."""
    found: tuple[float, Array] | None = None
    for k, start in _other_sides(search, fit):
        mine = [i for i, c in enumerate(fit.model.parts) if c.target == fit.model.parts[k].target]
        places, terms = fit.model.places, fit.hypothesis
        rest = search.on(tuple(t for i, t in enumerate(terms) if i not in mine))
        at = np.concatenate([np.arange(places[i].start, places[i].stop) for i in mine])
        model = Model(tuple(fit.model.parts[i] for i in mine))
        (local,) = follow_valley(rest, [(model, start[at])], fit.mask, prior, widths=(NARROWEST,))
        if local.energy < (fit.energy if found is None else found[0]):
            u = fit.u.copy()
            u[at] = local.u
            found = local.energy, u
    if found is None:
        return fit
    (whole,) = follow_valley(search, [(fit.model, found[1])], fit.mask, prior, widths=(NARROWEST,))
    return whole if whole.energy < wanted else fit


def _other_sides(search: Search, fit: Fit) -> Iterator[tuple[int, Array]]:
    """Numbers of the parts that are delays of joints at which more than noise is left, and values (P,) beyond the row."""
    problem = search.problem
    try:
        robot = apply(problem.robot, (*search.fixed, *fit.hypothesis))
    except EffectError:
        return
    names = list(robot.motor_names)
    row = max(float(np.median(np.diff(t.log.times_s))) for t in problem.measured)
    for k, (c, place) in enumerate(zip(fit.model.parts, fit.model.places, strict=True)):
        if c.effect.name != DELAY or c.target not in names:
            continue
        own = fit.mask & (problem.joint_of == names.index(c.target))
        if float((fit.residual[own] ** 2).sum()) <= NOISE * float(problem.floor[own].sum()):
            continue
        late = drive_of(robot, c.target).delay_s
        whole = round(late / row)
        other = (whole - BEYOND if late > whole * row else whole + BEYOND) * row
        value = c.values(fit.u[place])[c.effect.main.name] + other - late
        u = fit.u.copy()
        u[place] = np.clip(c.shares({c.effect.main.name: value}), c.lower, c.upper)
        if other > 0 and np.abs(u[place] - fit.u[place]).max() > 0:
            yield k, u
