"""Every effect at every place where it could act, as one list to search; and points of its range to look from."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.basics.names import nearest
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term, apply, find
from ee_dist.effects.effect import FAMILIES, Effect, EffectError
from ee_dist.effects.groups import groups, members_of
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

ROTOR = "rotor_inertia"
SHAREABLE = ("drive", "sensing", "body")
"""Families whose effects many joints or sensors may share."""


@dataclass(frozen=True)
class Candidate:
    """An effect at a target. Its values are searched as shares ``u`` (P,) of the way from neutral to a bound, in equal steps
    or, of factors, in equal ratios.

    ``bounds`` (lower, upper) of each parameter are those worth trying on this robot; ``inert`` are parameters that do
    nothing while the others are neutral (the speed at which a friction falls off).
    """

    effect: Effect
    target: str
    bounds: tuple[tuple[float, float], ...]
    inert: tuple[int, ...] = ()
    guess: bool = False
    """Whether it puts right, with one set of values, all that a description only assumed of its kind."""
    hint: tuple[float, ...] = ()
    """A point (u) that the measurements show by themselves; none where it is empty."""

    @property
    def name(self) -> str:
        return f"{self.effect.name}@{self.target}" if self.target else self.effect.name

    @property
    def size(self) -> int:
        """How many parameters are free."""
        return len(self.effect.parameters)

    @property
    def lower(self) -> Array:
        """Smallest u: -1 where the parameter has room below neutral, else 0."""
        pairs = zip(self.effect.parameters, self.bounds, strict=True)
        return np.array([-1.0 if low < p.neutral else 0.0 for p, (low, _) in pairs])

    @property
    def upper(self) -> Array:
        pairs = zip(self.effect.parameters, self.bounds, strict=True)
        return np.array([1.0 if high > p.neutral else 0.0 for p, (_, high) in pairs])

    def values(self, u: Sequence[float] | Array) -> dict[str, float]:
        """Parameters by name, in their own units, within bounds."""
        found = {}
        for p, (low, high), share in zip(self.effect.parameters, self.bounds, u, strict=True):
            end = high if share >= 0 else low
            if p.by_ratio:
                value = p.neutral * (end / p.neutral) ** abs(float(share))
            else:
                value = p.neutral + float(share) * abs(end - p.neutral)
            found[p.name] = float(min(max(value, low), high))
        return found

    def shares(self, values: Mapping[str, float]) -> Array:
        """The inverse of ``values``."""
        out = []
        for p, (low, high) in zip(self.effect.parameters, self.bounds, strict=True):
            gap = values[p.name] - p.neutral
            end = high if gap >= 0 else low
            if end == p.neutral:
                out.append(0.0)
            elif p.by_ratio:
                out.append(math.copysign(math.log(values[p.name] / p.neutral) / math.log(end / p.neutral), gap))
            else:
                out.append(gap / abs(end - p.neutral))
        return np.array(out)

    def rooms(self, u: Sequence[float] | Array) -> Array:
        """(P,) what a unit of u is in the parameters' own units, at u."""
        out, values = [], self.values(u)
        for p, (low, high), share in zip(self.effect.parameters, self.bounds, u, strict=True):
            end = high if share >= 0 else low
            out.append(values[p.name] * abs(math.log(end / p.neutral)) if p.by_ratio else abs(end - p.neutral))
        return np.array(out)

    def members(self, robot: Robot) -> tuple[str, ...]:
        """The joints, parts or sensors of the group that it acts on; none where it acts at a single place."""
        return members_of(robot, self.target, self.effect.targets(robot))

    def term(self, u: Sequence[float] | Array) -> Term:
        return Term(self.effect.name, self.target, tuple(self.values(u).items()))

    def probes(self, shares: Sequence[float]) -> list[Array]:
        """Points to look at first: each parameter alone, to both sides where it has two; the only one if it has none. And what
        the measurements show by themselves."""
        if not self.size:
            return [np.zeros(0)]
        points = []
        for k in range(self.size):
            for side in (self.upper[k], self.lower[k]):
                if side and k not in self.inert:
                    points += [side * share * np.eye(self.size)[k] for share in shares]
        # What an inert parameter does shows only beside another: the time at which a sensor sticks decides at which value, the
        # side on which a spring rests which way it pulls.
        beside = [u for u in points if np.abs(u).max() == max(shares)]
        for k in self.inert:
            sides = [side for side in (self.upper[k], self.lower[k]) if side]
            points += [u + side * share * np.eye(self.size)[k] for u in beside for side in sides for share in shares]
        return [*points, *self.hinted]

    def has(self, values: Mapping[str, float]) -> bool:
        """Whether values are among those worth trying."""
        ends = zip(self.effect.parameters, self.bounds, strict=True)
        return all(low <= values[p.name] <= high for p, (low, high) in ends)

    @property
    def hinted(self) -> list[Array]:
        """The point that the measurements show by themselves, if there is one."""
        return [np.array(self.hint)] if self.hint else []


