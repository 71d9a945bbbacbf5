"""A mapping from its YAML: checked entry by entry, and what is wrong said with what would be right."""

from __future__ import annotations

from collections.abc import Mapping as Dictionary
from dataclasses import fields
from pathlib import Path
from typing import Any

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.mapping import HELD_IF, Clock, Column, Estimated, Even, Given, Mapping, Setting, Split
from ee_dist.measurements.readers.options import Options
from ee_dist.measurements.units import UNITS
from ee_dist.measurements.yaml_file import load_yaml, shown
from ee_dist.robots.untrusted import UntrustedError, yaml_of

LONGEST_S = 60.0
"""Leads and means beyond this are a slip of the unit."""
GAINS = ("kp", "kd")
MOST = 1e12
"""Of a number that a person states: beyond it sums of squares leave what numbers can hold."""
READ_ALIKE = ("unit", "sign", "scale", "offset", "signed_bits")
"""What a column has that stands for two channels, at both."""
UNKNOWN = "???"
"""Stands in a proposed mapping where only a person can know."""


_KEYS = (
    "robot", "format", "records", "separator", "header", "decimal", "tables", "side_by_side", "one_joint_each", "split", "time",
    "rate_hz", "sensors", "commands", "commands_between", "torques", "external", "supply", "enabled", "settings", "gains",
    "trial",
)  # fmt: skip


def read_mapping(path: str | Path) -> Mapping:
    """The mapping in a YAML file. Raises MeasurementError with the key that is wrong and what would be right."""
    file = Path(path)
    try:
        data = yaml_of(file, load_yaml)
    except FileNotFoundError:
        raise MeasurementError(f"{file}: no such file; expected a mapping in YAML") from None
    except UntrustedError as error:
        raise MeasurementError(f"{file}: {error}") from None
    except OSError as error:
        raise MeasurementError(f"{file}: cannot be read ({error.strerror})") from None
    return mapping_of(data, file)


def mapping_of(data: Any, file: Path) -> Mapping:
    """The mapping that a YAML file holds. Raises MeasurementError."""
    where = str(file)
    if not isinstance(data, Dictionary):
        raise MeasurementError(f"{where}: expected a mapping with 'robot', 'time', 'sensors' and 'commands'")
    for key in data:
        if key not in _KEYS:
            raise MeasurementError(f"{where}: unknown key {quoted(key)}; {nearest(str(key), _KEYS)}")
    if "sensors" not in data:
        raise MeasurementError(f"{where}: missing key 'sensors'")
    sensors: dict[str, Column | Estimated] = {}
    for name, entry in _table(data["sensors"], f"{where}: sensors").items():
        here = f"{where}: sensors: {name}"
        estimated = isinstance(entry, Dictionary) and "speed_of" in entry
        sensors[name] = _estimated(entry, here) if estimated else _column(entry, here)
    single = {k: _column(data[k], f"{where}: {k}") for k in ("supply", "enabled") if data.get(k) is not None}
    groups = {
        group: {
            k: _column(v, f"{where}: {group}: {k}")
            for k, v in _table(data.get(group) or {}, f"{where}: {group}").items()
        }
        for group in ("commands", "torques", "external")
    }
    mapping = Mapping(
        source=file,
        robot=data.get("robot"),
        time=_time(data.get("time"), f"{where}: time"),
        sensors=sensors,
        commands=groups["commands"],
        torques=groups["torques"],
        external=groups["external"],
        supply=single.get("supply"),
        enabled=single.get("enabled"),
        settings=_settings(data.get("settings"), where),
        gains=_gains(data.get("gains") or {}, f"{where}: gains"),
        reading=_reading(data, where),
        tables={
            k: _clock(v, f"{where}: tables: {k}")
            for k, v in _table(data.get("tables") or {}, f"{where}: tables").items()
        },
        side_by_side=_side_by_side(data.get("side_by_side"), f"{where}: side_by_side"),
        one_joint_each=_one_joint_each(data.get("one_joint_each"), f"{where}: one_joint_each"),
        split=_split(data.get("split"), f"{where}: split"),
        rate_hz=_rate(data.get("rate_hz"), f"{where}: rate_hz"),
        commands_between=_between(data.get("commands_between"), f"{where}: commands_between"),
        trial=data.get("trial"),
    )
    _check_once(mapping)
    _check_files(mapping)
    return mapping


