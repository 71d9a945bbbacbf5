"""What of a bolted robot moves by itself: limbs that nothing joins but a base that stands fast.

The legs of a quadruped on a stand, the arms of a torso, the fingers of a hand: what is changed at one of them moves no other, so
that each is simulated as a robot of its own, and only where it changed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ee_dist.basics.altered import altered
from ee_dist.robots.model import Robot, Wiring


@dataclass(frozen=True)
class Limb:
    """One of them. ``robot`` is the base with this limb alone; ``motors`` and ``sensors`` are its places in the whole."""

    robot: Robot
    motors: tuple[int, ...]
    sensors: tuple[int, ...]


def limbs(robot: Robot) -> tuple[Limb, ...]:
    """The limbs of a robot that have sensors, each channel in one of them; one alone, the robot itself, where it walks about or
    touches a floor, where all drives share a supply that sags, and where no more than one limb has sensors."""
    if not robot.touches_nothing or robot.world.supply_sag:
        return (whole(robot),)
    tops = _tops(robot)
    if len(tops) < 2:
        return (whole(robot),)
    carried = {j.child: j for j in robot.joints}
    owner = {name: k for k, top in enumerate(tops) for name in robot.subtree(top)}
    moved = {j.name: j.child for j in robot.joints}
    # What stands with the base reads the same whatever moves: it goes with the first limb.
    of_sensors = [owner.get(s.target if s.kind == "touch" else moved.get(s.target, ""), 0) for s in robot.sensors]
    sensed = sorted(set(of_sensors))
    if len(sensed) < 2:
        return (whole(robot),)
    found = []
    for k in sensed:
        # Of the base what leads to the limb, and what the limb's own sensors are on.
        parts = {name for name, o in owner.items() if o == k} | {robot.root.name}
        parts |= {s.target for s, o in zip(robot.sensors, of_sensors, strict=True) if o == k and s.target in carried}
        for name in [*parts]:
            while name in carried:
                name = carried[name].parent
                parts.add(name)
        found.append(_limb(robot, parts, [i for i, o in enumerate(of_sensors) if o == k]))
    return tuple(found)


def whole(robot: Robot) -> Limb:
    """All of it as one."""
    return Limb(robot, tuple(range(len(robot.drives))), tuple(range(len(robot.sensors))))


def _tops(robot: Robot) -> list[str]:
    """Names of the first part of each limb: what a joint that moves carries, on a part that stands with the root."""
    base, tops = [robot.root.name], list[str]()
    for name in base:
        for j in robot.joints:
            if j.parent == name:
                (base if j.kind == "fixed" else tops).append(j.child)
    return tops


def _limb(robot: Robot, parts: set[str], sensors: Sequence[int]) -> Limb:
    joints = tuple(j for j in robot.joints if j.child in parts)
    names = {j.name for j in joints}
    motors = tuple(k for k, d in enumerate(robot.drives) if d.joint in names)
    own = altered(
        robot,
        parts=tuple(p for p in robot.parts if p.name in parts),
        joints=joints,
        drives=tuple(robot.drives[k] for k in motors),
        sensors=tuple(robot.sensors[k] for k in sensors),
        wiring=Wiring(tuple(range(len(motors))), robot.wiring.hidden_gain),
        laws=tuple(law for law in robot.laws if law.joint in names),
        lost=tuple(name for name in robot.lost if name in parts),
        assumed=tuple(a for a in robot.assumed if a[0] in names),
    )
    return Limb(own, motors, tuple(sensors))
