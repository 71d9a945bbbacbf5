"""Effects on the body: what it is made of and what is still there."""

from __future__ import annotations

import math
from collections.abc import Mapping

from ee_dist.effects.catalogue import effect
from ee_dist.effects.effect import Parameter
from ee_dist.effects.scales import Range, always
from ee_dist.effects.targets import carried_parts, is_arm, parts
from ee_dist.robots.model import Robot

PAPER = "Bongard and Lipson 2004"


@effect(
    "part_lost",
    family="body",
    targets=carried_parts,
    physics="A part breaks off at its joint and takes with it all that it carried; its motors turn nothing.",
    signature="Its touch sensor stays open and its joint stays at zero; the body leans towards the gap from the first step.",
    reference=PAPER,
)
def part_lost(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.without(target)


@effect(
    "part_mass",
    family="body",
    targets=parts,
    parameters=(Parameter("change", "1", -0.9, 3.0, 0.0, "change of mass as a share of the nominal mass", 0.02),),
    ranges=always(change=(-0.8, 3.0)),
    physics="A part is heavier or lighter than the model says; its inertia scales with its mass.",
    signature="Torques and sag grow with the acceleration and the tilt of the part; nothing changes at rest if it is carried "
    "by the structure.",
    reference=PAPER,
    everywhere=True,
)
def part_mass(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    part = robot.part(target)
    scale = 1.0 + values["change"]
    xx, yy, zz, xy, xz, yz = (scale * v for v in part.inertia_kg_m2)
    return robot.with_part(target, mass_kg=scale * part.mass_kg, inertia_kg_m2=(xx, yy, zz, xy, xz, yz))


def _shifts(robot: Robot, target: str) -> dict[str, Range]:
    """Up to four fifths of the way to the end of the part, and no more than 0.1 m."""
    part = robot.part(target)
    reach = 0.0
    for shape in part.shapes:
        middle = math.dist(shape.position_m, part.com_m)
        half = max(shape.size) if shape.kind != "capsule" else shape.size[0] + shape.size[1] / 2
        reach = max(reach, middle + half)
    most = min(0.1, 0.8 * (reach or 0.1))
    return dict.fromkeys(("along_x_m", "along_y_m", "along_z_m"), (-most, most))


@effect(
    "com_shifted",
    family="body",
    targets=parts,
    parameters=(
        Parameter("along_x_m", "m", -math.inf, math.inf, 0.0, "shift along the part's x axis", 0.002),
        Parameter("along_y_m", "m", -math.inf, math.inf, 0.0, "shift along the part's y axis", 0.002),
        Parameter("along_z_m", "m", -math.inf, math.inf, 0.0, "shift along the part's z axis", 0.002),
    ),
    physics="The centre of mass of a part lies elsewhere than in the model, as with a payload or a battery put on one side.",
    signature="A lean that is constant at rest and turns with the part; joint load differs between the sides.",
    reference="Featherstone 2008, Rigid Body Dynamics Algorithms, section 2.13",
    ranges=_shifts,
)
def com_shifted(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    x, y, z = robot.part(target).com_m
    return robot.with_part(target, com_m=(x + values["along_x_m"], y + values["along_y_m"], z + values["along_z_m"]))


def _loads(robot: Robot, target: str) -> dict[str, Range]:
    """Half of all that moves, anywhere within a quarter of the robot's length of the part's frame, 10 cm at least."""
    first = 0 if robot.free_base else 1
    reach = max(0.1, 0.25 * _length(robot))
    return {"mass_kg": (0.0, 0.5 * sum(p.mass_kg for p in robot.present_parts[first:]))} | dict.fromkeys(
        ("x_m", "y_m", "z_m"), (-reach, reach)
    )


def _length(robot: Robot) -> float:
    """The longest way from the root along the joints to a part's frame, m."""
    far = {robot.root.name: 0.0}
    for name in robot.subtree(robot.root.name)[1:]:
        joint = robot.joint_of(name)
        far[name] = far[joint.parent] + math.hypot(*joint.position_m)
    return max(far.values())


@effect(
    "payload",
    family="body",
    targets=parts,
    parameters=(
        Parameter("mass_kg", "kg", 0.0, math.inf, 0.0, "mass of what is attached", 0.01),
        Parameter("x_m", "m", -math.inf, math.inf, 0.0, "its centre along x of the part's frame", 0.005),
        Parameter("y_m", "m", -math.inf, math.inf, 0.0, "its centre along y", 0.005),
        Parameter("z_m", "m", -math.inf, math.inf, 0.0, "its centre along z", 0.005),
    ),
    physics="Something hangs on a part that the model does not know: a tool, a load, a battery. It counts as a point mass where "
    "its centre is.",
    signature="Residual torque of one weight and one inertia at all joints that carry the part, at rest and in motion, that "
    "turns with the part; nothing at the joints beyond it.",
    reference="Atkeson, An and Hollerbach 1986, Estimation of Inertial Parameters of Manipulator Loads and Links, IJRR 5(3)",
    ranges=_loads,
    worth_proposing=is_arm,
)
def payload(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    mass = values["mass_kg"]
    if mass == 0.0:
        return robot
    part = robot.part(target)
    total = part.mass_kg + mass
    at = (values["x_m"], values["y_m"], values["z_m"])
    x, y, z = ((part.mass_kg * c + mass * p) / total for c, p in zip(part.com_m, at, strict=True))
    # Two points a distance apart turn about their common centre with the reduced mass.
    dx, dy, dz = (p - c for c, p in zip(part.com_m, at, strict=True))
    reduced = part.mass_kg * mass / total
    shift = (dy * dy + dz * dz, dx * dx + dz * dz, dx * dx + dy * dy, -dx * dy, -dx * dz, -dy * dz)
    xx, yy, zz, xy, xz, yz = (i + reduced * s for i, s in zip(part.inertia_kg_m2, shift, strict=True))
    return robot.with_part(target, mass_kg=total, com_m=(x, y, z), inertia_kg_m2=(xx, yy, zz, xy, xz, yz))


@effect(
    "part_inertia",
    family="body",
    targets=parts,
    parameters=(
        Parameter(
            "along_x", "1", -0.99, 24.0, 0.0, "change of the mass's spread (mean square) along x, as a share", 0.05
        ),
        Parameter("along_y", "1", -0.99, 24.0, 0.0, "the same along y", 0.05),
        Parameter("along_z", "1", -0.99, 24.0, 0.0, "the same along z", 0.05),
    ),
    ranges=always(along_x=(-0.8, 3.0), along_y=(-0.8, 3.0), along_z=(-0.8, 3.0)),
    physics="The mass of a part is spread wider or closer about its centre than in the model. Spread along an axis adds to the "
    "inertia about the other two, so that every value is one that a rigid body can have.",
    signature="Residual torque in proportion to the angular acceleration of the part; nothing at rest.",
    reference="Wensing, Kim and Slotine 2018, Linear Matrix Inequalities for Physically Consistent Inertial "
    "Parameter Identification",
    searchable=False,
)
def part_inertia(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    sx, sy, sz = (1.0 + values[k] for k in ("along_x", "along_y", "along_z"))
    if (sx, sy, sz) == (1.0, 1.0, 1.0):
        return robot
    xx, yy, zz, xy, xz, yz = robot.part(target).inertia_kg_m2
    half = (xx + yy + zz) / 2
    a, b, c = (half - xx) * sx, (half - yy) * sy, (half - zz) * sz
    products = (xy * math.sqrt(sx * sy), xz * math.sqrt(sx * sz), yz * math.sqrt(sy * sz))
    return robot.with_part(target, inertia_kg_m2=(b + c, a + c, a + b, *products))
