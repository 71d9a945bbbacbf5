"""The paper's quadruped: a body and four legs of two parts, eight hinges of +-pi/4, four touch and four angle sensors.

The paper gives neither sizes, masses nor joint axes. Chosen here: the layout of the common eight-servo walking kits.
A hip turns its leg fore and aft about the vertical, a knee lifts the foot. The stance is low and wide, so that the
robot can stand and be repaired with a leg missing, and a step is a lift and a swing, which makes evolved gaits walk
rather than vibrate. Drives are those of a small digital servo (3 N.m at stall, 5 rad/s at no load, the class of a
Dynamixel XM430-W350: 4.1 N.m, 4.8 rad/s at 12 V), whose gear also gives the reflected rotor inertia that keeps the joint stiff to
jitter.

Feet are rubber. On a perfectly hard floor a contact solver with few iterations decides which of four feet carries the
robot, so that one engine's robot stands on a diagonal and another's does not; feet that give settle it by physics.

With a leg lost the robot leans on the edge of its body. The shell is smooth, so that it can be dragged along: function can
be restored at all.

Angle sensors sit on the hips: the knees speak through the touch sensors of their feet.
"""

from __future__ import annotations

import math

from ee_dist.robots.model import Drive, Joint, Part, Robot, Sensor, Shape, Wiring, World
from ee_dist.robots.solids import box_inertia, rod_inertia

LEGS = ("front_left", "front_right", "rear_left", "rear_right")
BODY_HALF = (0.14, 0.09, 0.03)
BODY_KG, UPPER_KG, LOWER_KG = 1.6, 0.2, 0.16
UPPER_M, LOWER_M, RADIUS_M, FOOT_M = 0.11, 0.13, 0.012, 0.018
FOOT_GIVE_M_N = 3e-4
"""Rubber feet: 2 mm under a quarter of the weight."""
SHELL_GRIP = 0.2
"""Body and upper legs are smooth plastic: they slide where a rubber foot (friction 1) holds."""
RANGE_RAD = math.pi / 4
HEADING_RAD = {"front_left": 1 / 3, "front_right": -1 / 3, "rear_left": 2 / 3, "rear_right": -2 / 3}
"""Direction of a leg at rest, seen from above, in units of pi; forward is 0."""


def quadruped() -> Robot:
    """The robot of Bongard and Lipson (2004), section 3, with the choices above."""
    parts = [
        Part(
            "body",
            BODY_KG,
            (0.0, 0.0, 0.0),
            box_inertia(BODY_KG, *BODY_HALF),
            (Shape("box", BODY_HALF),),
            "body",
            SHELL_GRIP,
        )
    ]
    joints: list[Joint] = []
    along_x = (0.0, math.sin(math.pi / 4), 0.0, math.cos(math.pi / 4))
    for leg in LEGS:
        half_turn = HEADING_RAD[leg] * math.pi / 2
        front = 1.0 if leg.startswith("front") else -1.0
        left = 1.0 if leg.endswith("left") else -1.0
        upper, lower = f"upper_{leg}", f"lower_{leg}"
        parts += [
            Part(
                upper,
                UPPER_KG,
                (UPPER_M / 2, 0.0, 0.0),
                rod_inertia(UPPER_KG, UPPER_M, RADIUS_M, "x"),
                (Shape("capsule", (RADIUS_M, UPPER_M), (UPPER_M / 2, 0.0, 0.0), along_x),),
                f"leg_{leg}",
                SHELL_GRIP,
            ),
            Part(
                lower,
                LOWER_KG,
                (0.0, 0.0, -LOWER_M / 2),
                rod_inertia(LOWER_KG, LOWER_M, RADIUS_M, "z"),
                (Shape("sphere", (FOOT_M,), (0.0, 0.0, -LOWER_M)),),
                f"leg_{leg}",
            ),
        ]
        joints += [
            Joint(
                f"hip_{leg}",
                "hinge",
                "body",
                upper,
                (front * BODY_HALF[0] * 0.9, left * BODY_HALF[1], 0.0),
                (0.0, 0.0, 1.0),
                -RANGE_RAD,
                RANGE_RAD,
                (0.0, 0.0, math.sin(half_turn), math.cos(half_turn)),
            ),
            Joint(f"knee_{leg}", "hinge", upper, lower, (UPPER_M, 0.0, 0.0), (0.0, 1.0, 0.0), -RANGE_RAD, RANGE_RAD),
        ]
    order = [j.name for j in joints]
    drives = tuple(
        Drive(j, kp=15.0, ki=2.0, kd=0.1, torque_limit=3.0, speed_limit=5.0, rotor_inertia=0.012) for j in order
    )
    sensors = tuple(Sensor(f"touch_{leg}", "touch", f"lower_{leg}") for leg in LEGS) + tuple(
        Sensor(f"angle_{leg}", "angle", f"hip_{leg}") for leg in LEGS
    )
    return Robot(
        name="quadruped",
        parts=tuple(parts),
        joints=tuple(joints),
        drives=drives,
        sensors=sensors,
        wiring=Wiring(tuple(range(len(order))), (1.0, 1.0, 1.0)),
        world=World(compliance_m_n=FOOT_GIVE_M_N),
        start_position_m=(0.0, 0.0, LOWER_M + FOOT_M),
        time_step_s=0.01,
    )
