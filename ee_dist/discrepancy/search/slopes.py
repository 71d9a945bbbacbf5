"""Fitting: bounded Gauss-Newton for many candidates at once, one evaluator call per step for all of them.

A residual over seconds of contact is rugged in its parameters, so that a derivative at a point says little. Slopes are
taken over a finite step, which begins wide and shrinks, and a step that does not keep what it promised is tried shorter.
Far from the noise steps of plain least squares are tried too: what little of a large swing is near zero has, softened, the
greatest weight, and holds a weighed step back.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.problem import Mask, Problem
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search, least_error
from ee_dist.trials.log import Array

LENGTHS = (1.0, 0.5, 0.2)
"""How far along the Gauss-Newton step to look."""
NEAR = 4.0
"""Energy over what noise leaves up to which a step is taken at its word: where more is left a residual is rugged, and the
best of all lengths is better than the first that is good (of a real servo 52.7 and 55.5 mrad, with five values)."""
KEPT = 0.75
"""Share of what slopes foretell that the whole step must take off; else the shorter ones are tried."""
SAME = 0.5
"""Energy that data tell nothing by: half of what it costs to have a value one standard deviation off."""
WIDTHS = (0.12, 0.06, 0.03, 0.012)
"""Finite differences of the iterations, as shares of a parameter's room."""
FINER, NARROWER = 12, 3.0
"""More iterations at most, and by how much narrower each: by this, or, after one that did not pay, by how much more its slopes
changed the residual than is left of it, for then they told nothing of what is left."""
STILL, MISSES = 0.95, 2
"""Share of the energy that an iteration leaves at most which pays, far from the noise (near it SAME is what it takes off at
least); and after how many in turn that do not the fit ends. Of laws that are left half fitted luck chooses."""
DETERMINED = 100.0
"""Times the prior by which data determine a value well."""
CLOSEST = 1e-9
"""Share of a parameter's room below which two values are one."""


@dataclass(eq=False)
class _Run:
    model: Model
    u: Array
    energy: float = np.inf
    residual: Array | None = None
    slopes: Array | None = None
    origin: tuple[Array, Array] | None = None
    """Where the slopes were taken: values, and the residual as it is weighed there."""
    weights: Array | None = None
    width: float = WIDTHS[0]
    misses: int = 0
    """Iterations in turn that did not pay,"""
    moved: float = 0.0
    """and how much the last slopes changed the residual, as a share of what was left of it."""
    straight: bool = False
    """Whether the last step came to what slopes foretold: the next would lead nowhere that data tell from there,"""
    flat: bool = False
    """or slopes foretold nothing."""
    known: Array | None = None
    """(n, P0) slopes of the first values that are not taken anew."""

    def __post_init__(self) -> None:
        self.side = np.ones(len(self.u))
        """(P,) to which side of each value slopes are taken next."""


Leading = Array | list[Array] | None
"""(n, P0) slopes of the first P0 values of all models alike, or those of each: where they are known they are not taken anew."""
Evaluate = Callable[[Sequence[tuple[_Run, Array]]], list[tuple[float, Array]]]


def follow_slopes(
    search: Search,
    starts: Sequence[tuple[Model, Array]],
    mask: Mask,
    widths: Sequence[float] = WIDTHS,
    prior: float = 0.0,
    leading: Leading = None,
) -> list[Fit]:
    """The best values of each (model, start) on the residual values of ``mask`` (n,), in the order given.

    ``prior``: energy that a value at its bound costs beside one at neutral, so that a value which these data do not
    determine says nothing about others. Only trials with values in the mask are simulated on the way.
    """
    whole, search = search, search.within(mask)
    known = leading if isinstance(leading, list) else [leading] * len(starts)
    runs = [
        _Run(m, np.clip(np.asarray(u, float), m.lower, m.upper), known=None if k is None else k[mask])
        for (m, u), k in zip(starts, known, strict=True)
    ]

    def evaluate(points: Sequence[tuple[_Run, Array]]) -> list[tuple[float, Array]]:
        if not points:
            return []
        found = search.residuals([run.model.hypothesis(u) for run, u in points])
        return [
            (float(r[mask] @ r[mask]) + prior * float(u @ u) if np.isfinite(r).all() else np.inf, r)
            for (_, u), r in zip(points, found, strict=True)
        ]

    for run, (value, r) in zip(runs, evaluate([(run, run.u) for run in runs]), strict=True):
        run.energy, run.residual = value, r
    moving = [run for run in runs if len(run.u)]
    for step, width in enumerate(widths):
        going = [run for run in moving if not (run.straight or run.flat)]
        for run in going:
            run.width = width
        _iterate(going, mask, evaluate, whole.problem, prior)
        so_far = least_error([run.energy for run in runs], int(mask.sum()))
        search.progress("fitting", (step + 1) / len(widths), so_far)
    if len(widths) > 1:
        _finer(moving, mask, evaluate, whole.problem, prior)
    out = []
    if search is not whole:
        for run, r in zip(runs, whole.residuals([run.model.hypothesis(run.u) for run in runs]), strict=True):
            run.residual = r
    for run in runs:
        assert run.residual is not None
        slopes = run.slopes if run.slopes is not None else np.zeros((int(mask.sum()), len(run.u)))
        energy = run.energy - prior * float(run.u @ run.u)
        out.append(Fit(run.model, run.u, energy, run.residual, slopes, mask))
    return out


