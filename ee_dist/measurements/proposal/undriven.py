"""Commands in a log of a robot whose description has nobody to obey them."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.basics.names import listed
from ee_dist.measurements.proposal.words import OTHER, TIME, read_name
from ee_dist.measurements.robot_channels import command_kinds
from ee_dist.robots.model import Robot

MOST_NAMED = 4
"""Columns that are named, of arms with many."""


def untaken_commands(unused: Sequence[str], robot: Robot) -> list[str]:
    """A note on columns that are called commands and were not used because no joint takes any: why, and what would be right."""
    if command_kinds(robot) or not robot.drives:
        return []
    said = [read_name(name) for name in unused]
    asked = [n for n, r in zip(unused, said, strict=True) if r.command and r.kind not in (OTHER, TIME)]
    if not asked:
        return []
    more = [f"{len(asked) - MOST_NAMED} more"] if len(asked) > MOST_NAMED else []
    return [
        f"{listed([*asked[:MOST_NAMED], *more])}: called commands and left out, for no joint of {robot.name} takes commands "
        "('command: none' in all drives, as of an MJCF without actuators). Where a controller leads them, say so in a YAML and "
        f"import with robot.drives=FILE: '{robot.drives[0].joint}: {{command: position, kp: ..., kd: ..., torque_limit: ..., "
        "assumed: [kp, kd, torque_limit]}'; task=robot mjcf=FILE (urdf=FILE) writes such lines, with guesses"
    ]
