"""A folder of files that are right, and of files that are wrong in one way each, for the table of mistakes."""

from __future__ import annotations

import json
import os
import sqlite3
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import yaml

from ee_dist.engines.drivers import Commands, Network
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.describe import load_robot
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.serial import robot_to_dict
from ee_dist.trials.log import SensorLog

URDF = """<robot name="arm"><link name="base"/><link name="rod"><inertial><mass value="{mass}"/>
<inertia ixx="0.1" iyy="0.1" izz="0.1" ixy="0" ixz="0" iyz="0"/></inertial></link>
<joint name="turn" type="{kind}"><parent link="base"/><child link="{child}"/><axis xyz="{axis}"/>
<limit lower="-1" upper="1" effort="5" velocity="5"/></joint></robot>
"""
MJCF = """<mujoco><worldbody><body><inertial pos="0 0 0" mass="{mass}" diaginertia="1 1 1"/>
<joint name="turn" type="{kind}" axis="0 0 1" range="-60 60"/></body></worldbody>
<actuator><position joint="{joint}" kp="3"/></actuator></mujoco>
"""
RIGHT: dict[str, str] = {"mass": "1", "kind": "revolute", "child": "rod", "axis": "0 0 1"}
DRIVES = "urdf: arm.urdf\ndrives: {turn: %s}\n"
SERVO = "robot: servo_pendulum\neffects:\n  - %s\n"
MAPPING = (
    "robot: servo_pendulum\ntime: {column: t, unit: s}\n"
    "sensors: {position: {column: q, unit: %s}, speed: {speed_of: position}}\n"
)
"""Without commands: to be filled in by each."""
COMMANDS = "commands: {servo: {column: g, unit: rad}}\n"
PLUGIN = """from dataclasses import replace

import numpy as np
from ee_dist.effects import Parameter, drive_law, effect
from ee_dist.robots.model import Law

@effect("{name}", family="{family}", targets=lambda robot: {targets}, physics="p", signature="s",
        parameters=(Parameter("{parameter}", "N.m", {low}, 1.0, 0.0, "m"),))
def mine(robot, target, values):
    {body}
"""


LAW = """
@drive_law("{name}")
def torque(joint):
    return {torque}
"""
AS_IT_IS = {"family": "drive", "targets": '("servo",)', "parameter": "much", "low": "0.0", "body": "return robot"}


def plugin(name: str, law: str = "", **changes: str) -> str:
    """A user's own effect; with ``law`` it acts by a law of torque that returns this."""
    if law:
        changes["body"] = f'return robot.with_law(Law("{name}", target, tuple(values.items())))'
    return PLUGIN.format(name=name, **(AS_IT_IS | changes)) + (LAW.format(name=name, torque=law) if law else "")


def _chain(joints: int) -> str:
    """A robot of many links, each of which hangs on the one before."""
    link = '<link name="l{0}"><inertial><mass value="1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>'
    joint = '<joint name="j{0}" type="revolute"><parent link="l{1}"/><child link="l{0}"/><limit lower="0" upper="1"/></joint>'
    links = "".join(link.format(k) for k in range(joints + 1))
    return f'<robot name="c">{links}{"".join(joint.format(k, k - 1) for k in range(1, joints + 1))}</robot>'


def urdf(**changes: str) -> str:
    return URDF.format(**(RIGHT | changes))


def mjcf(**changes: str) -> str:
    return MJCF.format(**({"mass": "1", "kind": "hinge", "joint": "turn"} | changes))


def runs() -> dict[str, dict[str, Any]]:
    """Summaries of finished runs by their folders, as far as a later verb looks into them."""
    told = {"task": "explain", "way": "open_loop", "engine": "mujoco", "model_terms": []}

    def tied(target: str) -> list[dict[str, Any]]:
        terms = [{"effect": e, "target": target, "values": {}} for e in ("backlash", "deadband")]
        names = [f"{t['effect']}@{target}" for t in terms]
        return [{"name": n, "terms": [t], "earned": True, "tied_with": [m for m in names if m != n]}
                for n, t in zip(names, terms, strict=True)]  # fmt: skip

    return {
        "compared": {"task": "compare"},
        "later": told | {"format": 2},
        "foreign": {"name": "of another program"},
        "whole": told | {"result_digest": "0"},
        "odd": {"task": "explain", "verdict": "effect"},
        "settled": told | {"verdict": "nothing_missing", "candidates": []},
        "alone": told | {"verdict": "effect", "candidates": [tied("servo")[0] | {"tied_with": []}]},
        "tied": told | {"verdict": "effect", "candidates": tied("servo")},
        "elbow": told | {"verdict": "effect", "candidates": tied("elbow")},
    }


