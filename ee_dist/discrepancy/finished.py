"""What a search for improvements ends with: all values fitted once more, how sure they are, and what is left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ee_dist.discrepancy.evidence.holdout import PRIOR, prior_of
from ee_dist.discrepancy.evidence.intervals import ParameterReport, parameters
from ee_dist.discrepancy.evidence.left import Leftover, leftovers, may_be_noise, settled
from ee_dist.discrepancy.evidence.signs import either_sign
from ee_dist.discrepancy.evidence.together import flat_widths
from ee_dist.discrepancy.evidence.worth import worth_of
from ee_dist.discrepancy.examine import Current, Examined
from ee_dist.discrepancy.explain import NOTHING_MISSING, UNEXPLAINED
from ee_dist.discrepancy.ladder import Improvement, Rung, Twin
from ee_dist.discrepancy.left_as_guessed import beside_guesses
from ee_dist.discrepancy.search.candidates import values_of, with_room_left
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.described import as_far_as_there_is
from ee_dist.trials.log import Array

EXPLAINED, BETTER = "explained", "better_not_explained"


def finished(
    search: Search,
    current: Current,
    ladder: list[Rung],
    base: Array,
    stopped: str,
    last: Examined | None,
    twins: list[Twin],
    tried: int,
    no_farther: frozenset[str],
) -> Improvement:
    """The result of a search that climbed the ``ladder`` from the residual ``base`` (n,) and ``stopped`` with ``current``;
    ``last``: what was tried on top of it, ``tried``: of how many effects it chose; ``no_farther``:
    guesses that were given more room in vain."""
    problem = search.problem
    floor, source = problem.noise_floor()
    terms: Hypothesis = search.fixed
    told: list[ParameterReport] = []
    worth, left = None, leftovers(problem, base)
    residual = base
    if current.parts:
        then = (*search.fixed, *current.hypothesis)
        roomy = with_room_left(problem.robot, then, current.parts)
        current = Current(roomy, values_of(roomy, current.hypothesis))
        model = Model(current.parts)
        # Where only noise is left values are what the measurements say.
        prior = prior_of(search, [(model, current.u)]) - PRIOR
        fit = fit_one(search, model, [current.u], None, (*WIDTHS[2:], 0.006), prior)
        terms = as_far_as_there_is(problem.robot, (*search.fixed, *fit.hypothesis))
        fit = replace(fit, u=values_of(model.parts, terms[len(search.fixed) :]))
        residual = fit.residual
        left = leftovers(problem, residual)
        beside = beside_guesses(search, fit)
        reports = parameters(problem, fit, left, tried, either_sign(search, fit), flat_widths(search, fit), beside)
        told = [replace(p, term=p.term + len(search.fixed)) for p in reports]
        worth = worth_of(problem, fit, base)
    before, after = ladder[0].error_heldout, ladder[-1].error_heldout
    verdict = _verdict(len(ladder) > 1 or bool(current.parts), left, after, floor)
    return Improvement(
        verdict,
        taken_off(before, after, floor),
        ladder,
        terms,
        told,
        base,
        residual,
        floor,
        source,
        left,
        stopped,
        last,
        worth=worth,
        unsure=may_be_noise(problem, residual),
        twins=twins,
        judged_on=ladder[-1].held_out,
        no_farther=no_farther,
    )


def taken_off(before: float, after: float, floor: float) -> float:
    """The share of the squared error above the noise that went."""
    above = before**2 - floor**2
    return (before**2 - max(after, floor) ** 2) / above if above > 0 else 0.0


def _verdict(changed: bool, left: Sequence[Leftover], error_after: float, floor: float) -> str:
    if settled(left, error_after, floor):
        return EXPLAINED if changed else NOTHING_MISSING
    return BETTER if changed else UNEXPLAINED
