"""Which of limbs that are alike is which: what holds a limb up leaves its controllers behind their goals, to the side that its
weight pulls to, and the hips of a left leg are pulled the other way than those of a right one."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import chain, islice, permutations

import numpy as np

from ee_dist.robots.inverse_dynamics import joint_torques
from ee_dist.robots.model import Robot, RobotError
from ee_dist.trials.log import Array

GOES, APART = 0.8, 0.4
"""How well the errors of controllers must go with the weight in some order (the cosine between the two, joint by joint), and how
much less well in the one that is taken for granted, for that to be another."""
MOST_ORDERS, ROWS = 720, 40
"""Orders that are tried, those of six limbs, and rows of the log that are looked at."""


@dataclass(frozen=True)
class Exchanged:
    """The joints in the order in which weight is held, how well it goes then, and how it goes in the order asked about."""

    names: tuple[str, ...]
    goes: float
    went: float


def limbs_of(robot: Robot, names: tuple[str, ...]) -> list[tuple[str, ...]]:
    """Driven joints of each limb, in the order of ``names``: chains that begin at the same part and have as many joints, the most
    numerous kind."""
    starts: dict[str, list[str]] = {}
    for j in robot.joints:
        starts.setdefault(j.parent, []).append(j.child)
    found: list[list[tuple[str, ...]]] = []
    for children in starts.values():
        by_length: dict[int, list[tuple[str, ...]]] = {}
        for child in children:
            carried = set(robot.subtree(child))
            own = tuple(n for n in names if robot.joint(n).child in carried)
            by_length.setdefault(len(own), []).append(own)
        found += [limbs for length, limbs in by_length.items() if length > 1 and len(limbs) > 1]
    return max(found, key=lambda limbs: sum(map(len, limbs)), default=[])


def exchanged(robot: Robot, names: tuple[str, ...], position: Array, command: Array) -> Exchanged | None:
    """Whether another order of limbs that are alike than ``names`` is the one in which weight is held. ``position`` and
    ``command`` (T, J) are the columns as ``names`` has them, rad. None where the weight does not tell."""
    limbs = limbs_of(robot, names)
    if robot.free_base or not limbs:
        return None
    some = position[:: max(1, len(position) // ROWS)]
    error = (command - position).mean(axis=0)
    orders = [
        dict(zip(chain(*limbs), chain(*order), strict=True)) for order in islice(permutations(limbs), MOST_ORDERS)
    ]
    scores = []
    for order in orders:
        columns = [names.index(order.get(m, m)) for m in robot.motor_names]
        scores.append(_goes(robot, some[:, columns], error[columns]))
    if max(scores) < GOES or scores[0] > max(scores) - APART:
        return None
    # Of those that go as well the one that exchanges least: fore and hind legs are often alike to their weight.
    good = [k for k, score in enumerate(scores) if score > max(scores) - 0.1 * APART]
    best = min(good, key=lambda k: _moved(names, orders[k]))
    back = {column: joint for joint, column in orders[best].items()}
    return Exchanged(tuple(back.get(n, n) for n in names), scores[best], scores[0])


def _goes(robot: Robot, position: Array, error: Array) -> float:
    """Cosine, over the joints, of the mean torque that their errors (M,) ask of controllers and that which weight needs along
    positions (T, M); -1 where there is none."""
    try:
        weight = joint_torques(robot, position, 0 * position, 0 * position).mean(axis=0)
    except (RobotError, np.linalg.LinAlgError):
        return -1.0
    asked = np.array([d.kp for d in robot.drives]) * error
    size = float(np.linalg.norm(asked) * np.linalg.norm(weight))
    return float(asked @ weight) / size if np.isfinite(size) and size > 0 else -1.0


def _moved(names: tuple[str, ...], order: dict[str, str]) -> int:
    return sum(abs(names.index(a) - names.index(b)) for a, b in order.items())