def servo_log(rows: int = 60) -> SensorLog:
    robot, _ = load_robot("servo_pendulum")
    t = np.arange(rows) * robot.time_step_s
    values = np.stack([np.sin(3 * t)] * len(robot.sensors), axis=1)
    units = tuple(s.unit for s in robot.sensors)
    return SensorLog(t, values, np.sin(3 * t)[:, None], robot.sensor_names, units, robot.motor_names)


def texts() -> dict[str, str]:
    rows = [f"{0.005 * k:.3f},{np.sin(0.1 * k):.6f},{np.sin(0.1 * k + 0.1):.6f}" for k in range(60)]
    table = "t,q,g\n" + "\n".join(rows) + "\n"
    entries = [dict(zip("tqg", map(float, r.split(",")), strict=True)) for r in rows]
    robot = robot_to_dict(quadruped())
    heavy = json.loads(json.dumps(robot))
    heavy["robot"]["parts"][0]["mass_kg"] = 1e300
    older = robot | {"version": 99}
    return {
        "arm.urdf": urdf(),
        "no_mass.urdf": urdf(mass="-1"),
        "word_mass.urdf": urdf(mass="heavy"),
        "huge_mass.urdf": urdf(mass="1e300"),
        "kind.urdf": urdf(kind="rotary"),
        "child.urdf": urdf(child="rodd"),
        "axis.urdf": urdf(axis="0 0"),
        "cut.urdf": urdf()[:200],
        "entity.urdf": '<!DOCTYPE r [<!ENTITY x SYSTEM "file:///etc/passwd">]><robot name="&x;"><link name="a"/></robot>',
        "empty.urdf": "",
        "sdf.urdf": "<sdf/>",
        "arm.xml": mjcf(),
        "ball.xml": mjcf(kind="ball"),
        "joint.xml": mjcf(joint="trun"),
        "mass.xml": mjcf(mass="-1"),
        "cut.xml": mjcf()[:150],
        "include.xml": '<mujoco><include file="/etc/passwd"/></mujoco>',
        "html.xml": "<html/>",
        "arm.yaml": DRIVES % "{kp: 3}",
        "gain.yaml": DRIVES % "{kp: -3}",
        "noise.yaml": DRIVES % "{kp: 3}" + "sensors: [{name: a, kind: position, target: turn, noise: .nan}]\n",
        "kind.yaml": DRIVES % "{kp: 3}" + "sensors: [{name: a, kind: positon, target: turn}]\n",
        "target.yaml": DRIVES % "{kp: 3}" + "sensors: [{name: a, kind: position, target: trun}]\n",
        "twice.yaml": DRIVES % "{kp: 3}" + 2 * "sensors: [{name: a, kind: position, target: turn}]\n",
        "same.yaml": DRIVES % "{kp: 3}" + "sensors: [" + 2 * "{name: a, kind: position, target: turn}," + "]\n",
        "joint.yaml": "urdf: arm.urdf\ndrives: {trun: {kp: 3}}\n",
        "drive.yaml": DRIVES % "{kpp: 3}",
        "drives.yaml": "urdf: arm.urdf\ndrives: [turn]\n",
        "command.yaml": DRIVES % "{command: speedy}",
        "step.yaml": DRIVES % "{kp: 3}" + "time_step_s: 10\n",
        "floor.yaml": DRIVES % "{kp: 3}" + "has_floor: maybe\n",
        "no_urdf.yaml": "urdf: nowhere.urdf\n",
        "deep.yaml": "robot: " + "[" * 200 + "]" * 200,
        "mapping.yaml": "robot: {robot: {robot: quadruped}}\n",
        "list.yaml": "- 1\n- 2\n",
        "beside.yaml": "urdf: arm.urdf\neffects: []\n",
        "tab.yaml": "robot:\n\tservo\n",
        "binary.yaml": "\x00\x01",
        "heavy.json": json.dumps(heavy),
        "version.json": json.dumps(older),
        "cut.json": json.dumps(robot)[:500],
        "model.yaml": SERVO % "{effect: viscous_friction, target: servo, damping_nm_s_rad: 0.005}",
        "effect.yaml": SERVO % "{effect: viscous_fricton, target: servo}",
        "place.yaml": SERVO % "{effect: viscous_friction, target: elbow}",
        "parameter.yaml": SERVO % "{effect: viscous_friction, target: servo, damping: 0.005}",
        "value.yaml": SERVO % "{effect: viscous_friction, target: servo, damping_nm_s_rad: much}",
        "bounds.yaml": SERVO % "{effect: motor_weak, target: servo, loss: 5}",
        "huge.yaml": SERVO % "{effect: coulomb_friction, target: servo, torque_nm: 1.0e+300}",
        "less.yaml": SERVO % "{effect: viscous_friction, target: servo, damping_nm_s_rad: -5}",
        "nan.yaml": SERVO % "{effect: viscous_friction, target: servo, damping_nm_s_rad: .nan}",
        "nameless.yaml": SERVO % "{target: servo}",
        "word.yaml": SERVO % "viscous_friction",
        "effects.yaml": "robot: servo_pendulum\neffects: viscous_friction\n",
        "key.yaml": "robot: servo_pendulum\neffekts: []\n",
        "robot.yaml": "robot: servo_pendulim\n",
        "number.yaml": "robot: {robot: servo_pendulum, gain: fast}\n",
        "unknown.yaml": "robot: {robot: servo_pendulum, gian: 3}\n",
        "t.csv": table,
        "t.json": json.dumps(entries),
        "words.csv": table.replace("0.099833", "much"),
        "gap.csv": table.replace("0.099833", ""),
        "back.csv": table.replace("0.100,", "0.001,"),
        "jump.csv": table.replace("0.295,", "1e12,"),
        "inf.csv": table.replace("0.099833", "inf"),
        "comma.csv": table.replace(",", ";").replace(".", ","),
        "ragged.csv": table.replace("0.010,", "0.010,1,1,"),
        "header.csv": "t,q,g\n",
        "one.csv": "\n".join(table.splitlines()[:2]) + "\n",
        "still.csv": "t,q,g\n" + "0,1,1\n" * 60,
        "empty.csv": "",
        "cut2.json": json.dumps(entries)[:300],
        "word.json": '"hello"',
        "deep.json": "[" * 5000,
        "rows.json": "[1, 2, 3]",
        "good.map": MAPPING % "rad" + COMMANDS,
        "unit.map": MAPPING % "radd" + COMMANDS,
        "metres.map": MAPPING % "m" + COMMANDS,
        "column.map": (MAPPING % "rad").replace("column: q", "column: qq") + COMMANDS,
        "time.map": (MAPPING % "rad").replace("time: {column: t, unit: s}\n", "") + COMMANDS,
        "key.map": MAPPING % "rad" + COMMANDS + "comands: {}\n",
        "joint.map": MAPPING % "rad" + COMMANDS.replace("servo", "sevro"),
        "push.map": MAPPING % "rad" + COMMANDS + "external: {sevro: {column: push, unit: N.m}}\n",
        "gains.map": MAPPING % "rad" + COMMANDS + "gains: {sevro: {kp: 2}}\n",
        "sensor.map": (MAPPING % "rad").replace("position", "positon") + COMMANDS,
        "robot.map": (MAPPING % "rad").replace("servo_pendulum", "servo_pendulim") + COMMANDS,
        "scale.map": (MAPPING % "rad, scale: .nan") + COMMANDS,
        "list.map": "- 1\n",
        "notes.mcap": "a shopping list",
        "notes.bag": "a shopping list",
        "notes.db3": "a shopping list",
        "notes.npz": "a shopping list",
        "notes.mat": "a shopping list",
        "notes.h5": "a shopping list",
        "notes.parquet": "a shopping list",
        "notes.xlsx": "a shopping list",
        "none.py": plugin("my_none", body="return None"),
        "number.py": plugin("my_number", body="return 3"),
        "key.py": plugin("my_key", body="return values['wrong']"),
        "stop.py": plugin("my_stop", body="raise SystemExit(0)"),
        "family.py": plugin("my_family", family="magic"),
        "low.py": plugin("my_low", low="5.0"),
        "name.py": plugin("my_name", parameter="effect"),
        "targets.py": plugin("my_targets", targets="robot.nothing"),
        "shape.py": plugin("my_shape", law="np.zeros(3)"),
        "nan.py": plugin("my_nan", law="joint.position * np.nan"),
        "law.py": plugin("my_law", law="1 / 0"),
        "nothing.py": plugin("my_nothing", law="None"),
        "text.py": plugin("my_text", law="'much'"),
        "raises.py": "raise ValueError('mine')\n",
        "exits.py": "import sys\nsys.exit(0)\n",
        "syntax.py": "def (:\n",
        "import.py": "import nowhere_to_be_found\n",
        "known.py": plugin("motor_weak"),
        "robot_dir.py": "x = 1 / 0\n",
        "ends.py": "raise GeneratorExit\n",
        "break.py": plugin("my\\nname"),
        "heights.xml": mjcf().replace(
            "<worldbody>", '<asset><hfield name="h" nrow="60000" ncol="60000" size="1 1 1 1"/></asset><worldbody>'
        ),
        "chain.urdf": _chain(1000),
        "sensors.yaml": DRIVES % "{kp: 3}"
        + "sensors:\n"
        + "".join(f"- {{name: s{k}, kind: position, target: turn}}\n" for k in range(1001)),
        "fine.yaml": DRIVES % "{kp: 3}" + "time_step_s: 1.0e-12\n",
        "empty.rrd": "",
        "wide.csv": ",".join(f"c{k}" for k in range(10001)) + 2 * ("\n" + ",".join(["1"] * 10001)) + "\n",
        "large.map": MAPPING % "rad, scale: 1.0e+300" + COMMANDS,
        "large.csv": table.replace("0.099833", "1e300"),
    }


