"""How large the numbers of a robot are, so that an effect's range suits a small servo and a machine tool alike."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from statistics import median

from ee_dist.robots import ranges
from ee_dist.robots.inertia import felt_inertia, steady_inertia
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import drive_of

__all__ = [
    "Range",
    "Ranges",
    "always",
    "drive_of",
    "firmest",
    "inertia",
    "longest_delay",
    "speed",
    "steady",
    "stiffest",
    "torque",
    "travel",
    "weight",
]

STEPS = 2.8
"""Time steps in a radian of a joint's own oscillation from which its controller is simulated as it is."""
LATE_STEPS = 2.0
"""Time steps that such a joint is late, at least."""
DELAYED_STEPS, DELAYED_S = 20.0, 0.1
"""Longest delay worth trying: of a controller that works in the robot's steps, and of one that does not;"""
OF_THE_LAG = 1.25
"""and as a share of the lag with which readings were seen to follow commands, of which the delay is a part. Of several joints the
least lag counts: what one lags more is as a rule its own sluggishness, and too long a range makes slopes of delays coarse."""
SLUGGISH_S, WAITS = 0.5, 1.05
"""Lag of half of the joints from which it is none of their own, but what all of them wait for, and its share."""
Range = tuple[float, float]
Ranges = Callable[[Robot, str], Mapping[str, Range]]


@dataclass(frozen=True)
class Always:
    """Ranges that are the same for every robot and target."""

    ranges: tuple[tuple[str, Range], ...]

    def __call__(self, robot: Robot, target: str) -> Mapping[str, Range]:
        return dict(self.ranges)


def always(**ranges: Range) -> Ranges:
    """``always(share=(0.0, 0.8))``: for parameters whose hard bounds are wider than what is worth trying."""
    return Always(tuple(ranges.items()))


def longest_delay(robot: Robot) -> float:
    """s; of buses and firmware, which do not know how finely somebody simulates."""
    lags = [j.lag_s for j in robot.joints if j.lag_s > 0] or [0.0]
    waits = WAITS * median(lags) if median(lags) > SLUGGISH_S else 0.0
    return max(DELAYED_STEPS * robot.time_step_s, DELAYED_S, OF_THE_LAG * min(lags), waits)


def travel(robot: Robot, joint: str) -> float:
    """Half the range of a joint, at most 1 rad of a hinge; rad (m)."""
    return ranges.travel(robot.joint(joint))


def inertia(robot: Robot, joint: str) -> float:
    """What a torque on the joint meets, kg.m^2 (kg)."""
    return float(felt_inertia(robot)[robot.motor_names.index(joint)])


def spare_inertia(robot: Robot, joint: str) -> float:
    """How much less inertia a joint may feel for its controller to be steady in the robot's time step, kg.m^2 (kg)."""
    drive, dt = drive_of(robot, joint), robot.time_step_s
    stiff, damping = (drive.kp, drive.kd) if drive.command == "position" else (0.0, drive.kp)
    return inertia(robot, joint) - max(stiff * (STEPS * dt) ** 2, 2.0 * damping * dt)


def torque(robot: Robot, joint: str) -> float:
    """The torque limit of a drive, or what its controller asks at half the range of the joint; N.m (N)."""
    return ranges.top_torque(robot, drive_of(robot, joint))


def speed(robot: Robot, joint: str) -> float:
    """The speed of a drive without load, or half the range of the joint in a quarter of a second; rad/s (m/s)."""
    return ranges.top_speed(robot.joint(joint), drive_of(robot, joint))


def steady(robot: Robot, joint: str) -> float:
    """The inertia with which all joints can be stopped at once, kg.m^2 (kg)."""
    return float(steady_inertia(robot)[robot.motor_names.index(joint)])


def stiffest(robot: Robot, joint: str) -> float:
    """The stiffest spring on the joint that its time step resolves, some twelve steps a period; N.m/rad (N/m)."""
    return 0.25 * steady(robot, joint) / robot.time_step_s**2


def firmest(robot: Robot, joint: str) -> float:
    """The largest gain of a position controller that the time step resolves; N.m/rad (N/m). A joint that is damped so much that
    its inertia hardly matters follows as a filter does, and what counts is how late."""
    drive, dt = drive_of(robot, joint), robot.time_step_s
    late = drive.kd / (LATE_STEPS * dt) if drive.command == "position" else 0.0
    return max(inertia(robot, joint) / (STEPS * dt) ** 2, late)


def weight(robot: Robot) -> float:
    """N; of the mass alone where there is no gravity."""
    return sum(p.mass_kg for p in robot.present_parts) * (robot.world.gravity_m_s2 or 9.81)