def _finer(
    runs: Sequence[_Run],
    mask: Mask,
    evaluate: Evaluate,
    problem: Problem,
    prior: float,
) -> None:
    """Finer steps for those that still come nearer by them: where sensors are precise and one effect is all that is missing,
    the last width is coarser than what data tell. Half fitted, an explanation loses to one that stands in for it."""
    for _ in range(FINER):
        runs = [run for run in runs if np.isfinite(run.energy) and not (run.straight or run.flat)]
        runs = [run for run in runs if run.misses < MISSES or run.moved >= NARROWER]
        if not runs:
            break
        for run in runs:
            run.width /= max(NARROWER, run.moved) if run.misses else NARROWER
        _iterate(runs, mask, evaluate, problem, prior)


def _iterate(runs: Sequence[_Run], mask: Mask, evaluate: Evaluate, problem: Problem, prior: float) -> None:
    """Slopes over each run's width, and steps along them."""
    before, floor = [run.energy for run in runs], float(problem.floor[mask].sum())
    same = tells_nothing(problem, mask)
    _slopes(runs, mask, evaluate, problem)
    _steps(runs, mask, evaluate, floor, same, prior)
    for run, energy in zip(runs, before, strict=True):
        paid = run.energy < (energy - same if energy <= NEAR * floor else STILL * energy)
        run.misses = 0 if paid else run.misses + 1


def tells_nothing(problem: Problem, mask: Mask) -> float:
    """Energy that data tell nothing by, of the residual values of ``mask`` (n,). Where windows begin from what was measured, what
    is off there, a position and a speed of each channel, stays for the whole window: it is no more evidence than these are."""
    if not problem.layout.by_segment:
        return SAME
    starts = 2 * len(problem.layout.channels) * np.unique(problem.segment_of[mask]).size
    return SAME * max(1.0, float(problem.layout.known[mask].sum()) / max(starts, 1))


def weighed(problem: Problem, residual: Array) -> tuple[Array, Array]:
    """The residual (n,) before it is softened, and the weights (n,) with which squares of it count as the energy counts them: how
    robust losses are minimised (Huber 1981, "Robust Statistics", section 7.8)."""
    smooth = problem.smooth(residual)
    return smooth, np.minimum(np.abs(residual) / np.maximum(np.abs(smooth), 1e-12), 1.0)


def counted(change: Array, weights: Array, smooth: Array) -> Array:
    """Slopes (n, P) as the energy counts them. Where a residual is exactly zero its weight is that of none, as though it said
    nothing; of a value that moves such values alone (a sensor that is dead, and told to be) it says all that there is."""
    columns = weights[:, None] * change
    silent = np.linalg.norm(columns, axis=0) <= 1e-9 * np.linalg.norm(change, axis=0)
    columns[:, silent] = (change * (smooth == 0)[:, None])[:, silent]
    return np.asarray(columns)


def _slopes(runs: Sequence[_Run], mask: Mask, evaluate: Evaluate, problem: Problem) -> None:
    """Derivatives over the run's width (narrower for a small value), towards the inside; a better point found is taken. Those of
    the first values may be known."""
    points = []
    firsts = [0 if run.known is None else run.known.shape[1] for run in runs]
    for run, first in zip(runs, firsts, strict=True):
        for k in range(first, len(run.u)):
            h = min(run.width, 0.3 * abs(run.u[k]) + 0.2 * run.width)
            u = run.u.copy()
            side = _side(run, k, h)
            u[k] += side * h
            points.append((run, np.clip(u, run.model.lower, run.model.upper)))
    found = evaluate(points)
    at = 0
    for run, first in zip(runs, firsts, strict=True):
        assert run.residual is not None
        columns = [] if run.known is None else list(run.known.T)
        best = (run.energy, run.u, run.residual)
        smooth, weights = weighed(problem, run.residual)
        moved = 0.0
        for k in range(first, len(run.u)):
            (value, r), (_, u) = found[at], points[at]
            at += 1
            gap = u[k] - run.u[k]
            usable = np.isfinite(value) and np.isfinite(run.energy) and abs(gap) > 1e-12
            change = problem.smooth(r)[mask] - smooth[mask] if usable else np.zeros(int(mask.sum()))
            column = (change / gap if usable else change)[:, None]
            columns.append(counted(column, weights[mask], smooth[mask])[:, 0])
            moved = max(moved, float(np.linalg.norm(change)))
            if value < best[0]:
                best = (value, u, r)
            elif usable:
                # Far from where it leads a residual bends: slopes tell more of the side that goes down.
                run.side[k] = -np.sign(gap)
        run.slopes = np.stack(columns, axis=1)
        run.origin, run.weights = (run.u, weights * smooth), weights[mask]
        run.moved = moved / max(float(np.linalg.norm(smooth[mask])), 1e-12)
        run.energy, run.u, run.residual = best


