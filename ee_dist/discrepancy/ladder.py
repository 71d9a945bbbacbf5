"""The ladder: effects added one after the other, all refitted together each time, until none earns its place.

Earlier effects are refitted with each new one, because they have stood in for what was missing: damping fitted without
dry friction is twice what it should be. What counts is the error on data that the fit has not seen; the rule asks for a
stated share of the error and for a gain that stands out from its scatter over the held-out segments.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from ee_dist.discrepancy.candidates import Candidate, known
from ee_dist.discrepancy.fit import WIDTHS, Fit, Model, fit_all
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.screen import Progress, quiet, screen
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

INVISIBLE = 1e-6
"""Energy of the change of a prediction below which an effect cannot show in these measurements."""
Proposal = tuple[Candidate, ...]
"""Effects that are added in one go: mostly one, or a family whose members only work together."""


@dataclass(frozen=True)
class Rule:
    """When an effect has earned its place on held-out data: it takes at least ``share`` off the error, and its gain is
    at least ``t`` standard errors over the segments. ``judged``: how many proposals are judged in a step (0: all).
    ``folds``: into how many parts the segments are cut, each held out once."""

    share: float = 0.05
    t: float = 2.0
    steps: int = 5
    judged: int = 0
    folds: int = 4


@dataclass(eq=False)
class Verdict:
    """A proposal on top of the model of its step. ``gain``: share of the held-out error that it takes off; ``residual``
    (n,): size of each value in the fit that had not seen it; ``u``: values fitted on the first fold; ``tied``: held-out
    data do not tell it from the best."""

    name: str
    proposal: Proposal
    model: Model
    u: Array
    residual: Array
    error_heldout: float
    gain: float
    t: float
    why_not: str
    tied: bool = False


@dataclass(eq=False)
class Rung:
    """A step of the ladder: what was added, the fit on all data, errors in the problem's own unit, what else was tried
    on top of the rung before."""

    added: str
    fit: Fit
    error_fit: float
    error_heldout: float
    tried: list[Verdict] = field(default_factory=list)

    @property
    def hypothesis(self) -> Hypothesis:
        return self.fit.hypothesis


def natural(problem: Problem, value: float) -> float:
    """An error in the unit that people use for this problem, where it has one."""
    convert = getattr(problem, "natural", None)
    return float(convert(value)) if convert is not None else value


Folds = list[NDArray[np.int64]]
"""Ways of cutting the segments into folds: each (segments,), which fold holds a segment out."""


def folds_of(problem: Problem, count: int) -> Folds:
    """Whole trials take turns where there are as many as folds, else the segments of each do.

    Where trials differ in their settings (a gain, a payload), a second way holds out one setting after the other: a model
    must also be right about settings that it was not fitted to.
    """
    trial = np.asarray(problem.trial_of_segment)
    if len(problem.trials) >= count:
        ways = [trial % count]
    else:
        first = np.array([np.flatnonzero(trial == k)[0] for k in range(len(problem.trials))])
        ways = [(np.arange(len(problem.segments)) - first[trial]) % count]
    setups = [t.setup for t in getattr(problem, "measured", ())]
    settings = list(dict.fromkeys(setups))
    if 1 < len(settings) < len(setups):
        ways.append(np.array([settings.index(s) for s in setups])[trial] % count)
    return ways


def climb(
    problem: Problem,
    start: Hypothesis,
    proposals: Sequence[Proposal],
    rule: Rule = Rule(),
    progress: Progress = quiet,
) -> list[Rung]:
    """From the model ``start``, whose values are refitted too, to the last effect that earns its place.

    The last entry, ``stopped``, repeats the last rung and holds what was tried on top of it and failed.
    """
    parts = tuple(known(problem.robot, t) for t in start)
    values = [c.shares(dict(t.values)) for c, t in zip(parts, start, strict=True)]
    folds = folds_of(problem, rule.folds)
    fit = fit_everything(problem, Model(parts), [np.concatenate(values) if values else np.zeros(0)], progress)
    current = cross_fit(problem, [(fit.model, fit.u)], folds, progress)[0][1]
    rungs = [_rung(problem, "start", fit, current, [])]
    present = {c.name for c in parts}
    open_ = [p for p in proposals if not present & {c.name for c in p}]
    for _ in range(rule.steps):
        tried = judge_all(problem, rungs[-1].fit, current, open_, folds, rule, progress)
        earned = [v for v in tried if not v.why_not]
        if not earned:
            break
        best = min(earned, key=lambda v: v.error_heldout)
        grown = fit_everything(problem, best.model, [best.u, _padded(rungs[-1].fit, best.proposal)], progress)
        current = best.residual
        rungs.append(_rung(problem, best.name, grown, current, tried))
        taken = {c.name for c in best.proposal}
        open_ = [p for p in open_ if not taken & {c.name for c in p}]
    else:
        tried = []
    last = rungs[-1]
    return [*rungs, Rung("stopped", last.fit, last.error_fit, last.error_heldout, tried)]


def judge_all(
    problem: Problem,
    fit: Fit,
    current: Array,
    proposals: Sequence[Proposal],
    folds: Folds,
    rule: Rule,
    progress: Progress = quiet,
) -> list[Verdict]:
    """Every proposal, or the most promising, fitted together with the model so far and judged on held-out segments.

    ``current`` (n,) is the held-out residual of the model so far. Best first.
    """
    chosen = _promising(problem, fit, proposals, rule.judged or len(proposals), progress)
    models = [Model((*fit.model.parts, *p)) for p in chosen]
    # Where a fit follows slopes, some effects are lost from a start too far away, others see no slope too near.
    sizes = (0.05,) if getattr(problem, "rugged", False) else (0.05, 0.005)
    starts = [(m, _padded(fit, p, size)) for size in sizes for m, p in zip(models, chosen, strict=True)]
    found = cross_fit(problem, starts, folds, progress)
    out = []
    for i, proposal in enumerate(chosen):
        _, residual, u = min(found[i :: len(chosen)], key=lambda f: f[0])
        out.append(_verdict(problem, proposal, models[i], u, residual, current, rule))
    ranked = sorted(out, key=lambda v: v.error_heldout)
    for v in ranked[1:]:
        behind = _standard_errors(problem, v.residual**2 - ranked[0].residual ** 2)
        v.tied = not (v.why_not or ranked[0].why_not) and behind < rule.t
    return ranked


def parted_most(problem: Problem, tied: Sequence[Verdict]) -> str:
    """The trial in which the predictions of some models differ most."""
    values = problem.residuals([v.model.hypothesis(v.u) for v in tied])
    finite = np.where(np.isfinite(values).all(axis=0), values, 0.0).var(axis=0)
    trial = problem.trial_of_segment[problem.segment_of]
    size = np.bincount(trial, minlength=len(problem.trials))
    mean = np.bincount(trial, weights=finite, minlength=len(problem.trials)) / np.maximum(size, 1)
    return problem.trials[int(np.argmax(mean))]


def _standard_errors(problem: Problem, gained: Array) -> float:
    """How many of its standard errors over the segments the mean of values (n,) is above zero."""
    count = len(problem.segments)
    by_segment = np.bincount(problem.segment_of, weights=gained, minlength=count)
    spread = float(by_segment.std(ddof=1)) / math.sqrt(count) if count > 1 else math.inf
    return float(by_segment.mean()) / spread if spread > 0 else 0.0


def cross_fit(
    problem: Problem, starts: Sequence[tuple[Model, Array]], folds: Folds, progress: Progress = quiet
) -> list[tuple[float, Array, Array]]:
    """For each (model, start): energy of the fits on what they saw, held-out residual (n,), values u of the first fold.

    With several ways of holding out, a value of the residual is the root mean square over them.
    """
    seen = np.zeros(len(starts))
    square = [np.zeros(len(problem.segment_of)) for _ in starts]
    values: list[Array] = []
    for way in folds:
        for k in range(int(way.max()) + 1):
            out = (way == k)[problem.segment_of]
            if not out.any():
                continue
            fits = fit_all(problem, list(starts), (), ~out, widths=WIDTHS[1:], progress=progress)
            trials = np.unique(problem.trial_of_segment[way == k]).tolist()
            rows = problem.residuals([f.hypothesis for f in fits], trials)
            for i, (fit, row) in enumerate(zip(fits, rows, strict=True)):
                seen[i] += fit.energy
                square[i][out] += row[out] ** 2 / len(folds)
            values = values or [f.u for f in fits]
    return list(zip(seen.tolist(), [np.sqrt(s) for s in square], values, strict=True))


def _verdict(
    problem: Problem, proposal: Proposal, model: Model, u: Array, residual: Array, current: Array, rule: Rule
) -> Verdict:
    before, after = natural(problem, error(current)), natural(problem, error(residual))
    t = _standard_errors(problem, current**2 - residual**2)
    gain = 1.0 - after / before if math.isfinite(after) else -math.inf
    why = ""
    if gain < rule.share:
        why = f"takes {gain:.1%} off the held-out error; {rule.share:.0%} are asked for"
    elif t < rule.t:
        why = f"its gain is {t:.1f} standard errors; {rule.t:g} are asked for"
    name = " + ".join(c.name for c in proposal)
    return Verdict(name, proposal, model, u, residual, after, gain, t, why)


def fit_everything(problem: Problem, model: Model, starts: Sequence[Array], progress: Progress = quiet) -> Fit:
    """The best fit of a model on all segments, from any of the starts."""
    everything = np.ones(len(problem.segment_of), dtype=bool)
    fits = fit_all(problem, [(model, u) for u in starts], (), everything, widths=WIDTHS, progress=progress)
    return min(fits, key=lambda f: f.energy)


def _padded(fit: Fit, proposal: Proposal, size: float = 0.05) -> Array:
    """The values so far, and a little of each new parameter: at exactly neutral some have no slope."""
    return np.concatenate([fit.u, *(np.where(c.upper > 0, size, -size) for c in proposal)])


def _promising(
    problem: Problem, fit: Fit, proposals: Sequence[Proposal], count: int, progress: Progress
) -> list[Proposal]:
    """Those that change the prediction at all, the most promising first, at most ``count``; and all families, whose
    members promise little one by one."""
    pool = {c.name: c for p in proposals for c in p}
    screened = screen(problem, list(pool.values()), fit.hypothesis, (0.03, 0.1, 0.3), progress=progress)
    found = {s.candidate.name: s for s in screened}
    seen = [p for p in proposals if max(found[c.name].reach for c in p) > INVISIBLE]
    ranked = sorted(seen, key=lambda p: -max(found[c.name].promise for c in p))
    return [p for k, p in enumerate(ranked) if k < count or len(p) > 1]


def _rung(problem: Problem, added: str, fit: Fit, current: Array, tried: list[Verdict]) -> Rung:
    seen = math.sqrt(fit.energy / max(1, int(fit.mask.sum())))
    return Rung(added, fit, natural(problem, seen), natural(problem, error(current)), tried)