def _between(value: Any, where: str) -> str | None:
    if value is None or (isinstance(value, str) and value in HELD_IF):
        return value
    raise MeasurementError(f"{where}: expected {' or '.join(map(quoted, HELD_IF))}, not {quoted(value)}")


def _check_once(mapping: Mapping) -> None:
    """One column is one channel, but for a torque, which may be sensed or commanded and also balanced, read alike.

    Raises MeasurementError naming both.
    """
    seen: dict[tuple[str, str], list[tuple[str, str, Column]]] = {}
    for group, name, column in mapping.columns():
        others = seen.setdefault((column.table, column.column), [])
        for other in others:
            if group == other[0] or "torques" not in (group, other[0]):
                raise MeasurementError(_same(mapping, column, other[:2], (group, name)))
            differing = [k for k in READ_ALIKE if getattr(column, k) != getattr(other[2], k)]
            if differing:
                told = " and ".join(shown(getattr(c, differing[0])) for c in (other[2], column))
                raise MeasurementError(
                    f"{mapping.source}: column {quoted(column.column)} is {other[0]} {other[1]} and {group} {name}, but with "
                    f"{differing[0]} {told}; it is one signal: say the same at both"
                )
        others.append((group, name, column))


def _same(mapping: Mapping, column: Column, one: tuple[str, str], two: tuple[str, str]) -> str:
    return (
        f"{mapping.source}: column {quoted(column.column)} is {one[0]} {one[1]} and also {two[0]} {two[1]}; "
        "one column is one channel: name the right column for each, or leave out what was not recorded"
    )


def _check_files(mapping: Mapping) -> None:
    """Where one table has a file of its own, every table and every channel has one. Raises MeasurementError."""
    filed = [k for k, c in mapping.tables.items() if c.file]
    ways = [k for k in ("tables", "side_by_side", "one_joint_each") if getattr(mapping, k)]
    if len(ways) > 1:
        raise MeasurementError(
            f"{mapping.source}: {ways[0]}, and {ways[1]}: files are either tables with a time each, or stand side by side, or "
            "are trials of one joint each; leave one of the two out"
        )
    if not filed:
        return
    for name, clock in mapping.tables.items():
        _check_shape(clock.file, name, f"{mapping.source}: tables: {name}: file: expected a name")
    for group, name, c in mapping.columns():
        if c.table not in mapping.tables:
            raise MeasurementError(
                f"{mapping.source}: {group}: {name}: which file? add 'table: {filed[0]}'; there are: {', '.join(filed)}"
            )


def _check_shape(shape: str, name: str, wanted: str) -> None:
    """Raises MeasurementError for what is no name of the files of one kind, with {trial} once at most."""
    if not shape or shape.count("{trial}") > 1:
        raise MeasurementError(
            f"{wanted} such as '{{trial}}_{name}.csv' or '{{trial}}/{name}.csv', or '{name}.csv' where each trial has a folder, "
            f"not {quoted(shape)}"
        )


def _rate(value: Any, where: str) -> float | None:
    if value is None:
        return None
    rate = _number(value, where)
    if not 0 < rate <= 1e6:
        raise MeasurementError(f"{where}: expected a positive number of at most 1e6, not {shown(value)}")
    return rate


def _time(value: Any, where: str) -> Column | Even | None:
    if value is None:
        return None
    if isinstance(value, Dictionary) and set(value) == {"rate_hz"}:
        rate = _rate(value["rate_hz"], f"{where}: rate_hz")
        assert rate is not None
        return Even(rate)
    column = _column(value, where, "s")
    if column.offset or column.sign != 1:
        raise MeasurementError(f"{where}: expected column, unit and scale only; a time has no sign and no offset")
    return column


def _clock(value: Any, where: str) -> Clock:
    entry = {"file": value} if isinstance(value, str) else value
    if not isinstance(entry, Dictionary):
        raise MeasurementError(f"{where}: expected {{file: ..., time: ..., offset_s: ...}}, not {shown(value)}")
    for key in entry:
        if key not in ("file", "time", "offset_s"):
            raise MeasurementError(
                f"{where}: unknown key {quoted(key)}; {nearest(str(key), ('file', 'time', 'offset_s'))}"
            )
    offset = entry.get("offset_s")
    return Clock(
        str(entry.get("file", "")),
        _time(entry.get("time"), f"{where}: time"),
        None if offset is None else _number(offset, f"{where}: offset_s"),
    )