def _steps(runs: Sequence[_Run], mask: Mask, evaluate: Evaluate, floor: float, same: float, prior: float) -> None:
    """The step that slopes lead to, and shorter ones: all of them where more than NEAR times the ``floor`` is left, else where
    the whole one does not come to what slopes foretell."""

    def better(points: Sequence[tuple[_Run, Array]]) -> None:
        asked = [(run, u) for run, u in points if not np.allclose(u, run.u, rtol=0.0, atol=CLOSEST)]
        for (run, u), (value, r) in zip(asked, evaluate(asked), strict=True):
            if value < run.energy:
                run.energy, run.u, run.residual = value, u, r

    full, shorter, aims = [], [], []
    for run in runs:
        assert run.origin is not None and run.slopes is not None
        origin, residual = run.origin
        if not np.isfinite(residual).all():
            # No slope where nothing can be simulated: nearer to neutral.
            full.append((run, run.u * 0.5))
            continue
        step = gauss_newton(run.slopes, residual[mask], origin, prior, run.model)
        aim = origin + step
        step = np.clip(step, -0.5, 0.5)
        first, *others = (np.clip(origin + length * step, run.model.lower, run.model.upper) for length in LENGTHS)
        bent = residual[mask] + run.slopes @ (first - origin)
        here = float(residual[mask] @ residual[mask]) + prior * float(origin @ origin)
        there = float(bent @ bent) + prior * float(first @ first)
        full.append((run, first))
        if here > NEAR * floor:
            full += [(run, u) for u in (*others, _unweighed(run, mask, prior))]
            continue
        shorter += [(run, here - KEPT * (here - there), u) for u in others]
        run.flat = here - there < same
        if not run.flat and np.array_equal(first, aim):
            aims.append((run, first, there))
    better(full)
    for run, first, there in aims:
        run.straight = run.u is first and abs(run.energy - there) < same
    better([(run, u) for run, enough, u in shorter if not run.energy <= enough])


def gauss_newton(slopes: Array, residual: Array, u: Array, prior: float, model: Model) -> Array:
    """(P,) the Gauss-Newton step from values u (P,), where ``slopes`` (n, P) of the residual (n,) are known."""
    plain, down, step = slopes.T @ slopes, -slopes.T @ residual, np.zeros(len(u))
    normal = plain + prior * np.eye(len(u))
    damp = 1e-6 * np.trace(normal) / max(1, len(u)) + 1e-12
    free = np.flatnonzero(~at_end(plain, down, u, prior, model))
    system = (normal + damp * np.eye(len(u)))[np.ix_(free, free)]
    step[free] = np.linalg.solve(system, (down - prior * u)[free])
    return step


def at_end(normal: Array, down: Array, u: Array, prior: float, model: Model) -> Mask:
    """(P,) values at an end of their range that stay there: data which determine them well do not ask for less, and the prior
    would move them by next to nothing. Off the end by next to nothing can be another world: of a dead sensor a trace is left,
    whose readings are not the same number any more."""
    outside = ((u >= model.upper) & (down >= 0)) | ((u <= model.lower) & (down <= 0))
    return np.asarray(outside & (np.diag(normal) > DETERMINED * max(prior, 1e-12)))


def _side(run: _Run, k: int, h: float) -> float:
    """To which side of a value its slope is taken: up, or where it went down before, within its bounds."""
    side = float(run.side[k])
    at = run.u[k] + side * h
    return side if run.model.lower[k] <= at <= run.model.upper[k] else -side


def _unweighed(run: _Run, mask: Mask, prior: float) -> Array:
    """Where the step of plain least squares leads."""
    assert run.origin is not None and run.slopes is not None and run.weights is not None
    origin, residual = run.origin
    shares = np.maximum(run.weights, 1e-12)
    step = gauss_newton(run.slopes / shares[:, None], residual[mask] / shares, origin, prior, run.model)
    return np.asarray(np.clip(origin + np.clip(step, -0.5, 0.5), run.model.lower, run.model.upper))


def slopes_at(search: Search, model: Model, u: Array, width: float = WIDTHS[2]) -> Array:
    """(n, P) derivatives of the residual of a model at u, over ``width``."""
    points = [u]
    for k in range(len(u)):
        moved = u.copy()
        moved[k] += width if u[k] + width <= model.upper[k] else -width
        points.append(moved)
    rows, problem = search.residuals([model.hypothesis(v) for v in points]), search.problem
    smooth, weights = weighed(problem, rows[0])
    columns = [
        (problem.smooth(r) - smooth) / (v[k] - u[k]) if np.isfinite(r).all() else np.zeros(len(r))
        for k, (v, r) in enumerate(zip(points[1:], rows[1:], strict=True))
    ]
    if not columns:
        return np.zeros((rows.shape[1], 0))
    return counted(np.stack(columns, axis=1), weights, smooth)
