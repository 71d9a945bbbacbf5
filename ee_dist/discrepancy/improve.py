"""improve: add effects to a model, fit all of them together, drop those that a later one makes useless, and stop when none
earns its place on held-out data.

Earlier effects are fitted anew with each new one, because they have stood in for what was missing: damping fitted without
dry friction is twice what it should be.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Sequence

import numpy as np

from ee_dist.discrepancy.asked_for import to_be_added
from ee_dist.discrepancy.assumed import guesses_at_end, with_more_room
from ee_dist.discrepancy.base_model import residual_as_it_is
from ee_dist.discrepancy.everywhere import AT_ONCE, everywhere, looked_for_at_once, stands_out
from ee_dist.discrepancy.evidence.holdout import (
    Cut,
    HeldOut,
    cross_fit,
    held_out_by,
    travelling,
    windows,
)
from ee_dist.discrepancy.evidence.judge import Judged, judge
from ee_dist.discrepancy.evidence.left import leftovers, settled
from ee_dist.discrepancy.evidence.rule import LUCK, NEAR, no_more_than_noise
from ee_dist.discrepancy.examine import FAR, STANDARD_EFFORT, Current, Effort, Examined, examine
from ee_dist.discrepancy.exchanges import exchanged, refitted, twins_of
from ee_dist.discrepancy.explain import as_it_was, begin
from ee_dist.discrepancy.finished import finished
from ee_dist.discrepancy.ladder import UNFITTED, Improvement, Rung, Twin
from ee_dist.discrepancy.last_steps import last_steps
from ee_dist.discrepancy.problem import Problem, error, per_segment
from ee_dist.discrepancy.pruning import without_useless
from ee_dist.discrepancy.search.candidates import Candidate, Proposal, not_said, on_top_of, values_of
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.pool import as_long
from ee_dist.discrepancy.search.scan import scan
from ee_dist.discrepancy.search.screen import screen
from ee_dist.discrepancy.search.search import Progress, Search, quiet
from ee_dist.discrepancy.search.slopes import WIDTHS
from ee_dist.discrepancy.search.valley import LARGE
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.described import as_far_as_there_is
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

FEW = 1
"""Effects that the search adds before it looks whether much is a little wrong everywhere, if the next one does not do."""
OFTEN = 2
"""How often all that is a little wrong everywhere is fitted anew, once other effects have come beside it: beside several that
come at once, and again beside those of them that stay."""
REFUSED = 1
"""How often that may not earn its place before it is not looked for any more: it takes as long as all the rest."""
EXCHANGES = 2
"""How often an effect may be exchanged for what was tied with it."""
ROOMS = 3
"""How often bounds that depend on other values are set anew."""
RETURNS = 2
"""How often an effect may have been dropped and yet be looked at again: what came later may be dropped in turn."""
MOST = 24
"""Effects that are added at most unless told otherwise."""
REFUSALS = 2
"""How many steps may be refused because what is held out gets no better by them, before no other is looked for."""
NO_MORE = "no further effect earns its place: {why}"
NOR = "; nor does all that may be a little wrong everywhere, fitted at once"
WORSE = "with all values fitted anew, data held out are foretold no better"
MORE_ROOM = "with more room for what was guessed"
NOTHING_LEFT = "nothing is left that counts, above the noise and above the resolution at which channels are compared"
ONE_MORE = "one more effect"
"""What the search is at, for who waits."""


def improve(
    problem: Problem,
    pool: Sequence[Candidate],
    before: Hypothesis = (),
    wanted: Sequence[Candidate] | None = None,
    effort: Effort = STANDARD_EFFORT,
    most: int = MOST,
    progress: Progress = quiet,
    climbed: Callable[[Rung], None] | None = None,
) -> Improvement:
    """Add ``wanted`` (an empty list: fit only what the model has), or (None) whatever of ``pool`` earns its place, to the
    model ``before``; fit everything anew. What is wanted twice, or is in the model with free values, is not added again.
    ``climbed`` hears of every step of the ladder when it is taken."""
    as_it_is = residual_as_it_is(problem, before)
    search, current = begin(problem, before, progress)
    ladder = [_start("the model as it was", before, as_it_is, problem)]

    def climb(rung: Rung) -> None:
        rung.terms = as_far_as_there_is(problem.robot, rung.terms)
        if rung.reached is not None:
            rung.reached = as_far_as_there_is(problem.robot, rung.reached)
        ladder.append(rung)
        if climbed is not None:
            climbed(rung)

    if current.parts:
        climb(refitted(search, current))
    last: Examined | None = None
    own, twins, no_farther = len(current.parts), list[Twin](), frozenset[str]()
    if wanted is not None:
        new, stopped = to_be_added(problem.robot, current.parts, wanted)
        for c in new:
            judged = _asked(search, current, as_long(problem, c))
            current = Current(judged.model.parts, judged.u)
            climb(_rung(search, judged))
        current = _roomier(search, current, climb) or current
        no_farther = guesses_at_end(current.parts, current.u)
    else:
        exchanges, spread, anew, refused, nor = 0, 0, 0, 0, ""
        looked: set[str] | None = None
        beside: set[str] = set()
        tried_with: set[str] = set()
        seen: dict[str, tuple[Candidate, Array]] = {}
        worse: list[Proposal] = []
        stopped = f"{most} effect{'s were' if most > 1 else ' was'} added, which is as many as task.most allows"
        while sum(bool(r.added) for r in ladder) < most:
            has = (*search.fixed, *current.hypothesis)
            refused_too = {c.name for p in worse for c in p.parts}
            others = [c for c in _offered(problem.robot, pool, current, ladder) if c.name not in refused_too]
            others = on_top_of(problem.robot, has, others)
            last = examine(search.doing(ONE_MORE), current, others, effort, guesses_first=True)
            if own and len(current.parts) == own:
                kept = as_it_was(search, last, before, as_it_is, others, effort)
                if kept is not None:
                    last, current = kept, Current(current.parts, values_of(current.parts, before))
            best = last.best
            for j in last.judged:
                if j.earned and len(j.proposal.parts) == 1:
                    seen.setdefault(j.name, (j.proposal.parts[0], j.own))
            special = {c.name for c in current.parts[own:] if stands_out(problem.robot, c)}
            there = {c.name for c in current.parts}
            ready = anew < OFTEN and special != beside and bool(special) if spread else there != looked
            plain = best is not None and _seen_by_itself(best)
            if ready and not plain and refused < REFUSED and _many(search, last, len(current.parts) - own, spread > 0):
                alike = [(k, p.parts[0], u) for k, p, u in twins_of(current, ladder, own)]
                at_once, some = search.doing(AT_ONCE), looked_for_at_once(problem, pool)
                tried_with |= special
                found = everywhere(
                    at_once, current, own, some, held_out_by(problem), spread > 0, alike, [*seen.values()], best
                )
                looked = there
                # Where a single one does more than all of them and it together, it goes first.
                if found is None or best is None or found.held < float(best.held.sum()):
                    anew, beside = anew + (spread > 0), special
                    if found is not None:
                        current, spread = found.current, spread + 1
                        for rung in found.rungs:
                            climb(rung)
                        continue
                    refused += 1
                else:
                    looked = there | {c.name for c in best.proposal.parts}
                nor = NOR if found is None else ""
            if best is None:
                other = None
                if exchanges < EXCHANGES and len(current.u) < LARGE and leftovers(problem, last.base):
                    exchanges += 1
                    other = exchanged(search, current, ladder, own, pool, effort)
                if other is not None:
                    current, rung = other
                    climb(rung)
                    continue
                # Beside all that came since, a guess may be farther off than it could go when it was put right.
                if (wider := _roomier(search, current, climb)) is not None:
                    current = wider
                    continue
                no_farther = guesses_at_end(current.parts, current.u)
                why_not = WORSE if worse else last.judged[0].why_not if last.judged else LUCK
                stopped = NO_MORE.format(why=why_not) + ("" if spread else nor)
                if settled(leftovers(problem, last.base), ladder[-1].error_heldout, problem.noise_floor()[0]):
                    stopped = NOTHING_LEFT
                break
            model, start = best.model, best.u
            if len(model.parts) == len(best.proposal.parts):
                # It was judged on top of a model that stayed as it was.
                model, start = Model((*current.parts, *model.parts)), np.concatenate([current.u, start])
            fit = _with_room(search, fit_one(search, model, [start], None, WIDTHS[2:]))
            before_it, current = current, Current(fit.model.parts, fit.u)
            rung = _rung(search, best, [j.name for j in last.tied[1:]])
            # Shown are the values of a fit of all data, which the model keeps; the errors are those of data held out.
            rung.terms = (*search.fixed, *current.hypothesis)
            rung.added = current.hypothesis[len(current.parts) - len(best.proposal.parts) :]
            rung.alternatives = [(j.proposal, j.own) for j in last.tied[1:] if j.earned]
            cut = best.outcome.cut
            current, rung.dropped = without_useless(search, current, own, len(best.proposal.parts), cut, len(pool))
            if rung.dropped:
                # What is left was fitted anew: who keeps the model of this step, or reads its values, gets those.
                rung.reached = (*search.fixed, *current.hypothesis)
                rung.added = current.hypothesis[len(current.parts) - len(best.proposal.parts) :]
            _as_it_stands(search, current, cut, rung)
            no_better = rung.held_out == ladder[-1].held_out and rung.error_heldout >= ladder[-1].error_heldout
            # Beside a model that only goes along it was worth its place, and not where all values may follow the motions that
            # are fitted.
            why = WORSE if no_better else problem.never_moves((*search.fixed, *current.hypothesis))
            if why:
                worse.append(best.proposal)
                current = before_it
                if len(worse) < REFUSALS:
                    continue
                stopped = NO_MORE.format(why=why)
                break
            climb(rung)
        current, twins = last_steps(
            search, current, own, pool, climb, spread > 0, [*seen.values()], OFTEN - anew, tried_with
        )
    tried = 0 if wanted is not None else len(pool)
    return finished(search, current, ladder, as_it_is, stopped, last, twins, tried, no_farther)


def _roomier(search: Search, current: Current, climb: Callable[[Rung], None]) -> Current | None:
    """The model with more room for guesses that ended at an end of theirs, as a step of the ladder; None where that is not worth
    one."""
    wider = with_more_room(search, current.parts, current.u)
    if wider is None:
        return None
    found = Current(wider.parts, wider.u)
    climb(refitted(search, found, MORE_ROOM))
    return found


def _with_room(search: Search, fit: Fit) -> Fit:
    """A joint may have less of what all share by as much as that is. Where it has taken off all that was there when it was looked
    for, and all share more by now, it may take off that too."""
    robot = search.problem.robot
    for _ in range(ROOMS):
        parts, terms = fit.model.parts, fit.hypothesis
        now = on_top_of(robot, (*search.fixed, *terms), parts)
        at_end = [np.any(fit.u[p] <= c.lower + 1e-6) for p, c in zip(fit.model.places, parts, strict=True)]
        less = [end and w.bounds < c.bounds for end, w, c in zip(at_end, now, parts, strict=True)]
        if not any(less):
            break
        wider = tuple(w if more else c for more, w, c in zip(less, now, parts, strict=True))
        fit = fit_one(search, Model(wider), [values_of(wider, terms)], None, WIDTHS[2:])
    return fit


def _offered(robot: Robot, pool: Sequence[Candidate], current: Current, ladder: Sequence[Rung]) -> list[Candidate]:
    """What may be added: what is not there yet, and was not dropped as often as that. Two that stand in for one another would
    take turns to the end."""
    dropped = Counter(name for rung in ladder for name in rung.dropped)
    return [c for c in not_said(robot, current.parts, pool) if dropped[c.name] < RETURNS]


def _seen_by_itself(best: Judged) -> bool:
    """Whether commands and positions show it without a model: a stop is none of the small things that are wrong everywhere, which
    would stand in for it (a command gain of a half, in the place of a joint that ends there)."""
    return any(c.effect.seen_at is not None and c.hint for c in best.proposal.parts)


def _many(search: Search, found: Examined, added: int, spread: bool) -> bool:
    """Whether much is left although the search had its chance with few effects; or, when no single one is left that stands out,
    anything that counts, and where that is known to be ``spread`` over many places whatever is above the noise."""
    best, problem = found.best, search.problem
    # Windows of a single motion are weak evidence for so many values: few are looked for, and only where no single one is left.
    if best is not None and (added < FEW or not travelling(problem)):
        return False
    energy, noise = float((found.base**2).sum() if best is None else best.held.sum()), float(problem.floor.sum())
    if best is not None:
        return energy > FAR**2 * noise
    if spread:
        return energy > NEAR**2 * noise
    return not settled(leftovers(problem, found.base), error(found.base), problem.noise_floor()[0])


def _start(name: str, terms: Hypothesis, residual: Array, problem: Problem) -> Rung:
    e = error(residual)
    return Rung(name, (), terms, e, e, per_segment(problem, residual), UNFITTED)


def _as_it_stands(search: Search, current: Current, cut: Cut, rung: Rung) -> None:
    """Errors of a step from fits of the whole model that is left after it, so that steps compare: where it was judged what the
    model had before went along by its slopes alone."""
    (held,) = cross_fit(search, [(Model(current.parts), current.u)], cut)
    rung.error_fit, rung.error_heldout = float(np.sqrt(held.seen)), error(held.residual)
    rung.held = per_segment(search.problem, held.residual)


def _asked(search: Search, current: Current, c: Candidate) -> Judged:
    """An effect that was asked for, from the best start that a scan finds, whatever it is worth."""
    now = search.on(current.hypothesis)
    scanned = scan(now, screen(now, [c]))
    start = scanned[0].starts[0] if scanned else np.zeros(c.size)
    model = Model((*current.parts, c))
    fit = fit_one(search, model, [np.concatenate([current.u, start])])
    cut = windows(search.problem)
    held: list[HeldOut] = []
    for each in (cut, *travelling(search.problem)):
        held.append(cross_fit(search, [(model, fit.u)], each)[0])
    problem = search.problem
    near = no_more_than_noise(problem, float((held[0].residual ** 2).sum()))
    chosen = held[0] if near or len(held) == 1 else held[1]
    without = search.on(current.hypothesis).base()
    if current.parts:
        without = cross_fit(search, [(Model(current.parts), current.u)], chosen.cut)[0].residual
    judged = judge(problem, without, chosen, Proposal((c,)), model, 2)
    judged.u = fit.u
    return judged


def _rung(search: Search, judged: Judged, ties: Sequence[str] = ()) -> Rung:
    return Rung(
        judged.name,
        judged.terms,
        (*search.fixed, *judged.hypothesis),
        judged.error_fit,
        judged.error_heldout,
        judged.held,
        judged.held_out,
        judged.interval,
        list(ties),
    )
