"""What data that were not fitted must say of an effect, for it to earn its place: the same for every way of comparing."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.evidence.holdout import WINDOWS, Cut, HeldOut, bootstrap, travelling
from ee_dist.discrepancy.problem import Mask, Problem
from ee_dist.discrepancy.search.candidates import Proposal
from ee_dist.trials.log import Array

LEAST_SHARE = 0.002
"""Share of the starting energy that an effect must take off held-out data to be worth a term."""
LOST_SHARE = 0.3
"""An interval that reaches zero counts against an effect only where it makes some pieces of evidence worse by this share of
its gain: an effect that shows in one window of twenty, and harms none, is no less true for that."""
CAUTION = 2.0
"""By how much more an effect must gain than one did on an untouched robot: there the model's own error happened to look
like an effect, and on the next robot noise adds to it."""
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
MISTAKEN = 0.25
"""The same of what is the wrong way round, or in another's place, wherever more than noise is left: nobody would have missed it
for less, and people are sent to mend a file. On a UR5 of which one joint moved a reversed axis at another, which shook by a
millirad, took 18 % of what a soft model left."""
STARTS = 3.0
"""Standard deviations of what starts that are off do to a residual, beyond which it is not theirs."""
NOTHING = 1e-12
"""Energy that is none, to be divided by."""
LUCK = "its gain on held-out data is no more than luck"
AS_MUCH, OTHERS = 0.1, 1.5
"""Share of all that is left, and times what usual starts come to less, that these starts may come to less by."""
OF_STARTS = "what is left without it is no more than starts that are off may make"
MAY_BE_ZERO = "its gain on held-out data may be zero"
TOO_LITTLE = "it takes too little of what is above the noise"
TOO_LITTLE_ALONE = (
    f"a single motion is all the evidence, and it takes off less than {100 * ALONE:.0f} % of what is above the noise"
)


def least_energy(tried: int, parameters: int = 1) -> float:
    """Energy that the best of ``tried`` useless candidates may take off by luck, with a margin: the largest of that many
    chi-squared values with one degree of freedom is about 2 ln(tried), and every further parameter adds to it."""
    return 2.0 * math.log(max(tried, 2)) + 8.0 + 2.0 * parameters


def why_not(
    problem: Problem,
    cut: Cut,
    proposal: Proposal,
    before: Array,
    held: Array,
    tried: int,
    least: float = 1.0,
    which: Mask | None = None,
    tames: float = math.inf,
) -> str:
    """Why held-out energies (segments,) before and with a proposal do not speak for it, in the segments ``which`` (all):
    nothing if they do. ``least``: see judge. ``tames``: energy that it may take off by letting starts that are off do less."""
    chosen = np.ones(len(held), dtype=bool) if which is None else which
    units = np.unique(cut.unit_of[chosen])
    gained = cut.by_unit(before - held)[units]
    low, _ = bootstrap(gained, groups=cut.groups[units])
    values = chosen[problem.segment_of]
    total, gain, floor = float(before[chosen].sum()), float(gained.sum()), float(problem.floor[values].sum())
    dispersion = max(least, float(held[chosen].sum()) / int(values.sum()))
    # Where a model is wrong all over, useless effects take more off it by luck, in proportion.
    enough = least_energy(tried, max(1, proposal.size)) * dispersion + CAUTION * problem.gained
    counts = gain
    if problem.layout.by_segment:
        counts = max(min(gain, total - floor - _of_starts(problem)), gain - tames)
    if not np.isfinite(gain) or gain < enough:
        return LUCK
    if counts < enough:
        return OF_STARTS
    if may_be_zero(gained, low):
        return MAY_BE_ZERO
    worth = least_share(problem, cut, proposal, held)
    if gain < LEAST_SHARE * total or gain < worth * above_noise(problem, total, values):
        return TOO_LITTLE_ALONE if worth == ALONE else TOO_LITTLE
    return ""


def above_noise(problem: Problem, total: float, values: Mask | None = None) -> float:
    """What of an energy ``total``, of the residual ``values`` (n,; all), is more than noise. A floor that lies above all of it is
    known to be too high: there it is what is more than noise beyond doubt, lest nothing be there to explain and all do it."""
    chosen = slice(None) if values is None else values
    floor, sure = float(problem.floor[chosen].sum()), float(problem.sure[chosen].sum())
    return max(total - (floor if total > floor else sure), NOTHING)


def told_in(problem: Problem, found: HeldOut, without: Sequence[float], proposal: Proposal, tried: int) -> Mask:
    """(segments,) where the turn in which they are held out tells what a proposal's values are: where it takes off what is fitted
    there what it would have to take off elsewhere. ``without`` (fits,): energy that is left there without it.

    A limit that one kind of motion reaches has any value where that is held out, and foretells there what luck makes of it. That
    speaks neither for it nor against it."""
    told = np.zeros(len(problem.segments), dtype=bool)
    if found.cut.name == WINDOWS:
        return told
    for fit, before in zip(found.fits, without, strict=True):
        dispersion = max(1.0, fit.energy / max(1, int(fit.mask.sum())))
        enough = least_energy(tried, max(1, proposal.size)) * dispersion
        above = before - float(problem.floor[fit.mask].sum())
        if before - fit.energy >= max(enough, WORTH * above):
            told[np.unique(problem.segment_of[~fit.mask])] = True
    return told


def tamed(problem: Problem, found: HeldOut, total: float) -> float:
    """Energy of ``total`` that a model may take off by letting starts that are off do less than they do to the robot as it is
    described, were they all of it. A pole that rubs falls slower, whatever it truly does; a motor that is heavier *and* stiffer
    coasts as far on a wrong start, and what it takes off is its own."""
    floor = problem.floor_under(found.fixed)
    least = min((problem.floor_under((*found.fixed, *f.hypothesis)) for f in found.fits), default=floor)
    return total * (AS_MUCH + OTHERS * max(0.0, 1.0 - least / max(floor, NOTHING)))


def _of_starts(problem: Problem) -> float:
    """Energy by which starts that are off may be above what they are on average. Anything that holds a motion back lets them grow
    less, and goes below the floor: what it takes off there is no evidence for it."""
    known = np.bincount(problem.segment_of, weights=problem.layout.known)
    return STARTS * math.sqrt(2.0 * float(known @ known))


def least_share(problem: Problem, cut: Cut, proposal: Proposal, held: Array) -> float:
    """Share of what is above the noise that a proposal must take off, with which ``held`` (segments,) energies are left; nothing
    where that is no more than noise."""
    mistaken = any(c.effect.mistake for c in proposal.parts)
    if mistaken and not no_more_than_noise(problem, float(held.sum())):
        return MISTAKEN if cut.name != WINDOWS or travelling(problem) else ALONE
    if cut.name != WINDOWS:
        return WORTH
    if no_more_than_noise(problem, float(held.sum())) or travelling(problem):
        return 0.0
    expected = all(c.effect.everywhere and c.effect.family == "drive" for c in proposal.parts)
    return WORTH if expected else ALONE


def no_more_than_noise(problem: Problem, energy: float) -> bool:
    """Whether the energy of a held-out residual is that of noise, beyond doubt."""
    return energy <= NEAR**2 * float(problem.sure.sum())


def may_be_zero(gained: Array, low: float) -> bool:
    """Whether what pieces of evidence gained may be nothing. ``low``: the lower end of the interval of their sum."""
    return low <= 0 and lost(gained) > LOST_SHARE * float(gained.sum())


def lost(gained: Array) -> float:
    """Energy that pieces of evidence lose where the effect makes them worse."""
    return float(-np.minimum(gained, 0.0).sum())
