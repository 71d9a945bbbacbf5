"""Where to look from for drives that a description only guessed at: a grid of starts, and what else they may need."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from ee_dist.discrepancy.lags import told_anew_s
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import drive_of
from ee_dist.trials.log import Array

GAINS = (0.05, 0.1, 0.2, 0.5, 1.0, 2.0, 5.0)
"""Shares of the assumed gains to look from: a guess may be off by an order of magnitude."""
LAGS_RAD = (0.0, 0.02, 0.05)
"""Errors (rad, m) at which a joint comes to rest by dry friction, to look from: those of hobby servos."""
LIMITS, MORE = (0.0, 0.7), -4.0
"""Shares of the stated torque limit that are not there, to look from; and of one that was only guessed, there is more of it."""
MUCH_DAMPED = 2.0
"""Times the damping that was guessed from which a joint that follows as late as it was seen to follows as a filter does."""
CARRIED, MUCH = "weight_carried", 0.9
"""Controllers of arms that are sold carry the weight. Held up by gains alone it takes stiff ones and much friction, which no
single effect leads away from: soft gains sag. So they are looked for with most of it carried, too."""
LATE, LATER = "command_delay", (0.3, 0.7)
"""What passes between a command and a controller that nobody knows is not known either; a soft one looks late too, and leads
away from a stiff one that is. So they are looked for with a delay, from these shares of the lag that joints were seen to have."""
AHEAD, SOONER = "speed_feed_forward", 0.5
"""A controller that knows how fast its goal goes follows sooner than its damping would let it; a guess that does not know it
comes to gains many times too stiff. Where joints were seen to follow within this share of the lag that was guessed at, it is
looked for so, too, and found so, also where it takes off less, where a guess ended at its bound otherwise and does not so."""
TIMED, TAKES = "command_duration", (0.5, 1.0)
"""A controller that takes a set time to each goal looks soft and heavy, too. Where goals stand longer than joints lag, they are
looked for so as well, from these shares of the time from one goal to the next."""
ROTORS = ("rotor_factor", "rotor_inertia")
"""A rotor by what was guessed of it, or by what is added."""


def starts_of(problem: Problem, joints: Sequence[str], model: Model) -> list[Array]:
    """A grid: damping falls with the gain, so that a joint follows as fast, or is what makes it as late as it was seen to be,
    and friction holds as large an error. Rotors are as assumed, or fall with the gain too: who took a motor for ten times as
    strong as it is took its rotor for as heavy."""
    robot, names = problem.robot, {c.effect.name for c in model.parts}
    drives, lag = [drive_of(robot, j) for j in joints], lag_of(robot, joints)
    stiffness, damping, rotor = (
        float(np.median([getattr(d, n) for d in drives])) for n in ("kp", "kd", "rotor_inertia")
    )
    scaled = (False, True) if names & {*ROTORS} else (False,)
    limits = (*LIMITS, MORE) if {*joints} <= {*robot.assumed_joints("torque_limit")} else LIMITS
    delays = tuple(share * lag for share in LATER) if LATE in names else (0.0,)
    stand = stand_of(problem, joints) if TIMED in names else 0.0
    times = tuple(share * stand for share in TAKES) if TIMED in names else (0.0,)
    found = []
    for gain, apart, limit, lighter, (delay, takes), filters in product(
        GAINS, LAGS_RAD, limits, scaled, tuple(product(delays, times)), (False, True)
    ):
        # Evenly on its way, a goal is half of its time late.
        damped = (lag - delay - takes / 2) * stiffness / damping if filters and damping > 0 else 1.0
        if (lighter and gain == 1.0) or (filters and damped < MUCH_DAMPED):
            continue
        values = {
            "rotor_factor": gain if lighter else 1.0,
            "rotor_inertia": (gain - 1.0) * rotor if lighter else 0.0,
            "position_gain": gain,
            "speed_gain": gain * damped,
            "torque_limit": limit,
            "coulomb_friction": apart * gain * stiffness,
            LATE: delay,
            TIMED: takes,
            CARRIED: MUCH,
            AHEAD: 1.0,
        }
        mains = [(c, c.effect.main) for c in model.parts]
        u = [c.shares({p.name: values.get(c.effect.name, p.neutral)}) for c, p in mains]
        found.append(np.clip(np.concatenate(u), model.lower, model.upper))
    return found


def lag_of(robot: Robot, joints: Sequence[str]) -> float:
    """s by which most of the joints were seen to follow their commands; 0 where that is not known of most."""
    return float(np.median([robot.joint(j).lag_s for j in joints]))


def stand_of(problem: Problem, joints: Sequence[str]) -> float:
    """s from one goal of these joints to the next, of most; 0 where that is not known."""
    return told_anew_s(problem.measured, [problem.robot.motor_names.index(j) for j in joints])
