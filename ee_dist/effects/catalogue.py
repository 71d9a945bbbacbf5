"""The registry of effects: named, bounded changes to a robot. And hypotheses: short lists of them.

An effect is registered by decorating its transform ``(robot, target, values) -> robot``::

    @effect("motor_weak", family="drive", targets=motors, parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0),), ...)
    def motor_weak(robot, target, values): ...

A user's own file does the same and takes part in everything; see docs/own_effect.md.
"""

from __future__ import annotations

import math
import re
import sys
from collections import ChainMap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from numbers import Real
from types import MappingProxyType
from typing import Any, TypeVar

from ee_dist.basics.names import did_you_mean, listed, nearest
from ee_dist.basics.quoted import quoted
from ee_dist.effects.groups import common, members_of, name_of, shared_targets
from ee_dist.effects.scales import Range, Ranges
from ee_dist.robots.bodies import heaviest
from ee_dist.robots.model import Robot, RobotError
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
Model = TypeVar("Model", bound=System)

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
RESERVED = frozenset({"effect", "target", "effect_name"})


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
        so with all of them only where a little of it is in every robot: masses, but not loads or lost parts. Nor do hinges
        share with slides what has another unit there."""
        if self.family == "body" and not self.everywhere:
            return ()
        allowed = self.targets(robot)
        found = shared_targets(robot, allowed)
        members = {g: members_of(robot, g, allowed) for g in found}
        return tuple(
            g for g in found if all(len({self._unit_at(p, robot, m) for m in members[g]}) == 1 for p in self.parameters)
        )

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
        return dict(term(self.name, "", **found).values) if found else {}

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


@dataclass(frozen=True)
class Term:
    """One effect at one target with its values: a line of a model file."""

    effect: str
    target: str
    values: tuple[tuple[str, float], ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """{effect, target, <parameter>: value, ...}: the form of a model file."""
        return {"effect": self.effect, "target": self.target, **dict(self.values)}

    @property
    def name(self) -> str:
        """``effect@target``, as typed on the command line."""
        return f"{self.effect}@{self.target}" if self.target else self.effect

    def __str__(self) -> str:
        entry = EVERY.get(self.effect)
        shown = []
        for name, value in self.values:
            unit = entry.parameter(name).unit if entry else ""
            shown.append(f"{name} {value:.4g}" + (f" {unit}" if unit not in ("", "1") else ""))
        where = f" at {self.target}" if self.target else ""
        return f"{self.effect}{where}" + (f" ({', '.join(shown)})" if shown else "")


Hypothesis = tuple[Term, ...]

registered: dict[str, Effect] = {}
"""Where ``effect`` enters those on robots; what others read is CATALOGUE."""
_others: dict[str, Effect] = {}
CATALOGUE: Mapping[str, Effect] = MappingProxyType(registered)
"""All effects on robots by name, in the order in which they were registered."""
EVERY: Mapping[str, Effect] = MappingProxyType(ChainMap(_others, registered))
"""These, and the effects on other systems."""


def effect(
    name: str,
    *,
    family: str,
    targets: Callable[[Any], tuple[str, ...]],
    parameters: tuple[Parameter, ...] = (),
    physics: str,
    signature: str,
    reference: str = "",
    searchable: bool = True,
    ranges: Ranges | None = None,
    worth_proposing: Callable[[Robot], bool] | None = None,
    within: Ranges | None = None,
    everywhere: bool = False,
    of: type = Robot,
    guesses: Callable[[Robot], tuple[str, ...]] | None = None,
    seen_in: Callable[[Array], Mapping[str, float]] | None = None,
    seen_at: Callable[[Robot, str, Array, Array], Mapping[str, float]] | None = None,
    seen_beside: Callable[[Sequence[Beside]], Mapping[str, float]] | None = None,
    plainer: str = "",
    mistake: bool = False,
) -> Callable[[Transform], Transform]:
    """Register a transform as an effect. Raises EffectError where the name is taken or a fact contradicts itself."""

    def register(transform: Transform) -> Transform:
        if name in EVERY and EVERY[name].transform.__module__ != transform.__module__:
            raise EffectError(f"an effect named {quoted(name)} exists already")
        if not name.isidentifier():
            raise EffectError(f"{quoted(name)} cannot be the name of an effect; expected a word such as my_friction")
        if family not in (*FAMILIES, *OTHER_FAMILIES):
            raise EffectError(f"{name}: no family {quoted(family)}; there are: {', '.join(FAMILIES)}")
        for p in parameters:
            if not p.name.isidentifier() or p.name in RESERVED:
                raise EffectError(f"{name}: {quoted(p.name)} cannot be the name of a parameter")
            if not p.lower <= p.neutral <= p.upper or not math.isfinite(p.neutral):
                raise EffectError(f"{name}: the neutral value of {p.name} lies outside its bounds")
            if ranges is None and not (math.isfinite(p.lower) and math.isfinite(p.upper)):
                raise EffectError(f"{name}: {p.name} has no finite bounds, so the effect must give ranges")
        (registered if of is Robot else _others)[name] = Effect(
            name,
            family,
            transform,
            _Asked(name, targets, of),
            parameters,
            physics,
            signature,
            reference,
            searchable,
            ranges,
            worth_proposing,
            within,
            everywhere,
            of,
            guesses,
            seen_in,
            seen_at,
            seen_beside,
            plainer,
            mistake,
        )
        return transform

    return register


@dataclass(frozen=True)
class _Asked:
    """``targets`` of the effect ``name``, of which a user's own may fail or give something else: then it raises EffectError.
    None on a system of another kind than ``of``."""

    name: str
    targets: Callable[[Any], tuple[str, ...]]
    of: type

    def __call__(self, robot: System) -> tuple[str, ...]:
        if not isinstance(robot, self.of):
            return ()
        try:
            found = self.targets(robot)
        except (Exception, SystemExit) as error:
            raise EffectError(
                f"{self.name}: its targets failed on {robot.name}: {type(error).__name__}: {error}"
            ) from error
        if not isinstance(found, (tuple, list)) or not all(isinstance(t, str) for t in found):
            raise EffectError(f"{self.name}: its targets gave {quoted(found)}; expected a tuple of names")
        return tuple(found)


def find(name: str) -> Effect:
    """The effect of that name. Raises EffectError with the nearest names."""
    if name in EVERY:
        return EVERY[name]
    raise EffectError(f"no effect named {quoted(name)}; {did_you_mean(name, EVERY, cutoff=0.5)}")


def term(effect_name: str, target: str = "", **values: float) -> Term:
    """A term with its values checked against the effect's parameters and bounds; parameters left out are neutral."""
    entry = find(effect_name)
    for key, value in values.items():
        p = entry.parameter(key)
        if isinstance(value, bool) or not isinstance(value, Real) or not abs(value) <= sys.float_info.max:
            raise EffectError(f"{effect_name}: {key} must be a number ({p.unit}), not {quoted(value)}")
        if not p.lower <= value <= p.upper:
            raise EffectError(f"{effect_name}: {key} = {value:g} lies outside [{p.lower:g}, {p.upper:g}] {p.unit}")
    filled = entry.neutral_values() | {k: float(v) for k, v in values.items()}
    return Term(effect_name, target, tuple((p.name, float(filled[p.name])) for p in entry.parameters))


