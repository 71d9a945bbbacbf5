"""Steps whose forces act half way through them, for robots that no controller holds.

Semi-implicit Euler, which engines step by, takes the forces of where a joint was and the speeds of half a step ago. What comes
of that at links that swing is as much as what is looked for in them: two that swing from one another are 5 mrad off after half a
second in steps of 0.5 ms, 18 mrad in steps of 2 ms. Half a step at the speed at hand, the forces of there, and half a step at the
speed that comes of them is off by the square of the step (Stoermer-Verlet, by positions: Hairer, Lubich and Wanner 2003,
doi:10.1017/S0962492902000144): 0.1 mrad in steps of 2 ms, for the same work a step.
"""

from __future__ import annotations

import numpy as np

from ee_dist.engines.contract import Bodies, Truth
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, State


def goes_halfway(robot: Robot) -> bool:
    """Whether the robot is one for such steps: it stands fast, has nothing to fall on, and none of its joints is led by position
    or speed: controllers are steep, and know nothing of half steps."""
    if not robot.touches_nothing:
        return False
    led = {d.joint: d.command for d in robot.drives}
    return all(led.get(j.name) in ("torque", "none") for j in robot.joints if j.kind != "fixed")


class Halfway:
    """Implements ``ee_dist.engines.contract.Bodies`` on top of the ``bodies`` of an engine, in steps of ``time_step_s``."""

    def __init__(self, bodies: Bodies, time_step_s: float) -> None:
        self.bodies, self.gives = bodies, bodies.gives
        self.half_s = 0.5 * time_step_s
        start = bodies.read(False, False, False)
        self.joints, self.speeds = start.joints.copy(), start.speeds.copy()
        self.gained: Array = np.zeros_like(self.speeds)
        """Half of what the speeds (B, M) have gained in the last step: what they will have gained half way through this one,
        where it goes on so."""
        self.placed: list[int] = []
        """Rows that were put somewhere since they were read."""

    def middle(self) -> Array:
        """Joint positions (B, M) half way through the next step, at which its torques are to be."""
        return self.joints + self.half_s * self.speeds

    def read(self, touch: bool, pose: bool, twist: bool) -> Truth:
        if not (touch or pose or twist or self.placed):
            return Truth(self.joints, self.speeds)
        truth = self.bodies.read(touch, pose, twist)
        if self.placed:
            self.joints, self.speeds = self.joints.copy(), self.speeds.copy()
            self.joints[self.placed], self.speeds[self.placed] = truth.joints[self.placed], truth.speeds[self.placed]
            self.gained[self.placed] = 0.0
            self.placed = []
        truth.joints, truth.speeds = self.joints, self.speeds
        return truth

    def step(self, torques: Array, force: Array | None, give: Array | None = None) -> None:
        middle = self.middle()
        self.bodies.move(middle, self.speeds + self.gained)
        self.bodies.step(torques, force, give)
        speeds = self.bodies.read(False, False, False).speeds - self.gained
        self.gained = 0.5 * (speeds - self.speeds)
        self.joints, self.speeds = middle + self.half_s * speeds, speeds

    def move(self, joints: Array, speeds: Array) -> None:
        self.joints, self.speeds = joints, speeds

    def put(self, row: int, state: State) -> None:
        self.bodies.put(row, state)
        self.placed.append(row)

    def close(self) -> None:
        self.bodies.close()
