"""task=robot: a URDF or an MJCF: what was read, what is assumed, what is missing; a description to begin with, a picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from ee_dist.basics.files import write_whole
from ee_dist.engines.drivers import Commands
from ee_dist.recording.records import HARDWARE, RunRecord, TrialRecord
from ee_dist.robots.describe import kind_of, read_body
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import span
from ee_dist.robots.starter import JOINT_COLUMNS, Starter, moving_mass, source_from, starter
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.folder import check_file_name
from ee_dist.tasks.results.commands import command
from ee_dist.tasks.summary import Stopwatch, digest_of, write_summary
from ee_dist.tasks.terminal import terminal
from ee_dist.trials.log import Array, SensorLog, start_of
from ee_dist.viewing.rerun_scene import write_rrd

SECONDS_EACH, STEP_S = 2.0, 0.04
"""How long the picture moves each joint, and how far apart its rows are."""
SWING = 0.25
"""Share of half the range, at most half a radian or a tenth of a metre."""


@dataclass
class Options:
    name: str = "robot"
    output: str = "robot.yaml"


def run(config: Config, options: Options, out: Path) -> None:
    """Read ``config.urdf`` or ``config.mjcf``, tell of it, write ``robot.yaml`` and ``robot.rrd``.

    Raises ConfigError, RobotError.
    """
    watch = Stopwatch()
    given = [(kind, path) for kind, path in (("urdf", config.urdf), ("mjcf", config.mjcf)) if path]
    if len(given) != 1:
        raise ConfigError("task=robot looks at one file: urdf=FILE.urdf or mjcf=FILE.xml")
    check_file_name("task.output", options.output, "robot.yaml")
    kind, path = given[0][0], Path(given[0][1])
    if path.is_file() and kind_of(path) != kind:
        raise ConfigError(
            f"{kind}={path}: is {'an MJCF' if kind == 'urdf' else 'a URDF'}; write {kind_of(path)}={path}"
        )
    found = starter(read_body(kind, path), kind, source_from(path, out), str(path))
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / options.output, text_of(found))
    robot = found.robot
    rest = {
        "robot": robot.name,
        "mass_kg": sum(p.mass_kg for p in robot.parts),
        "moving_mass_kg": moving_mass(robot),
        "degrees_of_freedom": sum(j.kind != "fixed" for j in robot.joints) + 6 * robot.free_base,
        "joints": [dict(zip(JOINT_COLUMNS, row, strict=True)) for row in found.joints],
        "read": list(found.read),
        "assumed": list(found.assumed),
        "missing": list(found.missing),
        "description": options.output,
    }
    write_summary(out, "robot", config, options, watch, digest_of((robot, found.text)), rest)
    write_rrd(scene(robot), out / "robot.rrd")
    tell(terminal(), found, out / options.output, kind)


def text_of(found: Starter) -> str:
    """The description with a head that says what it is."""
    head = [
        f"# {found.robot.name}: written by task=robot; every value marked 'assumed' is a guess. Put it right and take the mark "
        "off, or let improve find it."
    ]
    head += [f"# missing: {m}" for m in found.missing]
    return "\n".join(head) + "\n" + found.text


def tell(console: Console, found: Starter, file: Path, kind: str) -> None:
    """Print what was read, assumed and missing, and what is next; ``kind``: of the robot (conf/robot)."""
    joints = Table(title=found.robot.name, title_justify="left", box=None, padding=(0, 1, 0, 0))
    for k, name in enumerate(JOINT_COLUMNS):
        # Where there is little room titles and names are folded, and numbers whole.
        widest = max((len(row[k]) for row in found.joints if k), default=8)
        joints.add_column(name, min_width=widest, overflow="fold", justify="left" if k in (0, 3) else "right")
    for row in found.joints:
        joints.add_row(*row)
    console.print(joints)
    for title, lines in (("read", found.read), ("assumed", found.assumed), ("missing", found.missing)):
        for line in lines or ("nothing",):
            console.print(f"{title:8} {line}", highlight=False, markup=False, soft_wrap=True)
    console.print(f"wrote {file} and {file.parent / 'robot.rrd'}", highlight=False, soft_wrap=True)
    following = command(["task=import", "measured=YOUR_LOG", f"robot={kind}", f"robot.drives={file}"])
    console.print(f"Next: {following}", highlight=False, markup=False, soft_wrap=True)


def scene(robot: Robot) -> RunRecord:
    """The robot at its start, each of its joints moved in turn: to see whether axes and ranges are right."""
    joints = sweep(robot)
    rows = len(joints)
    log = SensorLog(
        times_s=np.arange(rows) * STEP_S,
        sensors=np.zeros((rows, 0)),
        commands=joints.copy(),
        sensor_names=(),
        sensor_units=(),
        motor_names=robot.motor_names,
        base_pose=np.tile(np.array([*robot.start_position_m, *robot.start_rotation]), (rows, 1)),
        joints=joints,
        travel_m=0.0,
    )
    bare = Robot(**{**robot.__getstate__(), "sensors": ()})
    return RunRecord(
        bare, {"task": "robot"}, trials=[TrialRecord(0, "each joint in turn", HARDWARE, Commands(joints), log)]
    )


def sweep(robot: Robot) -> Array:
    """(T, M): each joint from its start a little up, a little down and back, one after the other."""
    start, each = start_of(robot), round(SECONDS_EACH / STEP_S)
    wave = np.sin(2 * np.pi * np.arange(each) / each)
    found = np.tile(start, (max(1, each * len(start)), 1))
    for k, half in enumerate(_halves(robot)):
        low, high = span(robot.joint(robot.motor_names[k]))
        found[k * each : (k + 1) * each, k] = np.clip(start[k] + half * wave, low, high)
    return found


def _halves(robot: Robot) -> Sequence[float]:
    found = []
    for name in robot.motor_names:
        joint = robot.joint(name)
        low, high = span(joint)
        found.append(min(SWING * (high - low), 0.5 if joint.kind == "hinge" else 0.1))
    return found
