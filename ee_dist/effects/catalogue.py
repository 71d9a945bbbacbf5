"""The registry of effects: named, bounded changes to a robot. And hypotheses: short lists of them.

An effect is registered by decorating its transform ``(robot, target, values) -> robot``::

    @effect("motor_weak", family="drive", targets=motors, parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0),), ...)
    def motor_weak(robot, target, values): ...

A user's own file does the same and takes part in everything; see docs.
"""

from __future__ import annotations

import difflib
import importlib.util
import sys
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

from ee_dist.robots.model import Robot, RobotError

FAMILIES = ("body", "world", "drive", "sensing", "wiring")


class EffectError(ValueError):
    """An unknown effect, target or parameter, or a value out of bounds; the message names what would be right."""


@dataclass(frozen=True)
class Parameter:
    """One number of an effect: its unit, its bounds, and the value at which the effect does nothing."""

    name: str
    unit: str
    lower: float
    upper: float
    neutral: float
    meaning: str = ""
    resolution: float = 0.0
    """Smallest change worth telling apart in a report."""


Transform = Callable[[Robot, str, Mapping[str, float]], Robot]


@dataclass(frozen=True)
class Effect:
    """An entry of the catalogue. ``physics`` and ``signature`` are for people: what it is, what it leaves in a residual."""

    name: str
    family: str
    transform: Transform
    targets: Callable[[Robot], tuple[str, ...]]
    parameters: tuple[Parameter, ...]
    physics: str
    signature: str
    reference: str = ""
    searchable: bool = True
    """Whether ``explain`` proposes it by itself."""

    @property
    def main(self) -> Parameter:
        """The parameter that says how much."""
        return self.parameters[0]

    def parameter(self, name: str) -> Parameter:
        for p in self.parameters:
            if p.name == name:
                return p
        raise EffectError(f"{self.name} has no parameter {name!r}; it has: {', '.join(p.name for p in self.parameters)}")

    def neutral_values(self) -> dict[str, float]:
        return {p.name: p.neutral for p in self.parameters}


@dataclass(frozen=True)
class Term:
    """One effect at one target with its values: a line of a model file."""

    effect: str
    target: str
    values: tuple[tuple[str, float], ...] = ()

    def as_dict(self) -> dict[str, Any]:
        """{effect, target, <parameter>: value, ...}: the form of a model file."""
        return {"effect": self.effect, "target": self.target, **dict(self.values)}

    def __str__(self) -> str:
        entry = CATALOGUE.get(self.effect)
        shown = []
        for name, value in self.values:
            unit = entry.parameter(name).unit if entry else ""
            shown.append(f"{name} {value:.4g}" + (f" {unit}" if unit not in ("", "1") else ""))
        where = f" at {self.target}" if self.target else ""
        return f"{self.effect}{where}" + (f" ({', '.join(shown)})" if shown else "")


Hypothesis = tuple[Term, ...]

_registry: dict[str, Effect] = {}
CATALOGUE: Mapping[str, Effect] = MappingProxyType(_registry)
"""All effects by name, in the order in which they were registered."""


def effect(
    name: str,
    *,
    family: str,
    targets: Callable[[Robot], tuple[str, ...]],
    parameters: tuple[Parameter, ...] = (),
    physics: str,
    signature: str,
    reference: str = "",
    searchable: bool = True,
) -> Callable[[Transform], Transform]:
    """Register a transform as an effect. Raises EffectError where the name is taken or a fact contradicts itself."""

    def register(transform: Transform) -> Transform:
        if name in _registry and _registry[name].transform.__module__ != transform.__module__:
            raise EffectError(f"an effect named {name!r} exists already")
        if family not in FAMILIES:
            raise EffectError(f"{name}: no family {family!r}; there are: {', '.join(FAMILIES)}")
        for p in parameters:
            if not p.lower <= p.neutral <= p.upper:
                raise EffectError(f"{name}: the neutral value of {p.name} lies outside its bounds")
        _registry[name] = Effect(name, family, transform, targets, parameters, physics, signature, reference, searchable)
        return transform

    return register


def find(name: str) -> Effect:
    """The effect of that name. Raises EffectError with the nearest names."""
    if name in _registry:
        return _registry[name]
    near = difflib.get_close_matches(name, _registry, n=3, cutoff=0.5)
    hint = f"did you mean {', '.join(near)}?" if near else f"there are: {', '.join(_registry)}"
    raise EffectError(f"no effect named {name!r}; {hint}")


def term(effect_name: str, target: str = "", **values: float) -> Term:
    """A term with its values checked against the effect's parameters and bounds; parameters left out are neutral."""
    entry = find(effect_name)
    for key, value in values.items():
        p = entry.parameter(key)
        if isinstance(value, bool) or not isinstance(value, (int, float)) or value != value:
            raise EffectError(f"{effect_name}: {key} must be a number ({p.unit}), not {value!r}")
        if not p.lower <= value <= p.upper:
            raise EffectError(f"{effect_name}: {key} = {value:g} lies outside [{p.lower:g}, {p.upper:g}] {p.unit}")
    filled = entry.neutral_values() | {k: float(v) for k, v in values.items()}
    return Term(effect_name, target, tuple((p.name, float(filled[p.name])) for p in entry.parameters))


def from_dict(entry: Mapping[str, Any]) -> Term:
    """A term from ``{effect, target, <parameter>: value}``. Raises EffectError."""
    if "effect" not in entry:
        raise EffectError(f"an entry without 'effect': {dict(entry)!r}")
    values = {str(k): v for k, v in entry.items() if k not in ("effect", "target")}
    return term(str(entry["effect"]), str(entry.get("target") or ""), **values)


def apply(robot: Robot, hypothesis: Iterable[Term]) -> Robot:
    """The model: the robot under every effect of the hypothesis, in order. Raises EffectError for a wrong target."""
    for t in hypothesis:
        entry = find(t.effect)
        allowed = entry.targets(robot)
        if t.target not in allowed:
            near = difflib.get_close_matches(t.target, allowed, n=3, cutoff=0.4) or allowed
            raise EffectError(f"{t.effect} cannot act on {t.target!r} of {robot.name}; it can act on: {', '.join(near)}")
        try:
            robot = entry.transform(robot, t.target, dict(t.values))
        except RobotError as error:
            raise EffectError(f"{t}: {error}") from error
    return robot


def load_plugin(path: str | Path) -> None:
    """Run a user's file that registers effects of their own. Raises EffectError where it cannot be read."""
    file = Path(path)
    if not file.is_file():
        raise EffectError(f"no such file of effects: {file}")
    name = f"ee_dist_plugin_{file.stem}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise EffectError(f"not a Python file: {file}")
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
