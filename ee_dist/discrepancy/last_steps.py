"""The end of improve: what these data do not tell leaves the model, a plainer effect or what does as well and is nearer to the
description comes in the place of another, and what is a little wrong everywhere is fitted anew beside what came."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import replace

from ee_dist.discrepancy.everywhere import AT_ONCE, everywhere, looked_for_at_once, stands_out
from ee_dist.discrepancy.evidence.holdout import cross_fit, held_out_by, travelling
from ee_dist.discrepancy.evidence.left import leftovers, settled
from ee_dist.discrepancy.examine import FAR, Current
from ee_dist.discrepancy.exchanges import at_one_place, nearest, refitted, strictest
from ee_dist.discrepancy.kinds import Everywhere
from ee_dist.discrepancy.ladder import Rung, Twin
from ee_dist.discrepancy.plainer import in_plain_terms
from ee_dist.discrepancy.pruning import without_neutral
from ee_dist.discrepancy.search.candidates import Candidate, values_of
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import LARGE
from ee_dist.discrepancy.told import told_only
from ee_dist.trials.log import Array

NOT_TOLD, IN_PLACE = "leaving out what is not told", "what does as well in its place"
"""What the search is at, for who waits."""


def last_steps(
    search: Search,
    current: Current,
    own: int,
    pool: Sequence[Candidate],
    climb: Callable[[Rung], None],
    spread: bool,
    seen: Sequence[tuple[Candidate, Array]],
    often: int,
    tried: AbstractSet[str],
) -> tuple[Current, list[Twin]]:
    """The model without what is not told, or the one that does as well and is nearer to the description, or better; and what does
    as well as an effect of it. Where what is a little wrong everywhere (``spread``) had stood in for an effect that only comes in
    its place here, it is fitted anew beside that, ``often`` times at most, and not beside what it was ``tried`` with before
    (names of effects), which would come to the same."""
    problem, robot, asked = search.problem, search.problem.robot, frozenset[str]()
    while True:
        plain = in_plain_terms(search.doing(NOT_TOLD), current, own, pool, strictest(problem))
        if plain.came:
            current, terms = plain.then, plain.then.hypothesis
            plainer = refitted(search, current, " + ".join(plain.came), plain.gone)
            plainer.added = terms[len(terms) - len(plain.came) :]
            climb(plainer)
        if spread or len(current.parts) - own > 1:
            current, asked = _told(search, current, own, len(pool), climb, spread)
        if len(current.parts) <= own + 1:
            return current, []
        before = {c.name for c in current.parts}
        current, twins, step = nearest(search.doing(IN_PLACE), current, own, pool, asked)
        found = None
        if step is None:
            if often:
                found = _beside_a_twin(search, current, own, pool, twins, seen)
        else:
            climb(step)
            came = [c for c in current.parts if c.name not in {*before, *tried} and stands_out(robot, c)]
            if spread and often and came:
                left = leftovers(problem, search.on(current.hypothesis).base())
                if not settled(left, step.error_heldout, problem.noise_floor()[0]):
                    some = looked_for_at_once(problem, pool)
                    found = everywhere(search.doing(AT_ONCE), current, own, some, held_out_by(problem), True, (), seen)
        if found is None:
            if not spread and len(current.u) < LARGE and (single := at_one_place(search, current, own)) is not None:
                current, step = single
                climb(step)
            if step is not None and (spread or len(current.parts) - own > 1):
                # Beside what came in the place of another, others may tell nothing any more.
                current, _ = _told(search, current, own, len(pool), climb, spread)
                stayed = {c.name for c in current.parts}
                twins = [t for t in twins if t.name in stayed]
            return current, twins
        often, current = often - 1, found.current
        for rung in found.rungs:
            climb(rung)


def _told(
    search: Search, current: Current, own: int, tried: int, climb: Callable[[Rung], None], spread: bool
) -> tuple[Current, frozenset[str]]:
    """The model without what is not told, and what of it another said. Of two that leave the same mark the values may be
    anything, and one of them says it all."""
    told = told_only(search.doing(NOT_TOLD), current, own, strictest(search.problem), tried, not spread)
    current, none = without_neutral(told.then, own)
    if told.gone or none:
        climb(refitted(search, current, "without what these data do not tell from neutral", (*told.gone, *none)))
    return current, told.instead


def _beside_a_twin(
    search: Search,
    current: Current,
    own: int,
    pool: Sequence[Candidate],
    twins: Sequence[Twin],
    seen: Sequence[tuple[Candidate, Array]],
) -> Everywhere | None:
    """Far from the noise what does as well as an effect of the model may be what is there, and all the rest stand in for it: what
    is a little wrong everywhere, fitted beside the first such that stands out; None where that is not better."""
    problem, by_name = search.problem, {c.name: c for c in (*pool, *current.parts)}
    able = [t for t in twins if t.term.name in by_name and stands_out(problem.robot, by_name[t.term.name])]
    left = search.on(current.hypothesis).base()
    if not able or not travelling(problem) or float(left @ left) <= FAR**2 * float(problem.floor.sum()):
        return None
    terms = able[0].terms[len(search.fixed) :]
    parts = tuple(by_name[t.name] for t in terms if t.name in by_name)
    if len(parts) < len(terms):
        return None
    twin = Current(parts, values_of(parts, terms))
    found = everywhere(search.doing(AT_ONCE), twin, own, pool, travelling(problem), True, (), seen)
    now = cross_fit(search, [(Model(current.parts), current.u)], strictest(problem))[0].energy
    if found is None or found.held >= now:
        return None
    step = refitted(search, twin, able[0].term.name, tuple(c.name for c in current.parts if c not in parts))
    step.added = tuple(t for t in terms if t.name not in {c.name for c in current.parts})
    return replace(found, rungs=[step, *found.rungs])
