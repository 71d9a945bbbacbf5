"""A model with one of its effects exchanged: for what was tied with it when it was added, or does as well in the end."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from collections.abc import Set as AbstractSet

import numpy as np

from ee_dist.discrepancy.assumed import puts_right
from ee_dist.discrepancy.evidence.holdout import AWAY, Cut, HeldOut, cross_fit, held_out_by
from ee_dist.discrepancy.evidence.judge import surely_better
from ee_dist.discrepancy.examine import Current, Effort, examine
from ee_dist.discrepancy.instead import Instead, instead_of
from ee_dist.discrepancy.ladder import Rung, Twin
from ee_dist.discrepancy.problem import Problem, error, per_segment
from ee_dist.discrepancy.pruning import allowed_loss
from ee_dist.discrepancy.search.candidates import Candidate, Proposal, candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import as_long
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS
from ee_dist.discrepancy.search.valley import LARGE
from ee_dist.discrepancy.torque_scale import other_scale
from ee_dist.trials.log import Array

LOOKED_AT = 2
"""How many of those that were tied are looked at, the best first."""


def strictest(problem: Problem) -> Cut:
    """The strictest way of holding out that there is."""
    return held_out_by(problem)[0]


def refitted(
    search: Search, current: Current, name: str = "its own values fitted anew", dropped: tuple[str, ...] = ()
) -> Rung:
    cut = strictest(search.problem)
    held = cross_fit(search, [(Model(current.parts), current.u)], cut)[0]
    terms = (*search.fixed, *current.hypothesis)
    return Rung(
        name,
        (),
        terms,
        float(np.sqrt(held.seen)),
        error(held.residual),
        per_segment(search.problem, held.residual),
        cut.name,
        dropped=dropped,
    )


def twins_of(current: Current, ladder: Sequence[Rung], own: int) -> list[tuple[int, Proposal, Array]]:
    """What was tied with a single effect of the model when it was added: the number of that part, and the values that suited."""
    where = {c.name: k for k, c in enumerate(current.parts) if k >= own}
    return [
        (where[t.name], p, u)
        for rung in ladder
        for t in rung.added
        if t.name in where and len(rung.added) == 1
        for p, u in rung.alternatives
        if len(p.parts) == 1 and p.parts[0].name not in where
    ]


def exchanged(
    search: Search, current: Current, ladder: Sequence[Rung], own: int, pool: Sequence[Candidate], effort: Effort
) -> tuple[Current, Rung] | None:
    """The model with one of its effects exchanged for what was tied with it when it was added, if that is better by more
    than luck: by itself, or with what earns its place only beside the other. Two effects that mimic one another decide
    which third one can still be seen."""
    problem, places = search.problem, Model(current.parts).places
    options = twins_of(current, ladder, own)
    models = [(Model(current.parts), current.u)]
    for k, p, u in options:
        parts = (*current.parts[:k], p.parts[0], *current.parts[k + 1 :])
        values = np.concatenate([current.u[: places[k].start], u, current.u[places[k].stop :]])
        models.append((Model(parts), values))
    if not options:
        return None
    cut = strictest(problem)
    now, *others = cross_fit(search, models, cut, WIDTHS[1:])
    order = _best_first(others)
    for i in order[:LOOKED_AT]:
        (k, proposal, _), (model, start), held = options[i], models[1 + i], others[i]
        changed = Current(model.parts, fit_one(search, model, [start], None, WIDTHS[1:]).u)
        if not surely_better(problem, now, held, len(pool)):
            names = {c.name for c in changed.parts}
            beside = examine(search, changed, [c for c in pool if c.name not in names], effort).best
            if beside is None:
                continue
            if beside.outcome.cut.name == cut.name:
                both = beside.outcome
            else:
                # Errors on motions and on settings that were not fitted do not compare.
                both = cross_fit(search, [(beside.model, beside.u)], cut, WIDTHS[1:])[0]
            if not surely_better(problem, now, both, len(pool)):
                continue
        rung = Rung(
            proposal.name,
            (changed.hypothesis[k],),
            (*search.fixed, *changed.hypothesis),
            float(np.sqrt(held.seen)),
            error(held.residual),
            per_segment(problem, held.residual),
            cut.name,
            dropped=(current.parts[k].name,),
        )
        return changed, rung
    return None


def at_one_place(search: Search, current: Current, own: int) -> tuple[Current, Rung] | None:
    """The model with a number that several places share exchanged for one of a single place, if that is better by more than luck.
    Of two effects that are missing the first that comes in takes what it can of the other, too: a little at all joints is
    near to much at one of them and something else at another. Once that has come, one place alone may say it better."""
    robot, problem = search.problem.robot, search.problem
    kinds = Counter(c.effect.name for c in current.parts)
    options: list[tuple[Candidate, Model, Array]] = []
    for k, (c, place) in enumerate(zip(current.parts, Model(current.parts).places, strict=True)):
        if k < own or kinds[c.effect.name] > 1 or puts_right(robot, c):
            continue
        for target in c.members(robot):
            single = as_long(problem, candidate(robot, c.effect, target))
            if problem.shows(c.effect.name, target):
                u = np.clip(single.shares(c.values(current.u[place])), single.lower, single.upper)
                values = np.concatenate([current.u[: place.start], u, current.u[place.stop :]])
                options.append((c, Model((*current.parts[:k], single, *current.parts[k + 1 :])), values))
    if not options:
        return None
    cut = strictest(problem)
    now, *others = cross_fit(search, [(Model(current.parts), current.u), *(o[1:] for o in options)], cut, WIDTHS[1:])
    best = _best_first(others)[0]
    gone, model, start = options[best]
    if not surely_better(problem, now, others[best], len(options)):
        return None
    then = Current(model.parts, fit_one(search, model, [start], None, WIDTHS[1:]).u)
    at = current.parts.index(gone)
    rung = refitted(search, then, then.parts[at].name, (gone.name,))
    rung.added = (then.hypothesis[at],)
    return then, rung


def _best_first(held: Sequence[HeldOut]) -> list[int]:
    return sorted(range(len(held)), key=lambda i: held[i].energy)


def nearest(
    search: Search, current: Current, own: int, pool: Sequence[Candidate], asked: AbstractSet[str] = frozenset()
) -> tuple[Current, list[Twin], Rung | None]:
    """The model, or, where another is surely better or does as well and is nearer to the description, that one and the step to
    it; and what does as well as an effect of the model in its place. ``asked``: names of what is told in any case if it does."""
    more = tuple(other_scale(search.problem, current, own, pool))
    found = instead_of(search, current, own, pool, asked, more)
    best = next((i for i in found if i.better), None)
    if best is not None and _surely(search, best, len(pool)):
        return best.then, [], _step(search, best)
    found, nearer = _nearest_of(search, found, len(pool))
    fixed = search.fixed
    twins = [
        Twin(i.gone.name, i.then.hypothesis[-1], (*fixed, *i.then.hypothesis))
        for i in found
        if nearer is None or (i.gone.name != nearer.gone.name and i.comes.name != nearer.comes.name)
    ]
    if nearer is None:
        return current, twins, None
    names, was = [c.name for c in current.parts], current.hypothesis
    gone = was[names.index(nearer.gone.name)]
    return nearer.then, [Twin(nearer.comes.name, gone, (*fixed, *was)), *twins], _step(search, nearer)


def _nearest_of(search: Search, found: Sequence[Instead], tried: int) -> tuple[list[Instead], Instead | None]:
    """What does as well on data held out, too, as far as that was asked; and of it what is nearest to the description."""
    left = list(found)
    for one in sorted((i for i in found if i.nearer), key=lambda i: float(i.fitted.u @ i.fitted.u)):
        if not _worse(search, one, tried):
            return left, one
        left.remove(one)
    return left, None


def _worse(search: Search, found: Instead, tried: int) -> bool:
    """Whether another model is worse, on data that its fits had not seen, by more than leaving a term out may cost."""
    one, other = _held_out(search, found)
    return other.energy - one.energy > allowed_loss(search.problem, one.energy, one.cut, tried)


def _surely(search: Search, found: Instead, tried: int) -> bool:
    """Whether another model is better on data that its fits had not seen."""
    one, other = _held_out(search, found)
    return surely_better(search.problem, one, other, tried, Proposal((found.comes,)))


def _held_out(search: Search, found: Instead) -> list[HeldOut]:
    """The model and the other one judged on what is held out in the strictest way, their values fitted as far as takes them away
    from those that have seen it."""
    models = [(f.model, f.u) for f in (found.was, found.fitted)]
    widths = WIDTHS[2:] if len(found.was.u) >= LARGE else WIDTHS[1:]
    return cross_fit(search, models, strictest(search.problem), widths, short=AWAY)


def _step(search: Search, found: Instead) -> Rung:
    rung = refitted(search, found.then, found.comes.name, (found.gone.name,))
    rung.added = found.then.hypothesis[-1:]
    return rung
