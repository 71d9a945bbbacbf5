"""Commands beside the positions of their joints: another unit, another sign, or a joint that does not move."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ee_dist.measurements.mapping import Column, Mapping
from ee_dist.measurements.robot_channels import command_kind
from ee_dist.measurements.standing import REST, reach_of, stands_still
from ee_dist.measurements.suspicious import command_suspicion
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

FEWEST_ROWS = 10
MANY = 3.0
"""Times what a drive can give from which a command is in another unit."""


def command_flaws(
    robot: Robot, mapping: Mapping, commands: Array, position_of: dict[str, Array], step_s: float
) -> Iterator[tuple[str, tuple[str, bool] | None]]:
    """(joint, what is suspicious of its commands and whether it is certain enough to stop), of joints that obey positions.
    ``commands`` (T, M) are NaN where drives are released."""
    led: dict[str, tuple[Array, Array]] = {}
    for k, drive in enumerate(robot.drives):
        obeyed = np.isfinite(commands[:, k])
        if drive.joint in position_of and obeyed.sum() > FEWEST_ROWS and command_kind(drive) == "position":
            led[drive.joint] = (commands[obeyed, k], position_of[drive.joint][obeyed])
    still = [j for j, (asked, seen) in led.items() if stands_still(asked, seen, reach_of(robot.joint(j)))]
    for joint, (asked, seen) in led.items():
        found = command_suspicion(joint, asked, seen, step_s)
        another_unit = found is not None and found[1]
        if not another_unit and np.ptp(seen) < REST * reach_of(robot.joint(joint)):
            found = None  # a joint that hardly moves says nothing of its commands
        follow = (other for other in led if other not in still and _alike(robot, mapping, joint, other))
        if joint in still and (not another_unit or any(follow)):
            unit = "rad" if robot.joint(joint).kind == "hinge" else "m"
            found = (f"{joint} does not move although it is commanded by {np.ptp(asked):.2g} {unit}", False)
        yield joint, found


def beyond_the_drive(robot: Robot, commands: Array) -> Iterator[str]:
    """A line on joints that are told torques of which their drives can give a part only: another unit, or volts. ``commands``
    (T, M) are NaN where drives are released."""
    for k, drive in enumerate(robot.drives):
        most = float(np.nanmax(np.abs(commands[:, k]))) if np.isfinite(commands[:, k]).any() else 0.0
        if command_kind(drive) == "torque" and most > MANY * drive.torque_limit > 0:
            unit = "N.m" if robot.joint(drive.joint).kind == "hinge" else "N"
            yield (
                f"command of {drive.joint}: reaches {most:.3g} {unit}, {most / drive.torque_limit:.2g} times what its drive can "
                f"give ({drive.torque_limit:.3g}): another unit, or volts, which need a scale ('scale:' at the column)?"
            )


def _alike(robot: Robot, mapping: Mapping, one: str, other: str) -> bool:
    """Whether the mapping says the same of the units of two joints, in positions and commands: where one follows its commands
    the other's are in no other unit."""
    said = []
    for joint in (one, other):
        sensor = next((s.name for s in robot.sensors if s.kind == "position" and s.target == joint), "")
        both = (mapping.sensors.get(sensor), mapping.commands.get(joint))
        said.append([(c.unit, c.scale) for c in both if isinstance(c, Column)])
    return said[0] == said[1] and len(said[0]) == 2
