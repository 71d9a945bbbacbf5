"""What a robot's file says, what has to be assumed and what is missing; and a description to begin with, assumptions marked."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import yaml

from ee_dist.basics.names import counted, listed
from ee_dist.robots.body import Body
from ee_dist.robots.described import ASSUMED, GRAVITY_M_S2, robot_of_body
from ee_dist.robots.inertia import felt_inertia
from ee_dist.robots.limits import guessed_limit, placeholders, told
from ee_dist.robots.model import Joint, Robot
from ee_dist.robots.ranges import travel

SETTLING_RAD, SETTLING_M = 0.1, 0.01
"""Error at which an assumed position controller asks for all the torque that there is."""
DAMPING = 0.7
"""Of an assumed controller against the inertia that its joint feels, as a share of critical."""
ROTOR_SPEEDS_UP = 250.0
"""rad/s^2 (m/s^2) that a motor gives its own rotor, seen through its gear: of hobby servos and the drives of arms 100 to 400.
Without any rotor a light last link follows an assumed controller within microseconds, which no simulation steps through."""


@dataclass(frozen=True)
class Starter:
    """``text`` is a description as YAML with every assumed value marked; ``robot`` what it describes. Lists are for people."""

    text: str
    robot: Robot
    joints: tuple[tuple[str, ...], ...]
    read: tuple[str, ...]
    assumed: tuple[str, ...]
    missing: tuple[str, ...]


JOINT_COLUMNS = ("joint", "from", "to", "command", "kp", "kd", "limit", "viscous", "dry", "rotor")
"""rad, N.m and kg.m^2 for a hinge; m, N and kg for a slide."""


STEP = "left out, so as fine as the drives need; a log may have any rate"


def starter(body: Body, kind: str, source: str, where: str) -> Starter:
    """A description of a body that names its file ``source``. Raises RobotError where no robot can be made of it."""
    assumed = list(body.assumed)
    by_mark: dict[str, list[str]] = {}
    lines = [f"{kind}: {_plain(source)}"]

    def line(text: str, mark: str | None, said: bool = True) -> None:
        lines.append(text + (f"  # assumed: {mark}" if mark and said else ""))
        if mark:
            by_mark.setdefault(mark, []).append(text.strip().split(":")[0])

    free = bool(body.free_base)
    line(f"free_base: {str(free).lower()}", None if body.free_base is not None else "bolted down")
    if body.time_step_s is not None:
        line(f"time_step_s: {body.time_step_s:g}", None)
    gravity = GRAVITY_M_S2 if body.gravity_m_s2 is None else body.gravity_m_s2
    why = (
        "  # the file compensates the weight of all bodies that move; 9.81 where the robot does not"
        if body.weight_carried
        else ""
    )
    line(
        f"gravity_m_s2: {gravity:g}{why}",
        None if body.gravity_m_s2 is not None else "straight down, in the frame of the root",
    )
    inertia = _inertia(body)
    blank = placeholders(body, inertia)
    swinging = _swinging(body, blank)
    drives = {
        j.name: _free(j, body) if j.name in swinging else _drive(j, body, inertia[j.name], j.name in blank)
        for j in body.moving
    }
    lines.append("drives:" if drives else "drives: {}")
    for name, (entry, guessed) in drives.items():
        known = [g for g in guessed if g in entry]
        marked = entry | {ASSUMED: known} if known else entry
        line(f"  {_plain(name)}: {_flow(marked)}", ", ".join(guessed) or None, known != guessed)
    idle = _undriven(body)
    if idle:
        lines += _led(body, idle, inertia)
    assumed += [f"{', '.join(names[:3])}{f' and {len(names) - 3} more' if names[3:] else ''}: {mark}"
                for mark, names in by_mark.items()]  # fmt: skip
    assumed += told(blank, body, swinging)
    assumed += _without_transmission(body, [n for n, (entry, _) in drives.items() if entry.get("command") != "none"])
    if body.sensors:
        lines.append(f"# sensors: the file's own {len(body.sensors)}; a list here takes their place")
    else:
        lines.append("# sensors: left out, so position and velocity of every joint; see docs/bring_your_robot.md")
        assumed.append("sensors: position and velocity of every driven joint, without noise")
    data = {k: v for k, v in yaml.safe_load("\n".join(lines)).items() if k != kind}
    robot, notes = robot_of_body(body, data, where)
    if body.time_step_s is None:
        # No value, so that it follows when the drives are put right.
        lines.insert(2, f"# time_step_s: {robot.time_step_s:g}  # assumed: {STEP}")
        assumed.append(f"time_step_s: {robot.time_step_s:g} s, {STEP}")
    text = "\n".join(lines) + "\n"
    read = (
        f"{len(robot.parts)} parts, {moving_mass(robot):.4g} kg" + ("" if free else " of them move"),
        f"{len(body.moving) + 6 * free} degrees of freedom: {len(body.moving)} joints"
        + (", base free" if free else ", base bolted down"),
        f"{sum(_acted_on(body.drives[name]) for name in body.driven)} joints with a drive or passive forces in the file",
        *_shapes(robot),
    )
    said = tuple(n for n in notes if n not in body.assumed)
    return Starter(
        text,
        robot,
        tuple(_row(robot, j) for j in body.moving),
        (*read, *said),
        tuple(assumed),
        (*_nobody_leads(idle), *_missing(robot), *_trusted(robot)),
    )


def _undriven(body: Body) -> tuple[Joint, ...]:
    """Joints that a file without any actuator has stops or passive forces of: of what drives them it says nothing."""
    if any(known.get("command", "none") != "none" for known in body.drives.values()):
        return ()
    return tuple(j for j in body.moving if j.name in body.driven)


def _led(body: Body, idle: Sequence[Joint], inertia: Mapping[str, float]) -> list[str]:
    """Comments for a description: the lines of drives by whose controllers such joints are led, with gains as they are guessed
    for a file that never has any."""
    bare = {
        n: {k: v for k, v in d.items() if k != "command" and (k, v) != ("torque_limit", math.inf)}
        for n, d in body.drives.items()
    }
    undriven, found = replace(body, drives=bare, driven=()), ["# where a controller leads a joint, its line is"]
    for joint in idle:
        entry, guessed = _drive(joint, undriven, inertia[joint.name], blank=False)
        found.append(f"#  {_plain(joint.name)}: {_flow(entry | {ASSUMED: guessed})}")
    return found


def _nobody_leads(idle: Sequence[Joint]) -> tuple[str, ...]:
    if not idle:
        return ()
    return (
        f"what drives {_first([j.name for j in idle])}: the file has no actuators, so each swings freely and no command of a log "
        "is its own; where a controller leads one, take its line in the comments below the drives",
    )


def _without_transmission(body: Body, driven: Sequence[str]) -> list[str]:
    """A line on the joints that no transmission drives, in a file in which others have one: motors are listed so."""
    known = [name for name in driven if name in body.transmissions]
    others = [name for name in driven if name not in known]
    if not known or not others:
        return []
    return [
        f"{listed(others)}: driven as the others, though the file has transmissions of {listed(known)} alone; 'command: none' "
        "where nothing drives a joint"
    ]


def _inertia(body: Body) -> Mapping[str, float]:
    """What a torque on each moving joint meets, with all rotors that the file states."""
    entries: dict[str, dict[str, Any]] = {}
    for joint in body.moving:
        rotor = body.drives.get(joint.name, {}).get("rotor_inertia", 0.0)
        entries[joint.name] = {"command": "none", "rotor_inertia": rotor}
    robot, _ = robot_of_body(body, {"drives": entries, "free_base": bool(body.free_base)}, body.name)
    return dict(zip(robot.motor_names, (float(v) for v in felt_inertia(robot)), strict=True))


def _swinging(body: Body, blank: Collection[str]) -> tuple[str, ...]:
    """Joints that nothing drives, by all that a file without drives can say: they turn without end and state no effort, where
    another joint states one that is its motor's."""
    efforts = {name for name, known in body.drives.items() if "torque_limit" in known} - set(blank)
    if not efforts or body.driven:
        return ()
    return tuple(j.name for j in body.moving if j.kind == "hinge" and math.isinf(j.ends[1]) and j.name not in efforts)