def candidate(robot: Robot, effect: Effect | str, target: str) -> Candidate:
    """An effect at a target or a group, with the range worth trying. Raises EffectError for an unknown effect or target."""
    entry = find(effect) if isinstance(effect, str) else effect
    allowed = entry.targets(robot)
    if target not in allowed and not members_of(robot, target, allowed):
        names = [*allowed, *entry.shared(robot)]
        near = nearest(target, names) or names[:8]
        raise EffectError(f"{entry.name} cannot act on {target!r} of {robot.name}; it can act on: {', '.join(near)}")
    worth = entry.bounds(robot, target)
    bounds = tuple(worth[p.name] for p in entry.parameters)
    plain = Candidate(entry, target, bounds)
    inert = []
    if plain.size > 1:
        for k in range(plain.size):
            u = (plain.upper if plain.upper[k] else plain.lower) * 0.5 * np.eye(plain.size)[k]
            if apply(robot, (plain.term(u),)) == robot:
                inert.append(k)
    return Candidate(entry, target, bounds, tuple(inert), entry.guesses_at(robot, target))


def candidates(
    robot: Robot,
    without: Iterable[str] = (),
    only: Iterable[str] | None = None,
    families: Iterable[str] = FAMILIES,
    sharing: bool = True,
) -> list[Candidate]:
    """All searchable effects of some families at all their targets, in the order of the catalogue, and (``sharing``) on
    groups of joints and sensors that share one set of values; among these what puts right what was only assumed.

    ``without`` leaves out effects or places (``effect`` or ``effect@target``); ``only`` leaves out all others. Raises
    EffectError for a name that is neither.
    """
    banned, wanted, seen = set(without), None if only is None else set(only), set(families)
    for name in (*banned, *(wanted or ())):
        effect, _, target = name.partition("@")
        if target:
            parse(robot, name)
        else:
            find(effect)
    named = {name.partition("@")[0] for name in wanted or ()}
    found = []
    for entry in CATALOGUE.values():
        if entry.name in banned or entry.family not in seen:
            continue
        # Who names an effect wants it tried also where it would not be proposed unasked.
        places = entry.targets(robot) if entry.name in named else entry.proposed(robot)
        if sharing and places and entry.parameters and entry.family in SHAREABLE:
            places = (*places, *entry.shared(robot))
        guess = entry.guessed(robot) if sharing else ""
        if members_of(robot, guess, entry.targets(robot)) and guess not in places:
            places = (*places, guess)
        for target in places:
            name = f"{entry.name}@{target}" if target else entry.name
            if name in banned or (wanted is not None and not {entry.name, name} & wanted):
                continue
            found.append(candidate(robot, entry, target))
    return found


def on_top_of(robot: Robot, terms: Hypothesis, pool: Iterable[Candidate]) -> list[Candidate]:
    """The pool, of which a single joint may have less of what several share in a model of these ``terms``, down to none."""
    of: dict[str, Hypothesis] = {}
    for t in terms:
        entry = find(t.effect)
        if any(p.on_top for p in entry.parameters) and members_of(robot, t.target, entry.targets(robot)):
            of[t.effect] = (*of.get(t.effect, ()), t)
    around = {name: apply(robot, some) for name, some in of.items()}
    return [
        candidate(around[c.effect.name], c.effect, c.target) if c.effect.name in around and not c.members(robot) else c
        for c in pool
    ]


