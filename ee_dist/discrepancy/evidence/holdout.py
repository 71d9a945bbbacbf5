"""What is held out: windows of the same motions, whole motions, or settings; and fits that have not seen it.

Windows of one motion are evidence only where nothing but noise is left: two windows of a motion share whatever else the
model gets wrong. Where more is left, only another motion, or another setting, tells whether an effect travels.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache, partial

import numpy as np

from ee_dist.discrepancy.evidence.repeats import between_rows, near, near_later
from ee_dist.discrepancy.problem import Index, Mask, Problem
from ee_dist.discrepancy.search.fit import SHORT, fit_all
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import WIDTHS, Leading
from ee_dist.discrepancy.search.valley import LARGE
from ee_dist.discrepancy.thinning import place
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.fixture import STAND
from ee_dist.evaluation.gathered import side_by_side
from ee_dist.robots.ranges import travel
from ee_dist.trials.log import Array, SensorLog

WINDOWS, MOTIONS, SETTINGS = (
    "other windows of the same motions",
    "motions that were not fitted",
    "settings that were not fitted",
)
IN_TURN = {
    WINDOWS: "windows of the fitted motions, held out in turn",
    MOTIONS: "fitted motions held out in turn",
    SETTINGS: "fitted settings held out in turn",
}
"""The same beside trials that were held out from all of it, which take no turn."""
ONE_BY_ONE = 4
"""Up to so many motions or settings each is held out by itself; more are held out in two groups."""
SAME_MOTION = 0.02
"""Two trials are one motion where their commands differ by less than this share of how much they vary, over nearly all of it;"""
SAME_COURSE = 0.15
"""or their positions do by less than this: torques that a controller works out differ each time. Commands too, where one of the
two begins later in the same motion, and rows fall elsewhere in it."""
ROWS = 4000
"""Rows at most by which it is looked whether one begins later."""
MOVES, TAKES_PART = 0.01, 0.2
"""Share of its range by which a joint varies that moves at all, and share of what it varies by at most in a trial in which it
takes part."""
STEPS = 100
"""Steps in which it is looked which way a joint goes."""
PRIOR = 1.0
"""Energy, beside noise, that a value at its bound costs in a fit that will be judged elsewhere: a value that the fitted part
does not determine is neutral there, and not what the part held out would like it to be."""
PIECES = 10
"""Pieces of a segment over which what is above the noise may average out."""
AWAY = 3
"""Iterations that take many values away from where all data had put them, in a turn that holds some of these out."""


@dataclass(frozen=True, eq=False)
class Cut:
    """A way of holding out. ``fold_of`` (segments,): the turn in which a segment is held out; ``unit_of`` (segments,): what
    counts as one piece of evidence, of ``group_of`` (segments,)."""

    name: str
    fold_of: Index
    unit_of: Index
    group_of: Index

    @property
    def folds(self) -> int:
        return int(self.fold_of.max()) + 1

    def seen(self, problem: Problem, fold: int) -> Mask:
        """(n,) residual values that are fitted in a turn."""
        return np.asarray(self.fold_of[problem.segment_of] != fold)

    def by_unit(self, energies: Array) -> Array:
        """(units,) sums of (segments,) energies."""
        return np.bincount(self.unit_of, weights=energies)

    @property
    def groups(self) -> Index:
        """(units,) the group of each unit."""
        out = np.zeros(int(self.unit_of.max()) + 1, dtype=np.int64)
        out[self.unit_of] = self.group_of
        return out


@dataclass(frozen=True, eq=False)
class HeldOut:
    """A model judged on what its fits had not seen: ``residual`` (n,) there, ``seen`` mean square where it was fitted,
    ``fits`` one a turn, on top of what is ``fixed``."""

    cut: Cut
    residual: Array
    seen: float
    fits: tuple[Fit, ...]
    fixed: Hypothesis = ()

    @property
    def energy(self) -> float:
        return float(self.residual @ self.residual)


def in_turn(held_out: str, apart: bool = True) -> str:
    """What was held out (the ``name`` of a cut); where trials were held ``apart`` from all, in words that tell the two apart."""
    return IN_TURN.get(held_out, held_out) if apart else held_out


def windows(problem: Problem) -> Cut:
    """Windows of a trial alternate in two turns; where a trial is a single segment, the trials do."""
    trial = np.asarray(problem.trial_of_segment)
    fold, group = np.zeros(len(trial), dtype=np.int64), trial.copy()
    single = 0
    for k in np.unique(trial):
        members = np.flatnonzero(trial == k)
        if len(members) == 1:
            fold[members] = single
            single = 1 - single
            # Within itself a single window does not vary: such trials are one group.
            group[members] = -1
        else:
            fold[members] = (np.arange(len(members)) + k) % 2
    return Cut(WINDOWS, fold, np.arange(len(trial)), group)


def travelling(problem: Problem) -> list[Cut]:
    """Ways of holding out that a motion or a setting takes part in as a whole; none where there is only one, nor motions where
    each joint has one of its own."""
    trial = np.asarray(problem.trial_of_segment)
    kinds = _kinds(problem)
    # How a robot was held is no setting of it: on a stand nothing says how the floor lies, and nothing there speaks against it.
    settings = [tuple(t for t in m.setup if t.effect != STAND) for m in problem.measured]
    cuts = []
    for name, of_trial in ((MOTIONS, kinds), (SETTINGS, settings)):
        different = list(dict.fromkeys(of_trial))
        if len(different) < 2 or (name == SETTINGS and len(different) == len(settings)):
            continue
        if name == MOTIONS and joint_by_joint(problem, kinds):
            continue
        number = np.array([_turn(different.index(x), len(different)) for x in of_trial])
        cuts.append(Cut(name, number[trial], trial, np.zeros_like(trial)))
    return cuts


def _turn(number: int, of: int) -> int:
    """The turn in which the motion (setting) of that number is held out. Of two groups each has one of every pair, in an order
    that no period of a series falls together with: of pieces that are slow and quick in turn each group has both."""
    return number if of <= ONE_BY_ONE else (number + int(2.0 * place(number // 2))) % 2


def held_out_by(problem: Problem) -> list[Cut]:
    """What is held out: motions and settings, or, of a single motion, windows."""
    return travelling(problem) or [windows(problem)]


def joint_by_joint(problem: Problem, kinds: Sequence[int] | None = None) -> bool:
    """Whether most joints that move do so in a single motion (of the numbers ``kinds``, by trial) each, or each way in a single
    one: what a joint is like there is then told by none of the others, and with its motion held out nothing says anything of
    it. Of a shaft that only ever turned forwards nobody knows its dry friction from a torque that is off."""
    if len(problem.measured) < 2:
        return False
    of = np.array(_kinds(problem) if kinds is None else kinds)
    courses = [_course(problem, t.log) for t in problem.measured]
    read = [s.target for s in problem.robot.sensors if s.kind == "position"]
    targets = read if problem.measured[0].log.joints is None else list(problem.robot.motor_names)
    if not targets or not all(len(c) and np.isfinite(c).any(axis=0).all() for c in courses):
        return False
    least = MOVES * np.array([travel(problem.robot.joint(t)) for t in targets])
    varies = np.stack([np.nanstd(c, axis=0) for c in courses])
    return _mostly_in_one(varies, least, of) or _mostly_in_one(
        np.stack([_each_way(c) for c in courses]), [*least, *least], of
    )


def _mostly_in_one(moved: Array, least: Sequence[float] | Array, of: Index) -> bool:
    """Whether most of what moves (``moved`` (trials, K), by more than ``least`` (K,)) takes part in a single motion each, whose
    number ``of`` (trials,) tells."""
    most = moved.max(axis=0)
    apart = [len(set(of[moved[:, k] > TAKES_PART * most[k]])) == 1 for k in np.flatnonzero(most > least)]
    return len(apart) > 1 and 2 * sum(apart) > len(apart)


def _each_way(course: Array) -> Array:
    """(2 K,) how far each joint of a course (T, K) goes up, and down, by steps in which noise is little."""
    known = course[np.isfinite(course).all(axis=1)]
    steps = np.diff(known[:: max(1, len(known) // STEPS)], axis=0)
    return np.concatenate([np.maximum(steps, 0.0).sum(axis=0), np.maximum(-steps, 0.0).sum(axis=0)])


def _kinds(problem: Problem) -> list[int]:
    """By trial: the number of its motion. Trials with the same commands or positions are repeats; so are those of one name in
    which a controller was in the loop."""
    out: list[int] = []
    for k in range(len(problem.measured)):
        same = [j for j in range(k) if _alike(problem, j, k)]
        out.append(out[same[0]] if same else k)
    return out


def _alike(problem: Problem, a: int, b: int) -> bool:
    one, other = problem.measured[a], problem.measured[b]
    if a in problem.looped or b in problem.looped:
        return one.name == other.name
    if near(one.log.commands, other.log.commands, SAME_MOTION):
        return True
    if _later(one.log, other.log, _read(problem)):
        return True
    first, second = (_course(problem, t.log) for t in (one, other))
    if not np.ptp(first, axis=0).any():
        return False
    commanded = any(np.isfinite(t.log.commands).any() for t in (one, other))
    return near(first, second, SAME_COURSE if commanded else SAME_MOTION)


@lru_cache(maxsize=1024)
def _later(one: SensorLog, other: SensorLog, positions: tuple[int, ...]) -> bool:
    """Whether one is the other's motion begun later, by commands and by positions (columns of the sensors)."""
    coarse = max(between_rows(log.commands[log.readings]) for log in (one, other))
    stride = max(1, max(len(one), len(other)) // ROWS)
    asked = [log.commands[::stride] for log in (one, other)]
    if not near_later(asked[0], asked[1], math.hypot(SAME_COURSE, coarse)):
        return False
    first, second = (_positions(log, positions)[::stride] for log in (one, other))
    return near_later(first, second, 2 * SAME_COURSE)


def _course(problem: Problem, log: SensorLog) -> Array:
    """(T, K) positions of the joints, as they are known or read."""
    return _positions(log, _read(problem))


def _read(problem: Problem) -> tuple[int, ...]:
    """The columns of sensors of position."""
    return tuple(i for i, s in enumerate(problem.robot.sensors) if s.kind == "position")


def _positions(log: SensorLog, columns: Sequence[int]) -> Array:
    return np.asarray(log.sensors[:, list(columns)] if log.joints is None else log.joints)


def cross_fit(
    search: Search,
    starts: Sequence[tuple[Model, Array]],
    cut: Cut,
    widths: Sequence[float] = WIDTHS[2:],
    leading: Leading = None,
    short: int = SHORT,
) -> list[HeldOut]:
    """Each (model, start) fitted in every turn on what is not held out, and judged on the rest. ``leading``, ``short``: slopes
    that are known, and iterations of many values (see fit.py)."""
    problem = search.problem
    residuals = [np.zeros(len(problem.segment_of)) for _ in starts]
    seen, count = np.zeros(len(starts)), 0
    prior = prior_of(search, starts)
    fits: list[list[Fit]] = [[] for _ in starts]
    masks = [mask for fold in range(cut.folds) if not (mask := cut.seen(problem, fold)).all()]
    turns = [partial(fit_all, search, starts, mask, widths, prior, leading, short) for mask in masks]
    for mask, turn in zip(masks, side_by_side(turns), strict=True):
        count += int(mask.sum())
        for i, fit in enumerate(turn):
            residuals[i][~mask] = fit.residual[~mask]
            seen[i] += fit.energy
            fits[i].append(fit)
    return [
        HeldOut(cut, r, float(s) / max(count, 1), tuple(f), search.fixed)
        for r, s, f in zip(residuals, seen, fits, strict=True)
    ]


def held_by_slopes(search: Search, fits: Sequence[Fit], cut: Cut) -> list[HeldOut]:
    """Models that were fitted to all data, judged on what is held out: many values follow in each turn by the slopes that are
    known, few are fitted anew. What the values do is simulated all the same. Where these slopes lead nowhere in any turn, as in a
    residual that is rugged far above the noise, values that have seen all data would be judged on them: those are fitted anew,
    as far as takes them away from there."""
    known = [i for i, f in enumerate(fits) if len(f.u) >= LARGE and f.mask.all()]
    others = [i for i in range(len(fits)) if i not in known]
    found: dict[int, HeldOut] = {}
    for some, leading in ((known, [fits[i].slopes for i in known]), (others, None)):
        if some:
            held = cross_fit(search, [(fits[i].model, fits[i].u) for i in some], cut, leading=leading)
            found |= dict(zip(some, held, strict=True))
    still = [i for i in known if all(np.array_equal(f.u, fits[i].u) for f in found[i].fits)]
    if still:
        anew = cross_fit(search, [(fits[i].model, fits[i].u) for i in still], cut, short=AWAY)
        found |= dict(zip(still, anew, strict=True))
    return [found[i] for i in range(len(fits))]


def prior_of(search: Search, starts: Sequence[tuple[Model, Array]]) -> float:
    """Energy that a value at its bound costs beside one at neutral: PRIOR where noise is left, and more by as much as a value is
    determined less than noise alone would have it. What is above the noise does not average out from one value to the next,
    but at best over some pieces of a segment."""
    problem = search.problem
    rows = search.residuals([m.hypothesis(u) for m, u in starts])
    energies = [float(r @ r) for r in rows if np.isfinite(r).all()]
    above = max(0.0, min(energies, default=0.0) - float(problem.floor.sum()))
    return PRIOR * (1.0 + above / (PIECES * len(problem.segments)))


def bootstrap(
    differences: Array, seed: int = 0, draws: int = 1000, level: float = 0.95, groups: Index | None = None
) -> tuple[float, float]:
    """Interval of the sum of ``differences`` (units,) under resampling of the units, within each of ``groups``
    (units,) if they are given: what shows only in some trials does not vanish because none of them was drawn."""
    d = np.asarray(differences, dtype=float)
    if not np.isfinite(d).all() or not len(d):
        return (-np.inf, np.inf)
    rng = np.random.default_rng([seed, len(d)])
    of = np.zeros(len(d), dtype=np.int64) if groups is None else groups
    sums = np.zeros(draws)
    for g in np.unique(of):
        mine = d[of == g]
        sums += mine[rng.integers(0, len(mine), (draws, len(mine)))].sum(axis=1)
    low, high = np.quantile(sums, [(1 - level) / 2, (1 + level) / 2])
    return float(low), float(high)
