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

from ee_dist.discrepancy.candidates import Candidate, known
from ee_dist.discrepancy.explain import fit_out
from ee_dist.discrepancy.fit import WIDTHS, Fit, Model, fit_all
from ee_dist.discrepancy.folds import halves
from ee_dist.discrepancy.judge import Judged
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.screen import Progress, quiet, screen
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

Proposal = tuple[Candidate, ...]
"""Effects that are added in one go: mostly one, or a family whose members only work together."""


@dataclass(frozen=True)
class Rule:
    """When an effect has earned its place on held-out data: it takes at least ``share`` off the error, and its gain is
    at least ``t`` standard errors over the segments. ``judged``: how many proposals are judged in a step (0: all)."""

    share: float = 0.05
    t: float = 2.0
    steps: int = 5
    judged: int = 0


@dataclass(eq=False)
class Verdict:
    """A proposal on top of the model of its step. ``gain``: share of the held-out error that it takes off."""

    name: str
    proposal: Proposal
    judged: Judged
    error_heldout: float
    gain: float
    t: float
    why_not: str


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


def climb(
    problem: Problem,
    start: Hypothesis,
    proposals: Sequence[Proposal],
    rule: Rule = Rule(),
    progress: Progress = quiet,
) -> list[Rung]:
    """From the model ``start``, whose values are refitted too, to the last effect that earns its place.

    The last rung's ``tried`` is repeated in an extra entry ``stopped``: what was tried on top of it and failed.
    """
    parts = tuple(known(problem.robot, t) for t in start)
    values = [c.shares(dict(t.values)) for c, t in zip(parts, start, strict=True)]
    u = np.concatenate(values) if values else np.zeros(0)
    half = halves(problem)
    fit = fit_everything(problem, Model(parts), [u], progress)
    nothing = problem.residuals([start])[0]
    (current,) = fit_out(problem, [(fit.model, fit.u)], nothing, (), half, 1, progress)
    rungs = [_rung(problem, "start", fit, current, [])]
    open_ = list(proposals)
    for _ in range(rule.steps):
        tried = judge_all(problem, rungs[-1].fit, current, open_, half, rule, progress)
        earned = [v for v in tried if not v.why_not]
        if not earned:
            rungs.append(Rung("stopped", rungs[-1].fit, rungs[-1].error_fit, rungs[-1].error_heldout, tried))
            return rungs
        best = min(earned, key=lambda v: v.error_heldout)
        grown = fit_everything(problem, best.judged.model, [best.judged.u, _padded(rungs[-1].fit, best.proposal)], progress)
        current = best.judged
        rungs.append(_rung(problem, best.name, grown, current, tried))
        taken = {c.name for c in best.proposal}
        open_ = [p for p in open_ if not taken & {c.name for c in p}]
    return rungs


def judge_all(
    problem: Problem,
    fit: Fit,
    current: Judged,
    proposals: Sequence[Proposal],
    half: Array,
    rule: Rule,
    progress: Progress = quiet,
) -> list[Verdict]:
    """Every proposal, or the most promising, fitted together with the model so far and judged on held-out segments."""
    chosen = list(proposals)
    if rule.judged and len(chosen) > rule.judged:
        chosen = _promising(problem, fit, chosen, rule.judged, progress)
    starts = [(Model((*fit.model.parts, *p)), _padded(fit, p)) for p in chosen]
    judged = fit_out(problem, starts, current.residual, (), half, len(starts), progress)
    before = natural(problem, error(current.residual))
    out = []
    for proposal, j in zip(chosen, judged, strict=True):
        gained = np.bincount(problem.segment_of, weights=current.residual**2, minlength=len(problem.segments)) - j.held
        spread = float(gained.std(ddof=1)) / math.sqrt(len(gained)) if len(gained) > 1 else math.inf
        t = float(gained.mean()) / spread if spread > 0 else 0.0
        after = natural(problem, j.error_heldout)
        gain = 1.0 - after / before if math.isfinite(after) else -math.inf
        why = ""
        if gain < rule.share:
            why = f"takes {gain:.1%} off the held-out error; {rule.share:.0%} are asked for"
        elif t < rule.t:
            why = f"its gain is {t:.1f} standard errors; {rule.t:g} are asked for"
        out.append(Verdict(" + ".join(c.name for c in proposal), proposal, j, after, gain, t, why))
    return sorted(out, key=lambda v: v.error_heldout)


def fit_everything(problem: Problem, model: Model, starts: Sequence[Array], progress: Progress = quiet) -> Fit:
    """The best fit of a model on all segments, from any of the starts."""
    everything = np.ones(len(problem.segment_of), dtype=bool)
    fits = fit_all(problem, [(model, u) for u in starts], (), everything, widths=WIDTHS, progress=progress)
    return min(fits, key=lambda f: f.energy)


def _padded(fit: Fit, proposal: Proposal) -> Array:
    """The values so far, and a little of each new parameter: at exactly neutral some have no slope."""
    return np.concatenate([fit.u, *(0.05 * (c.upper - (c.upper == 0)) for c in proposal)])


def _promising(problem: Problem, fit: Fit, proposals: Sequence[Proposal], count: int, progress: Progress) -> list[Proposal]:
    pool = {c.name: c for p in proposals for c in p}
    found = screen(problem, list(pool.values()), fit.hypothesis, (0.03, 0.1, 0.3), progress=progress)
    promise = {s.candidate.name: s.promise for s in found}
    return sorted(proposals, key=lambda p: -max(promise[c.name] for c in p))[:count]


def _rung(problem: Problem, added: str, fit: Fit, current: Judged, tried: list[Verdict]) -> Rung:
    share = math.sqrt(fit.energy / max(1, int(fit.mask.sum())))
    return Rung(added, fit, natural(problem, share), natural(problem, current.error_heldout), tried)
