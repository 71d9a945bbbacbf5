"""What could be in the place of an effect of the model that was found.

Where only motion was measured, a weak motor moves a robot as mass, rotor and friction that are all larger by one factor do. No
single effect looks like another there: several values together do. So it is asked of the whole model at its end, along the
directions that leave its residual as it is.
"""

from __future__ import annotations

import heapq
from collections.abc import Iterator, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.assumed import of_one_guess
from ee_dist.discrepancy.everywhere import FEWEST, stands_out
from ee_dist.discrepancy.evidence.holdout import PRIOR
from ee_dist.discrepancy.evidence.judge import TIE_ENERGY
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.search.candidates import Candidate, not_said, on_top_of, possible
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.screen import SHOWS
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import gauss_newton, slopes_at
from ee_dist.discrepancy.search.trials import calm_trials, telling
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.discrepancy.told import FEW
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

ALIKE = 0.3
"""Share of what an effect leaves that its model cannot make up for without it, that may be left with another in its place."""
PROBE = 0.02
"""Finite differences of these marks: a ridge is straight for a short way only."""
LOOKED_AT, STEPS, BACK, NEARLY, TRIED, WIDTH = 24, 2, 2.0, 0.04, 3, 0.03
"""Exchanges that are simulated, and how many steps along slopes that are known; up to which energy, as a share of that of
the model as it is, or of what is left there, slopes must lead back from there for one to be fitted, unless the values are
few; how many are; and their finite differences."""
FAR_MORE = 4.0
"""Times the median of an effect's values at its places, from which one of them is looked at by itself."""
ASIDE = 0.6
"""Where values are that do nothing by themselves, as a share of their ranges."""
NEARER, REST = 0.05, 0.5
"""By how much less the squares of all values, as shares of their ranges, must add up to, for a model to be nearer to the
description than one that does as well; and share of it that those of the rest may keep, for one effect to say most of what they
said together."""
FOLLOWS, FOLLOWS_LEAST = 0.3, 0.02
"""Share of itself, and of its range, by which a value changes that follows."""


@dataclass(frozen=True, eq=False)
class Instead:
    """``gone``: an effect of a model that was fitted (``was``); ``comes``: what does as well in its place, if all other values
    follow: the last part of the model ``then``, as it was ``fitted``. ``nearer``: to the description than the model was;
    ``better``: what was fitted is told apart in favour of it."""

    gone: Candidate
    was: Fit
    fitted: Fit
    nearer: bool
    better: bool

    @property
    def then(self) -> Current:
        return Current(self.fitted.model.parts, self.fitted.u)

    @property
    def comes(self) -> Candidate:
        return self.fitted.model.parts[-1]


def instead_of(
    search: Search,
    current: Current,
    own: int,
    pool: Sequence[Candidate],
    asked: AbstractSet[str] = frozenset(),
    more: Sequence[tuple[Model, Array]] = (),
) -> list[Instead]:
    """What of ``pool`` could be in the place of an effect beyond the first ``own``, the best for each: the residual is larger by
    no more than two explanations may differ that are not told apart. Effects of which a little is in every robot, and that the
    model has at many joints, are asked for only if the rest is much nearer to the description then: else nobody needs to know
    which of two it is; but all ``asked`` for (names) are. ``more``: exchanges to try beside, and where from."""
    model = Model(current.parts)
    (base,) = search.residuals([model.hypothesis(current.u)])
    search = search.among(calm_trials(search.problem, base))
    mine, floor = search.everything, search.problem.floor
    # What is alike in one trial is tried on all.
    one = telling(search.problem, base, search.trials or range(len(search.problem.trials)))
    looked = search if one is None else search.among([one])
    starts = [*more, *_promising(looked, np.where(looked.everything, base, 0.0), current, own, pool, asked)]
    if not starts:
        return []
    here = float(base[mine] @ base[mine])
    wanted = here + _allowed(here, floor[mine]) + PRIOR * float(current.u @ current.u)
    now, *fits = follow_valley(search, [(model, current.u), *starts], mine, PRIOR, widths=(WIDTH,), wanted=wanted)
    allowed = _allowed(now.energy, floor[mine])
    out: dict[str, Instead] = {}
    guessed = {current.parts[k].name for k in of_one_guess(model)}
    for fit in sorted(fits, key=lambda f: f.energy):
        (gone,) = (c for c in current.parts if c not in fit.model.parts)
        nearer = gone.name not in guessed and bool(fit.u @ fit.u + NEARER < now.u @ now.u)
        if fit.energy - now.energy < allowed and gone.name not in out:
            better = now.energy - fit.energy > allowed
            out[gone.name] = Instead(gone, now, fit, nearer, better)
    return list(out.values())