def with_room_left(robot: Robot, terms: Hypothesis, parts: Iterable[Candidate]) -> tuple[Candidate, ...]:
    """The parts of a model of these ``terms``, each of a single joint with as much to take off as is there now, described or
    shared: what joints share may have changed, or gone, since a part came into the model. Values stay within their bounds; how
    light a rotor may be is for the time step to say."""
    values, out = {t.name: dict(t.values) for t in terms}, []
    for c in parts:
        less = [bool(p.on_top) and p.on_top != ROTOR for p in c.effect.parameters]
        if any(less) and not c.members(robot):
            shared = tuple(t for t in terms if members_of(robot, t.target, c.effect.targets(robot)))
            (now,) = on_top_of(robot, shared, [candidate(robot, c.effect, c.target)])
            lowest = [
                min(left, values[c.name][p.name]) for p, (left, _) in zip(c.effect.parameters, now.bounds, strict=True)
            ]
            ends = zip(less, c.bounds, lowest, strict=True)
            c = replace(c, bounds=tuple((left if renewed else low, high) for renewed, (low, high), left in ends))
        out.append(c)
    return tuple(out)


def not_said(robot: Robot, parts: Iterable[Candidate], pool: Iterable[Candidate]) -> list[Candidate]:
    """Those of the pool that a model of these ``parts`` does not have yet: nor what all members of a group share where each has a
    value of its own, for then only sums would tell."""
    names = {c.name for c in parts}

    def said(c: Candidate) -> bool:
        members = c.members(robot)
        return c.name in names or (bool(members) and all(f"{c.effect.name}@{m}" in names for m in members))

    return [c for c in pool if not said(c)]


def possible(robot: Robot, terms: Hypothesis, pool: Iterable[Candidate]) -> list[Candidate]:
    """Those of the pool for which a model of these ``terms`` has room, and as far as it has: friction can differ by direction
    by as much as there is."""
    out, model = [], None
    for c in pool:
        if c.effect.within is None:
            out.append(c)
            continue
        model = apply(robot, terms) if model is None else model
        room = c.effect.room(model, c.target)
        bounds = tuple(room[p.name] for p in c.effect.parameters)
        if any(low < high for low, high in bounds):
            out.append(replace(c, bounds=bounds))
    return out


def shared(pool: Iterable[Candidate], robot: Robot) -> list[Candidate]:
    """Those that no single joint or sensor can be blamed for: the surroundings, the supply, the body, what all joints have
    in common. They are what a model is calibrated with on an untouched robot."""
    common = {"", "supply", robot.root.name, *groups(robot)}
    return [c for c in pool if c.effect.family == "world" or c.target in common]


def parse(robot: Robot, text: str) -> Candidate:
    """A candidate as typed: ``coulomb_friction@knee_front_left``. Raises EffectError with the nearest names."""
    name, _, target = text.partition("@")
    entry = find(name)
    targets = entry.targets(robot)
    if not target and len(targets) == 1:
        target = targets[0]
    return candidate(robot, entry, target)


def known(robot: Robot, term: Term) -> Candidate:
    """The candidate of a term of a model file, its range widened to hold the term's own values."""
    plain = candidate(robot, term.effect, term.target)
    values = dict(term.values)
    bounds = tuple(
        (min(low, values[p.name]), max(high, values[p.name]))
        for p, (low, high) in zip(plain.effect.parameters, plain.bounds, strict=True)
    )
    return Candidate(plain.effect, plain.target, bounds, plain.inert)


@dataclass(frozen=True)
class Proposal:
    """What is added to a model in one go: mostly one candidate; or a family whose members work together."""

    parts: tuple[Candidate, ...]
    label: str = ""

    @property
    def name(self) -> str:
        return self.label or " + ".join(c.name for c in self.parts)

    @property
    def size(self) -> int:
        return sum(c.size for c in self.parts)

    @property
    def guess(self) -> bool:
        """Whether it puts right no more than what a description only assumed; with what else such a drive has, if each is one
        value for all of just these joints."""
        at = {c.target for c in self.parts if c.effect.family != "world"}
        return all(c.guess for c in self.parts) or (self.parts[0].guess and len(at) == 1)


def values_of(parts: Sequence[Candidate], terms: Hypothesis) -> Array:
    """The u (P,) of terms of these candidates."""
    return np.concatenate([c.shares(dict(t.values)) for c, t in zip(parts, terms, strict=True)] or [np.zeros(0)])
