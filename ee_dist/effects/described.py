"""What effects make of a description: nothing that cannot be, and no more taken off than was described."""

from __future__ import annotations

from collections.abc import Iterator

from ee_dist.basics.altered import altered
from ee_dist.effects.catalogue import Hypothesis, Term, apply, find
from ee_dist.effects.effect import EffectError, Parameter
from ee_dist.robots.model import Drive, Robot, RobotError
from ee_dist.robots.numbers import checked
from ee_dist.robots.ranges import drive_of
from ee_dist.robots.system import System

ROUNDING = 1e-9
"""Share of a value by which it may be too much."""


def with_more(robot: Robot, target: str, law: str, value: float) -> Robot:
    """The robot with so much more of a drive's number, or less, down to none: two effects of a search may take off the same."""

    def changed(drive: Drive) -> Drive:
        return altered(drive, **{law: max(getattr(drive, law) + value, 0.0)})

    return robot.map_drive(target, changed)


def check_written(robot: System, terms: Hypothesis) -> None:
    """Raises EffectError for a value, as somebody wrote it, that takes off more than the robot is described with, or makes of it
    what no robot can be."""
    if not isinstance(robot, Robot):
        return
    changed = apply(robot, terms)
    _not_too_much(robot, terms)
    try:
        checked(changed, "with these effects")
    except RobotError as error:
        raise EffectError(str(error)) from None


def as_far_as_there_is(robot: Robot, terms: Hypothesis) -> Hypothesis:
    """The same terms, which take no more off a joint than it is described with where nothing that several joints share is left of
    it: what else a search took off does nothing, and a model file that says so could not be read."""
    out = list(terms)
    for k, name, joint in _too_much(robot, terms):
        has = float(getattr(drive_of(robot, joint), find(terms[k].effect).parameter(name).on_top))
        values = dict(out[k].values)
        values[name] = max(values[name], 0.0 - has)
        out[k] = Term(terms[k].effect, terms[k].target, tuple(values.items()))
    return tuple(out)


def _not_too_much(robot: Robot, terms: Hypothesis) -> None:
    """What a joint has less of than all of them share may be more than a fit left of it; the joint has none of it then."""
    for k, name, joint in _too_much(robot, terms):
        t, p = terms[k], find(terms[k].effect).parameter(name)
        has = getattr(drive_of(robot, joint), p.on_top)
        raise EffectError(
            f"{t}: {joint} is described with {has:g} {p.unit} of it; {-dict(t.values)[name]:g} cannot be taken off, so that "
            f"{name} is {0.0 - has:g} or more"
        )


def _too_much(robot: Robot, terms: Hypothesis) -> Iterator[tuple[int, str, str]]:
    """(number of the term, parameter, joint) of all that takes more off a joint than there is."""
    shared: set[tuple[str, str]] = set()
    for k, t in enumerate(terms):
        entry, values = find(t.effect), dict(t.values)
        joints = entry.places(robot, t.target)  # of a place that is none of them others say so
        for p in entry.parameters:
            if not p.on_top or values[p.name] >= 0:
                continue
            for joint in [j for j in joints if (t.effect, j) not in shared]:
                if takes_more_than_described(robot, joint, p, values[p.name]):
                    yield k, p.name, joint
        if len(joints) > 1:
            shared.update((t.effect, j) for j in joints)


def takes_more_than_described(robot: Robot, joint: str, parameter: Parameter, value: float) -> bool:
    """Whether a value takes more off a joint than the robot is described with there: it can only be taken off what several
    joints share in a model."""
    return bool(-value > getattr(drive_of(robot, joint), parameter.on_top) * (1 + ROUNDING))
