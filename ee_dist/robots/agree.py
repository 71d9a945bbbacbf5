"""Where two descriptions of one robot differ, in words; and whether the files behind a robot are still what they were."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import fields, replace
from pathlib import Path
from typing import Any

from ee_dist.basics.files import real
from ee_dist.basics.names import listed
from ee_dist.robots.describe import READERS
from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.robots.model import Robot, RobotError
from ee_dist.robots.texts import read_text

OF_THE_MEASUREMENT = ("noise",)
"""Fields of a sensor that belong to the readings rather than to the robot;"""
SEEN_IN_LOGS = ("lag_s",)
"""those of a joint."""


def differences(model: Robot, recorded: Robot) -> tuple[str, ...]:
    """What the model has otherwise than the recorded robot, a line each: ``drive servo: kp 2, in the log 17.8``.

    Noise of the sensors is a fact of the measurement and does not count; nor does the name.
    """
    found: list[str] = []
    for what, attribute, key in (
        ("part", "parts", "name"),
        ("joint", "joints", "name"),
        ("drive", "drives", "joint"),
        ("sensor", "sensors", "name"),
    ):
        mine = {getattr(i, key): i for i in getattr(model, attribute)}
        theirs = {getattr(i, key): i for i in getattr(recorded, attribute)}
        for name in [*mine, *(n for n in theirs if n not in mine)]:
            if name not in mine or name not in theirs:
                found.append(f"{what} {name}: only in {'the model' if name in mine else 'the log'}")
                continue
            found += _lines(f"{what} {name}", mine[name], theirs[name])
    found += _lines("world", model.world, recorded.world)
    for field in ("wiring", "laws", "free_base", "start_position_m", "start_rotation", "time_step_s"):
        found += _line("robot", field, getattr(model, field), getattr(recorded, field))
    return tuple(found)


def _lines(what: str, mine: Any, theirs: Any) -> Iterator[str]:
    for f in fields(mine):
        own = OF_THE_MEASUREMENT if what.startswith("sensor ") else SEEN_IN_LOGS if what.startswith("joint ") else ()
        if f.name not in own:
            yield from _line(what, f.name, getattr(mine, f.name), getattr(theirs, f.name))


def _line(what: str, field: str, mine: Any, theirs: Any) -> Iterator[str]:
    if mine != theirs:
        yield f"{what}: {field} {_shown(mine)}, in the log {_shown(theirs)}"


def _shown(value: Any) -> str:
    text = f"{value:g}" if isinstance(value, float) else str(value)
    return text if len(text) <= 60 else text[:57] + "..."


TIME_STEP = "time step"


def agreed(model: Robot, recorded: Robot, where: str) -> tuple[Robot, tuple[str, ...]]:
    """The robot to compare with a log: the ``model``'s, with the noise that the recorded robot's sensors have.

    Meters of motor torque that only the log has are added: they say nothing of the robot. And what it has otherwise than the
    log, for people. Raises RobotError where the two cannot be one robot: other joints,
    sensors, units, commands or time step.
    """
    model = _instrumented(model, recorded)
    for what, mine, theirs in (
        ("drives", model.motor_names, recorded.motor_names),
        ("sensors", model.sensor_names, recorded.sensor_names),
        ("units of sensors", [s.unit for s in model.sensors], [s.unit for s in recorded.sensors]),
        ("commands", [d.command for d in model.drives], [d.command for d in recorded.drives]),
        (TIME_STEP, [f"{model.time_step_s:g} s"], [f"{recorded.time_step_s:g} s"]),
    ):
        if list(mine) != list(theirs):
            not_those = "is not that" if what == TIME_STEP else "are not those"
            raise RobotError(
                f"{where}: the {what} of {model.name} {not_those} of the log: {listed(mine)}; the log has {listed(theirs)}"
                + (" (import it again with the other description)" if what == TIME_STEP else "")
            )
    noise = {s.name: {n: getattr(s, n) for n in OF_THE_MEASUREMENT} for s in recorded.sensors}
    sensors = tuple(replace(s, **noise[s.name]) for s in model.sensors)
    return replace(model, sensors=sensors), differences(model, recorded)


def _instrumented(model: Robot, recorded: Robot) -> Robot:
    more = tuple(s for s in recorded.sensors if s.kind == MOTOR_TORQUE and s.name not in model.sensor_names)
    return replace(model, sensors=(*model.sensors, *more)) if more else model


def source_digests(source: Any, folder: str | Path = ".") -> dict[str, str]:
    """SHA-256 of the files that a robot was read from, by absolute path: ``source`` is what ``load_robot`` takes.

    A description names a file of its own (a URDF), which counts too; a built-in robot has none.
    """
    found: dict[str, str] = {}
    if isinstance(source, Mapping):
        inside, folder = source, Path(folder)
    else:
        path = real(Path(folder) / str(source))
        if not path.is_file():
            return {}
        found[str(path)] = _digest(path)
        if path.suffix.lower() not in (".yaml", ".yml", ".json"):
            return found
        data = read_text(path, "the description of a robot")
        inside, folder = data if isinstance(data, Mapping) else {}, path.parent
    for kind in READERS:
        if kind in inside:
            file = real(folder / str(inside[kind]))
            if file.is_file():
                found[str(file)] = _digest(file)
    return found


def _digest(path: Path) -> str:
    return hashlib.sha256(path.read_bytes()).hexdigest()


SOURCES = "robot_sources"
"""Key in a recording's metadata under which ``source_digests`` stand, as JSON."""


def sources_text(source: Any, folder: str | Path = ".", more: Any = None) -> str:
    """``source_digests`` as the text that goes into a recording's metadata under SOURCES; ``more``: of a second source."""
    second = {} if more is None else source_digests(more, folder)
    return json.dumps(source_digests(source, folder) | second, sort_keys=True)


def changed_sources(metadata: Mapping[str, str]) -> tuple[str, ...]:
    """A line for each file that a recorded robot was read from and that is now another. A file that is gone says nothing."""
    try:
        known = json.loads(metadata.get(SOURCES, "{}"))
    except ValueError:
        return ()
    lines = []
    for name, digest in sorted(known.items()) if isinstance(known, dict) else ():
        path = Path(str(name))
        if path.is_file() and _digest(path) != digest:
            lines.append(
                f"{path} has changed since the import: the log keeps the robot as it was; import again, or name a model file"
            )
    return tuple(lines)
