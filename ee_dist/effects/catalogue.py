"""The registry of effects: named, bounded changes to a robot. And hypotheses: short lists of them.

An effect is registered by decorating its transform ``(robot, target, values) -> robot``::

    @effect("motor_weak", family="drive", targets=motors, parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0),), ...)
    def motor_weak(robot, target, values): ...

A user's own file does the same and takes part in everything; see docs/own_effect.md.
"""

from __future__ import annotations

import math
import re
from collections import ChainMap
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, TypeVar

from ee_dist.basics.names import did_you_mean, listed, nearest
from ee_dist.basics.quoted import quoted
from ee_dist.effects.effect import FAMILIES, OTHER_FAMILIES, Beside, Effect, EffectError, Parameter, Transform
from ee_dist.effects.scales import Ranges
from ee_dist.robots.model import Robot, RobotError
from ee_dist.robots.system import System
from ee_dist.trials.log import Array

RESERVED = frozenset({"effect", "target", "effect_name"})
Model = TypeVar("Model", bound=System)


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
    return Term(effect_name, target, tuple(find(effect_name).checked(values).items()))


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
    found = robot
    for t in hypothesis:
        found = _under(found, t, robot)
    return found


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
                known[key] = _under(model, t, robot)
            model = known[key]
        out.append(model)
    return out


def _under(robot: Model, t: Term, described: Model) -> Model:
    """The system under one effect, of a hypothesis on a ``described`` one: where others left nothing of what it changes, as of
    a rotor at one of two joints, is still a place of it."""
    entry = find(t.effect)
    if not isinstance(robot, entry.of):
        raise EffectError(f"{t.effect} is an effect on a {_kind(entry.of)}; {robot.name} is a {_kind(type(robot))}")
    places = entry.places(robot, t.target) or entry.places(described, t.target)
    if not places:
        allowed = entry.targets(robot)
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
