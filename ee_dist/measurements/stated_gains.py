"""Gains that a log states put into a robot whose description only assumed them, so that every verb begins with what is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ee_dist.effects.groups import ALL_JOINTS
from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.mapping import Mapping
from ee_dist.robots.model import Robot
from ee_dist.robots.time_step import too_coarse


def with_gains(robot: Robot, mapping: Mapping) -> tuple[Robot, Sequence[str]]:
    """The robot with the gains of a mapping, which nobody need find any more, and notes. Raises MeasurementError."""
    if not mapping.gains:
        return robot, ()
    for joint in mapping.gains:
        if joint not in (ALL_JOINTS, *robot.motor_names):
            raise MeasurementError(
                f"{mapping.source}: gains: {robot.name} has no driven joint {joint!r}; "
                f"{nearest(joint, (*robot.motor_names, ALL_JOINTS))}"
            )
    given = {m: {**mapping.gains.get(ALL_JOINTS, {}), **mapping.gains.get(m, {})} for m in robot.motor_names}
    drives = tuple(replace(d, **given[d.joint]) for d in robot.drives)  # type: ignore[arg-type]
    assumed = tuple((j, name) for j, name in robot.assumed if name not in given.get(j, {}))
    found = replace(robot, drives=drives, assumed=assumed)
    coarse = too_coarse(found)
    return found, (coarse,) if coarse is not None and too_coarse(robot) is None else ()