def _side_by_side(value: Any, where: str) -> dict[str, str]:
    if value is None:
        return {}
    found = {str(k): str(v) for k, v in _table(value, where).items()}
    for name, shape in found.items():
        _check_shape(shape, name, f"{where}: {name}: expected the name of a file")
    if len(found) == 1:
        raise MeasurementError(f"{where}: expected two files or more, not {quoted(next(iter(found)))} alone")
    return found


def _one_joint_each(value: Any, where: str) -> dict[str, str]:
    found = {} if value is None else {str(k): str(v) for k, v in _table(value, where, "name of its file").items()}
    for name, shape in found.items():
        if not shape:
            raise MeasurementError(f"{where}: {name}: expected the name of a file such as '{name}.csv' or '*{name}*'")
    return found


def _split(value: Any, where: str) -> Split | None:
    if value is None:
        return None
    if value == "restarts":
        return Split(restarts=True)
    if isinstance(value, Dictionary) and set(value) == {"column"}:
        return Split(str(value["column"]))
    raise MeasurementError(f"{where}: expected {{column: NAME}} or 'restarts' (of the time), not {shown(value)}")


def _reading(data: Dictionary[str, Any], where: str) -> Options:
    header, decimal, separator = data.get("header"), data.get("decimal"), data.get("separator")
    if header is not None and not isinstance(header, bool):
        raise MeasurementError(f"{where}: header: expected true or false, not {shown(header)}")
    if decimal not in (None, ",", "."):
        raise MeasurementError(f"{where}: decimal: expected ',' or '.', not {shown(decimal)}")
    if separator is not None and (not isinstance(separator, str) or len(separator) != 1):
        raise MeasurementError(f"{where}: separator: expected one sign such as ';', not {shown(separator)}")
    return Options(data.get("format"), str(data.get("records", "entries")), separator, header, decimal)


def _settings(value: Any, where: str) -> tuple[Setting, ...]:
    if value is None:
        return ()
    if not isinstance(value, list):
        raise MeasurementError(f"{where}: settings: expected a list of effects, not {shown(value)}")
    return tuple(_setting(s, f"{where}: settings[{i}]") for i, s in enumerate(value))


def _gains(value: Any, where: str) -> dict[str, dict[str, float]]:
    found: dict[str, dict[str, float]] = {}
    for joint, entry in _table(value, where, "{kp: number, kd: number}").items():
        for key, number in _table(entry, f"{where}: {joint}", "number").items():
            if key not in GAINS:
                raise MeasurementError(f"{where}: {joint}: unknown key {quoted(key)}; {nearest(key, GAINS)}")
            if (size := _number(number, f"{where}: {joint}: {key}")) < 0:
                raise MeasurementError(f"{where}: {joint}: {key}: expected 0 or more, not {size:g}")
            found.setdefault(joint, {})[key] = size
    return found


def _table(value: Any, where: str, entry: str = "{column: ..., unit: ...}") -> Dictionary[str, Any]:
    if not isinstance(value, Dictionary):
        raise MeasurementError(f"{where}: expected 'name: {entry}', not {shown(value)}")
    return {str(k): v for k, v in value.items()}


def _column(value: Any, where: str, unit: str = "1") -> Column:
    if isinstance(value, (str, int)) and not isinstance(value, bool):
        value = {"column": value, "unit": unit}
    column: Column = _made(Column, value, where)
    if UNKNOWN in (column.column, column.unit):
        more = "; where none were recorded, take 'commands' out" if ": commands" in where else ""
        raise MeasurementError(f"{where}: still {quoted(UNKNOWN)}: fill in what only you can know{more}")
    if column.unit not in UNITS:
        raise MeasurementError(f"{where}: no unit {quoted(column.unit)}; {nearest(column.unit, UNITS)}")
    if column.sign not in (1.0, -1.0):
        raise MeasurementError(f"{where}: sign: expected 1 or -1, not {column.sign:g}")
    if column.gaps not in ("error", "interpolate"):
        raise MeasurementError(f"{where}: gaps: expected 'error' or 'interpolate', not {quoted(column.gaps)}")
    if column.scale == 0:
        raise MeasurementError(f"{where}: scale: 0 makes every value the same; expected another number")
    if not 0 <= column.signed_bits <= 64:
        raise MeasurementError(
            f"{where}: signed_bits: expected the width of a counter, 1 to 64, not {column.signed_bits}"
        )
    for key in ("lead_s", "smooth_s"):
        if abs(getattr(column, key)) > LONGEST_S:
            raise MeasurementError(
                f"{where}: {key}: {getattr(column, key):g} s; expected seconds, at most {LONGEST_S:g}"
            )
    if column.rolls_over < 0:
        raise MeasurementError(f"{where}: rolls_over: expected the numbers of one round, not {column.rolls_over:g}")
    if column.smooth_s < 0:
        raise MeasurementError(f"{where}: smooth_s: expected 0 or more, not {column.smooth_s:g}")
    return column


