"""Leaving out terms that are of no use, or no longer."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.assumed import of_one_guess
from ee_dist.discrepancy.evidence.holdout import PIECES, PRIOR, WINDOWS, Cut, HeldOut, cross_fit, held_by_slopes
from ee_dist.discrepancy.evidence.judge import at_work
from ee_dist.discrepancy.evidence.rule import WORTH, least_energy
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.discrepancy.search.fit import fit_all
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import NEAR, WIDTHS
from ee_dist.discrepancy.search.valley import LARGE, follow_valley
from ee_dist.trials.log import Array

AGAIN = 0.03
"""Finite differences where the values are nearly right already."""
SURE = 0.01
"""What a channel is at least believed to vary, as a share of the one that varies most: a computed command has no noise."""
TOGETHER = 0.2
"""Share of the held-out energy that all terms that go at once may cost, where luck once is less than that."""
FITTED = 0.25
"""Share of the energy of what was fitted by which it may rise without all that goes at once."""
ROUNDS = 3
"""How often terms are left out and the rest is fitted anew."""


def pruned(search: Search, fit: Fit, own: int, tried: int, cut: Cut, newest: int = 0) -> Current:
    """The model without the terms whose values these data do not tell from neutral, fitted anew: one after the other the term
    that would cost least, by its value and what the others can make up for (Wald's test), as many of them as held-out data
    allow. The first ``own`` and the ``newest`` parts stay."""
    for _ in range(ROUNDS):
        gone = _useless(search, fit, own, tried, newest)
        after = {n: without_these(fit, [k for unit in gone[:n] for k in unit]) for n in halves(len(gone))}
        count = as_many(search.among(None), fit, after, cut, tried, each=True)
        if not count:
            break
        (fit,) = follow_valley(search, [(after[count].model, after[count].u)], fit.mask, PRIOR, widths=(AGAIN,))
    return Current(fit.model.parts, fit.u)


def _useless(search: Search, fit: Fit, own: int, tried: int, newest: int) -> list[list[int]]:
    """Numbers of the parts that may go, in the order in which they go; what goes together is one entry."""
    places, luck = fit.model.places, _luck(search.problem, fit)
    slopes = fit.slopes / np.sqrt(luck)[:, None]
    prior = PRIOR / max(float(luck.mean()), 1e-12)
    kept, units = list(range(len(fit.model.parts))), units_of(fit.model, own, len(fit.model.parts) - newest)
    values, out = fit.u.copy(), []
    while units:
        at = np.concatenate([np.arange(places[k].start, places[k].stop) for k in kept])
        normal = slopes[:, at].T @ slopes[:, at] + prior * np.eye(len(at))
        inverse, u = np.linalg.inv(normal), values[at]
        where = [
            np.flatnonzero(np.isin(at, np.concatenate([np.arange(len(fit.u))[places[k]] for k in m]))) for m in units
        ]
        costs = [
            float(u[mine] @ np.linalg.solve(inverse[np.ix_(mine, mine)], u[mine])) - least_energy(tried, len(mine))
            for mine in where
        ]
        cheapest = int(np.argmin(costs))
        if costs[cheapest] > 0:
            break
        # What the others make up for goes into them, as far as slopes tell.
        mine = where[cheapest]
        values[at] = u - _made_up_for(inverse, mine, u)
        out.append(units.pop(cheapest))
        kept = [k for k in kept if k not in out[-1]]
    return out


def halves(count: int) -> list[int]:
    """All, half, a quarter and so on, to one."""
    return [count >> k for k in range(count.bit_length())]


def as_many(
    search: Search,
    whole: Fit,
    fewer: dict[int, Fit],
    cut: Cut,
    tried: int,
    each: bool = False,
    known: HeldOut | None = None,
) -> int:
    """How many terms may go, of the numbers in ``fewer`` with the models that are left then, most first: without so many held-out
    data are foretold as well as by the whole model (``known``, where that was asked before), give or take luck once, or for
    ``each`` of them. Far from the noise a term must be worth more than luck to come in; to stay, where nothing else tells it, no
    more than that. Slopes may mislead where a joint sticks; and where much is left at one joint, luck is taken to be large at all
    that moves it. 0: none."""
    if not fewer:
        return 0
    problem, known = search.problem, known or held_by_slopes(search, [whole], cut)[0]
    two = cut.name != WINDOWS and len(np.unique(cut.unit_of)) == 2
    most = {n: may_leave(problem, known, cut, tried, n, each) for n in fewer}
    able = [n for n, fit in fewer.items() if not (two and not _fits_as_well(whole, fit)) and may_reach(fit, most[n])]
    # Far from the noise each may be fitted anew in every turn, which takes long; near it they cost little, and less together.
    far = known.energy > NEAR * float(problem.floor.sum())
    for some in [[n] for n in able] if far else [able[:1], able[1:]]:
        for n, without in zip(some, held_by_slopes(search, [fewer[n] for n in some], cut), strict=True):
            if without.energy <= most[n]:
                return n
    return 0


def may_leave(problem: Problem, known: HeldOut, cut: Cut, tried: int, count: int, each: bool = False) -> float:
    """Held-out energy that a model may leave without ``count`` terms of one that leaves what is ``known``."""
    return known.energy + _may_cost(problem, known.energy, cut, tried, count, each)


def may_reach(fit: Fit, most: float) -> bool:
    """Whether a model that was fitted to all data may leave no more than so much energy of those held out: what is held out in a
    turn is foretold no better by values that have not seen it than by those that have, or else these were no fit."""
    return not fit.mask.all() or fit.energy <= most


def _fits_as_well(whole: Fit, without: Fit) -> bool:
    """Whether what was fitted is still fitted without some terms. Of two motions neither tells from the other what only both do:
    then no term is told by itself from neutral, and what is held out speaks for none of many that are there together."""
    return without.energy <= (1.0 + FITTED) * whole.energy


def _made_up_for(inverse: Array, gone: Array, u: Array) -> Array:
    """(P,) by how much less each value is where those ``gone`` (numbers) go to neutral: these by all of themselves, the others by
    what makes up for them. ``inverse`` (P, P): covariance of the values u (P,)."""
    return np.asarray(inverse[:, gone] @ np.linalg.solve(inverse[np.ix_(gone, gone)], u[gone]))


def _luck(problem: Problem, fit: Fit) -> Array:
    """(n,) variance that luck moves each fitted value by. Noise averages out from value to value, what is above it at best from
    piece to piece; and what one channel leaves is no doubt about what the others say, nor what its readings leave one about its
    texture: a sensor is told to be noisy by that, whatever the noise leaves in its readings."""
    channel, squares = problem.channel_of[fit.mask], fit.residual[fit.mask] ** 2
    group = channel + len(problem.channels) * ~problem.layout.reading[fit.mask]
    count, energy, floor = (
        np.bincount(group, weights=w, minlength=2 * len(problem.channels))
        for w in (np.ones(len(group)), squares, problem.floor[fit.mask])
    )
    there = count > 0
    pieces = PIECES * len(np.unique(problem.segment_of[fit.mask])) / max(1, len(np.unique(channel)))
    luck = np.divide(floor, count, out=np.zeros_like(floor), where=there) + np.maximum(energy - floor, 0.0) / pieces
    return np.asarray(np.maximum(luck, max(SURE * float(luck.max()), 1e-12))[group])


def units_of(model: Model, first: int, end: int) -> list[list[int]]:
    """Numbers of the parts from ``first`` to ``end`` that have values, by what stays or goes together: masses of a body's parts
    share their marks, and some of them without the others would have to stand in for these. What puts right what was guessed of
    controllers as a whole stays."""
    units: dict[str, list[int]] = {}
    stays = of_one_guess(model)
    for k in range(first, end):
        c = model.parts[k]
        if c.size and k not in stays:
            units.setdefault(c.effect.name if goes_with_others(c) else c.name, []).append(k)
    return list(units.values())


def goes_with_others(c: Candidate) -> bool:
    """Whether it is one of a body's small effects, as a mass of one of its parts."""
    return c.effect.family == "body" and c.effect.everywhere


def without_useless(
    search: Search, current: Current, own: int, added: int, cut: Cut, tried: int
) -> tuple[Current, tuple[str, ...]]:
    """The model without the terms that the last ones have made useless: leaving them out costs no more held-out energy
    than luck, and less than a term must be worth."""
    stays = of_one_guess(Model(current.parts))
    old = [k for k in range(own, len(current.parts) - added) if k not in stays]
    if not old:
        return current, ()
    if len(current.u) >= LARGE:
        return _by_slopes(search, current, own, added, cut, tried)
    problem, places = search.problem, Model(current.parts).places
    models = [(Model(current.parts), current.u)]
    for k in old:
        keep = np.delete(np.arange(len(current.u)), places[k])
        models.append((Model((*current.parts[:k], *current.parts[k + 1 :])), current.u[keep]))
    whole, *without = cross_fit(search, models, cut)
    most = allowed_loss(problem, whole.energy, cut, tried)
    costs = [h.energy - whole.energy for h in without]
    cheapest = int(np.argmin(costs))
    if costs[cheapest] > most * 0.5:
        return current, ()
    model, start = models[1 + cheapest]
    name = current.parts[old[cheapest]].name
    fit = fit_all(search, [(model, start)], None, WIDTHS[2:])[0]
    return Current(model.parts, fit.u), (name,)


def _by_slopes(
    search: Search, current: Current, own: int, added: int, cut: Cut, tried: int
) -> tuple[Current, tuple[str, ...]]:
    """The same where trying each term by itself would take long: all those that slopes call useless at once, unless held-out
    data say otherwise."""
    (fit,) = follow_valley(search, [(Model(current.parts), current.u)], search.everything, PRIOR, 1, WIDTHS[-1:])
    kept = pruned(search, fit, own, tried, cut, added)
    names = {c.name for c in kept.parts}
    return kept, tuple(c.name for c in current.parts if c.name not in names)


def _may_cost(problem: Problem, energy: float, cut: Cut, tried: int, count: int, each: bool) -> float:
    """Held-out energy, of which a model has so much, that leaving ``count`` terms out may cost. What noise makes of one of
    them is what it may make of ``each``; else luck may be had once, and far from the noise as often as terms go."""
    # Many small effects may each be below the resolution at which channels are compared, and not all together.
    least = float(problem.floor.mean())
    if each:
        # Of few values luck is a large part each time, and the best of all that were tried does not come as often as terms go.
        most = max(luck(problem, energy, tried, least), TOGETHER * energy)
        return min(allowed_loss(problem, energy, cut, tried, least, count), most)
    return min(allowed_loss(problem, energy, cut, tried, least), count * luck(problem, energy, tried, least))


def allowed_loss(problem: Problem, energy: float, cut: Cut, tried: int, least: float = 1.0, count: int = 1) -> float:
    """Held-out energy that leaving ``count`` terms out may cost; ``least``: the variance that counts in a value."""
    most = count * luck(problem, energy, tried, least)
    if cut.name == WINDOWS:
        return most
    return max(most, 0.5 * WORTH * max(energy - float(problem.floor.sum()), 0.0))


def luck(problem: Problem, energy: float, tried: int, least: float = 1.0) -> float:
    """Held-out energy, of which a model has so much, that one useless effect of those ``tried`` may take off."""
    return least_energy(tried) * max(least, energy / len(problem.floor))


def without_these(fit: Fit, gone: Sequence[int]) -> Fit:
    """The fit without some parts, as slopes foretell it."""
    places, kept = fit.model.places, [k for k in range(len(fit.model.parts)) if k not in gone]
    at, stay = (
        np.concatenate([*(np.arange(places[k].start, places[k].stop) for k in some), np.zeros(0, dtype=int)])
        for some in (gone, kept)
    )
    inverse = np.linalg.inv(fit.slopes.T @ fit.slopes + PRIOR * np.eye(len(fit.u)))
    change = -_made_up_for(inverse, at, fit.u)
    model, residual = Model(tuple(fit.model.parts[k] for k in kept)), fit.residual.copy()
    u = np.clip((fit.u + change)[stay], model.lower, model.upper)
    residual[fit.mask] += fit.slopes @ change
    own = residual[fit.mask]
    return Fit(model, u, float(own @ own), residual, fit.slopes[:, stay], fit.mask)


def without_neutral(current: Current, own: int) -> tuple[Current, tuple[str, ...]]:
    """The model without the terms that ended at neutral, and their names: it is the same model, and nobody is told that no
    friction was added. The first ``own`` parts stay."""
    model = Model(current.parts)
    places, keep = model.places, at_work(model, current.u, own)
    none = [k for k in range(len(places)) if k not in keep]
    values = np.concatenate([current.u[places[k]] for k in keep] or [np.zeros(0)])
    return Current(tuple(current.parts[k] for k in keep), values), tuple(current.parts[k].name for k in none)
