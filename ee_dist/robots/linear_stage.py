"""A linear stage: one slide, driven by a force, under its own position controller.

The numbers are those of EMPS, a carriage on a ball screw (Janot, Gautier, Brunot 2019): voltage = kv * (kp * (reference -
position) - speed), clipped to +-10 V, and 35.15 N on the carriage for each volt. The controller knows no speed: it takes
the difference of its position readings over two samples of 1 ms (``speed_samples``).
"""

from __future__ import annotations

from ee_dist.robots.model import Drive, Joint, Law, Part, Robot, RobotError, Sensor, Wiring, World

JOINT = "carriage"
FORCE_N_V = 35.15065188
POSITION_GAIN_1_S = 160.18
SPEED_GAIN_V_S_M = 243.45
LIMIT_V = 10.0
TRAVEL_M = (-0.05, 0.3)
SPEED_LAW = "speed_from_readings"
"""The law by which the controller goes by a difference of readings, not by the true speed; see effects/controller_laws.py."""


def linear_stage(
    mass_kg: float = 100.0,
    viscous: float = 0.0,
    speed_samples: int = 2,
    time_step_s: float = 0.001,
) -> Robot:
    """The stage at position 0 (m). ``viscous`` N.s/m; ``speed_samples`` 0 gives the controller the true speed.

    Raises RobotError for a mass <= 0.
    """
    if mass_kg <= 0:
        raise RobotError(f"linear stage: mass {mass_kg:g} kg must be positive")
    small = (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)
    parts = (Part("frame", 1.0, (0.0, 0.0, 0.0), small), Part("carriage", mass_kg, (0.0, 0.0, 0.0), small))
    slide = Joint(JOINT, "slide", "frame", "carriage", (0.0, 0.0, 0.0), (1.0, 0.0, 0.0), *TRAVEL_M)
    damping = FORCE_N_V * SPEED_GAIN_V_S_M
    drive = Drive(
        JOINT,
        kp=damping * POSITION_GAIN_1_S,
        ki=0.0,
        kd=damping,
        torque_limit=FORCE_N_V * LIMIT_V,
        speed_limit=float("inf"),
        viscous=viscous,
    )
    laws = (Law(SPEED_LAW, JOINT, (("samples", float(speed_samples)),)),) if speed_samples else ()
    return Robot(
        name="linear_stage",
        parts=parts,
        joints=(slide,),
        drives=(drive,),
        sensors=(Sensor("position", "position", JOINT, "m"),),
        wiring=Wiring((0,)),
        world=World(has_floor=False),
        laws=laws,
        free_base=False,
        time_step_s=time_step_s,
    )
