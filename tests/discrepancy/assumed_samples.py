"""An arm whose description only guessed at its controllers."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

from way_samples import Sample, measure, problem_by, samples

from ee_dist.discrepancy.problem import Problem
from ee_dist.effects.catalogue import term
from ee_dist.robots.model import Robot

STIFFER, DRIER = 6.0, (0.3, 0.2)


def guessed(robot: Robot, fields: tuple[str, ...] = ("kp", "kd", "rotor_inertia")) -> Robot:
    """Described with controllers several times as stiff, because nobody knew them."""
    drives = tuple(replace(d, kp=STIFFER * d.kp, kd=3.0 * d.kd) for d in robot.drives)
    return replace(robot, drives=drives, assumed=tuple((d.joint, f) for d in drives for f in fields))


@cache
def the_problem(limit: float = 0.0) -> Problem:
    """``limit``: share of the stated torque limit that the robot has not."""
    sample: Sample = samples()["arm"]
    hidden = (term("torque_limit", "all_joints", loss=limit),) if limit else ()
    hidden += tuple(
        term("coulomb_friction", j, torque_nm=c) for j, c in zip(sample.robot.motor_names, DRIER, strict=True)
    )
    return problem_by("open_loop", measure(sample, hidden), guessed(sample.robot))