def _allowed(energy: float, floor: Array) -> float:
    """By how much more energy than this another model does as well, of residual values with a ``floor`` (n,)."""
    return TIE_ENERGY * max(float(floor.mean()), energy / len(floor))


@dataclass(frozen=True, eq=False)
class _Exchange:
    """Part number ``at`` of a model for ``comes``, whose slopes are ``marks`` (n, K); ``u``: all values then, its own last;
    ``rise``: of the energy, as slopes foretell it."""

    rise: float
    at: int
    comes: Candidate
    u: Array
    marks: Array


def _promising(
    search: Search, base: Array, current: Current, own: int, pool: Sequence[Candidate], asked: AbstractSet[str]
) -> list[tuple[Model, Array]]:
    """Exchanges in a model that leaves ``base`` (n,), from whose starts slopes lead back to about that energy, and where to, the
    best first: a ridge bends, and how high a straight step along it ends says little of what is on it."""
    have, mine = Model(current.parts), search.everything
    slopes = slopes_at(search, have, current.u, PROBE)
    marks = _Marks(slopes, slopes.T @ slopes, base, slopes.T @ base, float(base @ base), current.u)
    # What may go: parts without which the model is worse.
    rises = {at: marks.rise(have.places[at]) for at in range(own, len(have.parts))}
    may_go = {at: rise for at, rise in rises.items() if rise >= SHOWS}
    some: list[_Exchange] = []
    others = _others(search.problem.robot, search, current, pool)
    for few in search.batches(len(others)):
        found = _exchanges(search, marks, current, may_go, others[few], asked)
        some = heapq.nsmallest(LOOKED_AT, (*some, *found), key=lambda e: e.rise)
    models = [Model((*have.parts[: e.at], *have.parts[e.at + 1 :], e.comes)) for e in some]
    around = [np.concatenate([np.delete(slopes, have.places[e.at], axis=1), e.marks], axis=1) for e in some]
    wanted = BACK * max(float(base @ base), float(search.problem.floor[mine].sum()))
    at, each = {k: e.u for k, e in enumerate(some)}, len(current.u) <= FEW
    for _ in range(STEPS):
        rows = search.residuals([models[k].hypothesis(u) for k, u in at.items()])
        starts, before, at = [], at, {}
        for (k, u), row in zip(before.items(), rows, strict=True):
            if not np.isfinite(row).all():
                continue
            step = gauss_newton(around[k], row, u, PRIOR, models[k])
            left = row + around[k] @ step
            at[k] = np.clip(u + step, models[k].lower, models[k].upper)
            if each or float(left @ left) <= max(wanted, NEARLY * float(row @ row)):
                starts.append((float(left @ left), models[k], at[k]))
    return [(model, u) for _, model, u in sorted(starts, key=lambda f: f[0])[:TRIED]]


def _exchanges(
    search: Search,
    marks: _Marks,
    current: Current,
    may_go: Mapping[int, float],
    others: Sequence[Candidate],
    asked: AbstractSet[str],
) -> Iterator[_Exchange]:
    """The model with one part of those that ``may_go`` (number: rise of the energy without it) exchanged for one of ``others``,
    from where slopes say that this would lead."""
    robot, places, u = search.problem.robot, Model(current.parts).places, current.u
    together, at_rest = Model(tuple(others)), [_at_rest(c) for c in others]
    slopes = slopes_at(search.on(current.hypothesis), together, np.concatenate([*at_rest, np.zeros(0)]), PROBE)
    for c, rest, place in zip(others, at_rest, together.places, strict=True):
        moves = [k for k in range(c.size) if k not in c.inert]
        its = slopes[:, place]
        if max((float(its[:, k] @ its[:, k]) for k in moves), default=0.0) < SHOWS:
            continue
        beside = marks.beside(its[:, moves])
        for at, without in may_go.items():
            where = places[at]
            rise, values, much = marks.exchanged(where, beside)
            if rise > ALIKE * without:
                continue
            stay = np.delete(u, where)
            known = c.name in asked or _special(robot, current, current.parts[at])
            if not known and not _says_most(c, robot, stay, values):
                continue
            new = rest.copy()
            new[moves] += much
            if np.any(new < c.lower) or np.any(new > c.upper):
                continue
            yield _Exchange(rise, at, c, np.concatenate([values, new]), its.copy())


