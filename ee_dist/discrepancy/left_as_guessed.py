"""How sure values are beside what a description only guessed, and a model leaves as it was guessed.

Where a log shows how late a joint follows, gain and damping of its controller are told by their ratio alone. A model that has the
one and leaves the other at its guess tells the first to three digits, all of them the guess's.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ee_dist.discrepancy.assumed import guess_of
from ee_dist.discrepancy.evidence.intervals import half_widths
from ee_dist.discrepancy.evidence.together import flat_widths
from ee_dist.discrepancy.guesses import ROTORS
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import slopes_at
from ee_dist.trials.log import Array

FIELDS = {"position_gain": "kp", "speed_gain": "kd", "torque_limit": "torque_limit", "rotor_inertia": "rotor_inertia"}
"""Of a drive, by the effect that puts them right."""


def left_as_guessed(search: Search, fit: Fit) -> list[Candidate]:
    """One number for each field of the drives that was guessed, of which the model has none, where it could show."""
    problem = search.problem
    has = {t.effect for t in (*search.fixed, *fit.hypothesis)}
    if has & {*ROTORS}:
        has |= {*ROTORS}
    return [
        c
        for effect, field in FIELDS.items()
        for c in guess_of(problem.robot, effect, field)
        if c.effect.name not in has and c.effect.family in problem.families and problem.shows(c.effect.name, c.target)
    ]


def beside_guesses(search: Search, fit: Fit) -> Array:
    """(P,) half intervals of the values of a fit with all that was guessed and left so free as well; zeros where nothing was."""
    out = np.zeros(len(fit.u))
    if not len(fit.u) or not fit.mask.any():
        return out
    others = left_as_guessed(search, fit)
    if not others:
        return out
    more = Model(tuple(others))
    neutral = np.zeros(len(more.lower))
    slopes = slopes_at(replace(search, fixed=(*search.fixed, *fit.hypothesis)), more, neutral)[fit.mask]
    shows = np.abs(slopes).sum(axis=0) > 0
    free = Fit(
        Model((*fit.model.parts, *(c for c, s in zip(others, shows, strict=True) if s))),
        np.concatenate([fit.u, neutral[shows]]),
        fit.energy,
        fit.residual,
        np.concatenate([fit.slopes, slopes[:, shows]], axis=1),
        fit.mask,
    )
    # No farther than a search looks.
    return np.minimum(np.maximum(half_widths(search.problem, free), flat_widths(search, free)), 1.0)[: len(out)]
