"""What held-out data say joint by joint: an effect at a joint shows there most, and says nothing about the others.

Of an effect at all joints, each with a value of its own, one value may be wrong because its joint hardly moved where it was
fitted. What that joint loses elsewhere may be more than the others gain.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.problem import Problem, joints_of
from ee_dist.discrepancy.search.candidates import Candidate
from ee_dist.trials.log import Array


def gains_of(problem: Problem, parts: Sequence[Candidate], before: Array, after: Array) -> Array:
    """(K,) energy that held-out data lose at the joint of each part, between two residuals (n,): that which it acts on, or which
    its sensor reads; 0 for a part that is of no single joint."""
    own = problem.joint_of >= 0
    gains = np.bincount(
        problem.joint_of[own], weights=(before**2 - after**2)[own], minlength=len(problem.robot.motor_names)
    )
    read_by = {s.name: s.target for s in problem.robot.sensors}
    places = joints_of(problem.robot, [read_by.get(c.target, c.target) for c in parts])
    return np.array([0.0 if k is None else gains[k] for k in places])
