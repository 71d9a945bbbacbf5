"""The contract of every way of comparing: measured trials against one base model, and the residual for many hypotheses.

A way of comparing (open loop, free run, force balance, a user's own) derives from ``Problem``, fills in its fields and
two methods. Everything above it, from screening to the report, reads what is declared here and nothing else.
"""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ee_dist.discrepancy.blocked import blocked
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.recorded import bridged, not_compared
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.effect import FAMILIES, Beside
from ee_dist.effects.torque_readings import TORQUES_READ_LATE
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.log import Array, SensorLog, late

Index = NDArray[np.int64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class Layout:
    """Where each residual value belongs. Values are cut into segments (windows of a trial); channels have a unit.

    ``time_s`` (n,) is when a value was taken, from the start of its trial; ``reading`` (n,) whether it compares what a
    channel reads (rather than its texture or a computed command); ``floor`` (n,) its mean square under a perfect model, and
    ``known`` (n,) the part of that which is no noise: what calibration left, or what a start that is off does to all that
    follows. ``joint_of_channel``: the motor that a channel belongs to.
    """

    segments: tuple[str, ...]
    trial_of_segment: Index
    segment_of: Index
    channel_of: Index
    time_s: Array
    reading: Mask
    floor: Array
    known: Array
    channels: tuple[str, ...]
    units: tuple[str, ...]
    joint_of_channel: tuple[int | None, ...]
    by_segment: bool = False
    """Whether what is ``known`` differs from segment to segment by itself, as starts do, and not from robot to robot."""


@dataclass(frozen=True, eq=False)
class Series:
    """One channel of one trial as people look at it: (T,) times, measured and predicted values in ``unit``."""

    trial: int
    channel: int
    unit: str
    times_s: Array
    measured: Array
    predicted: Array


class Through(NamedTuple):
    """How far off a model is that runs through: in ``natural_unit``, and as people read it."""

    size: float
    told: str


def joined(series: Sequence[Series]) -> list[Series]:
    """One of each trial and channel, in the order in which they come: stretches of a trial one after another, with a row of NaN
    between, so that no line is drawn from one to the next. So is a gap between readings, over which nothing was measured."""
    parts: dict[tuple[int, int], list[Series]] = {}
    for s in series:
        parts.setdefault((s.trial, s.channel), []).extend(_pieces(s))
    return [own[0] if len(own) == 1 else _one(own) for own in parts.values()]


def _pieces(series: Series) -> list[Series]:
    ends = [0, *(np.flatnonzero(late(series.times_s)) + 1).tolist(), len(series.times_s)]
    if len(ends) == 2:
        return [series]
    cut = ("times_s", "measured", "predicted")
    return [replace(series, **{n: getattr(series, n)[a:b] for n in cut}) for a, b in pairwise(ends)]


def _one(parts: Sequence[Series]) -> Series:
    def across(name: str) -> Array:
        found = [getattr(parts[0], name)]
        for p in parts[1:]:
            own = getattr(p, name)
            found += [own[:1] if name == "times_s" else np.array([np.nan]), own]
        return np.concatenate(found)

    return replace(parts[0], times_s=across("times_s"), measured=across("measured"), predicted=across("predicted"))


IN_STEPS = (
    "Each command is taken to have acted in one step of a simulation, and not to have been held until the next row, as a robot's "
    "drives do ('commands_between: held' in the mapping says that they did)."
)
EVENT = 170.0
"""Energy of a few values that come a step early or late, at a contact or a reversal: a model good to the noise misses some."""
TIMES_NOISE = "times the noise"
"""The unit of an error of channels that have no unit in common."""


class Problem(ABC):
    """Measured trials against one base model, under one way of comparing.

    A residual value is (measured - predicted) / scale, so that values of all channels can be added up. Facts with a
    default are those that most ways need not think about.
    """

    way: str
    """Its name on the command line, ``task.by``."""
    robot: Robot
    """The base model that hypotheses are applied to."""
    measured: tuple[MeasuredTrial, ...]
    layout: Layout
    error_definition: str
    """One sentence: what the error number is, with its unit."""
    natural_name: str = "error"
    """What ``natural`` gives, in a user's words."""
    natural_unit: str = "standard deviations"
    averaged: str = "what is compared"
    """What ``raw`` values are, beside the rows of a log."""
    families: frozenset[str] = frozenset(FAMILIES)
    """Families of effects that can show in this way of comparing."""
    switches: bool = True
    """Whether effects without a parameter (a part that is lost) can be told in this way of comparing."""
    gained: float = 0.0
    """Energy that the most promising effect took off an untouched robot (from calibration)."""
    shared_by_trials: str = ""
    """Why a trial has another error by itself than beside these others, for people; empty: it has the same."""
    unjudged: tuple[str, ...] = ()
    """Joints that move, but at which nothing is compared: what several joints share is looked for at the others."""
    calibrated: bool = False
    """Whether the model was calibrated on an untouched robot: its own terms are then known, not free."""

    @abstractmethod
    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        """(H, n): one row a hypothesis. Rows with numbers that are not finite mean a model that cannot be simulated.

        With ``trials`` only those are computed; values of the others are zero, whatever the hypothesis.
        """

    @property
    def piece_of(self) -> Index:
        """(n,) the piece of a trial that each residual value is simulated in: the trial, unless a way starts anew within."""
        return self.trial_of

    def residuals_of_pieces(self, hypotheses: Sequence[Hypothesis], pieces: Collection[int]) -> Array:
        """(H, n): those of some pieces (see ``piece_of``) alone; values of the others are zero, whatever the hypothesis."""
        return self.residuals(hypotheses, tuple(pieces))

    @abstractmethod
    def noise_floor(self) -> tuple[float, str]:
        """The error that a perfect model would have, and where the figure comes from."""

    @abstractmethod
    def raw(self, residual: Array) -> Array:
        """(n,): residual values in the units of their channels; NaN where a value compares no reading."""

    @abstractmethod
    def series(self, hypothesis: Hypothesis) -> list[Series]:
        """Measured and predicted, trial by trial and channel by channel."""

    def smooth(self, residual: Array) -> Array:
        """(n,) residual values as they follow a parameter smoothly: before large ones are softened."""
        return residual

    def natural(self, error: float) -> float:
        """An error in ``natural_unit``."""
        return error

    def told(self, error: float) -> str:
        """An error as people read it, with its unit."""
        return f"{error:.3g}"

    def weight_of(self, trial: int) -> float:
        """By what squares of a trial's residual values are weighed beside those of the other trials."""
        return 1.0

    def trial_error(self, residual: Array, trial: int) -> float:
        """The error of one trial by itself, of the residual (n,) of all."""
        return error(residual[self.trial_of == trial]) / math.sqrt(self.weight_of(trial))

    def beside(self, residual: Array, channel: int) -> list[Beside]:
        """What a sensor read and what the model that leaves ``residual`` (n,) predicts of it, of each trial that was simulated;
        none where a way cannot tell one from the other."""
        return []

    def simulated(self, hypothesis: Hypothesis, beside: Sequence[Sensor] = ()) -> list[SensorLog | None]:
        """The simulated motion of each trial with the poses of all parts, and, after its own channels, what sensors ``beside``
        the robot's would read; None where nothing is simulated."""
        return [None] * len(self.measured)

    def shows(self, effect: str, target: str) -> bool:
        """Whether an effect of one of ``families`` can show at a place in these very data. A supply that was measured sags as it
        was measured to: what would take more off it stands in for something else. When the torques of a log were read shows only
        where they are compared: a balance of forces says so itself, and sensors of torque have delays of their own."""
        return effect != TORQUES_READ_LATE and (effect != "supply_sag" or not self.supply_known)

    @cached_property
    def supply_known(self) -> bool:
        """Whether the voltage of the supply was recorded in every trial, for drives that are described to follow it."""
        logged = all(t.log.supply_v is not None for t in self.measured)
        return logged and any(d.supply_nominal_v > 0 for d in self.robot.drives)

    def remarks(self, hypothesis: Hypothesis) -> list[str]:
        """What this way alone can say about what a model leaves, in lines for people."""
        return []

    def says_nothing(self, model: Hypothesis) -> str:
        """Why a model that leaves little says next to nothing of what was measured; empty: it does say something."""
        return ""

    def never_moves(self, model: Hypothesis) -> str:
        """Why a model, run through, does not move where the robot did and its description does; empty: it does. In windows it
        goes on with the speed that it is given."""
        return ""

    def run_through(self, models: Sequence[Hypothesis]) -> list[Through] | None:
        """How far off each of some models is over whole records, where a search goes by windows of them and controllers lead the
        robot; None elsewhere."""
        return None

    def other_errors(self, *models: Hypothesis) -> list[str]:
        """Errors of a model, or of one and another made from it, as this way counts them elsewhere, in lines for people."""
        return []

    def farther_off(self, before: Hypothesis, after: Hypothesis, fell: bool) -> str:
        """Where the model ``after`` is farther off than the one ``before`` in plain numbers, or hardly nearer in any, for people;
        empty: nowhere, or the error itself is such a number. ``fell``: whether the error did."""
        return ""

    def spoiled(self, model: Hypothesis) -> list[str]:
        """What makes a comparison with this model worth little, in lines for people that every verb says."""
        return []

    @property
    def notes(self) -> list[str]:
        """What of these measurements is not compared, or not as it was recorded, and why: every verb says so."""
        in_steps = any(t.hardware and t.commands_held is False for t in self.measured)
        left_out = not_compared(self.measured, self.robot) + bridged(self.measured)
        return [IN_STEPS] * in_steps + left_out + blocked(self.measured, self.robot)

    @property
    def doubts(self) -> str:
        """What about these measurements is to be put right before anything that is found in them is believed; empty: nothing."""
        return ""

    @cached_property
    def numbers(self) -> tuple[int, ...]:
        """Those of the trials in their log, from 1 on: of some that were chosen too."""
        return tuple(t.number or k for k, t in enumerate(self.measured, start=1))

    @cached_property
    def trials(self) -> tuple[str, ...]:
        return tuple(t.name for t in self.measured)

    @property
    def searched(self) -> Problem:
        """What a search fits and judges by: itself, unless another view of the same measurements tells more."""
        return self

    @property
    def whole(self) -> Problem:
        """For people to look at: all of these measurements, of which a search may have taken a part."""
        return self

    def as_searched(self, like: Problem) -> Problem:
        """The measure that a search of another problem (``like``) went by, of all of these trials, which took no part in it:
        errors stand beside those of the search."""
        return self

    @cached_property
    def events(self) -> Array:
        """(trials, channels) energy that a few values may have which come a step early or late: as much as contacts have, unless
        a way knows better."""
        return np.full((len(self.measured), len(self.channels)), EVENT)

    @property
    def looped(self) -> tuple[int, ...]:
        """Trials in which a controller was in the loop: only there does wiring show."""
        return ()

    @property
    def trust(self) -> tuple[float, ...]:
        """How predictable each trial is, by any scale; equal where the way does not know."""
        return (1.0,) * len(self.measured)

    def beginning(self, seconds: float) -> Problem:
        """The same problem with the first ``seconds`` of each trial alone, for what only looks where to go; itself where that
        would save little, or where a way cannot cut its trials."""
        return self

    # -- names of the layout, which everything reads -------------------------------------------------------------------

    @property
    def segments(self) -> tuple[str, ...]:
        return self.layout.segments

    @property
    def segment_of(self) -> Index:
        return self.layout.segment_of

    @property
    def trial_of_segment(self) -> Index:
        return self.layout.trial_of_segment

    @property
    def channel_of(self) -> Index:
        return self.layout.channel_of

    @property
    def channels(self) -> tuple[str, ...]:
        return self.layout.channels

    @property
    def floor(self) -> Array:
        return self.layout.floor

    @property
    def sure(self) -> Array:
        """(n,) what of the floor is noise beyond doubt; less, where the floor is only known to be no higher."""
        return self.floor

    def floor_under(self, hypothesis: Hypothesis) -> float:
        """The sum of the floor, were the robot as a hypothesis says: what starts that are off make of a motion is another's then.
        Raises EffectError for one that does not fit the robot."""
        return float(self.floor.sum())

    @cached_property
    def curves(self) -> tuple[tuple[int, str], ...]:
        """The trials, and the channels of each, that a residual has values of."""
        there = np.unique(self.trial_of * len(self.channels) + self.channel_of)
        return tuple((int(k) // len(self.channels), self.channels[int(k) % len(self.channels)]) for k in there)

    @cached_property
    def compared(self) -> tuple[str, ...]:
        """The channels that a residual has values of: what nobody recorded in any of these trials is none of them."""
        there = {channel for _, channel in self.curves}
        return tuple(name for name in self.channels if name in there)

    @cached_property
    def trial_of(self) -> Index:
        """(n,) the trial of each residual value."""
        return np.asarray(self.layout.trial_of_segment[self.layout.segment_of])

    @cached_property
    def joint_of(self) -> Index:
        """(n,) the motor that the channel of each residual value belongs to; -1 for none."""
        joints = np.array([-1 if j is None else j for j in self.layout.joint_of_channel], dtype=np.int64)
        return np.asarray(joints[self.layout.channel_of])


def error(residuals: Array) -> float:
    """Root mean square of residual values: the one error number. Infinite where a model cannot be simulated."""
    return float(np.sqrt(np.mean(np.square(residuals)))) if np.isfinite(residuals).all() else float("inf")


def per_segment(problem: Problem, residual: Array) -> Array:
    """(segments,) energy of one residual (n,)."""
    return np.bincount(problem.segment_of, weights=residual**2, minlength=len(problem.segments))


def joints_of(robot: Robot, targets: Sequence[str]) -> tuple[int | None, ...]:
    """The motor that each target (a joint, a part) is, if it is one."""
    names = list(robot.motor_names)
    return tuple(names.index(t) if t in names else None for t in targets)
