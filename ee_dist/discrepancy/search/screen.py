"""Screening: a few rollouts for each candidate tell which could explain the residual at all.

Each probe shifts the prediction by some d. The residual r is best explained by a share a of that shift, a = <d, r>/<d, d>,
which takes <d, r>^2 / <d, d> off its energy: the gain that the candidate promises. For an effect of small, linear action
this is exact from a single probe; for others a probe of the right size comes close.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.discrepancy.search.ground import Ground
from ee_dist.discrepancy.search.refit import Refit
from ee_dist.discrepancy.search.search import Search
from ee_dist.trials.log import Array

SHOWS = 30.0
"""Energy (in variances of noise) of a change of the prediction from which its shape tells what more of it would do."""
FURTHER = 40
"""Candidates at most whose small probes show and that are looked at further on: of fewer all are. Of 160 effects drawn on
six robots the hidden one was among the first twenty as often as with all."""


@dataclass(frozen=True, eq=False)
class Screened:
    """``promise``: energy that the candidate could take off the residual. ``starts``: values (u) to fit from, best
    first. ``reach``: largest change of the prediction that any probe made, as energy. ``elsewhere``: it shows in other
    trials than the one by which most are screened; ``late``: a little of it does nothing, as of a limit that no load reaches."""

    candidate: Candidate
    promise: float
    starts: tuple[Array, ...]
    reach: float
    elsewhere: bool = False
    late: bool = False


def screen(
    search: Search,
    pool: Sequence[Candidate],
    shares: Sequence[float] = (0.1, 0.6),
    refit: Refit = Refit(),  # noqa: B008
    few: Ground | None = None,
) -> list[Screened]:
    """Promise of each candidate on top of what the search has fixed, in the order of the pool. ``refit``: what the values of
    the model so far can make up for by themselves is no promise.

    The smallest probes come first, to one side. What shows in them and is not among the FURTHER best by them needs no more, and
    the larger ones go to the side that they promise; to both for guesses, and where the model is FAR off. What does not show in
    them may show further on. A ``few`` of its rows, where they are given, are enough for all this, but for what does not show
    in them at all."""
    whole = Ground.of(search, refit)
    pool = [seen_beside(search.problem, c, whole.base) for c in pool]
    alone = whole if few is None or few.total <= 0 else few
    rows: list[list[_Probe]] = [[] for _ in pool]
    small = [(i, u) for i, c in enumerate(pool) for u in _smallest(c, shares)]

    def ask(ground: Ground, points: Sequence[tuple[int, Array]], begun: float, ended: float) -> None:
        for part in search.batches(len(points)):
            some = points[part]
            found = ground.search.residuals([(pool[i].term(u),) for i, u in some])
            for (i, u), r in zip(some, found, strict=True):
                if np.isfinite(r).all():
                    rows[i].append(_promise(ground, r, whole.total, pool[i], u))
            search.progress("screening", begun + (ended - begun) * part.stop / len(points))

    every = max(1, sum(len(c.probes(shares)) for c in pool))
    # A third of the larger probes is usual where many candidates are asked for.
    first = len(small) / (len(small) + (every - len(small)) / (3 if len(pool) > FURTHER else 1))
    ask(alone, small, 0.0, first)
    further = _further(pool, rows)
    far = alone.far
    ask(alone, [(i, u) for i in further for u in _larger(pool[i], shares, rows[i], far or pool[i].guess)], first, 0.9)
    hidden: set[int] = set()
    if whole is not alone:
        hidden = {i for i, found in enumerate(rows) if not any(p.shows for p in found)}
        ask(whole, [(i, u) for i in sorted(hidden) for u in pool[i].probes((max(shares),))], 0.9, 1.0)
    search.progress("screening", 1.0)
    return [_screened(c, found, i in hidden) for i, (c, found) in enumerate(zip(pool, rows, strict=True))]


@dataclass(frozen=True, eq=False)
class _Probe:
    """One value (u), the energy that it promises, at which share of it, the energy of the change it makes, and what part of the
    residual (d, r) lies along that change."""

    u: Array
    promise: float
    share: float
    reach: float
    along: float

    @property
    def shows(self) -> bool:
        return self.reach >= SHOWS

    @property
    def unbounded(self) -> float:
        """Energy that the change would take off at the best of all sizes."""
        return self.along**2 / self.reach if self.reach > 0 else 0.0


def seen_beside(problem: Problem, c: Candidate, residual: Array) -> Candidate:
    """The candidate with what its sensor shows of its values beside a model that leaves ``residual`` (n,)."""
    if c.effect.seen_beside is None or c.target not in problem.robot.sensor_names:
        return c
    values = c.effect.shown_beside(problem.beside(residual, problem.robot.sensor_names.index(c.target)))
    return replace(c, hint=tuple(c.shares(values).tolist())) if values and c.has(values) else c


def _smallest(c: Candidate, shares: Sequence[float]) -> list[Array]:
    """The smallest probe of each parameter, to the upper side where it has two; and what the measurements show by themselves."""
    if not c.size:
        return c.probes(shares)
    alone = [u for u in c.probes((min(shares),)) if np.count_nonzero(u) == 1 and tuple(u) != c.hint]
    return [*(u for u in alone if u.max() > 0 or not c.upper[_moved(u)]), *c.hinted]


def _further(pool: Sequence[Candidate], rows: Sequence[Sequence[_Probe]]) -> list[int]:
    """Candidates that are looked at further on."""
    free = [i for i, c in enumerate(pool) if c.size]
    seen = [i for i in free if any(p.shows for p in rows[i])]
    best = sorted(seen, key=lambda i: -max(p.unbounded for p in rows[i]))[:FURTHER]
    needless = {i for i in seen if not pool[i].guess and not _later(pool[i])}.difference(best)
    return [i for i in free if i not in needless]


def _later(c: Candidate) -> bool:
    """Whether it begins at a moment of its own: a little of it from the start on says nothing of all of it from then on."""
    return any(c.effect.parameters[k].unit == "s" for k in c.inert)


def _larger(c: Candidate, shares: Sequence[float], found: Sequence[_Probe], both: bool) -> list[Array]:
    """The other probes, unless to ``both`` sides without those of a parameter to the one of its two sides that its smallest one
    speaks against."""
    against = {}
    for p in () if both else found:
        k = _moved(p.u)
        if p.shows and p.along and _two_sided(c, k):
            against[k] = -np.sign(p.along * p.u[k])
    out = []
    for u in c.probes(shares):
        k = _moved(u)
        opposed = np.count_nonzero(u) == 1 and np.sign(u[k]) == against.get(k)
        if not opposed and not any(np.array_equal(u, p.u) for p in found):
            out.append(u)
    return out


def _moved(u: Array) -> int:
    """The parameter that a probe moves, or moves most."""
    return int(np.abs(u).argmax())


def _two_sided(c: Candidate, k: int) -> bool:
    return bool(c.lower[k] < 0 < c.upper[k])


def _promise(ground: Ground, residual: Array, energy: float, candidate: Candidate, u: Array) -> _Probe:
    """``energy``: of the trials that promises are for, of which these may be one."""
    base, r = ground.base, ground.refit(residual)
    d = base - r
    reach, along = float(d @ d), float(d @ base)
    if reach < 1e-9:
        return _Probe(u, 0.0, 0.0, 0.0, 0.0)
    a = along / reach
    if not len(u):
        a = 1.0
    else:
        size = float(np.abs(u).max())
        low = -1.0 if _two_sided(candidate, _moved(u)) else 0.0
        a = min(max(a, low / size), 1.0 / size)
        a = min(max(a, -3.0), 3.0)
    linear = a * along * 2 - a * a * reach
    direct = ground.total - float(r @ r)
    return _Probe(
        u,
        max(linear, direct, 0.0) * (energy / ground.total if ground.total > 0 else 1.0),
        1.0 if direct >= linear else a,
        reach,
        along,
    )


def _screened(candidate: Candidate, found: Sequence[_Probe], elsewhere: bool) -> Screened:
    if not found:
        return Screened(candidate, 0.0, (), 0.0)
    ordered = sorted(found, key=lambda p: -p.promise)
    starts: list[Array] = []
    if candidate.size > 1:
        # The best point of each parameter, put together: the parameters of an effect often add up (x and y of a push).
        joint = np.zeros(candidate.size)
        for p in reversed(ordered):
            k = _moved(p.u)
            if p.promise > 0:
                joint[k] = p.share * p.u[k]
        starts.append(np.clip(joint, candidate.lower, candidate.upper))
    for p in ordered[:3]:
        # What measurements show is so or it is not: a share of a grid's step is another grid.
        share = 1.0 if tuple(p.u) == candidate.hint else p.share
        starts.append(np.clip(share * p.u, candidate.lower, candidate.upper) if len(p.u) else p.u)
    late = candidate.size == 1 and not found[0].shows
    return Screened(candidate, ordered[0].promise, tuple(starts), max(p.reach for p in found), elsewhere, late)
