"""A pendulum on a hobby servo: one hinge, a point mass, a DC motor behind a gear with proportional control in firmware.

The numbers are those of a Dynamixel XL330-M288 on 7.4 V as its data sheet gives them at 5 V (0.52 N.m at stall, 103
turns a minute without load), both in proportion to the voltage. The firmware turns a position error into a duty cycle,
duty = error * 4096/(2 pi) * gain/256 / 885, clipped to +-1 (Robotis e-Manual, XL330, "Position P Gain"; 885 counts are
full voltage), and the motor makes torque = stall * duty - back_emf * speed.
"""

from __future__ import annotations

import math

from ee_dist.robots.model import Drive, Joint, Part, Robot, RobotError, Sensor, Wiring, World

JOINT = "servo"
SUPPLY_V = 7.4
STALL_NM = 0.52 * SUPPLY_V / 5.0
NO_LOAD_RAD_S = 103 * 2 * math.pi / 60 * SUPPLY_V / 5.0
ROTOR_KG_M2 = 0.002
"""Reflected inertia of rotor and gear with the bare arm: a guess of the right size, for a fit to correct."""
COUNTS_PER_RAD = 4096 / (2 * math.pi)
FULL_DUTY_COUNTS = 885
POINT_KG_M2 = 1e-9
"""A point has none; engines want a positive number."""


def duty_per_rad(gain: float) -> float:
    """Duty cycle that the firmware answers to one radian of error at a position gain (its register, 0 to 16383)."""
    return COUNTS_PER_RAD * gain / 256 / FULL_DUTY_COUNTS


def servo_pendulum(
    gain: float = 400.0,
    mass_kg: float = 0.49,
    length_m: float = 0.1,
    viscous: float = 0.0,
    time_step_s: float = 0.004,
) -> Robot:
    """The pendulum hanging down at position 0 (rad). ``viscous`` N.m.s/rad. Raises RobotError for lengths or masses <= 0."""
    if mass_kg <= 0 or length_m <= 0:
        raise RobotError(f"servo pendulum: mass {mass_kg:g} kg and length {length_m:g} m must be positive")
    bench = Part("bench", 1.0, (0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0))
    point = (POINT_KG_M2, POINT_KG_M2, POINT_KG_M2, 0.0, 0.0, 0.0)
    arm = Part("arm", mass_kg, (0.0, 0.0, -length_m), point)
    hinge = Joint(JOINT, "hinge", "bench", "arm", (0.0, 0.0, 0.0), (0.0, 1.0, 0.0), -2 * math.pi, 2 * math.pi)
    drive = Drive(
        JOINT,
        kp=STALL_NM * duty_per_rad(gain),
        ki=0.0,
        kd=0.0,
        torque_limit=STALL_NM,
        speed_limit=NO_LOAD_RAD_S,
        rotor_inertia=ROTOR_KG_M2,
        supply_nominal_v=SUPPLY_V,
        viscous=viscous,
    )
    sensors = (Sensor("position", "position", JOINT, "rad"), Sensor("speed", "velocity", JOINT, "rad/s"))
    return Robot(
        name="servo_pendulum",
        parts=(bench, arm),
        joints=(hinge,),
        drives=(drive,),
        sensors=sensors,
        wiring=Wiring((0,)),
        world=World(has_floor=False),
        free_base=False,
        time_step_s=time_step_s,
    )
