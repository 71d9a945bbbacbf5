"""Leaving out, in the end, what these data do not tell from neutral."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.discrepancy.evidence.holdout import PRIOR, Cut, HeldOut, held_by_slopes, prior_of
from ee_dist.discrepancy.evidence.intervals import half_widths
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.pruning import (
    AGAIN,
    as_many,
    goes_with_others,
    halves,
    may_leave,
    may_reach,
    units_of,
    without_these,
)
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import NEAR, gauss_newton, weighed
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.discrepancy.torque_scale import MASS, without_masses
from ee_dist.trials.log import Array

Units = Callable[[Model, int, int], list[list[int]]]
"""Numbers of the parts from one to another, by what goes together."""
NOT_FAR, CHORDS = 5.0, 3
"""How far from neutral, in halves of its interval, a value is without which it is simulated, and in how many steps the others
follow;"""
SAME = 1e-6
"""Share of its energy by which a motion that is computed otherwise may differ and be the same."""
FEW, REFITS = 16, 3
"""how many values are few, all of which are tried, and in how many descents the others are fitted then."""


@dataclass(frozen=True, eq=False)
class Told:
    """The model ``then`` without what is not told from neutral; ``gone``: the names of that, and ``instead`` those among them in
    whose place something else stayed that was missed as little."""

    then: Current
    gone: tuple[str, ...] = ()
    instead: frozenset[str] = frozenset()


def told_only(search: Search, current: Current, own: int, cut: Cut, tried: int, open_only: bool = False) -> Told:
    """The model without the terms whose intervals hold neutral (``open_only``: of which some value may be anything), one
    after the other, the least told first, for what one of two alike leaves makes the other plain; then without those that
    are not missed. As many of them leave as held-out data allow; the first ``own`` parts stay. Masses of a body's parts go
    together; far from the noise, where one of them that is told keeps others at their bounds, then each by itself."""
    current, same = _without_scale(search, current, own)
    told, fit = _left_out(search, current, own, cut, tried, open_only, units_of)
    told = Told(told.then, (*same, *told.gone), told.instead)
    problem = search.problem
    if open_only or fit.energy <= NEAR * float(problem.floor.sum()):
        return told
    stayed = Model(told.then.parts)
    if not any(len(unit) > 1 for unit in units_of(stayed, own, len(stayed.parts))):
        return told
    more, _ = _left_out(search, told.then, own, cut, tried, open_only, _each)
    return Told(more.then, (*told.gone, *more.gone), told.instead | more.instead)


def _without_scale(search: Search, current: Current, own: int) -> tuple[Current, tuple[str, ...]]:
    """The model without the masses, of those from part ``own`` on, without which it is the very same motion once all that goes
    with torques is smaller by their factor; and their names. Slopes over finite steps tell such a mass, as any way along a
    ridge that is bent, and held-out data cannot say anything of it."""
    model = Model(current.parts)
    masses = [[k] for k in range(own, len(current.parts)) if current.parts[k].effect.name == MASS]
    units = [*masses, [k for (k,) in masses]] if len(masses) > 1 else masses
    starts = [(unit, without_masses(search.problem.robot, model, current.u, unit)) for unit in units]
    found = [(unit, u) for unit, u in starts if u is not None]
    if not found:
        return current, ()
    left = [Model(tuple(c for k, c in enumerate(current.parts) if k not in unit)) for unit, _ in found]
    rows = search.residuals(
        [model.hypothesis(current.u), *(m.hypothesis(u) for m, (_, u) in zip(left, found, strict=True))]
    )
    energy = float(rows[0] @ rows[0])
    for (unit, u), m, r in zip(found, left, rows[1:], strict=True):
        if abs(float(r @ r) - energy) <= SAME * energy:
            return Current(m.parts, u), tuple(current.parts[k].name for k in unit)
    return current, ()


def _left_out(
    search: Search, current: Current, own: int, cut: Cut, tried: int, open_only: bool, units: Units
) -> tuple[Told, Fit]:
    """The same by ``units``, what goes together; and the fit of the model that is left."""
    gone: list[tuple[str, ...]] = []
    alike: dict[str, frozenset[str]] = {}
    fits: list[Fit] = []
    known: HeldOut | None = None

    def too_much(without: Fit) -> bool:
        # Of values that only together leave much less too little is told: held-out data would take nearly all of them back.
        return known is not None and not may_reach(without, may_leave(search.problem, known, cut, tried, len(gone) + 1))

    while True:
        start = [(Model(current.parts), current.u)]
        (fit,) = follow_valley(search, start, search.everything, prior_of(search, start), 2, (AGAIN,))
        fits, found = [*fits[:-1], fit], len(gone)
        known = known or held_by_slopes(search, [fit], cut)[0]
        # As far as slopes tell what goes is made up for by the rest; then all that stays is fitted anew.
        while least := _least_told(search.problem, fit, own, open_only, units):
            without = without_these(fit, least)
            if too_much(without):
                break
            gone.append(tuple(fit.model.parts[k].name for k in least))
            fit = without
            fits.append(fit)
        while not open_only and (less := _not_missed(search, fit, own, units)) is not None and not too_much(less.fit):
            gone.append(less.names)
            alike |= dict.fromkeys(less.names, less.others)
            fit = less.fit
            fits.append(fit)
        current = Current(fit.model.parts, fit.u)
        if len(gone) == found:
            break
    gone = gone[: as_many(search, fits[0], {n: fits[n] for n in halves(len(gone))}, cut, tried, known=known)]
    kept, names = fits[len(gone)], tuple(name for names in gone for name in names)
    stay = {c.name for c in kept.model.parts}
    instead = frozenset(n for n in names if alike.get(n, frozenset()) & stay)
    return Told(Current(kept.model.parts, kept.u), names, instead), kept


def _each(model: Model, first: int, end: int) -> list[list[int]]:
    """Numbers of the parts from ``first`` to ``end``, each by itself, of those that go together: of all others it was asked
    whether they are told."""
    return [[k] for k in range(first, end) if model.parts[k].size and goes_with_others(model.parts[k])]


@dataclass(frozen=True, eq=False)
class _Without:
    """A fit without the parts of some ``names``, which are not missed; ``others``: what is not either, if these stay."""

    names: tuple[str, ...]
    fit: Fit
    others: frozenset[str]


def _not_missed(search: Search, fit: Fit, own: int, units_by: Units) -> _Without | None:
    """Of parts, from ``own`` on, that slopes tell from neutral, and which are not missed when it is simulated without them,
    those without which the model is nearest to the description. None where each is missed. Along a ridge slopes over finite
    steps rise where the residual does not, and their intervals are too narrow. How far a value is told goes with the root
    of what it costs to go without it (the likelihood ratio beside Wald's test). Of few values all are tried, by fits."""
    told, few = _told(fit, half_widths(search.problem, fit)), len(fit.u) <= FEW
    units = [unit for unit in units_by(fit.model, own, len(told)) if few or max(told[k] for k in unit) < NOT_FAR]
    if not units:
        return None
    foretold = [without_these(fit, unit) for unit in units]
    simulated = _followed(search, foretold)
    if few:
        starts = [(f.model, f.u) for f in simulated]
        simulated = follow_valley(search, starts, search.everything, PRIOR, REFITS, (AGAIN,))
    found: list[tuple[tuple[str, ...], Fit]] = []
    for unit, by_slopes, without in zip(units, foretold, simulated, strict=True):
        rises = [max(f.energy - fit.energy, 0.0) for f in (without, by_slopes)]
        if max(told[k] for k in unit) * np.sqrt(rises[0] / max(rises[1], 1e-12)) < 1.0:
            found.append((tuple(fit.model.parts[k].name for k in unit), without))
    if not found:
        return None
    names, nearest = min(found, key=lambda f: float(f[1].u @ f[1].u))
    return _Without(names, nearest, frozenset(n for some, _ in found for n in some if n not in names))


def _followed(search: Search, starts: Sequence[Fit]) -> list[Fit]:
    """Of each fit that slopes foretold the best that is simulated on the way that the same slopes lead from there (the chord
    method, Newton's with slopes that stay); one with infinite energy where none can be simulated."""
    now, best = [f.u for f in starts], [replace(f, energy=np.inf) for f in starts]
    for _ in range(CHORDS):
        rows = search.residuals([f.model.hypothesis(u) for f, u in zip(starts, now, strict=True)])
        for k, (f, r) in enumerate(zip(starts, rows, strict=True)):
            energy = float(r[f.mask] @ r[f.mask])
            if not np.isfinite(energy):
                continue
            if energy < best[k].energy:
                best[k] = replace(f, u=now[k], energy=energy, residual=r)
            smooth, weights = weighed(search.problem, r)
            step = gauss_newton(f.slopes, (weights * smooth)[f.mask], now[k], PRIOR, f.model)
            now[k] = np.clip(now[k] + step, f.model.lower, f.model.upper)
    return best


def _told(fit: Fit, half: Array) -> list[float]:
    """How far each part is told from neutral, as a multiple of ``half`` (P,) its intervals: by the values that tell that it is
    there. When a sensor sticks may be plain where what sticks is next to none."""
    times = np.abs(fit.u) / np.maximum(half, 1e-12)
    return [
        float(np.max(np.delete(times[p], c.inert), initial=0.0))
        for c, p in zip(fit.model.parts, fit.model.places, strict=True)
    ]


def _least_told(problem: Problem, fit: Fit, own: int, open_only: bool, units_by: Units) -> list[int]:
    """Numbers of the parts, from ``own`` on, that are told least, if their intervals hold neutral."""
    half, places = half_widths(problem, fit), fit.model.places
    told = _told(fit, half)
    units = units_by(fit.model, own, len(told))
    if open_only:
        units = [unit for unit in units if any(np.max(half[places[k]], initial=0.0) > 1.0 for k in unit)]
    least = min(units, key=lambda unit: max(told[k] for k in unit), default=[])
    return least if least and max(told[k] for k in least) < 1.0 else []
