"""Runs the peer programs on the same robot and says what one of their evaluations costs."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.robots.model import Part, Robot

PROGRAMS = Path(__file__).resolve().parent


def write_urdf(robot: Robot, path: Path) -> None:
    """The robot as a URDF: same masses, inertias, shapes and joints. Rotors have no place in it."""
    lines = [f'<robot name="{robot.name}">']
    for part in robot.parts:
        lines += _link(part)
    for joint in robot.joints:
        drive = next(d for d in robot.drives if d.joint == joint.name)
        lines.append(
            f'<joint name="{joint.name}" type="revolute"><parent link="{joint.parent}"/><child link="{joint.child}"/>'
            f'{_origin(joint.position_m, joint.rotation)}<axis xyz="{_words(joint.axis)}"/>'
            f'<limit lower="{joint.lower}" upper="{joint.upper}" effort="{drive.torque_limit}" '
            f'velocity="{drive.speed_limit}"/></joint>'
        )
    path.write_text("\n".join([*lines, "</robot>"]), encoding="utf-8")


def _link(part: Part) -> list[str]:
    xx, yy, zz, xy, xz, yz = part.inertia_kg_m2
    lines = [
        f'<link name="{part.name}"><inertial>{_origin(part.com_m, (0.0, 0.0, 0.0, 1.0))}<mass value="{part.mass_kg}"/>',
        f'<inertia ixx="{xx}" iyy="{yy}" izz="{zz}" ixy="{xy}" ixz="{xz}" iyz="{yz}"/></inertial>',
    ]
    for shape in part.shapes:
        if shape.kind == "box":
            form = f'<box size="{_words(tuple(2 * s for s in shape.size))}"/>'
        elif shape.kind == "sphere":
            form = f'<sphere radius="{shape.size[0]}"/>'
        else:
            form = f'<{shape.kind} radius="{shape.size[0]}" length="{shape.size[1]}"/>'
        lines.append(f"<collision>{_origin(shape.position_m, shape.rotation)}<geometry>{form}</geometry></collision>")
    return [*lines, "</link>"]


def _words(values: tuple[float, ...]) -> str:
    return " ".join(f"{v:.9g}" for v in values)


def _origin(position: tuple[float, ...], rotation: tuple[float, ...]) -> str:
    x, y, z, w = rotation
    roll = np.arctan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))
    return f'<origin xyz="{_words(position)}" rpy="{_words((float(roll), float(pitch), float(yaw)))}"/>'


def run_peer(program: str, urdf: Path, *arguments: str) -> dict[str, Any]:
    """What a peer program reports of a sample. Raises RuntimeError with its last line if it fails."""
    command = [sys.executable, str(PROGRAMS / f"{program}.py"), str(urdf), *arguments]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode:
        last = (done.stderr.strip().splitlines() or ["no message"])[-1]
        raise RuntimeError(f"{program}: {last}")
    return dict(json.loads(done.stdout[done.stdout.index("{") :]))
