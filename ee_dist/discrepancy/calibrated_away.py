"""What a calibration may hide: one joint of a robot that passes for untouched differs from all joints like it.

A calibration takes the robot as it is for one in order. What a single joint has is not fitted, or fitted as one of many
small values, and counts as known from then on: a fault of the robot that the model was calibrated on is never seen again.
Joints with the same drive are a little off alike; so each effect is fitted at all of them at once, each with a value of
its own, and one that keeps far more than its mates is told.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.evidence.holdout import PRIOR
from ee_dist.discrepancy.evidence.intervals import half_widths
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, known
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Progress, Search, quiet
from ee_dist.discrepancy.search.trials import calm_trials
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term
from ee_dist.effects.groups import like_joints, members_of
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

FEWEST = 4
"""Like joints of which one can be told to be the odd one: of three, two that agree may do so by luck."""
DEVIATIONS = 5.0
"""Robust standard deviations of its mates' values from which one is none of them,"""
TIMES = 4.0
"""how many times as large as theirs it must be,"""
SHARE = 0.125
"""and the share of what is left above the noise without it that it must account for: where much is a little off everywhere,
one of many values is always the largest."""
ALIKE = 0.05
"""Share by which the numbers of like drives may differ."""
ITERATIONS, WIDTHS = 4, (0.12,)
"""Of the fit, and its first finite difference as a share of a value's room."""
FAMILIES = ("drive", "sensing")
"""Of effects that like joints, and sensors at them, have alike."""
SIGMA_OF_MAD, HALF_WIDTH = 1.4826, 1.96
"""Of a normal variable: its standard deviation over the median absolute deviation, and 95 % intervals in deviations."""


@dataclass(frozen=True)
class OddOne:
    """A value at one joint, or of one sensor at it, that is ``times`` as large as is ``typical`` (in the unit of the effect's
    main parameter) of its ``mates``, and ``deviations`` robust standard deviations from their middle. ``share`` of what is left
    above the noise without it goes with it."""

    term: Term
    joint: str
    typical: float
    times: float
    deviations: float
    mates: tuple[str, ...]
    share: float


@dataclass(frozen=True, eq=False)
class _Row:
    """One effect at all places of a class: candidates, their values to begin with, and the rest of the model."""

    parts: tuple[Candidate, ...]
    joints: tuple[str, ...]
    start: Array
    rest: Hypothesis


def calibrated_away(
    problem: Problem, terms: Hypothesis, pool: Sequence[Candidate], progress: Progress = quiet
) -> list[OddOne]:
    """Values that stand out from those of like joints, for the calibrated model ``terms`` and the effects of ``pool`` that have
    one parameter; those that account for most first, one a joint."""
    terms = _member_by_member(problem.robot, terms)
    base = problem.residuals([terms])[0]
    search = Search(problem, trials=tuple(calm_trials(problem, base)), progress=progress)
    rows = list(_rows(problem.robot, terms, pool))
    best: dict[str, OddOne] = {}
    for rest in dict.fromkeys(r.rest for r in rows):
        mine, on = [r for r in rows if r.rest == rest], search.on(rest)
        starts = [(Model(r.parts), r.start) for r in mine]
        # Down the valley: large errors are softened, and there a plain slope says too little of a value and of how sure it is.
        fits = follow_valley(on, starts, search.everything, PRIOR, ITERATIONS, WIDTHS)
        for row, fit in zip(mine, fits, strict=True):
            for odd in _odd(on, row, fit):
                if odd.joint not in best or odd.share > best[odd.joint].share:
                    best[odd.joint] = odd
    return sorted(best.values(), key=lambda o: -o.share)


