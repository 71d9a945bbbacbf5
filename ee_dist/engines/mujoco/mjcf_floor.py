"""The floor of an MJCF: of its planes the one that the robot stands on, how high it lies and how it grips."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import mujoco
import numpy as np

from ee_dist.robots.model import Vec3
from ee_dist.trials.log import Array

_PLANE = int(mujoco.mjtGeom.mjGEOM_PLANE)
WALL = 0.5
"""Upward share of a plane's normal below which nothing stands on it."""
LEVEL = 1e-6


@dataclass(frozen=True)
class Floor:
    """A plane by a point and its normal (3,); ``friction`` and ``priority`` are those of its geom."""

    point: Array
    normal: Array
    friction: float
    priority: int

    @property
    def tilt_deg(self) -> float:
        across = math.hypot(self.normal[0], self.normal[1])
        return math.degrees(math.atan2(across, self.normal[2])) if across > LEVEL else 0.0

    def height_at(self, place: Vec3) -> float:
        """m of the plane above or below the origin, where a robot at that place stands."""
        if not self.tilt_deg:
            return float(self.point[2])
        away = np.array(place) - self.point
        return float(self.point[2] - self.normal[:2] @ away[:2] / self.normal[2])

    def grip(self, friction: float, priority: int) -> float:
        """Sliding friction between the floor and a geom, as MuJoCo chooses it: of the higher priority, else the larger."""
        if priority == self.priority:
            return max(friction, self.friction)
        return friction if priority > self.priority else self.friction


def floor_of(m: Any) -> tuple[Floor | None, list[str]]:
    """The floor and notes for people."""
    d = mujoco.MjData(m)
    mujoco.mj_kinematics(m, d)
    planes = [g for g in range(m.ngeom) if m.geom_type[g] == _PLANE and m.body_weldid[m.geom_bodyid[g]] == 0]
    normals = {g: np.array(d.geom_xmat[g].reshape(3, 3)[:, 2]) for g in planes}
    usable = [g for g in planes if normals[g][2] > WALL]

    def rank(g: int) -> tuple[bool, bool, float]:
        touches = bool(m.geom_contype[g] or m.geom_conaffinity[g])
        return touches, bool(normals[g][2] > 1 - LEVEL), float(d.geom_xpos[g][2])

    notes = []
    further = len(planes) - min(1, len(usable))
    if further:
        notes.append(f"planes left out, for there is one level floor: {further}")
    if not usable:
        return None, notes
    g = max(usable, key=rank)
    floor = Floor(np.array(d.geom_xpos[g]), normals[g], float(m.geom_friction[g, 0]), int(m.geom_priority[g]))
    if floor.tilt_deg:
        notes.append(f"the floor is tilted by {floor.tilt_deg:.3g} degrees: it is taken as level")
    return floor, notes
