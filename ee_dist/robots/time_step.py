"""How finely a robot has to be simulated: what its drives do in a step, and the step that is taken where nobody names one."""

from __future__ import annotations

import math
from dataclasses import replace

from ee_dist.robots.inertia import felt_inertia
from ee_dist.robots.model import Drive, Robot

FINE_S = 0.002
"""The step of a robot that stands on a floor, or some of whose joints no controller holds: contacts and free swings are short."""
STEPS_S = (0.01, 0.005, 0.004)
"""Coarser ones, for robots that stand fast and whose controllers are slower than they."""
TURNED, TAKEN = 0.3, 0.5
"""Of a drive's own oscillation the angle (rad), and of a speed the share that damping takes off it, in a step that is fine."""
LIGHTER = 0.1
"""Times what was guessed that a rotor may weigh."""
TOO_COARSE = 2.0
"""Times that step from which on a simulation is another robot's."""


def default_step_s(robot: Robot) -> float:
    """The time step of a robot whose description names none, s."""
    obeys = {d.joint: d.command for d in robot.drives}
    moving = {j.name: obeys.get(j.name, "none") for j in robot.joints if j.kind != "fixed"}
    swings = any(moving.get(j.name) == "none" for j in robot.joints if j.kind == "hinge")
    if not robot.touches_nothing or swings or "torque" in moving.values():
        return FINE_S
    coarsest = coarsest_step_s(_with_light_rotors(robot))
    return next((s for s in STEPS_S if s <= coarsest), FINE_S)


def _with_light_rotors(robot: Robot) -> Robot:
    """The robot as it may turn out to be: rotors that were guessed are looked for from a tenth on, and a controller that somebody
    knows moves those, too. Where it was guessed as well, the two are off together."""
    guessed, of_gains = (
        {j for j, field in robot.assumed if field in fields} for fields in (("rotor_inertia",), ("kp", "kd"))
    )
    drives = tuple(
        replace(d, rotor_inertia=LIGHTER * d.rotor_inertia) if d.joint in guessed - of_gains else d
        for d in robot.drives
    )
    return replace(robot, drives=drives)


def coarsest_step_s(robot: Robot) -> float:
    """The coarsest time step that resolves what the drives' controllers and motors do, s; infinite without any that hold."""
    pairs = zip(robot.drives, felt_inertia(robot).tolist(), strict=True) if robot.drives else ()
    return min((_resolved_s(d, inertia) for d, inertia in pairs), default=math.inf)


def _resolved_s(drive: Drive, inertia: float) -> float:
    motor = drive.torque_limit / drive.speed_limit if math.isfinite(drive.torque_limit) else 0.0
    damping = motor + {"position": drive.kd, "speed": drive.kp}.get(drive.command, 0.0)
    found = TAKEN * inertia / damping if damping > 0 else math.inf
    if drive.command == "position" and drive.kp > 0:
        found = min(found, TURNED * math.sqrt(inertia / drive.kp))
    return found


def too_coarse(robot: Robot) -> str | None:
    """A line for people where the robot's time step does not resolve its drives; None where it does."""
    coarsest = coarsest_step_s(robot)
    if robot.time_step_s <= TOO_COARSE * coarsest:
        return None
    good = next((s for s in (*STEPS_S, FINE_S, FINE_S / 2, FINE_S / 4) if s <= coarsest), None)
    if good is None:
        return f"time_step_s {robot.time_step_s:g}: too coarse; {too_light(robot)}"
    return (
        f"time_step_s {robot.time_step_s:g}: too coarse for its controllers, which need {good:g} s; sensors may be read more "
        "seldom than that"
    )


def too_light(robot: Robot) -> str:
    """Which drive asks for the finest steps, and what is most likely wrong with it: a line for people."""
    inertias = felt_inertia(robot).tolist()
    needed = [_resolved_s(d, inertia) for d, inertia in zip(robot.drives, inertias, strict=True)]
    k = needed.index(min(needed))
    drive, unit = robot.drives[k], "kg.m^2" if robot.joint(robot.drives[k].joint).kind == "hinge" else "kg"
    return (
        f"the drive of {drive.joint} (kp {drive.kp:g}, kd {drive.kd:g}) moves only {inertias[k]:.2g} {unit}, which takes "
        f"steps of {needed[k]:.1g} s: give it the rotor_inertia of its motor, seen through the gear, or smaller gains"
    )
