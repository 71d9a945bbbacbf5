"""improve: add effects to a model, fit all of them together, and stop when none earns its place on held-out data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import combinations

import numpy as np

from ee_dist.discrepancy.candidates import Candidate, known
from ee_dist.discrepancy.explain import STANDARD_EFFORT, Effort, Explanation, explain, fit_out
from ee_dist.discrepancy.fit import WIDTHS, Fit, Model, fit_all
from ee_dist.discrepancy.folds import bootstrap, halves
from ee_dist.discrepancy.judge import LEAST_SHARE, LOST_SHARE, Judged, lost, needed
from ee_dist.discrepancy.misfit import Leftover, leftovers
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.scan import scan
from ee_dist.discrepancy.screen import Progress, Screened, quiet, screen
from ee_dist.effects.catalogue import Hypothesis, Term
from ee_dist.trials.log import Array

AT_BOUND = 0.985
"""Share of the way to a bound from which a value counts as being at it."""
NO_MORE = "no effect takes more off held-out data than luck"
TOO_LITTLE = "what is left is spread: no effect takes a tenth of it off held-out data"
WORTH = 0.1
"""Share of the squared error above the noise floor that an effect must take off to be added. Where a model is wrong in ways
that no effect describes (another simulator, resampled records), some effect always takes a little of it, surely and
wrongly."""


@dataclass(eq=False)
class Rung:
    """A step of the ladder: the model with ``added``. ``held`` is the held-out energy by segment."""

    added: Hypothesis
    terms: Hypothesis
    error_fit: float
    error_heldout: float
    held: Array
    interval: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class ParameterReport:
    """A fitted value with its 95 % interval; ``flag`` says what is wrong with it, if anything."""

    term: int
    name: str
    value: float
    low: float
    high: float
    flag: str


@dataclass(eq=False)
class Improvement:
    """``terms``: the final model, fitted on all data. ``stopped``: why no further effect was added."""

    ladder: list[Rung]
    terms: Hypothesis
    parameters: list[ParameterReport]
    residual: Array
    noise_floor: float
    floor_source: str
    left: list[Leftover]
    stopped: str
    explanations: list[Explanation] = field(default_factory=list)

    def ties(self, step: int) -> list[str]:
        """What the measurements do not tell from the effect that step ``step`` (from 1) of ``effect=auto`` added."""
        if not 1 <= step <= min(len(self.explanations), len(self.ladder) - 1):
            return []
        tied = self.explanations[step - 1].tied
        added = {(t.effect, t.target) for t in self.ladder[step].added}
        others = [j.name for j in tied if (j.candidate.effect.name, j.candidate.target) not in added]
        return others if len(others) < len(tied) else []


def improve(
    problem: Problem,
    pool: Sequence[Candidate],
    before: Hypothesis = (),
    wanted: Sequence[Candidate] | None = None,
    effort: Effort = STANDARD_EFFORT,
    most: int = 6,
    progress: Progress = quiet,
) -> Improvement:
    """Add ``wanted``, or (None) whatever of ``pool`` earns its place, to the model ``before``; refit everything."""
    half = halves(problem)
    base = problem.residuals([before])[0]
    if not np.isfinite(base).all():
        raise ValueError("the model cannot be simulated on these commands: its motion leaves the finite numbers")
    parts = [known(problem.robot, t) for t in before]
    u = np.concatenate([c.shares(dict(t.values)) for c, t in zip(parts, before, strict=True)] or [np.zeros(0)])
    start = per_model(problem, base)
    ladder = [Rung((), before, error(base), error(base), start)]
    floor, _ = problem.noise_floor()
    explanations: list[Explanation] = []
    stopped = "the effects asked for were added"
    if wanted is not None:
        for c in wanted:
            model, at = _with_best_start(problem, parts, u, [c], ladder[-1].terms)
            judged = fit_out(problem, [(model, at)], base, (), half, len(pool), progress)[0]
            parts, u = [*parts, c], judged.u
            ladder.append(_rung(problem, judged, 1, ladder[-1]))
    else:
        while True:
            if len(parts) - len(before) >= most:
                stopped = f"{most} effects were added, which is as many as are allowed"
                break
            now = ladder[-1].terms
            found = explain(problem, [c for c in pool if c.name not in {p.name for p in parts}], now, effort, progress)
            explanations.append(found)
            options = _options(problem, found, pool)
            rung, stopped = None, NO_MORE
            for group in options:
                model, at = _with_best_start(problem, parts, u, group, now, found)
                judged = fit_out(problem, [(model, at)], base, (), half, len(pool), progress)[0]
                step = _rung(problem, judged, len(group), ladder[-1])
                if not _earns(step, ladder[-1], needed(problem, len(pool), sum(c.size for c in group))):
                    continue
                if worth(ladder[-1].error_heldout, step.error_heldout, floor) < WORTH:
                    stopped = TOO_LITTLE
                else:
                    rung = step
                    parts, u = [*parts, *group], judged.u
                    break
            if rung is None:
                break
            ladder.append(rung)
    return _finish(problem, parts, u, ladder, base, stopped, explanations, progress)


def worth(before: float, after: float, floor: float) -> float:
    """Share of the squared error above the noise floor that a step takes off; 1 where nothing was above it."""
    above = before**2 - floor**2
    return (before**2 - after**2) / above if above > 0 else 1.0


def per_model(problem: Problem, residual: Array) -> Array:
    return np.bincount(problem.segment_of, weights=residual**2, minlength=len(problem.segments))


def _options(problem: Problem, found: Explanation, pool: Sequence[Candidate]) -> list[list[Candidate]]:
    """What to try adding: the best candidate that earned its place and those tied with it; where none did but something
    is left, pairs of effects at the place that promises most (friction by load, linear and quadratic, pays together)."""
    singles = [[c.candidate] for c in found.candidates if c.earned][:3]
    if singles or not found.left:
        return singles
    hopeful = sorted((s for s in found.screened if s.promise > 0), key=lambda s: -s.promise)
    if not hopeful:
        return []
    place = hopeful[0].candidate.target
    there = [s.candidate for s in hopeful if s.candidate.target == place and s.candidate.size][:4]
    return [list(pair) for pair in combinations(there, 2)][:4]


def _with_best_start(
    problem: Problem,
    parts: Sequence[Candidate],
    u: Array,
    group: Sequence[Candidate],
    now: Hypothesis,
    found: Explanation | None = None,
) -> tuple[Model, Array]:
    """All parts and the new ones, starting where each new one does best alone on top of the model so far."""
    starts: list[Array] = [np.asarray(u, float)]
    judged: dict[str, Judged] = {} if found is None else {j.name: j for j in found.candidates}
    for c in group:
        if c.name in judged and len(group) == 1:
            starts.append(judged[c.name].u)
            continue
        hopeful: list[Screened] = screen(problem, [c], now)
        scanned = scan(problem, hopeful, now)
        share = 1.0 if len(group) == 1 else 0.5
        starts.append(share * scanned[0].starts[0] if scanned else np.zeros(c.size))
    return Model((*parts, *group)), np.concatenate(starts)


def _rung(problem: Problem, judged: Judged, added: int, last: Rung) -> Rung:
    gained = last.held - judged.held
    whole = float(last.held.sum())
    low, high = bootstrap(gained, groups=problem.trial_of_segment)
    scale = whole if whole > 0 else 1.0
    return Rung(
        judged.hypothesis[-added:],
        judged.hypothesis,
        judged.error_fit,
        judged.error_heldout,
        judged.held,
        (low / scale, high / scale),
    )


def _earns(step: Rung, last: Rung, least: float) -> bool:
    gained = float((last.held - step.held).sum())
    whole = float(last.held.sum())
    sound = step.interval[0] > 0 or lost(last.held - step.held) <= LOST_SHARE * gained
    return bool(np.isfinite(gained) and gained > max(least, LEAST_SHARE * whole) and sound)


def _finish(
    problem: Problem,
    parts: Sequence[Candidate],
    u: Array,
    ladder: list[Rung],
    base: Array,
    stopped: str,
    explanations: list[Explanation],
    progress: Progress,
) -> Improvement:
    floor, source = problem.noise_floor()
    if not parts:
        return Improvement(ladder, (), [], base, floor, source, leftovers(problem, base), stopped, explanations)
    everything = np.ones(len(problem.segment_of), dtype=bool)
    model = Model(tuple(parts))
    fit = fit_all(problem, [(model, u)], (), everything, widths=(*WIDTHS[2:], 0.006), progress=progress)[0]
    left = leftovers(problem, fit.residual)
    return Improvement(
        ladder, fit.hypothesis, _parameters(fit), fit.residual, floor, source, left, stopped, explanations
    )


def _parameters(fit: Fit) -> list[ParameterReport]:
    spread, out, at = fit.spread(), [], 0
    for index, (c, term) in enumerate(zip(fit.model.parts, fit.hypothesis, strict=True)):
        u, s = fit.u[at : at + c.size], spread[at : at + c.size]
        rooms = c.rooms(u)
        for k, (name, value) in enumerate(term.values):
            half = 1.96 * float(s[k] * rooms[k]) if np.isfinite(s[k]) else float("inf")
            flag = ""
            if not np.isfinite(half) or half > max(abs(rooms[k]), 1e-12):
                flag = "not determined by these data"
            elif abs(u[k]) > AT_BOUND:
                flag = "at its bound: the range is too small, or the effect is another"
            elif abs(u[k]) < 1.96 * s[k]:
                flag = "not told from neutral"
            out.append(ParameterReport(index, name, value, value - half, value + half, flag))
        at += c.size
    return out


def appended(before: Hypothesis, term: Term) -> Hypothesis:
    """A model with one more line."""
    return (*before, term)
