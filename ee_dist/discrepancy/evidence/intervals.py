"""How sure a fitted value is: by noise where only noise is left, by the spread between trials where more is left, and by what
is left itself where it stands out, for that may be an effect of nearly the same mark."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy  # which loads its parts when they are used; scipy.stats, which calls these functions, takes a second

from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.evidence.rule import least_energy
from ee_dist.discrepancy.problem import Mask, Problem
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.discrepancy.search.fitted import Fit
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

AT_BOUND = 0.985
"""Share of the way to a bound from which a value counts as being at it."""
LEVEL = 0.95
PARTS = 4
"""Windows of what stands out that count as pieces by themselves, where fewer curves do. Of 141 values of 47 robots of one joint,
one record each by a balance of forces, whose models lacked one or two effects, 99 % were within the interval so, and 100 % at 4.6
times its width, by curves alone."""
FARTHER = 2.0
"""Times its interval that a value may be off beside what was guessed, to be told so."""
FEW = 3
"""Trials from which they are the pieces that vary; with fewer, segments are."""
NOT_DETERMINED = "not determined by these data"
ENDED = "at its bound"
BOUND = f"{ENDED}: the range is too small, or the effect is another"
NONE_LEFT = f"{ENDED}: next to none is left of what was described"
NO_LIGHTER = (
    f"{ENDED}: with less its controller would shake in this time step; write what is left into the description (or a smaller "
    "time_step_s), and begin anew"
)
LEFT_AT_MOST = 0.15
"""Share of what was described up to which next to none is left."""
NEUTRAL = "not told from neutral"
HARDLY = "hardly told from neutral: of as many effects as were tried, luck may tell one as far"
EITHER = "the other sign does as well"
TOGETHER = "told only together with others of the model, which make up for it"
BESIDE_GUESSES = "told only beside what the description guessed of these drives, which may make up for it"
WIDER = "widened by what is left unexplained"
ALL_OF_IT = "what is left unexplained could be all of it"


@dataclass(frozen=True)
class ParameterReport:
    """A fitted value of term number ``term`` with its 95 % interval, in the parameter's own unit; ``flag`` says what is
    wrong with it, if anything, ``doubt`` what the rest that the model leaves has to do with it. ``tells``: whether it tells that
    the effect is there; the moment from which a sensor sticks does not, if what sticks may be none."""

    term: int
    name: str
    value: float
    low: float
    high: float
    flag: str
    doubt: str = ""
    tells: bool = True

    @property
    def note(self) -> str:
        """Both."""
        return "; ".join(filter(None, (self.flag, self.doubt)))


def parameters(
    problem: Problem,
    fit: Fit,
    left: Sequence[Leftover] = (),
    tried: int = 0,
    either: Mask | None = None,
    flat: Array | None = None,
    guesses: Array | None = None,
) -> list[ParameterReport]:
    """Every value of a fit, in the order of its terms; ``left`` is what stands out of its residual. ``tried``:
    how many effects were in question, of which one in twenty is told from neutral for nothing (0: those of the fit). ``either``
    (P,): values of which the other sign does as well (signs.py); ``flat`` (P,): how far values may go together with others
    (together.py); ``guesses`` (P,): half intervals with what was guessed free as well (left_as_guessed.py)."""
    half_u = half_widths(problem, fit)
    along = np.zeros(len(fit.u)) if flat is None else flat
    beside = np.zeros(len(fit.u)) if guesses is None else guesses
    by_luck = math.sqrt(least_energy(tried)) / scipy.special.ndtri(0.5 + LEVEL / 2) if tried else 1.0
    wider = np.maximum(half_u, half_widths_by_rest(problem, fit, left))
    out, at = [], 0
    hypothesis: Hypothesis = fit.hypothesis
    for index, (c, term) in enumerate(zip(fit.model.parts, hypothesis, strict=True)):
        u, s, w = (x[at : at + c.size] for x in (fit.u, half_u, wider))
        rooms = c.rooms(u)
        for k, (name, value) in enumerate(term.values):
            room = abs(float(rooms[k]))
            half = (
                max(float(w[k]), float(along[at + k]), float(beside[at + k])) * room if np.isfinite(w[k]) else math.inf
            )
            # By the data alone: what earned its place is told, though something else may have gone into its value. At a bound the
            # slope is of one side, and may say next to nothing of a value that the other side would tell.
            flag = at_bound(c, k, float(u[k]), value, _described(problem.robot, c, k))
            if not np.isfinite(s[k]) or float(s[k]) * room > max(room, 1e-12):
                flag = f"{flag}; {NOT_DETERMINED}" if flag else NOT_DETERMINED
            elif not flag and abs(u[k]) < s[k]:
                flag = NEUTRAL
            elif not flag and abs(u[k]) < by_luck * s[k]:
                flag = HARDLY
            elif not flag and either is not None and either[at + k]:
                flag = EITHER
            if flag in ("", HARDLY, EITHER) and along[at + k] > s[k]:
                flag = TOGETHER
            if flag in ("", HARDLY, EITHER) and beside[at + k] > FARTHER * s[k]:
                flag = BESIDE_GUESSES
            doubt = "" if w[k] <= s[k] else ALL_OF_IT if abs(u[k]) < w[k] else WIDER
            low, high = value - half, value + half
            if math.isfinite(half):  # no farther than physics allows
                known = c.effect.parameters[k]
                # Of what is described no more can be taken off than is there.
                least = max(known.lower, c.bounds[k][0]) if known.on_top else known.lower
                low, high = max(low, min(least, value)), min(high, max(known.upper, value))
            out.append(ParameterReport(index, name, value, low, high, flag, doubt, k not in c.inert))
        at += c.size
    return out


def _described(robot: Robot, c: Candidate, k: int) -> float:
    """How much is described of what a parameter comes on top of, the least of several joints; 0 where it is on top of nothing."""
    field, at = c.effect.parameters[k].on_top, {*(c.members(robot) or (c.target,))}
    return min((float(getattr(d, field)) for d in robot.drives if d.joint in at), default=0.0) if field else 0.0


def at_bound(c: Candidate, k: int, u: float, value: float = 0.0, described: float = 0.0) -> str:
    """What to think of the ``value`` of a candidate's parameter number ``k``, on top of what is ``described``, if it ended where
    the search may not go farther. That all of something is lost, as of a frozen sensor or a dead motor, is an answer."""
    known, (_, end) = c.effect.parameters[k], c.bounds[k]
    if abs(u) <= AT_BOUND or (u > 0 and known.whole and end == known.upper):
        return ""
    if u < 0 and known.on_top == "rotor_inertia" and value > (LEFT_AT_MOST - 1.0) * described:
        return NO_LIGHTER
    return NONE_LEFT if u < 0 and known.on_top else BOUND


def called(reports: Sequence[ParameterReport]) -> str:
    """``95 % intervals``, and whether what is left unexplained has widened any of them."""
    return f"{100 * LEVEL:.0f} % intervals" + (f", {WIDER}" if any(p.doubt for p in reports) else "")


def half_widths(problem: Problem, fit: Fit, level: float = LEVEL) -> Array:
    """(P,) half the interval of each u.

    The larger of two: from the noise of single values, and from the spread between pieces of evidence, trials where there
    are three or more (cluster-robust covariance, Liang and Zeger 1986), with Student's quantile for so few pieces. Infinite
    where the data say nothing.
    """
    if not len(fit.u) or not fit.mask.any():
        return np.full(len(fit.u), np.inf)
    inverse, weak = _inverse(fit)
    excess = max(1.0, fit.energy / max(1, int(fit.mask.sum()) - len(fit.u)))
    by_noise = np.sqrt(np.maximum(np.diag(inverse), 0.0) * excess) * scipy.special.ndtri(0.5 + level / 2)
    piece = problem.trial_of if len(problem.trials) >= FEW else problem.segment_of
    piece = np.unique(piece[fit.mask], return_inverse=True)[1]
    count = int(piece.max()) + 1
    if count < 2:
        return np.where(weak, np.inf, by_noise)
    pull = fit.slopes * fit.residual[fit.mask][:, None]
    scores = np.stack([np.bincount(piece, weights=column, minlength=count) for column in pull.T], axis=1)
    spread = inverse @ (scores.T @ scores) @ inverse * count / (count - 1)
    by_pieces = np.sqrt(np.maximum(np.diag(spread), 0.0)) * scipy.special.stdtrit(count - 1, 0.5 + level / 2)
    return np.where(weak, np.inf, np.maximum(by_noise, by_pieces))


def half_widths_by_rest(problem: Problem, fit: Fit, left: Sequence[Leftover], level: float = LEVEL) -> Array:
    """(P,) how far each u may be off because an effect that is not in the model has gone into it.

    The fit has taken all of that effect that runs along its slopes, and what is left runs across them: its scores are zero, so
    that no spread of theirs says anything. Its size does. What is missing leaves one pattern in a curve (a channel during a
    trial), however many values that has; so each curve that stands out counts as one piece, which moves a value by as much as a
    pattern of the size of its rest can (Cauchy and Schwarz). For a pattern that may run anywhere, along the slopes or across,
    the ratio of the one to the other is Student's, with as many degrees of freedom as there are such curves (as many as would
    count alike), or as they have windows, up to PARTS: a record says no less for not having been cut into several files. Zero
    where nothing stands out."""
    inverse, _ = _inverse(fit)
    pulls = fit.slopes @ inverse
    trial, channel = problem.trial_of[fit.mask], problem.channel_of[fit.mask]
    places = {name: k for k, name in enumerate(problem.channels)}
    moved = [
        (pulls[(trial == g.index) & (channel == places[g.channel])] ** 2).sum(axis=0) * max(g.excess, 0.0) for g in left
    ]
    squares = np.array(moved).reshape(len(moved), len(fit.u))
    total = squares.sum(axis=0)
    pieces = np.divide(total**2, (squares**2).sum(axis=0), out=np.ones(len(fit.u)), where=total > 0)
    of = np.asarray(problem.trial_of_segment)
    windows = sum(int((of == g.index).sum()) for g in left)
    pieces = np.maximum(pieces, min(windows, PARTS))
    return np.asarray(np.sqrt(total) * scipy.special.stdtrit(pieces, 0.5 + level / 2))


def _inverse(fit: Fit) -> tuple[Array, Mask]:
    """(P, P) covariance of the values for noise of one, and (P,) which of them the data say nothing about."""
    normal = fit.slopes.T @ fit.slopes
    weak = np.diag(normal) < 1e-9
    return np.linalg.pinv(normal + np.diag(np.where(weak, 1e-9, 0.0))), weak