def _free(joint: Joint, body: Body) -> tuple[dict[str, Any], list[str]]:
    """The same of a joint that swings freely."""
    known = dict(body.drives.get(joint.name, {}))
    known.pop("torque_limit", None)
    return {"command": "none", **known}, ["command"]


def _drive(joint: Joint, body: Body, inertia: float, blank: bool) -> tuple[dict[str, Any], list[str]]:
    """Fields of a drive as they are written down, and those of them that are assumed. ``blank``: the limit stated is none."""
    known = dict(body.drives.get(joint.name, {}))
    guessed: list[str] = []
    if blank or "torque_limit" not in known:
        known["torque_limit"] = _rounded(guessed_limit(joint, body, inertia))
        guessed.append("torque_limit")
    if joint.name not in body.driven:
        limit = float(known["torque_limit"])
        moved, rotor = inertia, []
        if not known.get("rotor_inertia"):
            known["rotor_inertia"] = behind = _rounded(limit / ROTOR_SPEEDS_UP)
            moved, rotor = moved + behind, ["rotor_inertia"]
        error = min(SETTLING_RAD if joint.kind == "hinge" else SETTLING_M, 0.2 * travel(joint))
        kp = limit / error
        known |= {"command": "position", "kp": _rounded(kp)}
        known["kd"] = _rounded(2 * DAMPING * math.sqrt(kp * moved))
        guessed += ["command", "kp", "kd", *rotor]
    elif known.get("torque_limit") == math.inf and known.get("command") != "none":
        guessed.append("no torque limit in the file")
    order = ["command", "kp", "ki", "kd", "torque_limit"]
    # A file that says damping by a force's bias has a zero with a sign.
    known = {k: v + 0.0 if isinstance(v, float) else v for k, v in known.items()}
    return {k: known[k] for k in [*(o for o in order if o in known), *(k for k in known if k not in order)]}, guessed


