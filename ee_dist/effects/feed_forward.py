"""Controllers that are told the speed of their goal beside its position."""

from __future__ import annotations

from collections.abc import Mapping

from ee_dist.effects import scales
from ee_dist.effects.catalogue import effect
from ee_dist.effects.described import with_more
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range
from ee_dist.effects.targets import is_arm
from ee_dist.robots.model import Robot

MOST = 1.5
"""Share of the commanded speed that a controller may go along with: more than all of it overshoots."""


def _damped(robot: Robot) -> tuple[str, ...]:
    """Joints under a controller of positions that damps."""
    return tuple(d.joint for d in robot.drives if d.command == "position" and d.kd > 0)


def _shares(robot: Robot, target: str) -> dict[str, Range]:
    has = scales.drive_of(robot, target).feed_forward
    return {"share": (0.0 - has, max(MOST - has, 0.0))}


@effect(
    "speed_feed_forward",
    family="drive",
    targets=_damped,
    parameters=(
        Parameter(
            "share",
            "1",
            -10.0,
            10.0,
            0.0,
            "share of the commanded speed that the controller does not damp, on top of nominal",
            0.02,
            on_top="feed_forward",
        ),
    ),
    physics="The controller knows the speed of its goal, as one that follows a trajectory does, and damps what the joint's speed "
    "differs from that: with all of it a moving joint does not lag by its own damping.",
    signature="The joint lags less than predicted while it moves, in proportion to its speed; nothing changes at rest, nor in "
    "how it settles.",
    reference="Siciliano, Sciavicco, Villani and Oriolo 2009, Robotics, section 8.3 (decentralised feed-forward compensation)",
    ranges=_shares,
    worth_proposing=is_arm,
)
def speed_feed_forward(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return with_more(robot, target, "feed_forward", values["share"])
