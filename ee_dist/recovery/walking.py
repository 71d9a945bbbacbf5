"""Robots as the loop sees them: they are to go forward, and the paper's six situations may have changed them."""

from __future__ import annotations

from collections.abc import Mapping

from ee_dist.effects.catalogue import Hypothesis, Term
from ee_dist.effects.targets import carried_parts, motors, parts, sensors, stopped_joints
from ee_dist.evaluation.jobs import Travel
from ee_dist.evolution.ga import SCALE
from ee_dist.recovery.behaviour import gait_of
from ee_dist.recovery.gait import gait
from ee_dist.recovery.subject import Situation, Subject, share
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog

HEAVIER = (1.0, 2.0)
"""A part grows heavier by 100 to 200 %."""
STEEPEST_DEG = 30.0


def _heavier(much: int) -> Mapping[str, float]:
    low, high = HEAVIER
    return {"change": low + (high - low) * share(much)}


def _loss(much: int) -> Mapping[str, float]:
    return {"loss": share(much)}


def _tilt(much: int) -> Mapping[str, float]:
    return {"sideways_deg": STEEPEST_DEG * much / SCALE}


def _floor(robot: Robot) -> tuple[str, ...]:
    return ("floor",)


def normal(terms: list[Term], robot: Robot) -> Hypothesis:
    """Without terms that others make meaningless, in a fixed order.

    What sits on a lost part is gone with it. Of two changes of one kind at one place the first counts.
    """
    lost = {name for t in terms if t.effect == "part_lost" for name in robot.subtree(t.target)}
    gone = lost | {j.name for j in robot.joints if j.child in lost}
    kept: dict[tuple[str, str], Term] = {}
    for t in terms:
        if t.effect == "part_lost":
            if robot.joint_of(t.target).parent not in lost:
                kept[t.effect, t.target] = t
        elif t.target not in gone and any(value != 0.0 for _, value in t.values):
            kept.setdefault((t.effect, t.target), t)
    return tuple(kept[key] for key in sorted(kept))


def _cheats(robot: Robot, log: SensorLog) -> tuple[str, ...]:
    found = gait(robot, log)
    return () if found is None else found.cheats


WALKING = Subject(
    noun="robot",
    function=Travel(),
    quantity="distance",
    unit="m",
    meaning="How far it went forward",
    situations=(
        Situation("part_lost", carried_parts),
        Situation("part_mass", parts, _heavier),
        Situation("motor_weak", motors, _loss),
        Situation("sensor_failing", sensors, _loss),
        Situation("joint_jam", stopped_joints, _loss),
        Situation("floor_tilt", _floor, _tilt),
    ),
    normal=normal,
    tried_places=lambda robot: len(parts(robot)),
    behaviour=lambda robot: gait_of(robot, Travel()),
    cheats=_cheats,
)