def _estimated(value: Any, where: str) -> Estimated:
    made: Estimated = _made(Estimated, value, where)
    if made.cutoff_hz <= 0:
        raise MeasurementError(f"{where}: cutoff_hz: expected a positive number, not {made.cutoff_hz:g}")
    if not 1 <= made.order <= 12:
        raise MeasurementError(f"{where}: order: expected 1 to 12, not {made.order}")
    return made


def _made(kind: Any, value: Any, where: str) -> Any:
    """A dataclass of texts, finite numbers and switches from a mapping."""
    if not isinstance(value, Dictionary):
        raise MeasurementError(f"{where}: expected {{{fields(kind)[0].name}: ...}}, not {shown(value)}")
    known = {f.name: f for f in fields(kind)}
    made: dict[str, Any] = {}
    for key, entry in value.items():
        if key not in known:
            raise MeasurementError(f"{where}: unknown key {quoted(key)}; {nearest(str(key), known)}")
        default = known[key].default
        if isinstance(default, bool):
            if not isinstance(entry, bool):
                raise MeasurementError(f"{where}: {key}: cannot be {shown(entry)}; expected true or false")
            made[str(key)] = entry
        elif isinstance(default, (int, float)) or default is None:
            number = _number(entry, f"{where}: {key}")
            if isinstance(default, int) and number != int(number):
                raise MeasurementError(f"{where}: {key}: cannot be {shown(entry)}; expected a whole number")
            made[str(key)] = int(number) if isinstance(default, int) else number
        elif isinstance(entry, (str, int)) and not isinstance(entry, bool):
            made[str(key)] = str(entry)
        else:
            raise MeasurementError(f"{where}: {key}: cannot be {shown(entry)}")
    first = fields(kind)[0].name
    if first not in made:
        raise MeasurementError(f"{where}: missing key {quoted(first)}")
    return kind(**made)


def _number(value: Any, where: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise MeasurementError(f"{where}: cannot be {shown(value)}; expected a number")
    if not abs(value) <= MOST:
        raise MeasurementError(f"{where}: {shown(value)}; expected a finite number of at most {MOST:g}")
    return float(value)


def _setting(value: Any, where: str) -> Setting:
    if not isinstance(value, Dictionary) or "effect" not in value:
        raise MeasurementError(f"{where}: expected {{effect: ..., target: ..., <parameter>: ...}}, not {shown(value)}")
    values: dict[str, float | Given] = {}
    for key, entry in value.items():
        if key in ("effect", "target", "trials"):
            continue
        place = next((p for p in ("header", "column") if isinstance(entry, Dictionary) and p in entry), "")
        if place and set(entry) <= {place, "scale"}:
            scale = _number(entry.get("scale", 1.0), f"{where}: {key}: scale")
            if scale == 0:
                raise MeasurementError(f"{where}: {key}: scale: 0 makes every value the same; expected another number")
            values[str(key)] = Given(place, str(entry[place]), scale)
        elif isinstance(entry, (int, float)) and not isinstance(entry, bool):
            values[str(key)] = _number(entry, f"{where}: {key}")
        else:
            raise MeasurementError(
                f"{where}: {key}: expected a number, {{header: key, scale: number}} or {{column: name, scale: number}}, "
                f"not {shown(entry)}"
            )
    trials = value.get("trials", [])
    trials = [trials] if isinstance(trials, str) else trials
    if not isinstance(trials, list) or not all(isinstance(t, str) and t for t in trials):
        raise MeasurementError(f"{where}: trials: expected names such as [heavy_1, 'heavy_*'], not {shown(trials)}")
    return Setting(str(value["effect"]), str(value.get("target", "")), values, tuple(trials))
