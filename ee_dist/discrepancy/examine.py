"""One step of the search, the same for explain and improve: which effect, on top of the model so far, explains most.

Screen all candidates, scan the promising over their range, fit the best of them quickly, then fit these together with what
the model has already and judge them on data that the fits had not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from ee_dist.discrepancy.assumed import assumed_drives
from ee_dist.discrepancy.brief import briefly, in_brief
from ee_dist.discrepancy.evidence.by_joint import gains_of
from ee_dist.discrepancy.evidence.holdout import Cut, cross_fit, travelling, windows
from ee_dist.discrepancy.evidence.judge import FEW_SHOW, Judged, judge, ranked
from ee_dist.discrepancy.evidence.left import Leftover, leftovers
from ee_dist.discrepancy.evidence.rule import least_energy, no_more_than_noise
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.run_through import that_hold_run_through
from ee_dist.discrepancy.search.candidates import Candidate, Proposal, possible
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.pool import held_still
from ee_dist.discrepancy.search.refit import Refit
from ee_dist.discrepancy.search.scan import Scanned, scan
from ee_dist.discrepancy.search.screen import Screened, screen
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS, follow_slopes, slopes_at
from ee_dist.discrepancy.search.trials import busiest, calm_trials, telling
from ee_dist.discrepancy.search.valley import LARGE
from ee_dist.discrepancy.several import families, pairs
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.groups import WHOLE
from ee_dist.trials.log import Array

FAR = 2.0
"""Error over the noise floor of the best quick fit from which windows of the same motions need not even be looked at."""
NEARLY = 1.2
"""The same where starts of windows make the floor: noise is little of it, and of other windows nothing more is to be had."""
WORTH_JUDGING = 0.4
"""Share of what the best quick fit takes off that another must take off to be judged beside it, unless it is among the first
AT_LEAST."""
AT_LEAST = 4
MOST_OF_IT = 0.5
"""Share of what is above the noise that guesses put right may leave, for nothing else to be looked at before."""
Looked = TypeVar("Looked", Screened, Scanned)
MANY_JOINTS = 3
"""Joints from which an effect at each of them is judged joint by joint too."""


@dataclass(frozen=True)
class Effort:
    """How much is tried. ``shares``: sizes of the probes; ``first``: candidates that are scanned over their range;
    ``second``: those of them that get a quick fit, from ``starts`` points each; ``final``: those fitted out and judged."""

    shares: tuple[float, ...] = (0.1, 0.6)
    first: int = 20
    second: int = 9
    starts: int = 2
    final: int = 6


STANDARD_EFFORT = Effort()


@dataclass(frozen=True, eq=False)
class Current:
    """The model so far: free parts and their values u on top of what the search has fixed."""

    parts: tuple[Candidate, ...] = ()
    u: Array = field(default_factory=lambda: np.zeros(0))

    @property
    def hypothesis(self) -> Hypothesis:
        return Model(self.parts).hypothesis(self.u)


@dataclass(eq=False)
class Examined:
    """``judged``: ranked, best first. ``base`` (n,): residual of the model as it is; ``left``: what the best, or the model as
    it is, leaves unexplained."""

    judged: list[Judged]
    screened: list[Screened]
    base: Array
    left: list[Leftover]
    tried: int

    @property
    def best(self) -> Judged | None:
        return self.judged[0] if self.judged and self.judged[0].earned else None

    @property
    def tied(self) -> list[Judged]:
        """The best and all that are tied with it."""
        best = self.best
        return [] if best is None else [best, *(c for c in self.judged if c.name in best.tied_with)]


def examine(
    search: Search,
    current: Current,
    pool: Sequence[Candidate],
    effort: Effort = STANDARD_EFFORT,
    guesses_first: bool = False,
) -> Examined:
    """Judge what of ``pool`` explains the residual of the current model. ``guesses_first``: where drives were assumed and much of
    it goes with them put right, nothing else is looked at: nobody believes in a guess, and beside it all the rest looks another.
    Raises ValueError for a model that cannot be simulated."""
    problem, now = search.problem, search.on(current.hypothesis)
    pool = possible(problem.robot, now.fixed, pool)
    base = now.base()
    if not np.isfinite(base).all():
        raise ValueError("the model cannot be simulated on these commands: its motion leaves the finite numbers")
    calm = calm_trials(problem, base)
    # What the model has already moves little when one effect is added: its slopes are taken once for all proposals.
    leading = None
    if len(current.u):
        leading = slopes_at(search, Model(current.parts), current.u)
    refit, busy = Refit(leading), busiest(problem, base, calm)
    brief = briefly(now.among(busy), base, ())
    guessed = assumed_drives(brief, pool, [t.name for t in now.fixed])
    if guessed is not None and guesses_first:
        right = _put_right(search, current, guessed, base, len(pool), leading)
        if right is not None:
            return Examined([right], [], base, leftovers(problem, right.residual), len(pool))
    alone = telling(problem, base, busy)
    chosen = None
    if alone is not None:
        chosen = in_brief(search.among([alone]), Model(current.parts), current.u, base, refit)
    screened = screen(now.among(busy), pool, effort.shares, refit, None if chosen is None else chosen.ground)
    least = least_energy(len(pool))
    promising = sorted((s for s in screened if s.promise > 0.5 * least), key=lambda s: -s.promise)
    promising = _first(promising, effort.first)
    # Scans and quick fits only choose who is judged: where one trial tells that, on it alone.
    if chosen is not None and (problem.looped or any(s.elsewhere for s in promising)):
        chosen = None
    wide = now.among(busy) if chosen is None else chosen.ground.search
    scanned = sorted(scan(wide, promising, refit if chosen is None else chosen.ground.refit), key=lambda s: s.energy)
    scanned = _first(scanned, effort.second)
    few, slopes = (search.among(calm), leading) if chosen is None else (chosen.search, chosen.slopes)
    quick = sorted(_quick(few, current, scanned, effort.starts, slopes), key=lambda f: f.energy)
    first, own = base if few.problem is problem else few.on(current.hypothesis).base(), few.everything
    energy = float((first[own] ** 2).sum())
    quick = [
        f
        for k, f in enumerate(quick)
        if f.model.parts[-1].guess
        or k < min(AT_LEAST, effort.final)
        or (k < effort.final and energy - f.energy >= WORTH_JUDGING * (energy - quick[0].energy))
    ]
    starts = [(Proposal((f.model.parts[-1],)), f.u[len(current.u) :]) for f in quick]
    has = {t.effect for t in (*search.fixed, *current.hypothesis) if t.target in WHOLE}
    looked_at = np.isin(problem.trial_of, busy)
    above = float((base[looked_at] ** 2 - problem.floor[looked_at]).sum())
    starts += families(screened, starts, least, has, above, held_still(problem))
    starts += [guessed] if guessed is not None else []
    nearest = min((f.energy for f in quick), default=0.0) / max(float(few.problem.floor[own].sum()), 1e-12)
    far = nearest > (NEARLY if problem.layout.by_segment else FAR) ** 2
    judged = _judged(search, current, starts, base, len(pool), leading, far)
    if judged and not judged[0].earned and not far and leftovers(problem, base):
        two = pairs(screened, now)
        if two:
            judged = ranked([*judged, *_judged(search, current, two, base, len(pool), leading)])
    judged = that_hold_run_through(problem, search.fixed, current.hypothesis, judged)
    best = judged[0] if judged and judged[0].earned else None
    left = leftovers(problem, base if best is None else best.residual)
    return Examined(judged, screened, base, left, len(pool))


def _put_right(
    search: Search,
    current: Current,
    guessed: tuple[Proposal, Array],
    base: Array,
    tried: int,
    leading: Array | None,
) -> Judged | None:
    """What was assumed of drives put right, where that takes most of what is above the noise off data held out."""
    problem, (proposal, u) = search.problem, guessed
    left = search.residuals([Model((*current.parts, *proposal.parts)).hypothesis(np.concatenate([current.u, u]))])[0]
    far = float(left @ left) > FAR**2 * float(problem.floor.sum())
    found = _judged(search, current, [guessed], base, tried, leading, far)
    found = that_hold_run_through(problem, search.fixed, current.hypothesis, found)
    noise = float(problem.floor.sum())
    if not found or not found[0].earned:
        return None
    most = noise + MOST_OF_IT * (float(base @ base) - noise)
    return found[0] if float(found[0].held.sum()) < most else None


def _judged(
    search: Search,
    current: Current,
    starts: Sequence[tuple[Proposal, Array]],
    base: Array,
    tried: int,
    leading: Array | None = None,
    far: bool = False,
) -> list[Judged]:
    """On windows; where more than noise is left with the best of them (``far``: where that is known beforehand), on whole
    motions and settings."""
    if not starts:
        return []
    problem, cuts = search.problem, travelling(search.problem)
    found: list[Judged] = []
    if not (far and cuts):
        found = under(search, current, starts, windows(problem), base, tried, leading)
        if not cuts or (found[0].earned and no_more_than_noise(problem, float(found[0].held.sum()))):
            return found
        found = []
    for cut in cuts:
        again = under(search, current, starts, cut, base, tried, leading)
        found = strictest(found, again) if found else again
    alone = [j for j in found if j.partly and j.earned]
    for j in alone:
        j.why_not = FEW_SHOW.format(kinds=j.held_out.split()[0])
    return ranked(found) if alone else found


def _first(found: Sequence[Looked], count: int) -> list[Looked]:
    """The first ``count``, and whatever puts right what was only assumed: nobody has to believe in that."""
    return [s for k, s in enumerate(found) if k < count or s.candidate.guess]


def under(
    search: Search,
    current: Current,
    starts: Sequence[tuple[Proposal, Array]],
    cut: Cut,
    base: Array,
    tried: int,
    leading: Array | None = None,
) -> list[Judged]:
    """Proposals fitted together with the current model and judged under one cut, ranked; effects at many joints also at those
    alone where they pay."""
    problem, without = search.problem, base
    fitted = [float((base[seen] ** 2).sum()) for k in range(cut.folds) if not (seen := cut.seen(problem, k)).all()]
    if len(current.u):
        # Of many values, fits that know the slopes stay nearer to where all data put them than fits that do not: a useless
        # effect would look right for that alone.
        same = leading if len(current.u) >= LARGE else None
        before = cross_fit(search, [(Model(current.parts), current.u)], cut, leading=same)[0]
        without, fitted = before.residual, [f.energy for f in before.fits]

    def judged(some: Sequence[tuple[Proposal, Array]]) -> list[Judged]:
        models = [(Model((*current.parts, *p.parts)), np.concatenate([current.u, u])) for p, u in some]
        outcomes = cross_fit(search, models, cut, leading=leading)
        return [
            judge(problem, without, outcome, p, model, tried, fitted=fitted)
            for outcome, (p, _), (model, _) in zip(outcomes, some, models, strict=True)
        ]

    found = judged(starts)
    fewer = _where_they_pay(problem, without, found)
    return ranked([*found, *judged(fewer)] if fewer else found)


def _where_they_pay(problem: Problem, without: Array, found: Sequence[Judged]) -> list[tuple[Proposal, Array]]:
    """Effects at many joints, each with a value of its own, without the joints at which held-out data do not want them, where
    that may be better than all that was judged: and values to start from."""
    best = max((j.gain for j in found if j.earned), default=0.0)
    total, out = float(without @ without), []
    for j in found:
        if len(j.proposal.parts) < MANY_JOINTS or not np.isfinite(j.gain):
            continue
        gains = gains_of(problem, j.proposal.parts, without, j.residual)
        pays = gains > 0
        if pays.sum() < 2 or pays.all() or float(gains[pays].sum()) <= best * total:
            continue
        parts = tuple(c for c, p in zip(j.proposal.parts, pays, strict=True) if p)
        places = Model(j.proposal.parts).places
        values = np.concatenate([j.own[place] for place, p in zip(places, pays, strict=True) if p])
        kinds = {c.effect.name for c in parts}
        out.append((Proposal(parts, f"{kinds.pop()}@each of {len(parts)} joints" if len(kinds) == 1 else ""), values))
    return out


def strictest(first: Sequence[Judged], second: Sequence[Judged]) -> list[Judged]:
    """Under two cuts an effect must earn its place under both; the one under which it did worse speaks for it, or that of which
    every turn tells its value. What only one of them asked for, at the joints where it pays there, has not."""
    other = {j.name: j for j in second}
    out = []
    for j in first:
        if j.name not in other:
            continue
        k = other[j.name]
        if j.earned and k.earned and j.partly != k.partly:
            out.append(k if j.partly else j)
        else:
            out.append(k if (not k.earned and j.earned) or (k.earned == j.earned and k.explained < j.explained) else j)
    return ranked(out)


def _quick(
    search: Search, current: Current, scanned: Sequence[Scanned], starts: int, leading: Array | None
) -> list[Fit]:
    """The better of a few quick fits of each candidate with the model so far, on all data: it only chooses who is judged."""
    tasks = [(i, s.candidate, u) for i, s in enumerate(scanned) for u in s.starts[:starts]]
    models = [(Model((*current.parts, c)), np.concatenate([current.u, u])) for _, c, u in tasks]
    fits = follow_slopes(search, models, search.everything, WIDTHS[1:3], leading=leading)
    best: dict[int, Fit] = {}
    for (i, _, _), fit in zip(tasks, fits, strict=True):
        if i not in best or fit.energy < best[i].energy:
            best[i] = fit
    return [best[i] for i in sorted(best)]
