"""A desk arm of six hobby servos, described as a user would: a URDF, and what a URDF cannot say."""

from __future__ import annotations

import tempfile
from pathlib import Path

import yaml

from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot

LINKS = (
    # name, mass (kg), length (m), axis of the joint before it
    ("shoulder_turn", 0.12, 0.06, "0 0 1"),
    ("upper_arm", 0.16, 0.12, "0 1 0"),
    ("forearm", 0.13, 0.12, "0 1 0"),
    ("wrist_bend", 0.08, 0.05, "0 1 0"),
    ("wrist_roll", 0.06, 0.05, "1 0 0"),
    ("jaw", 0.04, 0.06, "0 0 1"),
)
RATE_HZ = 100.0
DRIVE = {"kp": 17.8, "kd": 0.3, "torque_limit": 2.9, "speed_limit": 6.0, "rotor_inertia": 0.02}


def urdf(heavier: float = 1.0, effort: float = DRIVE["torque_limit"]) -> str:
    """The body: a chain of six revolute joints, each link a rod along x (the first along z)."""
    parts = ["<robot name='desk_arm_6'><link name='base'/>"]
    parent, at = "base", "0 0 0.05"
    for k, (name, stated, length, axis) in enumerate(LINKS):
        mass = heavier * stated
        across = mass * length**2 / 12 + 1e-5
        middle = f"0 0 {length / 2}" if k == 0 else f"{length / 2} 0 0"
        parts.append(
            f"<link name='{name}'><inertial><origin xyz='{middle}'/><mass value='{mass}'/>"
            f"<inertia ixx='{across}' iyy='{across}' izz='{across}' ixy='0' ixz='0' iyz='0'/></inertial></link>"
            f"<joint name='joint_{k + 1}' type='revolute'><parent link='{parent}'/><child link='{name}'/>"
            f"<origin xyz='{at}'/><axis xyz='{axis}'/><limit lower='-1.7' upper='1.7' effort='{effort:g}' velocity='6'/></joint>"
        )
        parent, at = name, f"0 0 {length}" if k == 0 else f"{length} 0 0"
    return "".join([*parts, "</robot>"])


def desk_arm_6(noise_rad: float = 0.0008) -> Robot:
    """Position channels only, as hobby servos report them."""
    joints = [f"joint_{k + 1}" for k in range(len(LINKS))]
    with tempfile.TemporaryDirectory() as folder:
        (Path(folder) / "arm.urdf").write_text(urdf(), encoding="utf-8")
        entry = {
            "urdf": "arm.urdf",
            "time_step_s": 1 / RATE_HZ,
            "has_floor": False,
            "drives": {j: dict(DRIVE) for j in joints},
            "sensors": [{"name": f"{j}_position", "kind": "position", "target": j, "noise": noise_rad} for j in joints],
        }
        (Path(folder) / "arm.yaml").write_text(yaml.safe_dump(entry), encoding="utf-8")
        return load_robot("arm.yaml", Path(folder))[0]
