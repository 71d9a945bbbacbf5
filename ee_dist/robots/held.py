"""Joints that stand still: of a body in a file those that a person says were not moved."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from ee_dist.basics.names import did_you_mean, listed
from ee_dist.basics.quoted import quoted
from ee_dist.robots.body import Body
from ee_dist.robots.kinematics import joint_pose
from ee_dist.robots.model import Joint, RobotError
from ee_dist.robots.numbers import number

KEY = "fixed_joints"
BEYOND = 0.01
"""rad (m) by which a place may lie beyond the limits of its joint, as readings may."""


def held_still(body: Body, asked: Any, where: str) -> Body:
    """The body with some joints rigid, each where it stood. ``asked``: places by joint, rad (m); None: none.

    Raises RobotError for a joint that does not move, or a place that it cannot reach.
    """
    if asked is None:
        return body
    if not isinstance(asked, Mapping):
        raise RobotError(f"{where}: {KEY}: expected 'joint: where it stood', rad or m, not {quoted(asked)}")
    moving = {j.name: j for j in body.moving}
    places: dict[str, float] = {}
    for name, value in asked.items():
        if name not in moving:
            raise RobotError(
                f"{where}: {KEY}: no moving joint named {quoted(name)}; {did_you_mean(str(name), tuple(moving))}"
            )
        places[name] = number(value, f"{where}: {KEY}: {name}")
        low, high = moving[name].ends
        if not low - BEYOND <= places[name] <= high + BEYOND:
            unit = "rad" if moving[name].kind == "hinge" else "m"
            raise RobotError(
                f"{where}: {KEY}: {name} cannot stand at {places[name]:g} {unit}: it goes from {low:.4g} to {high:.4g}"
            )
    if not places:
        return body
    told = listed([f"{name} at {value:g}" for name, value in places.items()])
    return replace(
        body,
        joints=tuple(_rigid(j, places[j.name]) if j.name in places else j for j in body.joints),
        drives={name: found for name, found in body.drives.items() if name not in places},
        driven=tuple(name for name in body.driven if name not in places),
        unlimited=tuple(name for name in body.unlimited if name not in places),
        sensors=tuple(s for s in body.sensors if s.kind == "touch" or s.target not in places),
        notes=(*body.notes, f"joints that stand still: {told}; their drives and sensors are left out"),
    )


def _rigid(joint: Joint, place: float) -> Joint:
    pose = joint_pose(joint, np.array([place]))[0]
    position, turn = tuple(map(float, pose[:3])), tuple(map(float, pose[3:]))
    return Joint(joint.name, "fixed", joint.parent, joint.child, position, joint.axis, 0.0, 0.0, turn)  # type: ignore[arg-type]
