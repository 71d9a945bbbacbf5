"""Effects of the surroundings."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ee_dist.effects import scales
from ee_dist.effects.body import PAPER
from ee_dist.effects.catalogue import effect
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range, always
from ee_dist.effects.targets import base, floor, is_arm, mounting
from ee_dist.robots.model import Robot


@effect(
    "floor_tilt",
    family="world",
    targets=floor,
    parameters=(
        Parameter("sideways_deg", "deg", -30.0, 30.0, 0.0, "turn of the floor about the forward axis", 0.5),
        Parameter("forward_deg", "deg", -30.0, 30.0, 0.0, "turn of the floor about the sideways axis, nose down", 0.5),
    ),
    physics="The robot stands on a slope: gravity pulls along the floor as well as into it.",
    signature="All legs on the lower side carry more from the first step; the error is constant while the robot stands.",
    reference=PAPER,
)
def floor_tilt(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    world = robot.world
    return robot.with_world(
        tilt_x_rad=world.tilt_x_rad + math.radians(values["sideways_deg"]),
        tilt_y_rad=world.tilt_y_rad + math.radians(values["forward_deg"]),
    )


@effect(
    "mounting_tilt",
    family="world",
    targets=mounting,
    parameters=(
        Parameter("sideways_deg", "deg", -180.0, 180.0, 0.0, "turn of the ground under the base about its x axis", 0.1),
        Parameter("forward_deg", "deg", -180.0, 180.0, 0.0, "turn of the ground about the y axis, nose down", 0.1),
    ),
    ranges=always(sideways_deg=(-30.0, 30.0), forward_deg=(-30.0, 30.0)),
    physics="The base is bolted to something that is not level: a cart, a wall, a bench with one leg too short. Gravity comes "
    "from another direction than the model says.",
    signature="Residual torque at rest that changes with the pose, at all joints that carry weight at once, and of one "
    "direction in space.",
    worth_proposing=is_arm,
)
def mounting_tilt(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    world = robot.world
    return robot.with_world(
        tilt_x_rad=world.tilt_x_rad + math.radians(values["sideways_deg"]),
        tilt_y_rad=world.tilt_y_rad + math.radians(values["forward_deg"]),
    )


@effect(
    "weight_carried",
    family="world",
    targets=mounting,
    parameters=(Parameter("share", "1", 0.0, 1.0, 0.0, "share of the weight that is carried", 0.02),),
    physics="The robot's own controllers, or springs and counterweights, carry a share of its weight before any command comes "
    "in, as those of most arms that are sold do: it moves as if gravity were weaker, and measured torques may leave it out.",
    signature="The model sags under its weight where the robot does not, in proportion to the load on each joint and in every "
    "pose; what acceleration needs is right, which lighter parts would make wrong.",
    reference="Siciliano, Sciavicco, Villani and Oriolo 2009, Robotics, section 8.5.1 (PD control with gravity compensation)",
    worth_proposing=is_arm,
)
def weight_carried(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_world(gravity_m_s2=robot.world.gravity_m_s2 * (1.0 - values["share"]))


@effect(
    "floor_friction",
    family="world",
    targets=floor,
    parameters=(
        Parameter("change", "1", -0.95, 2.0, 0.0, "change of the friction coefficient, as a share of it", 0.02),
    ),
    physics="The floor is slicker or grippier than modelled: a foot slides at a smaller or larger share of its load.",
    signature="Feet slip where the model holds, or hold where it slips: joints agree, the body's motion does not.",
    reference="Stewart and Trinkle 1996, Int. J. Numer. Meth. Engng 39(15)",
    ranges=always(change=(-0.95, 1.0)),
)
def floor_friction(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_world(friction=robot.world.friction * (1.0 + values["change"]))


def _give(robot: Robot, target: str) -> dict[str, Range]:
    # One centimetre under a quarter of the weight.
    return {"compliance_m_n": (0.0, 0.04 / scales.weight(robot))}


@effect(
    "floor_compliance",
    family="world",
    targets=floor,
    parameters=(Parameter("compliance_m_n", "m/N", 0.0, math.inf, 0.0, "depth for each newton on a contact", 1e-5),),
    physics="The floor gives under load: carpet, foam or soil instead of concrete.",
    signature="The body stands lower and feet touch for longer; impacts are softened, and gaits lose height.",
    reference="Johnson 1985, Contact Mechanics",
    ranges=_give,
)
def floor_compliance(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_world(compliance_m_n=robot.world.compliance_m_n + values["compliance_m_n"])


def _pushes(robot: Robot, target: str) -> dict[str, Range]:
    most = 0.5 * scales.weight(robot)
    return {"along_x_n": (-most, most), "along_y_n": (-most, most)}


@effect(
    "push",
    family="world",
    targets=base,
    parameters=(
        Parameter("along_x_n", "N", -math.inf, math.inf, 0.0, "force along x of the floor", 0.05),
        Parameter("along_y_n", "N", -math.inf, math.inf, 0.0, "force along y of the floor", 0.05),
    ),
    physics="Something pulls or pushes the body all the time with one force: wind, a cable, a tether.",
    signature="The body drifts and leans one way whatever it does, and does not turn with it; a slope does the same, but also "
    "makes it heavier or lighter on its feet.",
    ranges=_pushes,
)
def push(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    world = robot.world
    return robot.with_world(
        push_x_n=world.push_x_n + values["along_x_n"], push_y_n=world.push_y_n + values["along_y_n"]
    )


def _drags(robot: Robot, target: str) -> dict[str, Range]:
    # The weight, at one metre per second.
    return {"damping_n_s_m": (0.0, scales.weight(robot))}


@effect(
    "drag",
    family="world",
    targets=base,
    parameters=(Parameter("damping_n_s_m", "N.s/m", 0.0, math.inf, 0.0, "force against the body for each m/s", 0.05),),
    physics="Air, water or a towed load resists the body in proportion to its speed.",
    signature="Residual force against the body's velocity and in proportion to it; nothing at rest.",
    reference="Fossen 2011, Handbook of Marine Craft Hydrodynamics and Motion Control, section 6.4",
    ranges=_drags,
)
def drag(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_world(drag_n_s_m=robot.world.drag_n_s_m + values["damping_n_s_m"])
