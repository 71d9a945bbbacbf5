"""The rule of evidence, the same for every way of comparing: what an effect is worth on data it was not fitted to, and
which effects cannot be told apart there."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ee_dist.discrepancy.evidence.holdout import WINDOWS, Cut, HeldOut, bootstrap, travelling
from ee_dist.discrepancy.evidence.intervals import half_widths
from ee_dist.discrepancy.problem import Problem, error, per_segment
from ee_dist.discrepancy.search.candidates import Candidate, Proposal
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

LEAST_SHARE = 0.002
"""Share of the starting energy that an effect must take off held-out data to be worth a term."""
LOST_SHARE = 0.3
"""An interval that reaches zero counts against an effect only where it makes some pieces of evidence worse by this share of
its gain: an effect that shows in one window of twenty, and harms none, is no less true for that."""
CAUTION = 2.0
"""By how much more an effect must gain than one did on an untouched robot: there the model's own error happened to look
like an effect, and on the next robot noise adds to it."""
TIE_ENERGY = 9.0
"""Two explanations closer than this (3 standard deviations, squared) on held-out data are not told apart."""
APART = 6.0
"""Held-out energy of an explanation, over that of another, from which it is no other explanation of the same."""
WORTH = 0.1
"""Share of the squared error above the noise floor that an effect must take off where more than noise is left with it.
Where a model is wrong in ways that no effect describes (another simulator, resampled records), some effect always takes a
little of it, surely and wrongly."""
NEAR = 1.1
"""Error, over what is noise beyond doubt, up to which windows of the same motions are evidence enough: no more than noise is
left. A floor that is only an upper bound makes no evidence weaker."""
ALONE = 0.3
"""The same where a single motion is all the evidence, but for what a robot's description leaves open (friction, rotors and gains
of the drives). Windows of one motion share what a model gets wrong in it, and something always takes part of that: on a real arm
without a load (UR10e) a payload takes 21 %, and a heavier last link as much."""
FULLER = 0.8
"""Share of what a law leaves above the noise that the same with a further term must leave at most, to go before it in a tie."""
STARTS = 3.0
"""Standard deviations of what starts that are off do to a residual, beyond which it is not theirs."""
LUCK = "its gain on held-out data is no more than luck"
MAY_BE_ZERO = "its gain on held-out data may be zero"
TOO_LITTLE = "it takes too little of what is above the noise"
VAGUE = "none of its numbers is told from neutral; a plainer effect explains as much for each of its own"


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
    sure: float = 0.0
    """What of the energy is noise beyond doubt."""
    why_not: str = ""
    vague: bool = False
    """Whether it has several numbers of which these data tell none from neutral: it patches what others say plainly."""
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
    def name(self) -> str:
        return self.proposal.name


def least_energy(tried: int, parameters: int = 1) -> float:
    """Energy that the best of ``tried`` useless candidates may take off by luck, with a margin: the largest of that many
    chi-squared values with one degree of freedom is about 2 ln(tried), and every further parameter adds to it."""
    return 2.0 * math.log(max(tried, 2)) + 8.0 + 2.0 * parameters


def judge(
    problem: Problem,
    base: Array,
    found: HeldOut,
    proposal: Proposal,
    model: Model,
    tried: int,
    least: float = 1.0,
) -> Judged:
    """``base`` (n,): held-out residual of the model without the proposal, under the same cut. ``least``: mean square of a
    residual value from which it counts: 1, the resolution at which channels are compared, or less where noise is less."""
    cut = found.cut
    before, held = per_segment(problem, base), per_segment(problem, found.residual)
    gained = cut.by_unit(before - held)
    low, high = bootstrap(gained, groups=cut.groups)
    total, gain = float(before.sum()), float(gained.sum())
    floor = float(problem.floor.sum())
    dispersion = max(least, float(held.sum()) / len(base))
    # Where a model is wrong all over, useless effects take more off it by luck, in proportion.
    enough = least_energy(tried, max(1, proposal.size)) * dispersion + CAUTION * problem.gained
    above = max(total - floor, 1e-12)
    counts = min(gain, total - floor - _of_starts(problem)) if problem.layout.by_segment else gain
    why = ""
    if not np.isfinite(gain) or counts < enough:
        why = LUCK
    elif _may_be_zero(gained, low):
        why = MAY_BE_ZERO
    elif gain < LEAST_SHARE * total or gain < _worth(problem, cut, proposal, held) * above:
        why = TOO_LITTLE
    values = np.mean([f.u for f in found.fits], axis=0) if _agree(found) else _best(found)
    share = total if total > 0 else 1.0
    return Judged(
        proposal=proposal,
        model=model,
        u=values,
        error_fit=math.sqrt(max(found.seen, 0.0)),
        error_heldout=error(found.residual) if np.isfinite(found.residual).all() else math.inf,
        gain=gain / share if math.isfinite(gain) else -math.inf,
        explained=(gain / above if total > floor else 0.0) if math.isfinite(gain) else -math.inf,
        interval=(low / share, high / share),
        held=held,
        residual=found.residual,
        outcome=found,
        dispersion=dispersion if math.isfinite(dispersion) else 1.0,
        sure=float(problem.sure.sum()),
        why_not=why,
        vague=_vague(problem, found, proposal),
    )


def _of_starts(problem: Problem) -> float:
    """Energy by which starts that are off may be above what they are on average. Anything that holds a motion back lets them grow
    less, and goes below the floor: what it takes off there is no evidence for it."""
    known = np.bincount(problem.segment_of, weights=problem.layout.known)
    return STARTS * math.sqrt(2.0 * float(known @ known))


def surely_better(problem: Problem, one: HeldOut, other: HeldOut, tried: int) -> bool:
    """Whether of two models judged under one cut the ``other`` is better by what a new effect must be worth. Where much is left,
    some model always does a little better by chance."""
    cut, before, after = one.cut, per_segment(problem, one.residual), per_segment(problem, other.residual)
    gained = cut.by_unit(before - after)
    gain, energy = float(gained.sum()), float(before.sum())
    if not np.isfinite(gain) or gain < least_energy(tried) * max(1.0, energy / len(problem.floor)):
        return False
    if cut.name == WINDOWS:
        return True
    low, _ = bootstrap(gained, groups=cut.groups)
    return not _may_be_zero(gained, low) and gain >= WORTH * (energy - float(problem.floor.sum()))


def _worth(problem: Problem, cut: Cut, proposal: Proposal, held: Array) -> float:
    """Share of what is above the noise that a proposal must take off; nothing where no more than noise is left with it."""
    if cut.name != WINDOWS:
        return WORTH
    if no_more_than_noise(problem, float(held.sum())) or travelling(problem):
        return 0.0
    expected = all(c.effect.everywhere and c.effect.family == "drive" for c in proposal.parts)
    return WORTH if expected else ALONE


def no_more_than_noise(problem: Problem, energy: float) -> bool:
    """Whether the energy of a held-out residual is that of noise, beyond doubt."""
    return energy <= NEAR**2 * float(problem.sure.sum())


def _vague(problem: Problem, found: HeldOut, proposal: Proposal) -> bool:
    if len(proposal.parts) > 1 or proposal.size < 2 or not found.fits:
        return False
    for fit in found.fits:
        half = half_widths(problem, fit)[-proposal.size :]
        if (np.abs(fit.u[-proposal.size :]) > half).any():
            return False
    return True


def _may_be_zero(gained: Array, low: float) -> bool:
    """Whether what pieces of evidence gained may be nothing. ``low``: the lower end of the interval of their sum."""
    return low <= 0 and lost(gained) > LOST_SHARE * float(gained.sum())


def lost(gained: Array) -> float:
    """Energy that pieces of evidence lose where the effect makes them worse."""
    return float(-np.minimum(gained, 0.0).sum())


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
        same = [best, *(j for j in ordered[1:] if j.earned and j.name in best.tied_with)]
        # Of as many, a number that was only assumed is blamed before parts that somebody vouched for.
        first = min(same, key=_least_said)
        # What was only guessed at is asked for before as many numbers that are tied with it, be these tied with a better one too.
        asked = [
            j
            for j in ordered
            if j.earned and j.name in first.tied_with and j.proposal.guess and j.proposal.size <= first.proposal.size
        ]
        first = min((first, *asked), key=_least_said)
        first = min((j for j in ordered if j.name in first.tied_with and _fuller(j, first)), key=_left, default=first)
        if first is not best:
            # What is tied with either may be it.
            others = dict.fromkeys([*first.tied_with, best.name, *best.tied_with])
            first.tied_with = [name for name in others if name != first.name]
        more = {j.name for j in ordered if contains(j, first)}
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


def _fuller(j: Judged, first: Judged) -> bool:
    """Whether it is the same and more, and takes off a part of what that leaves. With a handful of motions nothing is sure: the
    further term may be none, and yet foretells better on the whole."""
    if not j.earned or not contains(j, first):
        return False
    return float(first.held.sum()) > NEAR**2 * first.sure and _left(j) <= FULLER * _left(first)


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
