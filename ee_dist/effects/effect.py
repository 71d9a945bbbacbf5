"""What an effect is: a named, bounded change to a robot, with what people and searches need to know of it."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from numbers import Real
from typing import Any

from ee_dist.basics.quoted import quoted
from ee_dist.effects.groups import common, members_of, name_of, shared_targets
from ee_dist.effects.scales import Range, Ranges
from ee_dist.robots.bodies import heaviest
from ee_dist.robots.model import Robot
from ee_dist.robots.system import System
from ee_dist.trials.log import Array

FAMILIES = ("body", "world", "drive", "sensing", "wiring")
OTHER_FAMILIES = ("genes",)
"""Of effects on systems that are no robots."""


class EffectError(ValueError):
    """An unknown effect, target or parameter, or a value out of bounds; the message names what would be right."""


@dataclass(frozen=True)
class Parameter:
    """One number of an effect: its unit, its bounds, and the value at which the effect does nothing.

    ``lower`` and ``upper`` are what physics allows (infinite where it sets no limit); which values are worth trying on
    a robot says ``Effect.bounds``. ``unit`` is that of a hinge; on a slide see ``Effect.unit``.
    """

    name: str
    unit: str
    lower: float
    upper: float
    neutral: float
    meaning: str = ""
    resolution: float = 0.0
    """Smallest change worth telling apart in a report."""
    on_top: str = ""
    """The number of a drive that the value comes on top of: below zero there is less of it than described."""
    by_ratio: bool = False
    """Whether ranges are walked through in equal ratios: a factor of a tenth is as far as one of ten."""
    of_trial: bool = False
    """Whether it is a time since a trial began: any until the longest one ends is worth trying."""

    @property
    def whole(self) -> bool:
        """Whether it is a share of something, from nothing to all of it."""
        return self.unit == "1" and (self.lower, self.neutral, self.upper) == (0.0, 0.0, 1.0)


Transform = Callable[[Any, str, Mapping[str, float]], Any]

SLIDE_UNITS = {
    "rad": "m",
    "rad/s": "m/s",
    "s/rad": "s/m",
    "s^2/rad": "s^2/m",
    "N.m": "N",
    "N.m/rad": "N/m",
    "N.m.s/rad": "N.s/m",
    "rad/(N.m)": "m/N",
    "1/(N.m)": "1/N",
    "kg.m^2": "kg",
}
"""What a unit of a hinge is on a slide."""


@dataclass(frozen=True, eq=False)
class Beside:
    """What a sensor read in a trial and what a model predicts, (N,) each, at times (N,) since the trial began, s."""

    times_s: Array
    measured: Array
    predicted: Array


@dataclass(frozen=True)
class Effect:
    """An entry of the catalogue. ``physics`` and ``signature`` are for people: what it is, what it leaves in a residual."""

    name: str
    family: str
    transform: Transform
    targets: Callable[[Any], tuple[str, ...]]
    parameters: tuple[Parameter, ...]
    physics: str
    signature: str
    reference: str = ""
    searchable: bool = True
    """Whether ``explain`` proposes it by itself."""
    ranges: Ranges | None = None
    """Values worth trying on a robot at a target, for parameters whose scale depends on them."""
    worth_proposing: Callable[[Robot], bool] | None = None
    """On which robots ``explain`` proposes it, where that is not all of them."""
    within: Ranges | None = None
    """How far a robot's other values leave room for it at a target: beyond that a search does not propose it."""
    everywhere: bool = False
    """Whether a little of it is in every real robot, at each of its targets."""
    of: type = Robot
    """The kind of system that it changes; on others it has no targets."""
    guesses: Callable[[Robot], tuple[str, ...]] | None = None
    """The joints at which a description only assumed what it changes: ``explain`` asks for it first there, with one set of values
    for all of them, whether or not it proposes it elsewhere."""
    seen_in: Callable[[Array], Mapping[str, float]] | None = None
    """Its values as readings (T,) of a sensor show them without a model: a search looks there too, for no slope may lead there.
    Empty where they show none."""
    seen_at: Callable[[Robot, str, Array, Array], Mapping[str, float]] | None = None
    """Its values as the commands (T,) and positions (T,) of a joint show them, of all trials and as late as they are; empty where
    they show none, and there it is not proposed unasked."""
    seen_beside: Callable[[Sequence[Beside]], Mapping[str, float]] | None = None
    """Its values as what a model leaves of a sensor shows them: a search looks there too. Empty where it shows none."""
    plainer: str = ""
    """The effect that says most of it with fewer numbers: what a search asks for in its place, once all else is known."""
    mistake: bool = False
    """Whether it says no more than which way round something is, or which is which: a mistake of a description or a mapping, that
    no robot catches and any way of comparing tells."""

    def shared(self, robot: Robot) -> tuple[str, ...]:
        """Groups of joints or sensors that it can act on with one set of values (see groups.py). What is wrong with a part is
        so with all of them only where a little of it is in every robot: masses, but not loads or lost parts. What begins at some
        moment of a trial is the fault of one: sensors that stop at once are a logger that did. Nor do hinges share with slides
        what has another unit there."""
        if (self.family == "body" and not self.everywhere) or any(p.of_trial for p in self.parameters):
            return ()
        allowed = self.targets(robot)
        found = shared_targets(robot, allowed)
        members = {g: members_of(robot, g, allowed) for g in found}
        return tuple(
            g for g in found if all(len({self._unit_at(p, robot, m) for m in members[g]}) == 1 for p in self.parameters)
        )

    def places(self, robot: System, target: str) -> tuple[str, ...]:
        """Where it acts on a system: at its target, or at all members of a group; nowhere that it cannot."""
        allowed = self.targets(robot)
        return (target,) if target in allowed else members_of(robot, target, allowed)

    def proposed(self, robot: Robot) -> tuple[str, ...]:
        """The targets at which ``explain`` proposes it by itself: all or none, but of parts that are fixed to one another only
        the heaviest."""
        sought = self.searchable and (self.worth_proposing is None or self.worth_proposing(robot))
        if not sought or self.family != "body" or not self.parameters or not isinstance(robot, Robot):
            return self.targets(robot) if sought else ()
        found, one_each = self.targets(robot), heaviest(robot)
        parts = {p.name for p in robot.parts}
        return tuple(t for t in found if t in one_each or t not in parts)

    def guessed(self, robot: System) -> str:
        """The joints, or the group, at which a description only assumed what it changes; empty where it assumed nothing."""
        joints = () if self.guesses is None or not isinstance(robot, Robot) else self.guesses(robot)
        return name_of(robot, tuple(j for j in joints if j in self.targets(robot)))

    def guesses_at(self, robot: System, target: str) -> bool:
        """Whether this target is all that the description only assumed."""
        return target != "" and target == self.guessed(robot)

    @property
    def main(self) -> Parameter:
        """The parameter that says how much."""
        return self.parameters[0]

    def parameter(self, name: str) -> Parameter:
        for p in self.parameters:
            if p.name == name:
                return p
        raise EffectError(
            f"{self.name} has no parameter {quoted(name)}; it has: {', '.join(p.name for p in self.parameters)}"
        )

    def checked(self, values: Mapping[str, float]) -> dict[str, float]:
        """All its values, in their order: these, within its bounds, and neutral those that are left out. Raises EffectError."""
        for key, value in values.items():
            p = self.parameter(key)
            if isinstance(value, bool) or not isinstance(value, Real) or not abs(value) <= sys.float_info.max:
                raise EffectError(f"{self.name}: {key} must be a number ({p.unit}), not {quoted(value)}")
            if not p.lower <= value <= p.upper:
                raise EffectError(f"{self.name}: {key} = {value:g} lies outside [{p.lower:g}, {p.upper:g}] {p.unit}")
        return {n: float(v) for n, v in (self.neutral_values() | dict(values)).items()}

    def neutral_values(self) -> dict[str, float]:
        return {p.name: p.neutral for p in self.parameters}

    def bounds(self, robot: Robot, target: str) -> dict[str, Range]:
        """(lower, upper) worth trying at this target, by parameter: finite, around neutral, within the hard bounds.

        For a group, what is worth trying at every member.
        """
        allowed = self.targets(robot)
        if target not in allowed and (members := members_of(robot, target, allowed)):
            return common([self.bounds(robot, m) for m in members])
        own = {} if self.ranges is None else self.ranges(robot, target)
        found = {}
        for p in self.parameters:
            low, high = own.get(p.name, (p.lower, p.upper))
            found[p.name] = (max(p.lower, min(low, p.neutral)), min(p.upper, max(high, p.neutral)))
            if not all(map(math.isfinite, found[p.name])):
                raise EffectError(f"{self.name}: {p.name} has no finite range at {quoted(target)} of {robot.name}")
        return found

    def room(self, robot: Robot, target: str) -> dict[str, Range]:
        """(lower, upper) of each parameter that a search may propose on a robot as it is, at a target or a group."""
        worth = self.bounds(robot, target)
        if self.within is None:
            return worth
        members = members_of(robot, target, self.targets(robot)) or (target,)
        most = common([self.within(robot, m) for m in members])
        return {n: (max(low, most[n][0]), min(high, most[n][1])) for n, (low, high) in worth.items()}

    def shown_in(self, readings: Array) -> dict[str, float]:
        """Its values by parameter, as readings (T,) of a sensor show them by themselves; empty where they show none. Raises
        EffectError where a user's own ``seen_in`` fails, or gives what is none of them."""
        return {} if self.seen_in is None else self._shown("seen_in", partial(self.seen_in, readings))

    def shown_at(self, robot: Robot, joint: str, told: Array, at: Array) -> dict[str, float]:
        """The same, as commands (T,) and positions (T,) of a joint show them (``seen_at``)."""
        return {} if self.seen_at is None else self._shown("seen_at", partial(self.seen_at, robot, joint, told, at))

    def shown_beside(self, trials: Sequence[Beside]) -> dict[str, float]:
        """The same, as a sensor beside a model without it shows them (``seen_beside``)."""
        return {} if self.seen_beside is None else self._shown("seen_beside", partial(self.seen_beside, trials))

    def _shown(self, called: str, look: Callable[[], Mapping[str, float]]) -> dict[str, float]:
        try:
            found = dict(look())
        except (Exception, SystemExit) as error:
            raise EffectError(f"{self.name}: its {called} failed: {type(error).__name__}: {error}") from error
        return self.checked(found) if found else {}

    def unit(self, parameter: str, robot: Robot, target: str) -> str:
        """The unit of a parameter at this target: N on a slide where it is N.m on a hinge, or the unit of a channel."""
        place = next(iter(members_of(robot, target, self.targets(robot))), target)
        return self._unit_at(self.parameter(parameter), robot, place)

    @staticmethod
    def _unit_at(parameter: Parameter, robot: Robot, place: str) -> str:
        """The same at a single joint, part or sensor."""
        unit = parameter.unit
        if unit == "channel":
            return next((s.unit for s in robot.sensors if s.name == place), unit)
        slide = any(j.name == place and j.kind == "slide" for j in robot.joints)
        return SLIDE_UNITS.get(unit, unit) if slide else unit
