"""Fitting many values of one model at once: Levenberg-Marquardt within bounds.

Where everything is a little wrong, values stand in for one another, and a search that fits them in small groups is caught
between them. All together they have one valley, which slopes lead down. Slopes are taken of the residual before it is
softened (``Problem.smooth``) and weighed as the energy weighs it, which is how robust losses are minimised (Huber 1981,
"Robust Statistics", section 7.8).

Slopes of fifty values are fifty simulations, and a step is eight. So between slopes that are taken anew those of the last step
are corrected by what it showed (Broyden 1965, "A class of methods for solving nonlinear simultaneous equations"), as long as
steps by them pay.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search, least_error
from ee_dist.discrepancy.search.slopes import NEAR, at_end, counted, weighed
from ee_dist.trials.log import Array

LARGE = 10
"""Values from which a model is fitted this way."""
ITERATIONS = 30
WIDEST, NARROWEST = 0.12, 0.006
"""Finite differences, as shares of a value's room: wide while the fit is far off, narrow in the end."""
FINEST = 0.05
"""Share of the narrowest step over which slopes are taken at least, of values of which it changes more than is left: a play
that is known to a thousandth of a radian is not told by slopes over two."""
DAMPINGS = (0.01, 0.1, 1.0, 10.0, 100.0)
"""Tried at once, relative to the one that did best before;"""
PLAIN = (0.1, 1.0, 10.0)
"""those of plain least squares, where more is left than slopes as they are weighed can be trusted with (``slopes.NEAR``)."""
SHORTEST = 100.0
"""Damping, relative, with which a step is so short that slopes which lead nowhere by it lead nowhere."""
GAIN = 0.005
"""Share of the energy that an iteration must take off, or else slopes are taken narrower; at the narrowest it ends."""
BEHIND = 0.5
"""Share of its energy that a better descent has left when one that stands still is given up."""
SLOW, BEGUN = 0.25, 2
"""Share of what is missing to where a descent is of use that a round must take off, from which round on, or else it is given up:
rounds that take off a fifth less each than the one before never come there."""
FOLLOWED, PAYS = 3, 0.02
"""Steps in turn by corrected slopes, at most, and the share of the energy that a step must take off for another to follow it."""


@dataclass(eq=False)
class _Run:
    model: Model
    u: Array
    width: float
    residual: Array
    energy: float = np.inf
    damping: float = 1e-3
    plain_damping: float = 1e-3
    slopes: Array | None = None
    """(n, P) derivatives of the smooth residual where it is fitted,"""
    smooth: Array | None = None
    """(n,) that residual,"""
    weights: Array | None = None
    """(n,) and by what it is weighed."""
    before: tuple[float, Array] | None = None
    """Energy and values before the last step,"""
    rounds: int = 0
    """how often slopes were taken,"""
    round_from: float = np.inf
    """with what energy the last time,"""
    followed: int = 0
    """and which step by the slopes corrected since then comes next (0: they are taken anew)."""
    again: bool = False
    """Whether the same slopes are tried again with shorter steps,"""
    still: bool = False
    """and whether the last slopes led next to nowhere."""
    reach: Array | None = None
    """(P,) the step of each value at most that slopes are taken over in the end: by so much it changes what is left."""
    done: bool = False

    def weighed_slopes(self, rows: int) -> Array:
        """(n, P), zeros where none were taken."""
        if self.slopes is None or self.weights is None or self.smooth is None:
            return np.zeros((rows, len(self.u)))
        return counted(self.slopes, self.weights, self.smooth)


