"""The mapping: which column is which channel, in which unit. One YAML file for all files of one kind.

See docs/bring_your_robot.md for the form, and docs/examples for those of two public data sets.
"""

from __future__ import annotations

from collections.abc import Mapping as Dictionary
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any

from ee_dist.measurements.errors import MeasurementError, nearest
from ee_dist.measurements.units import UNITS
from ee_dist.robots.untrusted import UntrustedError, yaml_of


@dataclass(frozen=True)
class Column:
    """A column as a channel: value = sign * scale * number + offset, which is in ``unit``.

    ``signed_bits``: an unsigned counter of that width that holds a signed number. ``unwrap``: an angle that jumps by
    whole turns. ``gaps: interpolate`` fills empty cells from their neighbours. ``lead_s``: how long before its time stamp
    a command took effect. ``smooth_s``: centred mean over that time.
    """

    column: str
    unit: str = "1"
    sign: float = 1.0
    scale: float = 1.0
    offset: float = 0.0
    signed_bits: int = 0
    unwrap: bool = False
    gaps: str = "error"
    lead_s: float = 0.0
    smooth_s: float = 0.0


@dataclass(frozen=True)
class Estimated:
    """A speed that nobody measured: central differences of a position channel behind a low-pass."""

    speed_of: str
    cutoff_hz: float = 50.0
    order: int = 4


@dataclass(frozen=True)
class Setting:
    """What is known to be special about a trial, as an effect: a value is a number, or taken from the file's header."""

    effect: str
    target: str
    values: Dictionary[str, float | tuple[str, float]]
    """Parameter to a number, or to (header key, scale)."""


@dataclass(frozen=True)
class Mapping:
    """A checked mapping. ``robot`` is a name, a path or a description; ``folder`` is where its paths begin."""

    source: Path
    robot: Any
    time: Column
    sensors: Dictionary[str, Column | Estimated]
    commands: Dictionary[str, Column]
    torques: Dictionary[str, Column] = field(default_factory=dict)
    supply: Column | None = None
    enabled: Column | None = None
    settings: tuple[Setting, ...] = ()
    kind: str | None = None
    records: str = "entries"
    separator: str = ","
    rate_hz: float | None = None
    trial: str | None = None
    """Name of a trial, with {key} for entries of the file's header."""

    @property
    def folder(self) -> Path:
        return self.source.parent


_KEYS = (
    "robot", "format", "records", "separator", "time", "rate_hz", "sensors", "commands", "torques", "supply", "enabled",
    "settings", "trial",
)  # fmt: skip


def read_mapping(path: str | Path) -> Mapping:
    """The mapping in a YAML file. Raises MeasurementError with the key that is wrong and what would be right."""
    file = Path(path)
    try:
        data = yaml_of(file)
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
            raise MeasurementError(f"{where}: unknown key {key!r}; {nearest(str(key), _KEYS)}")
    for key in ("time", "sensors", "commands"):
        if key not in data:
            raise MeasurementError(f"{where}: missing key {key!r}")
    rate = data.get("rate_hz")
    if rate is not None and (isinstance(rate, bool) or not isinstance(rate, (int, float)) or rate <= 0):
        raise MeasurementError(f"{where}: rate_hz: expected a positive number, not {rate!r}")
    sensors: dict[str, Column | Estimated] = {}
    for name, entry in _table(data["sensors"], f"{where}: sensors").items():
        here = f"{where}: sensors: {name}"
        estimated = isinstance(entry, Dictionary) and "speed_of" in entry
        sensors[name] = _made(Estimated, entry, here) if estimated else _column(entry, here)
    single = {k: _column(data[k], f"{where}: {k}") for k in ("supply", "enabled") if data.get(k) is not None}
    return Mapping(
        source=file,
        robot=data.get("robot"),
        time=_column(data["time"], f"{where}: time", "s"),
        sensors=sensors,
        commands={
            k: _column(v, f"{where}: commands: {k}") for k, v in _table(data["commands"], f"{where}: commands").items()
        },
        torques={
            k: _column(v, f"{where}: torques: {k}")
            for k, v in _table(data.get("torques") or {}, f"{where}: torques").items()
        },
        supply=single.get("supply"),
        enabled=single.get("enabled"),
        settings=tuple(_setting(s, f"{where}: settings[{i}]") for i, s in enumerate(data.get("settings") or [])),
        kind=data.get("format"),
        records=str(data.get("records", "entries")),
        separator=str(data.get("separator", ",")),
        rate_hz=None if rate is None else float(rate),
        trial=data.get("trial"),
    )


def _table(value: Any, where: str) -> Dictionary[str, Any]:
    if not isinstance(value, Dictionary):
        raise MeasurementError(f"{where}: expected 'name: {{column: ..., unit: ...}}', not {value!r}")
    return {str(k): v for k, v in value.items()}


def _column(value: Any, where: str, unit: str = "1") -> Column:
    if isinstance(value, str):
        value = {"column": value, "unit": unit}
    column: Column = _made(Column, value, where)
    if column.unit not in UNITS:
        raise MeasurementError(f"{where}: no unit {column.unit!r}; {nearest(column.unit, UNITS)}")
    if column.sign not in (1.0, -1.0):
        raise MeasurementError(f"{where}: sign: expected 1 or -1, not {column.sign:g}")
    if column.gaps not in ("error", "interpolate"):
        raise MeasurementError(f"{where}: gaps: expected 'error' or 'interpolate', not {column.gaps!r}")
    return column


def _made(kind: Any, value: Any, where: str) -> Any:
    """A dataclass of texts, numbers and switches from a mapping."""
    if not isinstance(value, Dictionary):
        raise MeasurementError(f"{where}: expected {{{fields(kind)[0].name}: ...}}, not {value!r}")
    known = {f.name: f for f in fields(kind)}
    made: dict[str, Any] = {}
    for key, entry in value.items():
        if key not in known:
            raise MeasurementError(f"{where}: unknown key {key!r}; {nearest(str(key), known)}")
        default = known[key].default
        if isinstance(default, bool):
            right = isinstance(entry, bool)
        elif isinstance(default, (int, float)):
            right = isinstance(entry, (int, float)) and not isinstance(entry, bool)
        else:
            right = isinstance(entry, (str, int))
            entry = str(entry)
        if not right:
            raise MeasurementError(f"{where}: {key}: cannot be {entry!r}")
        made[str(key)] = float(entry) if isinstance(default, float) else entry
    first = fields(kind)[0].name
    if first not in made:
        raise MeasurementError(f"{where}: missing key {first!r}")
    return kind(**made)


def _setting(value: Any, where: str) -> Setting:
    if not isinstance(value, Dictionary) or "effect" not in value:
        raise MeasurementError(f"{where}: expected {{effect: ..., target: ..., <parameter>: ...}}, not {value!r}")
    values: dict[str, float | tuple[str, float]] = {}
    for key, entry in value.items():
        if key in ("effect", "target"):
            continue
        if isinstance(entry, Dictionary) and set(entry) <= {"header", "scale"} and "header" in entry:
            values[str(key)] = (str(entry["header"]), float(entry.get("scale", 1.0)))
        elif isinstance(entry, (int, float)) and not isinstance(entry, bool):
            values[str(key)] = float(entry)
        else:
            raise MeasurementError(
                f"{where}: {key}: expected a number or {{header: key, scale: number}}, not {entry!r}"
            )
    return Setting(str(value["effect"]), str(value.get("target", "")), values)
