"""What an effect takes off a description, and that it is no more than was described."""

from __future__ import annotations

from dataclasses import replace

from ee_dist.effects.catalogue import EffectError, Hypothesis, find
from ee_dist.effects.groups import members_of
from ee_dist.robots.model import Drive, Robot
from ee_dist.robots.ranges import drive_of
from ee_dist.robots.system import System

ROUNDING = 1e-9
"""Share of a value by which it may be too much."""


def with_more(robot: Robot, target: str, law: str, value: float) -> Robot:
    """The robot with so much more of a drive's number, or less, down to none: two effects of a search may take off the same."""

    def changed(drive: Drive) -> Drive:
        return replace(drive, **{law: max(getattr(drive, law) + value, 0.0)})

    return robot.map_drive(target, changed)


def not_too_much(robot: System, terms: Hypothesis) -> None:
    """Raises EffectError for a value, as somebody wrote it, that takes off more than the robot is described with."""
    if not isinstance(robot, Robot):
        return
    for t in terms:
        entry, values = find(t.effect), dict(t.values)
        for p in entry.parameters:
            if not p.on_top or values[p.name] >= 0:
                continue
            places = entry.targets(robot)  # of a place that is none of them others say so
            for joint in members_of(robot, t.target, places) or tuple({t.target} & set(places)):
                has = getattr(drive_of(robot, joint), p.on_top)
                if -values[p.name] > has * (1 + ROUNDING):
                    raise EffectError(
                        f"{t}: {joint} is described with {has:g} {p.unit} of it; {-values[p.name]:g} cannot be taken off"
                    )