def moving_mass(robot: Robot) -> float:
    """Of all that can move, kg: what is bolted to a bolted base stays."""
    if robot.free_base:
        return sum(p.mass_kg for p in robot.parts)
    moved = {name for j in robot.joints if j.kind != "fixed" for name in robot.subtree(j.child)}
    return sum(p.mass_kg for p in robot.parts if p.name in moved)


def _acted_on(known: Mapping[str, float | str]) -> bool:
    return known.get("command") != "none" or any(v for k, v in known.items() if k not in ("command", "torque_limit"))


def _rounded(value: float) -> float:
    """Two digits: an assumption should not look like a measurement."""
    return float(f"{value:.2g}")


def _row(robot: Robot, joint: Joint) -> tuple[str, ...]:
    drive = next(d for d in robot.drives if d.joint == joint.name)
    stops = all(map(math.isfinite, joint.ends))
    reach = (
        (f"{joint.lower:.3g}", f"{joint.upper:.3g}")
        if stops
        else ("turns on", "")
        if joint.kind == "hinge"
        else ("-", "")
    )
    limit = "none" if math.isinf(drive.torque_limit) else f"{drive.torque_limit:.4g}"
    name = f"{joint.name} (slide)" if joint.kind == "slide" else joint.name
    rest = (f"{v:.3g}" if v else "" for v in (drive.viscous, drive.coulomb, drive.rotor_inertia))
    return name, *reach, drive.command, *(f"{v:.4g}" if v else "" for v in (drive.kp, drive.kd)), limit, *rest


def _trusted(robot: Robot) -> tuple[str, ...]:
    """What only the user knows of drives that the file states: each file that is simulated states some."""
    led = [d.joint for d in robot.drives if d.command in ("position", "speed")]
    told = [d.joint for d in robot.drives if d.command == "torque"]
    stated = [j for j in led if j not in robot.assumed_joints("kp")]
    found = []
    if told:
        found.append(
            f"whether the robot's own drives obey torques, as the file's actuators of {_first(told)} do: where a controller "
            "leads them to positions, it is 'command: position' with its kp and kd"
        )
    if stated:
        found.append(
            f"whether the file's gains of {_first(stated)} are the robot's: guesses that are marked so, 'assumed: [kp, kd]', are "
            "looked for first"
        )
    return tuple(found)


def _first(joints: Sequence[str]) -> str:
    return ", ".join(joints[:3]) + (f" and {len(joints) - 3} more" if joints[3:] else "")


def _shapes(robot: Robot) -> tuple[str, ...]:
    """How many can touch something, of a robot that stands on a floor or could."""
    count = sum(len(p.shapes) for p in robot.parts)
    if robot.world.has_floor:
        return (f"{counted(count, 'shape')} that can touch the floor",)
    return (f"{counted(count, 'shape')}, and no floor to touch",) if count else ()


def _missing(robot: Robot) -> tuple[str, ...]:
    found = []
    if robot.free_base and not any(p.shapes for p in robot.parts):
        found.append(
            "shapes that touch the floor: give the feet a sphere, box, capsule or cylinder, or the robot falls through"
        )
    if not any(s.noise for s in robot.sensors):
        found.append("noise of the sensors: it is estimated from a log where none is stated")
    if not any(d.rotor_inertia for d in robot.drives):
        found.append(
            "rotor inertia of the motors (rotor_inertia): it may be as large as the arm's own behind a high gear"
        )
    elif guessed := robot.assumed_joints("rotor_inertia"):
        found.append(
            f"a measured rotor inertia of {listed(guessed)}: what is assumed may be several times off, and behind a high gear "
            "it is as large as the arm's own"
        )
    if not any(d.coulomb or d.viscous for d in robot.drives):
        found.append("friction of the joints: explain and improve look for it")
    if not robot.drives:
        found.append("joints that move")
    return tuple(found)


def _flow(entry: Mapping[str, Any]) -> str:
    return "{" + ", ".join(f"{k}: {_plain(v)}" for k, v in entry.items()) + "}"


def _plain(value: Any) -> str:
    """A value as YAML has it within a line."""
    if isinstance(value, float) and math.isfinite(value):
        text = repr(value)
        return text if "e" not in text or "." in text else text.replace("e", ".0e")
    dumped: str = yaml.safe_dump(value, default_flow_style=True, width=1_000_000).strip()
    return dumped.removesuffix("...").strip()


def source_from(file: Path, folder: Path) -> str:
    """How a description in ``folder`` names a file: beside it or below by its relative path, else in full."""
    try:
        return str(file.resolve().relative_to(folder.resolve()))
    except ValueError:
        return str(file.resolve())