def from_dict(entry: Mapping[str, Any]) -> Term:
    """A term from ``{effect, target, <parameter>: value}``. Raises EffectError."""
    if not isinstance(entry, Mapping):
        raise EffectError(
            f"an effect is written {{effect: ..., target: ..., <parameter>: <value>}}, not {quoted(entry)}"
        )
    if "effect" not in entry:
        raise EffectError(f"an entry without 'effect': {quoted(dict(entry))}")
    name, values = str(entry["effect"]), {str(k): v for k, v in entry.items() if k not in ("effect", "target")}
    for key in values:
        find(name).parameter(key)
    return term(name, str(entry.get("target") or ""), **values)


def apply(robot: Model, hypothesis: Iterable[Term]) -> Model:
    """The model: the system under every effect of the hypothesis, in order. Raises EffectError for a wrong target."""
    for t in hypothesis:
        robot = _under(robot, t)
    return robot


def applied(robot: Model, hypotheses: Iterable[Iterable[Term]]) -> list[Model]:
    """The model of each hypothesis, as ``apply`` gives it. What several begin with alike is applied once: of hypotheses that
    differ in one of fifty terms that is half of all."""
    known: dict[tuple[int, Term], Model] = {}
    out = []
    for hypothesis in hypotheses:
        model = robot
        for t in hypothesis:
            key = id(model), t
            if key not in known:
                known[key] = _under(model, t)
            model = known[key]
        out.append(model)
    return out


def _under(robot: Model, t: Term) -> Model:
    """The system under one effect."""
    entry = find(t.effect)
    if not isinstance(robot, entry.of):
        raise EffectError(f"{t.effect} is an effect on a {_kind(entry.of)}; {robot.name} is a {_kind(type(robot))}")
    allowed = entry.targets(robot)
    places = (t.target,) if t.target in allowed else members_of(robot, t.target, allowed)
    if not places:
        shared = entry.shared(robot) if isinstance(robot, Robot) else ()
        near = nearest(t.target, [*allowed, *shared]) or allowed
        raise EffectError(f"{t.effect} cannot act on {quoted(t.target)} of {robot.name}; it can act on: {listed(near)}")
    try:
        for place in places:
            robot = entry.transform(robot, place, dict(t.values))
    except RobotError as error:
        raise EffectError(f"{t}: {error}") from error
    except (Exception, SystemExit) as error:
        raise EffectError(f"{t}: its transform failed: {type(error).__name__}: {error}") from error
    if not isinstance(robot, entry.of):
        raise EffectError(
            f"{t}: its transform gave {type(robot).__name__}, not a {entry.of.__name__}; does it return one?"
        )
    return robot


def _kind(of: type) -> str:
    """A kind of system in words: GeneNetwork is a gene network."""
    return re.sub(r"(?<=[a-z])(?=[A-Z])", " ", of.__name__).lower()
