"""What an effect is worth on data it was not fitted to, and which effects cannot be told apart there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ee_dist.discrepancy.evidence.holdout import WINDOWS, HeldOut, bootstrap
from ee_dist.discrepancy.evidence.intervals import BOUND, at_bound, half_widths
from ee_dist.discrepancy.evidence.rule import (
    NEAR,
    NOTHING,
    OF_STARTS,
    WORTH,
    above_noise,
    least_energy,
    least_share,
    may_be_zero,
    tamed,
    told_in,
    why_not,
)
from ee_dist.discrepancy.problem import Problem, error, per_segment
from ee_dist.discrepancy.search.candidates import Candidate, Proposal
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

TIE_ENERGY = 9.0
"""Two explanations closer than this (3 standard deviations, squared) on held-out data are not told apart."""
APART = 6.0
"""Held-out energy of an explanation, over that of another, from which it is no other explanation of the same."""
NONE = 1e-9
"""Share of its range at which a value is neutral."""
HALF = 0.5
"""Share of what many numbers at sound parts take off that fewer guesses must take off to be told before them."""
FULLER = 0.8
"""Share of what a law leaves above the noise that the same with a further term must leave at most, to go before it in a tie."""
VAGUE = "none of its numbers is told from neutral; a plainer effect explains as much for each of its own"
FEW_SHOW = "only some of the {kinds} tell its value: record more that show it"


def does_nothing(values: Array) -> bool:
    """Whether all values (shares of their ranges, neutral at 0) of an effect are at neutral; one that is no number counts so."""
    return not np.abs(values).max() > NONE


def at_work(model: Model, u: Array, first: int) -> list[int]:
    """Numbers of the parts that are not at neutral with these values (P,), and of the ``first`` few and those without values."""
    places = model.places
    return [k for k, c in enumerate(model.parts) if k < first or not c.size or not does_nothing(u[places[k]])]


@dataclass(eq=False)
class Judged:
    """One proposal on top of a model, both fitted together. Errors are root mean squares of residual values; ``gain`` and
    ``interval`` are shares of the held-out energy that it takes off, ``explained`` the share of what is above the noise;
    ``held`` (segments,) is the held-out energy, ``residual`` (n,) the held-out residual; ``u`` the values of the whole model."""

    proposal: Proposal
    model: Model
    u: Array
    error_fit: float
    error_heldout: float
    gain: float
    explained: float
    interval: tuple[float, float]
    held: Array
    residual: Array
    outcome: HeldOut
    dispersion: float
    error_without: float = math.nan
    """The held-out error of the model without the proposal, under the same cut."""
    sure: float = 0.0
    """What of the energy is noise beyond doubt."""
    why_not: str = ""
    vague: bool = False
    """Whether it has several numbers of which these data tell none from neutral: it patches what others say plainly."""
    partly: bool = False
    """Whether it earned its place in some turns alone, since nothing that was fitted in the others shows it."""
    rank: int = 0
    tied_with: list[str] = field(default_factory=list)

    @property
    def earned(self) -> bool:
        return not self.why_not

    @property
    def stands(self) -> bool:
        """Whether data do not speak against it: it earned its place, or would have if it said less."""
        return self.earned or self.why_not == VAGUE

    @property
    def held_out(self) -> str:
        """What was held out."""
        return self.outcome.cut.name

    @property
    def terms(self) -> Hypothesis:
        """The proposal with its fitted values."""
        return self.model.hypothesis(self.u)[len(self.model.parts) - len(self.proposal.parts) :]

    @property
    def hypothesis(self) -> Hypothesis:
        """All free terms of the model, the proposal's last."""
        return self.model.hypothesis(self.u)

    @property
    def candidate(self) -> Candidate:
        return self.proposal.parts[-1]

    @property
    def own(self) -> Array:
        """The fitted u of the proposal."""
        return self.u[len(self.u) - self.proposal.size :]

    @property
    def none_in_it(self) -> bool:
        """Whether an effect of it does nothing by its values: without that it is the same."""
        places = [p for p in Model(self.proposal.parts).places if p.stop > p.start]
        return any(does_nothing(self.own[p]) for p in places)

    @property
    def name(self) -> str:
        return self.proposal.name