@dataclass(frozen=True, eq=False)
class _Marks:
    """``slopes`` (n, P) of a model's values ``u``, ``gram`` (P, P) their products; ``base`` (n,) what it leaves, ``along`` (P,)
    its products with the slopes, ``energy`` with itself."""

    slopes: Array
    gram: Array
    base: Array
    along: Array
    energy: float
    u: Array

    def beside(self, marks: Array) -> tuple[Array, Array, Array]:
        """Products of the marks (n, K) of another effect with the model's, (P, K), with one another, and with what is left."""
        return self.slopes.T @ marks, marks.T @ marks, marks.T @ self.base

    def rise(self, gone: slice) -> float:
        """By how much the energy rises where the values ``gone`` are, and the model's others follow; 0 where nothing is gone."""
        return self.exchanged(gone, self.beside(np.zeros((len(self.base), 0))))[0] if gone.stop > gone.start else 0.0

    def exchanged(self, gone: slice, comes: tuple[Array, Array, Array]) -> tuple[float, Array, Array]:
        """By how much the energy rises where the values ``gone`` are, and the model's others and those of an effect that comes
        (its products, as ``beside`` gives them) follow, and what both are then."""
        (cross, own, along), u = comes, self.u[gone]
        stay = np.delete(np.arange(len(self.u)), gone)
        normal = np.block([[self.gram[np.ix_(stay, stay)], cross[stay]], [cross[stay].T, own]])
        target = np.concatenate([self.gram[stay, gone] @ u - self.along[stay], cross[gone].T @ u - along])
        size = float(u @ self.gram[gone, gone] @ u) - 2 * float(u @ self.along[gone])
        values = np.linalg.solve(normal + PRIOR * np.eye(len(target)), target)
        rise = size - 2 * float(values @ target) + float(values @ normal @ values)
        return max(rise, -self.energy), self.u[stay] + values[: len(stay)], values[len(stay) :]


def _at_rest(c: Candidate) -> Array:
    """Values (P,) of an effect that does nothing, and at which its others begin to: a load has no place while it has no mass."""
    u = np.zeros(c.size)
    for k in c.inert:
        u[k] = ASIDE * (c.upper[k] or c.lower[k])
    return u


def _special(robot: Robot, current: Current, c: Candidate) -> bool:
    """Whether a part of the model is one that somebody would go and look at: a fault, or what other joints could have, and only
    this one has, or has far more of."""
    if stands_out(robot, c):
        return True
    if c.members(robot) or len(c.effect.targets(robot)) < FEWEST:
        return False
    places = zip(current.parts, Model(current.parts).places, strict=True)
    much = {other.target: float(np.abs(current.u[where]).max()) for other, where in places if other.effect is c.effect}
    return len(much) == 1 or much[c.target] >= FAR_MORE * float(np.median(list(much.values())))


def _says_most(c: Candidate, robot: Robot, stay: Array, values: Array) -> bool:
    """Whether one effect says most of what the other values of a model (P,) say together without it: of all of them what is
    in every robot to a degree, and a fault of those that follow."""
    if stands_out(robot, c):
        follow = np.abs(values - stay) > np.maximum(FOLLOWS * np.abs(stay), FOLLOWS_LEAST)
        stay, values = stay[follow], values[follow]
    return bool(len(stay)) and float(values @ values) <= REST * float(stay @ stay)


def _others(robot: Robot, search: Search, current: Current, pool: Sequence[Candidate]) -> list[Candidate]:
    """What has values, is not in the model, and for which it has room; not what the model has already, shared otherwise."""
    has, kinds = (*search.fixed, *current.hypothesis), {c.effect.name for c in current.parts}
    others = not_said(robot, current.parts, pool)
    new = [c for c in others if c.size and not (c.effect.name in kinds and c.members(robot))]
    return possible(robot, has, on_top_of(robot, has, new))
