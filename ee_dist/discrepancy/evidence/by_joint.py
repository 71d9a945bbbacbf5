"""What held-out data say joint by joint: an effect at a joint shows there most, and says nothing about the others.

Of an effect at all joints, each with a value of its own, one value may be wrong because its joint hardly moved where it was
fitted. What that joint loses elsewhere may be more than the others gain.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.trials.log import Array


def gains_of(problem: Problem, parts: Sequence[Candidate], before: Array, after: Array) -> Array:
    """(K,) energy that held-out data lose at the joint of each part, between two residuals (n,); 0 for a part that is of no
    single joint."""
    joint = np.array([-1 if j is None else j for j in problem.layout.joint_of_channel])[problem.channel_of]
    size = len(problem.robot.motor_names)
    own = joint >= 0
    gains = np.bincount(joint[own], weights=(before**2 - after**2)[own], minlength=size)
    places = [joint_of(problem, c) for c in parts]
    return np.array([0.0 if k is None else gains[k] for k in places])


def joint_of(problem: Problem, c: Candidate) -> int | None:
    """The number of the joint that an effect acts on, or of that which its sensor reads; None for any other place."""
    names = list(problem.robot.motor_names)
    if c.target in names:
        return names.index(c.target)
    return next(
        (names.index(s.target) for s in problem.robot.sensors if s.name == c.target and s.target in names), None
    )