def follow_valley(
    search: Search,
    starts: Sequence[tuple[Model, Array]],
    mask: Mask,
    prior: float = 0.0,
    iterations: int = ITERATIONS,
    widths: Sequence[float] = (WIDEST,),
    settled: bool = False,
    rivals: bool = False,
    same: int = 0,
    values_only: bool = False,
    wanted: float = np.inf,
) -> list[Fit]:
    """The best values of each (model, start) on the residual values of ``mask`` (n,), in the order given, all in step: the best
    of a descent from each of ``widths``, of which the last steps follow ever narrower slopes, unless the start is ``settled``
    in a valley already. ``rivals``: only the best of all starts is wanted, and what comes near it. ``same``: so many values come
    first in all starts, and are alike there: slopes by these are taken once to begin with, beside nothing else. ``values_only``:
    slopes are not, and steps by corrected ones may be the last. ``wanted``: energy above which a descent is of no use: one that
    would not come there is given up. ``prior`` as in slopes.py; ``slopes`` of the results are those of the smooth residual,
    weighed."""
    whole, search = search, search.within(mask)
    points = [np.clip(np.asarray(u, float), m.lower, m.upper) for m, u in starts]
    rows = search.residuals([m.hypothesis(u) for (m, _), u in zip(starts, points, strict=True)])
    runs = [
        _Run(m, u, width, r, _cost(r, u, mask, prior), done=not len(u))
        for (m, _), u, r in zip(starts, points, rows, strict=True)
        for width in widths
    ]
    far = NEAR * float(search.problem.floor[mask].sum())
    known = _alike(search, starts[0][0], points[0], mask, same, widths[0]) if same else None
    while moving := [run for run in runs if not run.done and (run.followed or run.rounds < iterations)]:
        _from_nowhere([run for run in moving if not np.isfinite(run.energy)], search, mask, prior)
        anew = [run for run in moving if not (run.followed or run.again)]
        _slopes([run for run in anew if np.isfinite(run.energy)], search, mask, known)
        known = None
        for run in anew:
            run.rounds, run.round_from = run.rounds + 1, run.energy
        going = [run for run in moving if np.isfinite(run.energy)]
        _steps(going, search, mask, prior, far)
        for run in going:
            _next(run, far, settled, values_only or run.rounds < iterations)
            if run.followed:
                _correct(run, search, mask)
            else:
                run.done = run.done or _never_comes(run, wanted)
        together = len(runs) if rivals else len(widths)
        for k in range(0, len(runs), together):
            _give_up(runs[k : k + together])
        most, so_far = max(len(run.u) for run in moving), least_error([run.energy for run in runs], int(mask.sum()))
        search.progress(f"fitting {most} values", min(run.rounds for run in moving) / iterations, so_far)
    best = [min(runs[k : k + len(widths)], key=lambda r: r.energy) for k in range(0, len(runs), len(widths))]
    rows = np.array([run.residual for run in best])
    if search is not whole:
        rows = whole.residuals([run.model.hypothesis(run.u) for run in best])
    return [
        Fit(run.model, run.u, run.energy - prior * float(run.u @ run.u), row, run.weighed_slopes(int(mask.sum())), mask)
        for run, row in zip(best, rows, strict=True)
    ]


def _from_nowhere(runs: Sequence[_Run], search: Search, mask: Mask, prior: float) -> None:
    """No slope where nothing can be simulated: nearer to neutral."""
    for run in runs:
        run.u = 0.5 * run.u
    for run, r in zip(runs, search.residuals([run.model.hypothesis(run.u) for run in runs]), strict=True):
        run.residual, run.energy = r, _cost(r, run.u, mask, prior)


def _alike(search: Search, model: Model, u: Array, mask: Mask, count: int, width: float) -> Array | None:
    """(n, count) derivatives by the first values of a model, of a model that has no others; None where it cannot be simulated."""
    parts = tuple(c for c, place in zip(model.parts, model.places, strict=True) if place.stop <= count)
    first = Model(parts)
    (row,) = search.residuals([first.hypothesis(u[:count])])
    if not np.isfinite(row).all():
        return None
    run = _Run(first, u[:count], width, row)
    _slopes([run], search, mask)
    return run.slopes


def _slopes(runs: Sequence[_Run], search: Search, mask: Mask, known: Array | None = None) -> None:
    """Derivatives (n, P) of the smooth residual where the mask is, taken anew; but those by the first values, where they are
    ``known`` (n, K)."""
    have = 0 if known is None else known.shape[1]
    points = []
    for run in runs:
        for k in range(have, len(run.u)):
            h = min(run.width, 0.3 * abs(run.u[k]) + 0.2 * run.width)
            h = h if run.reach is None else min(h, float(run.reach[k]))
            v = run.u.copy()
            v[k] += h if run.u[k] + h <= run.model.upper[k] else -h
            points.append((run, v))
    rows = iter(search.residuals([run.model.hypothesis(v) for run, v in points]))
    smooth_of, at = search.problem.smooth, 0
    for run in runs:
        smooth, columns = _here(run, search, mask), []
        for k in range(have, len(run.u)):
            row, gap = next(rows), points[at][1][k] - run.u[k]
            at += 1
            usable = np.isfinite(row).all()
            columns.append((smooth_of(row)[mask] - smooth) / gap if usable else np.zeros(len(smooth)))
        # An effect may have no values of its own.
        first = np.zeros((len(smooth), 0)) if known is None else known
        run.slopes = np.column_stack([first, *columns])


def _here(run: _Run, search: Search, mask: Mask) -> Array:
    """The smooth residual where the run is, and its weights."""
    smooth, weights = weighed(search.problem, run.residual)
    run.smooth, run.weights = smooth[mask], np.maximum(weights[mask], 1e-12)
    return run.smooth


def _steps(runs: Sequence[_Run], search: Search, mask: Mask, prior: float, far: float) -> None:
    """The best of steps of all dampings, if it is better than where the runs are; those of plain least squares too from an energy
    of ``far`` on."""
    tries = [[(plain, d) for plain, d in _tries(run) if not plain or run.energy > far] for run in runs]
    points = [_points(run, mine, prior) for run, mine in zip(runs, tries, strict=True)]
    rows = iter(
        search.residuals([run.model.hypothesis(v) for run, some in zip(runs, points, strict=True) for v in some])
    )
    for run, mine, some in zip(runs, tries, points, strict=True):
        found = [next(rows) for _ in mine]
        costs = [_cost(r, v, mask, prior) for r, v in zip(found, some, strict=True)]
        best, run.before = int(np.argmin(costs)), (run.energy, run.u)
        if costs[best] < run.energy:
            plain, damping = mine[best]
            run.energy, run.u, run.residual = costs[best], some[best], found[best]
            if plain:
                run.plain_damping = max(damping, 1e-7)
            else:
                run.damping = max(damping, 1e-7)
        elif not run.followed:
            run.damping = min(100.0 * run.damping, 1e6)
            run.plain_damping = min(100.0 * run.plain_damping, 1e6)