def write(folder: Path) -> None:
    """All of them into a folder."""
    for name, text in texts().items():
        (folder / name).write_bytes(text.encode())
    (folder / "latin.yaml").write_bytes("robot: möbius\n".encode("latin-1"))
    np.savez(folder / "object.npz", t=np.array([{"a": 1}], dtype=object))
    np.savez(folder / "lengths.npz", t=np.arange(5.0), q=np.arange(7.0))
    pd.DataFrame({"t": [0.0, 0.1], "q": ["a", "b"]}).to_parquet(folder / "words.parquet")
    (folder / "cut.parquet").write_bytes((folder / "words.parquet").read_bytes()[:200])
    sqlite3.connect(folder / "tables.db3").execute("create table other (a int)").connection.commit()
    os.mkfifo(folder / "pipe.yaml")
    for name in ("loop.py", "loop.csv", "loop.mcap", "loop.xml"):
        (folder / name).symlink_to(name)
    (folder / "sparse.py").touch()
    os.truncate(folder / "sparse.py", 2**40)
    (folder / "folder.yaml").mkdir()
    (folder / "nothing").mkdir()
    for name, summary in runs().items():
        (folder / name).mkdir()
        (folder / name / "summary.json").write_text(json.dumps(summary))
    robot, _ = load_robot("servo_pendulum")
    log = servo_log()
    for name, driver in (("trial", Commands(log.commands)), ("weights", Network((0.0,)))):
        with RunWriter(folder / f"{name}.mcap", robot, {"task": "trial"}) as writer:
            writer.trial(TrialRecord(0, "t", HARDWARE, driver, log))
    (folder / "halved").mkdir()
    (folder / "halved" / "summary.json").write_text('{"task": "explain", "way": "op')
    content = (folder / "trial.mcap").read_bytes()
    (folder / "logged").mkdir()
    (folder / "logged" / "trial.mcap").write_bytes(content)
    (folder / "cut.mcap").write_bytes(content[:60])
    (folder / "flipped.mcap").write_bytes(content[:300] + bytes([content[300] ^ 16]) + content[301:])
    (folder / "sealed.json").write_text(json.dumps({"seal": "wrong"}))


def written(folder: Path) -> dict[str, Any]:
    """What lies in a folder, to compare: names and times."""
    return {str(p.relative_to(folder)): p.lstat().st_mtime_ns for p in folder.rglob("*")}


def as_yaml(data: Any) -> str:
    return yaml.safe_dump(data)