def judge(
    problem: Problem,
    base: Array,
    found: HeldOut,
    proposal: Proposal,
    model: Model,
    tried: int,
    least: float = 1.0,
    fitted: Sequence[float] = (),
) -> Judged:
    """``base`` (n,): held-out residual of the model without the proposal, under the same cut. ``least``: mean square of a
    residual value from which it counts: 1, the resolution at which channels are compared, or less where noise is less.
    ``fitted`` (fits,): energy that the model without the proposal leaves, in each turn, of what is fitted there."""
    cut = found.cut
    before, held = per_segment(problem, base), per_segment(problem, found.residual)
    gained = cut.by_unit(before - held)
    low, high = bootstrap(gained, groups=cut.groups)
    total, gain = float(before.sum()), float(gained.sum())
    above = above_noise(problem, total)
    why = why_not(problem, cut, proposal, before, held, tried, least)
    if why == OF_STARTS:
        why = why_not(problem, cut, proposal, before, held, tried, least, tames=tamed(problem, found, total))
    partly = False
    if why and fitted:
        told = told_in(problem, found, fitted, proposal, tried)
        if told.any() and not told.all():
            partly = not why_not(problem, cut, proposal, before, held, tried, least, told)
            why = "" if partly else why
    dispersion = max(least, float(held.sum()) / len(base))
    values = np.mean([f.u for f in found.fits], axis=0) if _agree(found) else _best(found)
    share = total if total > 0 else 1.0
    explained = 0.0 if above <= NOTHING else gain / above
    if not math.isfinite(gain):
        explained = -math.inf
    return Judged(
        proposal=proposal,
        model=model,
        u=values,
        error_fit=math.sqrt(max(found.seen, 0.0)),
        error_heldout=error(found.residual) if np.isfinite(found.residual).all() else math.inf,
        gain=gain / share if math.isfinite(gain) else -math.inf,
        explained=explained,
        interval=(low / share, high / share),
        held=held,
        residual=found.residual,
        outcome=found,
        dispersion=dispersion if math.isfinite(dispersion) else 1.0,
        error_without=error(base),
        sure=float(problem.sure.sum()),
        why_not=why,
        vague=_vague(problem, found, proposal),
        partly=partly,
    )


def surely_better(problem: Problem, one: HeldOut, other: HeldOut, tried: int, came: Proposal | None = None) -> bool:
    """Whether of two models judged under one cut the ``other`` is better by what a new effect must be worth. Where much is left,
    some model always does a little better by chance; and where a single motion is all the evidence, most effects take something
    off it: what only ``came`` with the other model must be worth as much there as any."""
    cut, before, after = one.cut, per_segment(problem, one.residual), per_segment(problem, other.residual)
    gained = cut.by_unit(before - after)
    gain, energy = float(gained.sum()), float(before.sum())
    if not np.isfinite(gain) or gain < least_energy(tried) * max(1.0, energy / len(problem.floor)):
        return False
    if cut.name == WINDOWS:
        share = 0.0 if came is None else least_share(problem, cut, came, after)
        return gain >= share * (energy - float(problem.floor.sum()))
    low, _ = bootstrap(gained, groups=cut.groups)
    return not may_be_zero(gained, low) and gain >= WORTH * (energy - float(problem.floor.sum()))


def _vague(problem: Problem, found: HeldOut, proposal: Proposal) -> bool:
    if len(proposal.parts) > 1 or proposal.size < 2 or not found.fits:
        return False
    for fit in found.fits:
        half = half_widths(problem, fit)[-proposal.size :]
        if (np.abs(fit.u[-proposal.size :]) > half).any():
            return False
    return True


def _agree(found: HeldOut) -> bool:
    values = np.array([f.u for f in found.fits])
    return bool(values.size) and float(np.ptp(values, axis=0).max()) < 0.05


def _best(found: HeldOut) -> Array:
    return min(found.fits, key=lambda f: f.energy / max(1, int(f.mask.sum()))).u