def _rows(robot: Robot, terms: Hypothesis, pool: Sequence[Candidate]) -> Iterator[_Row]:
    """What is fitted: each effect at the places of each class of like joints, with the values that the model has there."""
    has = {t.name: t for t in terms}
    by_effect: dict[str, dict[str, Candidate]] = {}
    for c in pool:
        if c.size == 1 and c.effect.family in FAMILIES:
            by_effect.setdefault(c.effect.name, {})[c.target] = c
    for mine in by_effect.values():
        for places in _places(robot):
            at = {p: mine[p] for p in places if p in mine}
            if len(at) < FEWEST:
                continue
            parts = tuple(known(robot, has[c.name]) if c.name in has else c for c in at.values())
            start = [c.shares(dict(has[c.name].values))[0] if c.name in has else 0.0 for c in parts]
            names = {c.name for c in parts}
            rest = tuple(t for t in terms if t.name not in names)
            yield _Row(parts, tuple(places[p] for p in at), np.array(start), rest)


def _places(robot: Robot) -> list[dict[str, str]]:
    """Classes of places that are alike, each with the joint that it belongs to: joints, and sensors of a kind at them."""
    out: list[dict[str, str]] = []
    for joints in like_joints(robot, ALIKE):
        out.append({j: j for j in joints})
        for kind in dict.fromkeys(s.kind for s in robot.sensors):
            out.append({s.name: s.target for s in robot.sensors if s.kind == kind and s.target in joints})
    return out


def _member_by_member(robot: Robot, terms: Hypothesis) -> Hypothesis:
    """The model with what its joints share told of each of them: the same model."""
    out: list[Term] = []
    for t in terms:
        members = members_of(robot, t.target, CATALOGUE[t.effect].targets(robot))
        out += [Term(t.effect, m, t.values) for m in members] if members else [t]
    return tuple(out)


def _odd(search: Search, row: _Row, fit: Fit) -> Iterator[OddOne]:
    """Values of a fit that stand out."""
    u = fit.u
    half = half_widths(search.problem, fit)
    rooms = np.array([c.rooms(u[k : k + 1])[0] for k, c in enumerate(row.parts)])
    values = np.array([c.values(u[k : k + 1])[c.effect.main.name] for k, c in enumerate(row.parts)])
    off = values - row.parts[0].effect.main.neutral
    error = np.abs(half * rooms) / HALF_WIDTH
    told = np.isfinite(error)
    for k in np.flatnonzero(told):
        mates = [i for i in np.flatnonzero(told) if i != k]
        if len(mates) < FEWEST - 1:
            continue
        middle = float(np.median(off[mates]))
        spread = _spread(off[mates] - middle)
        floor = max(float(np.median(error[mates])), float(error[k]), 1e-12)
        typical = max(float(np.median(np.abs(off[mates]))), floor)
        away, times = abs(float(off[k]) - middle) / max(spread, floor), abs(float(off[k])) / typical
        if away < DEVIATIONS or times < TIMES:
            continue
        share = _share(search, row, fit, int(k), middle)
        if share >= SHARE:
            yield OddOne(
                row.parts[k].term(u[k : k + 1]),
                row.joints[k],
                typical,
                times,
                away,
                tuple(row.parts[i].target for i in mates),
                share,
            )


def _spread(away: Array) -> float:
    """Standard deviation of a few values ``away`` (N,) from their middle, of which one may be odd too. The median absolute
    deviation of seven is small by luck too often to stand alone."""
    near = np.sort(np.abs(away))[:-1]
    return max(SIGMA_OF_MAD * float(np.median(np.abs(away))), float(np.sqrt(np.mean(near**2))))


def _share(search: Search, row: _Row, fit: Fit, k: int, middle: float) -> float:
    """What the value adds to the explanation, as a share of what is left above the noise where it is as its mates' are."""
    c = row.parts[k]
    u = fit.u.copy()
    u[k] = c.shares({c.effect.main.name: c.effect.main.neutral + middle})[0]
    problem = search.problem
    without = search.residuals([fit.model.hypothesis(np.clip(u, fit.model.lower, fit.model.upper))])[0]
    seen = np.ones(len(without), dtype=bool)
    if search.trials is not None:
        seen = np.isin(problem.trial_of, search.trials)
    left = float(without @ without)
    above = left - float(problem.floor[seen].sum())
    return (left - float(fit.residual[seen] @ fit.residual[seen])) / above if np.isfinite(left) and above > 0 else 0.0
