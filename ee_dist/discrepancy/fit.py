"""Fitting: bounded Gauss-Newton for many candidates at once, one evaluator call per step for all of them.

A residual over seconds of contact is rugged in its parameters, so that a derivative at a point says little. Slopes are
taken over a finite step, which begins wide and shrinks, and every step is tried at several lengths at once.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.candidates import Candidate
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.screen import Progress, quiet
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

LENGTHS = (1.0, 0.5, 0.2)
"""How far along the Gauss-Newton step to look."""
WIDTHS = (0.12, 0.06, 0.03, 0.012)
"""Finite differences of the iterations, as shares of a parameter's room."""


@dataclass(frozen=True, eq=False)
class Model:
    """Candidates whose values are free, in order: one for ``explain``, several for ``improve``."""

    parts: tuple[Candidate, ...]

    @property
    def lower(self) -> Array:
        return np.concatenate([c.lower for c in self.parts] or [np.zeros(0)])

    @property
    def upper(self) -> Array:
        return np.concatenate([c.upper for c in self.parts] or [np.zeros(0)])

    def hypothesis(self, u: Array) -> Hypothesis:
        terms, at = [], 0
        for c in self.parts:
            terms.append(c.term(u[at : at + c.size]))
            at += c.size
        return tuple(terms)


@dataclass(frozen=True, eq=False)
class Fit:
    """``energy``: sum of squares of the residual values that were fitted. ``slopes`` (n, P): the last derivatives."""

    model: Model
    u: Array
    energy: float
    residual: Array
    slopes: Array
    mask: Array

    @property
    def hypothesis(self) -> Hypothesis:
        return self.model.hypothesis(self.u)

    def spread(self) -> Array:
        """Standard deviation of each u from the curvature at the optimum; infinite where the data say nothing."""
        if not len(self.u):
            return np.zeros(0)
        normal = self.slopes.T @ self.slopes
        excess = max(1.0, self.energy / max(1, int(self.mask.sum()) - len(self.u)))
        weak = np.diag(normal) < 1e-9
        cov = np.linalg.pinv(normal + np.diag(np.where(weak, 1e-9, 0.0)))
        return np.where(weak, np.inf, np.sqrt(np.maximum(np.diag(cov), 0.0) * excess))


@dataclass(eq=False)
class _Run:
    model: Model
    u: Array
    energy: float = np.inf
    residual: Array | None = None
    slopes: Array | None = None
    origin: tuple[Array, Array] | None = None
    """Where the slopes were taken: values and residual."""


Evaluate = Callable[[Sequence[tuple[_Run, Array]]], list[tuple[float, Array]]]


def fit_all(
    problem: Problem,
    starts: Sequence[tuple[Model, Array]],
    before: Hypothesis,
    mask: Array,
    trials: Sequence[int] | None = None,
    widths: Sequence[float] = WIDTHS,
    progress: Progress = quiet,
) -> list[Fit]:
    """The best values of each (model, start) on the residual values of ``mask`` (n,), in the order given."""
    if getattr(problem, "rugged", False):
        from ee_dist.discrepancy.global_fit import effort_of, search_all

        generations, seeds = effort_of(len(widths), getattr(problem, "effort", 1.0))
        return search_all(problem, starts, before, mask, trials, generations, seeds, progress=progress)
    runs = [_Run(m, np.clip(np.asarray(u, float), m.lower, m.upper)) for m, u in starts]

    def evaluate(points: Sequence[tuple[_Run, Array]]) -> list[tuple[float, Array]]:
        if not points:
            return []
        found = problem.residuals([(*before, *run.model.hypothesis(u)) for run, u in points], trials)
        return [(float(r[mask] @ r[mask]) if np.isfinite(r).all() else np.inf, r) for r in found]

    for run, (value, r) in zip(runs, evaluate([(run, run.u) for run in runs]), strict=True):
        run.energy, run.residual = value, r
    moving = [run for run in runs if len(run.u)]
    for step, width in enumerate(widths):
        _slopes(moving, width, mask, evaluate)
        _steps(moving, mask, evaluate)
        progress("fitting", (step + 1) / len(widths))
    out = []
    for run in runs:
        assert run.residual is not None
        slopes = run.slopes if run.slopes is not None else np.zeros((int(mask.sum()), len(run.u)))
        out.append(Fit(run.model, run.u, run.energy, run.residual, slopes, mask))
    return out


def _slopes(runs: Sequence[_Run], width: float, mask: Array, evaluate: Evaluate) -> None:
    """Derivatives over ``width`` (narrower for a small value), towards the inside; a better point found is taken."""
    points = []
    for run in runs:
        for k in range(len(run.u)):
            h = min(width, 0.3 * abs(run.u[k]) + 0.2 * width)
            u = run.u.copy()
            u[k] += h if u[k] + h <= run.model.upper[k] else -h
            points.append((run, np.clip(u, run.model.lower, run.model.upper)))
    found = evaluate(points)
    at = 0
    for run in runs:
        assert run.residual is not None
        columns = []
        best = (run.energy, run.u, run.residual)
        for k in range(len(run.u)):
            (value, r), (_, u) = found[at], points[at]
            at += 1
            gap = u[k] - run.u[k]
            usable = np.isfinite(value) and np.isfinite(run.energy) and abs(gap) > 1e-12
            columns.append((r - run.residual)[mask] / gap if usable else np.zeros(int(mask.sum())))
            if value < best[0]:
                best = (value, u, r)
        run.slopes = np.stack(columns, axis=1)
        run.origin = (run.u, run.residual)
        run.energy, run.u, run.residual = best


def _steps(runs: Sequence[_Run], mask: Array, evaluate: Evaluate) -> None:
    points = []
    for run in runs:
        assert run.origin is not None and run.slopes is not None
        origin, residual = run.origin
        if not np.isfinite(residual).all():
            # No slope where nothing can be simulated: nearer to neutral.
            points += [(run, run.u * 0.5)]
            continue
        normal = run.slopes.T @ run.slopes
        right = -run.slopes.T @ residual[mask]
        damp = 1e-6 * np.trace(normal) / len(run.u) + 1e-12
        step = np.linalg.solve(normal + damp * np.eye(len(run.u)), right)
        step = np.clip(step, -0.5, 0.5)
        for length in LENGTHS:
            u = np.clip(origin + length * step, run.model.lower, run.model.upper)
            if not np.allclose(u, run.u, atol=1e-6):
                points.append((run, u))
    for (run, u), (value, r) in zip(points, evaluate(points), strict=True):
        if value < run.energy:
            run.energy, run.u, run.residual = value, u, r