def ranked(found: Sequence[Judged]) -> list[Judged]:
    """Best held-out energy first, those that earned their place before the others; ties are named, and of those that are
    tied with the best the one with the fewest numbers goes first: a richer law can always mimic a simpler one, and what is it
    and more is no other explanation. What is not told for its vague numbers alone may be true all the same, and is named in
    ties."""
    for j in found:
        if j.vague and j.earned and any(_plainer(k, j) for k in found):
            j.why_not = VAGUE
    ordered = sorted(found, key=lambda j: (not j.earned, float(j.held.sum())))
    for k, j in enumerate(ordered):
        j.tied_with, j.rank = [], k
    for a, one in enumerate(ordered):
        for other in ordered[a + 1 :]:
            if one.stands and other.stands and (one.earned or other.earned) and tied(one, other):
                one.tied_with.append(other.name)
                other.tied_with.append(one.name)
    if ordered:
        # Of explanations that data do not tell apart the one with the fewest numbers says the least that is not known.
        best = ordered[0]
        # Few motions tie nearly all: what takes off less than half as much is named, and does not go first for being short.
        as_good = [j for j in ordered[1:] if j.gain >= HALF * best.gain]
        same = [best, *(j for j in as_good if j.earned and j.name in best.tied_with)]
        # Of as many, a number that was only assumed is blamed before parts that somebody vouched for.
        first = min(same, key=_least_said)
        # What was only guessed at is asked for before as many numbers that are tied with it, be these tied with a better one too.
        asked = [
            j
            for j in ordered
            if j.earned and j.name in first.tied_with and j.proposal.guess and j.proposal.size <= first.proposal.size
        ]
        first = min((first, *asked), key=_least_said)
        # Nor do a dozen numbers at parts that somebody vouched for go before a few of guesses that take off half as much, unless
        # as few at such parts take off more: then many are only that at each place by itself.
        fewer = [
            j
            for j in ordered
            if j.earned
            and j.proposal.guess
            and j.proposal.size < first.proposal.size
            and j.gain >= HALF * first.gain
            and not any(_as_few_do_more(k, j) for k in ordered)
        ]
        sooner = bool(fewer) and not first.proposal.guess
        if sooner:
            first = max(fewer, key=lambda j: j.gain)
        both = [j for j in ordered if j.name in first.tied_with and _fuller(j, first, ordered)]
        first = min(both, key=_left, default=first)
        if first is not best and not sooner:
            # What is tied with either may be it.
            others = dict.fromkeys([*first.tied_with, best.name, *best.tied_with])
            first.tied_with = [name for name in others if name != first.name]
        more = {j.name for j in ordered if contains(j, first) or (contains(first, j) and first.none_in_it)}
        first.tied_with = [name for name in first.tied_with if name not in more]
        ordered.remove(first)
        ordered.insert(0, first)
    for k, j in enumerate(ordered):
        j.rank = k + 1
    return ordered


def contains(one: Judged, other: Judged) -> bool:
    """Whether one is the other and more: no other explanation, unless more pays."""
    names, fewer = ({c.name for c in j.proposal.parts} for j in (one, other))
    return fewer < names


def _left(j: Judged) -> float:
    """Share of what is above the noise that is left with it."""
    return 1.0 - j.explained


def _fuller(j: Judged, first: Judged, found: Sequence[Judged]) -> bool:
    """Whether it is the same and more, and takes off a part of what that leaves. With a handful of motions nothing is sure: the
    further term may be none, and yet foretells better on the whole. Of two that are tied what has both needs no lot drawn between
    them, where it takes off the tenth that any effect must. However little it takes off where the other ended at the end
    of its range, and it does not: that range is too small, or the effect is another."""
    if not j.earned or not contains(j, first) or float(first.held.sum()) <= NEAR**2 * first.sure:
        return False
    share = FULLER
    if _at_its_end(first) and not _at_its_end(j):
        share = 1.0
    elif _needs_no_choice(j, first, found):
        share = 1.0 - WORTH
    return _left(j) <= share * _left(first)


def _needs_no_choice(j: Judged, first: Judged, found: Sequence[Judged]) -> bool:
    """Whether all that it is more than ``first`` is by itself tied with that."""
    more = {c.name for c in j.proposal.parts} - {c.name for c in first.proposal.parts}
    return any(k.earned and k.name in first.tied_with and {c.name for c in k.proposal.parts} == more for k in found)


def _at_its_end(j: Judged) -> bool:
    """Whether a value of the proposal ended where it may not go farther, in some turn."""
    return any(
        at_bound(c, k, float(u)) == BOUND
        for fit in j.outcome.fits
        for c, place in zip(fit.model.parts, fit.model.places, strict=True)
        if c in j.proposal.parts
        for k, u in enumerate(fit.u[place])
    )


def _as_few_do_more(one: Judged, guess: Judged) -> bool:
    """Whether one that guesses at nothing says no more than a guess, and is better than it beyond what may be luck."""
    few = one.earned and not one.proposal.guess and one.proposal.size <= guess.proposal.size
    return few and one.gain > guess.gain and guess.name not in one.tied_with


def _least_said(j: Judged) -> tuple[int, bool, int]:
    return j.proposal.size, not j.proposal.guess, j.rank


def _plainer(one: Judged, vague: Judged) -> bool:
    """Whether an effect whose numbers are told explains as much for each of them as a vague one does for each of its own."""
    return one.earned and not one.vague and one.explained * vague.proposal.size >= vague.explained * one.proposal.size


def tied(one: Judged, other: Judged) -> bool:
    """Whether held-out data cannot tell which is better: the difference is small, or its interval holds zero. Of few pieces an
    interval holds nearly anything, but not that what leaves many times as much is as good."""
    less, more = sorted(float(j.held.sum()) for j in (one, other))
    if more > APART * max(less, float(one.sure)):
        return False
    gap = one.outcome.cut.by_unit(other.held - one.held)
    if not np.isfinite(gap).all():
        return False
    low, high = bootstrap(gap, seed=1)
    return abs(float(gap.sum())) < TIE_ENERGY * max(one.dispersion, 1.0) or low <= 0 <= high
