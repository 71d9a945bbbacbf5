"""One step of the search, the same for explain and improve: which effect, on top of the model so far, explains most.

Screen all candidates, scan the promising over their range, fit the best of them quickly, then fit these together with what
the model has already and judge them on data that the fits had not seen.
"""

from __future__ import annotations

from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from itertools import combinations
from typing import TypeVar

import numpy as np

from ee_dist.discrepancy.assumed import assumed_drives
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
Looked = TypeVar("Looked", Screened, Scanned)
GAIN = "position_gain"
MANY_JOINTS = 3
"""Joints from which an effect at each of them is judged joint by joint too."""
FAMILIES_TRIED, ADDS = 4, 0.3
"""Effects whose members at all joints, each with a value of its own, are tried together, and the share of what the best member
promises, or of what it leaves above the noise, that the others must add."""


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


def examine(search: Search, current: Current, pool: Sequence[Candidate], effort: Effort = STANDARD_EFFORT) -> Examined:
    """Judge what of ``pool`` explains the residual of the current model. Raises ValueError for one that cannot be simulated."""
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
    alone = telling(problem, base, busy)
    screened = screen(now.among(busy), pool, effort.shares, refit, alone)
    least = least_energy(len(pool))
    promising = sorted((s for s in screened if s.promise > 0.5 * least), key=lambda s: -s.promise)
    promising = _first(promising, effort.first)
    # Scans and quick fits only choose who is judged: where one trial tells that, on it alone.
    one = None
    if alone is not None and not problem.looped and not any(s.elsewhere for s in promising):
        one = [alone]
    scanned = sorted(scan(now.among(one or busy), promising, refit), key=lambda s: s.energy)
    scanned = _first(scanned, effort.second)
    few = one or calm
    quick = sorted(_quick(search.among(few), current, scanned, effort.starts, leading), key=lambda f: f.energy)
    energy = float((base[np.isin(problem.trial_of, few)] ** 2).sum())
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
    starts += _families(screened, starts, least, has, above, held_still(problem))
    guessed = assumed_drives(now.among(busy), pool, [t.name for t in (*search.fixed, *current.hypothesis)])
    starts += [guessed] if guessed is not None else []
    nearest = min((f.energy for f in quick), default=0.0) / max(_floor_of(problem, few), 1e-12)
    far = nearest > (NEARLY if problem.layout.by_segment else FAR) ** 2
    judged = _judged(search, current, starts, base, len(pool), leading, far)
    if judged and not judged[0].earned and not far and leftovers(problem, base):
        pairs = _pairs(screened, now)
        if pairs:
            judged = ranked([*judged, *_judged(search, current, pairs, base, len(pool), leading)])
    judged = that_hold_run_through(problem, search.fixed, current.hypothesis, judged)
    best = judged[0] if judged and judged[0].earned else None
    left = leftovers(problem, base if best is None else best.residual)
    return Examined(judged, screened, base, left, len(pool))


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


def _floor_of(problem: Problem, trials: Sequence[int]) -> float:
    """Energy that noise leaves in some trials."""
    return float(problem.floor[np.isin(problem.trial_of, list(trials))].sum())


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


def _families(
    screened: Sequence[Screened],
    singles: Sequence[tuple[Proposal, Array]],
    least: float,
    has: AbstractSet[str],
    above: float,
    held: AbstractSet[str],
) -> list[tuple[Proposal, Array]]:
    """Effects at all joints, each joint with a value of its own, where several joints promise something: one number for all of
    them, which the model may have already (``has``), may be too few. Of joints that were only ``held`` nothing tells a gain from
    a torque, and theirs is as that of the others. ``above``: energy above the noise. And friction by load, linear and quadratic,
    which pay together."""
    out: list[tuple[float, Proposal, Array]] = []
    by_effect: dict[str, list[Screened]] = {}
    whole = has | {s.candidate.effect.name for s in screened if s.candidate.target in WHOLE}
    for s in screened:
        if s.candidate.effect.name in whole and s.candidate.target in _joints(screened, s.candidate.effect.name):
            by_effect.setdefault(s.candidate.effect.name, []).append(s)
    for name, members in by_effect.items():
        visible = [s for s in members if s.starts and s.promise > least]
        if name == GAIN:
            visible = [s for s in visible if s.candidate.target not in held]
        if len(visible) < 2:
            continue
        promise, most = sum(s.promise for s in visible), max(s.promise for s in visible)
        # A shoulder's friction is little beside that of an elbow that leaves four fifths, and most of what this one cannot say.
        if promise - most > ADDS * min(most, max(above - most, 0.0)):
            label = f"{name}@each of {len(visible)} joints"
            parts = Proposal(tuple(s.candidate for s in visible), label)
            out.append((promise / np.sqrt(parts.size), parts, np.concatenate([s.starts[0] for s in visible])))
    out = sorted(out, key=lambda f: -f[0])[:FAMILIES_TRIED]
    found = [(p, u) for _, p, u in out]
    by_name = {s.candidate.name: s for s in screened}
    for single, u in singles:
        c = single.parts[0]
        other = by_name.get(f"quadratic_friction@{c.target}")
        if c.effect.name == "load_friction" and other is not None and other.reach > 0:
            start = np.where(other.candidate.upper > 0, 0.05, -0.05)
            found.append((Proposal((c, other.candidate)), np.concatenate([u, start])))
    return found


def _joints(screened: Sequence[Screened], effect: str) -> set[str]:
    """Targets of an effect that are single joints."""
    return {
        s.candidate.target
        for s in screened
        if s.candidate.effect.name == effect and s.candidate.target not in WHOLE and "+" not in s.candidate.target
    }


def _pairs(screened: Sequence[Screened], now: Search) -> list[tuple[Proposal, Array]]:
    """Pairs of effects at the place that promises most: some pay only together."""
    hopeful = sorted((s for s in screened if s.promise > 0), key=lambda s: -s.promise)
    if not hopeful:
        return []
    place = hopeful[0].candidate.target
    there = [s for s in hopeful if s.candidate.target == place and s.candidate.size][:4]
    best = {s.candidate.name: s.starts[0] for s in scan(now, there)}
    pairs = [p for p in combinations(there, 2) if all(s.candidate.name in best for s in p)][:4]
    return [
        (
            Proposal((a.candidate, b.candidate)),
            0.5 * np.concatenate([best[a.candidate.name], best[b.candidate.name]]),
        )
        for a, b in pairs
    ]