def _next(run: _Run, far: float, settled: bool, more: bool) -> None:
    """What a run does next, after a step: another by corrected slopes, if that may pay, or slopes anew, narrower where the last
    took next to nothing: at once as narrow as they get where more than ``far`` is left, for what is missing there is not to be
    had of the values. One that is ``settled`` ends with such a step, once shorter ones by the same slopes led nowhere either;
    others at the narrowest. ``more``: whether slopes may be taken again, for corrected ones are no evidence."""
    assert run.before is not None
    before, gained = run.before[0], run.before[0] - run.energy
    run.again = settled and not run.followed and gained <= 0 and run.damping < SHORTEST
    if run.again:
        return
    run.still = not run.followed and gained < GAIN * before
    if run.still:
        run.done = settled or (run.width <= NARROWEST and not _goes_finer(run))
        run.width = max(0.5 * run.width, NARROWEST) if run.energy <= far else NARROWEST
    elif not run.followed and not run.rounds % 2:
        run.width = max(0.7 * run.width, NARROWEST)
    pays = more and gained > PAYS * before and run.followed < FOLLOWED
    run.followed = run.followed + 1 if pays else 0


def _goes_finer(run: _Run) -> bool:
    """Whether slopes are to be taken once more, of values of which the narrowest step changes more than is left, over steps
    that do not: those told nothing of what is left."""
    if run.reach is not None or run.smooth is None or run.slopes is None or run.weights is None:
        return False
    left = float(np.linalg.norm(run.smooth * run.weights))
    reach = left / np.maximum(np.linalg.norm(run.weighed_slopes(len(run.smooth)), axis=0), 1e-12)
    run.reach = np.maximum(reach, FINEST * NARROWEST)
    return bool((reach < NARROWEST).any())


def _never_comes(run: _Run, wanted: float) -> bool:
    """Whether a descent will not come down to where it is of use, by what its last round took off."""
    missing, taken = run.energy - wanted, run.round_from - run.energy
    return run.rounds >= BEGUN and missing > 0 and taken < SLOW * missing


def _give_up(runs: Sequence[_Run]) -> None:
    """Of descents of which the best is wanted, those end that stand still far above it."""
    best = min(run.energy for run in runs)
    for run in runs:
        run.done = run.done or (run.still and best < BEHIND * run.energy)


def _correct(run: _Run, search: Search, mask: Mask) -> None:
    """The slopes, by what the last step showed: changed along it alone, each value counted by what it moves."""
    assert run.slopes is not None and run.smooth is not None and run.before is not None
    was, step = run.smooth, run.u - run.before[1]
    _here(run, search, mask)
    along = np.square(run.slopes).sum(axis=0) * step
    size = float(along @ step)
    if size > 0:
        run.slopes = run.slopes + np.outer(run.smooth - was - run.slopes @ step, along / size)


def _tries(run: _Run) -> list[tuple[bool, float]]:
    """Dampings, and whether of plain least squares."""
    return [(False, run.damping * d) for d in DAMPINGS] + [(True, run.plain_damping * d) for d in PLAIN]


def _cost(r: Array, u: Array, mask: Mask, prior: float) -> float:
    return float(r[mask] @ r[mask]) + prior * float(u @ u) if np.isfinite(r).all() else float("inf")


def _points(run: _Run, tries: Sequence[tuple[bool, float]], prior: float) -> list[Array]:
    """Where steps lead, by least squares weighed or plain, and damped."""
    assert run.slopes is not None and run.smooth is not None and run.weights is not None
    systems = {}
    for plain in {plain for plain, _ in tries}:
        slopes = run.slopes if plain else counted(run.slopes, run.weights, run.smooth)
        values = run.smooth if plain else run.smooth * run.weights
        systems[plain] = slopes.T @ slopes, -(slopes.T @ values)
    return [_step(run, *systems[plain], prior, damping) for plain, damping in tries]


def _step(run: _Run, normal: Array, down: Array, prior: float, damping: float) -> Array:
    """Where a damped Gauss-Newton step leads, values that it would push out of their bounds held there."""
    u, model = run.u, run.model
    scale = np.diag(normal)
    scale = np.maximum(scale, 1e-6 * max(float(scale.max()), 1e-12))
    free = ~at_end(normal, down, u, prior, model)
    system, down = normal + prior * np.eye(len(u)) + damping * np.diag(scale), down - prior * u
    point = u
    for _ in range(4):
        step = np.zeros(len(u))
        if free.any():
            step[free] = np.linalg.solve(system[np.ix_(free, free)], down[free])
        point = np.clip(u + step, model.lower, model.upper)
        out = ((u + step < model.lower) & (u <= model.lower)) | ((u + step > model.upper) & (u >= model.upper))
        if not (out & free).any():
            break
        free &= ~out
    return point
