"""Model files: a base robot and the effects that it is believed to have. To add an effect is to append a line ::

robot: servo_pendulum            # a name, a file beside this one (.yaml, .urdf), or a description
effects:
  - {effect: viscous_friction, target: servo, damping_nm_s_rad: 0.005}
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from ee_dist.basics.files import write_whole
from ee_dist.basics.quoted import quoted
from ee_dist.effects.catalogue import Hypothesis, apply, from_dict
from ee_dist.effects.described import check_written
from ee_dist.effects.effect import EffectError
from ee_dist.robots.describe import READERS, load_robot
from ee_dist.robots.model import Robot, RobotError
from ee_dist.robots.ranges import drive_of
from ee_dist.robots.serial import robot_to_dict
from ee_dist.robots.texts import read_text


@dataclass(frozen=True)
class ModelFile:
    """``robot`` is the base, without the effects of ``terms``; ``source`` is how the file names it, seen from ``folder``."""

    robot: Robot
    terms: Hypothesis
    source: Any
    folder: Path

    @property
    def model(self) -> Robot:
        """The robot with its effects. What these changed is no longer assumed."""
        found = apply(self.robot, self.terms)
        still = [
            (j, f) for j, f in found.assumed if getattr(drive_of(found, j), f) == getattr(drive_of(self.robot, j), f)
        ]
        return replace(found, assumed=tuple(still))


def read_model(path: str | Path) -> ModelFile:
    """A model file, or the description of a robot that names its file: a model without effects.

    Raises RobotError or EffectError in one line: no such file, not YAML, an unknown robot, effect, target or value.
    """
    file = Path(path)
    data = read_text(file, "a model file (YAML)")
    if isinstance(data, Mapping) and {"task", "result_digest"} <= set(data):
        raise RobotError(
            f"{file}: the summary of a run, not a model; the model that task=improve makes is model.yaml beside it"
        )
    if isinstance(data, Mapping) and any(key in data for key in (*READERS, "version")):
        if "effects" in data:
            raise RobotError(f"{file}: 'effects' beside the description of a robot: put the description below 'robot:'")
        data = {"robot": data}
    if not isinstance(data, Mapping) or "robot" not in data:
        raise RobotError(
            f"{file}: a model file is a mapping with 'robot' and 'effects', or a robot's description with 'urdf' or 'mjcf'"
        )
    for key in data:
        if key not in ("robot", "effects"):
            raise RobotError(f"{file}: unknown key {quoted(key)}; there are: robot, effects")
    try:
        robot, _ = load_robot(data["robot"], file.parent)
    except RobotError as error:
        # Of a description within the file nobody else knows where it stands.
        raise RobotError(f"{file}: {error}" if isinstance(data["robot"], Mapping) else str(error)) from None
    entries = data.get("effects") or []
    if not isinstance(entries, list):
        raise EffectError(f"{file}: effects: expected a list, not {quoted(entries)}")
    try:
        terms = tuple(from_dict(e) for e in entries)
        check_written(robot, terms)
    except EffectError as error:
        raise EffectError(f"{file}: {error}") from None
    return ModelFile(robot, terms, data["robot"], file.parent)


def write_model(path: str | Path, source: Any, folder: Path, terms: Hypothesis, notes: Sequence[str] = ()) -> None:
    """Write a model file, whole or not at all; ``notes`` become comments above it.

    ``source`` names the robot as seen from ``folder`` (a robot itself is written out in full).
    """
    file = Path(path)
    if isinstance(source, Robot):
        source = robot_to_dict(source)
    elif isinstance(source, str) and Path(source).suffix:
        source = os.path.relpath(folder / source, file.parent)
    elif isinstance(source, Mapping) and "urdf" in source:
        source = {**source, "urdf": os.path.relpath(folder / str(source["urdf"]), file.parent)}
    lines = [f"# {line}" for note in notes for line in note.splitlines()]
    flow = None if not isinstance(source, str) else False
    lines.append(yaml.safe_dump({"robot": source}, sort_keys=False, default_flow_style=flow, width=120).rstrip())
    lines.append("effects:" if terms else "effects: []")
    lines += [
        f"  - {yaml.safe_dump(t.as_dict(), default_flow_style=True, sort_keys=False, width=1000).strip()}"
        for t in terms
    ]
    write_whole(file, "\n".join(lines) + "\n")
