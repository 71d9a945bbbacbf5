"""Messages of a bag as tables: one a topic, a row a message, fields as columns, joints by their names.

Whatever names its joints (``name`` or ``joint_names`` beside lists of that length) gets columns such as
``position[elbow]``; a trajectory gets a row for each of its points.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers.options import bounded
from ee_dist.measurements.readers.plans import carried_out
from ee_dist.measurements.table import WIDEST, Recorded, Table

TIME = "time"
_NO_SERIES = re.compile(
    r"Image|PointCloud|Log$|TFMessage|CameraInfo|String$|Diagnostic|MarkerArray|OccupancyGrid|PlotJuggler"
)
_LEFT_OUT = re.compile(r"covariance|(^|\.)(layout|header\.seq)")
STAMP_APART_S = 10.0
"""A stamp this far from when the message was logged counts from something else (since boot, say): the log time is taken."""
CLOCKS_APART_S = 0.02
"""Topics whose times are this much further apart than their logging were stamped by clocks that differ."""


LATEST_NS = 2**62
"""The year 2116: beyond it a time is no time, and sums of two do not fit into 64 bits."""


def is_series(kind: str) -> bool:
    """Whether messages of a type can hold a robot's channels."""
    return not _NO_SERIES.search(kind)


@dataclass
class _Rows:
    """One topic while it is read: (stamp or None, log time, how long after that) in ns, and the fields, of messages with the same
    fields; ``plan``: they are points of trajectories."""

    at_ns: list[tuple[int | None, int, int]] = field(default_factory=list)
    fields: dict[str, list[Any]] = field(default_factory=dict)
    parts: dict[str, tuple[str, ...]] = field(default_factory=dict)
    plan: bool = False


class Gatherer:
    """Takes messages one by one and gives a trial."""

    def __init__(self, file: Path) -> None:
        self.file, self.numbers = file, 0
        self.topics: dict[str, dict[tuple[Any, ...], _Rows]] = {}
        self.notes: list[str] = []

    def add(self, topic: str, log_ns: int, message: Any) -> None:
        """A message: a mapping, or an object with annotated fields. Raises MeasurementError where memory would not do, and for
        a time that no clock has."""
        if not 0 <= log_ns < LATEST_NS:
            raise MeasurementError(f"{self.file}: {topic}: a message logged at {log_ns} ns; the file is damaged")
        for stamp_ns, after_ns, flat, parts in _rows(message):
            if not flat:
                continue
            key = tuple((k, len(v) if isinstance(v, np.ndarray) else 0, parts.get(k)) for k, v in flat.items())
            kinds = self.topics.setdefault(topic, {})
            rows = kinds.setdefault(key, _Rows(parts=parts))
            if len(kinds) > 64:
                raise MeasurementError(
                    f"{self.file}: {topic}: its messages differ in their fields; nothing to compare in it"
                )
            rows.at_ns.append((stamp_ns, log_ns, after_ns or 0))
            rows.plan = after_ns is not None
            for name, v in flat.items():
                rows.fields.setdefault(name, []).append(v)
                self.numbers += len(v) if isinstance(v, np.ndarray) else 1
        bounded(self.file, 40.0 * self.numbers)

    def trial(self) -> Recorded:
        """All topics as tables on one clock, which starts at 0. Raises MeasurementError where there are none."""
        stamped = self._by_stamps()
        made: list[tuple[str, _Rows, Any, dict[str, Any]]] = []
        for topic, kinds in self.topics.items():
            for k, rows in enumerate(sorted(kinds.values(), key=lambda r: -len(r.at_ns))):
                name = topic if not k else f"{topic} #{k + 1}"
                made.append((name, rows, *self._series(name, rows, stamped.get(topic, False))))
        if not made:
            raise MeasurementError(
                f"{self.file}: no messages with numbers in it (JointState, Imu, Wrench, trajectories, ...)"
            )
        start = min(int(at.min()) for _, _, at, _ in made)
        tables = []
        for name, rows, at, fields in made:
            columns: dict[str, Any] = {TIME: (at - start) / 1e9} | fields
            tables.append(Table(self.file, columns, name=name, clock=TIME, parts=rows.parts, planned=rows.plan))
        # The topic that tells most about joints first.
        tables.sort(key=lambda t: (not any("position" in c and p for c, p in t.parts.items()), -len(t)))
        if self.notes:
            tables[0].notes = tuple(self.notes)
        return Recorded("", tuple(tables))

    def _series(self, name: str, rows: _Rows, stamped: bool) -> tuple[Any, dict[str, Any]]:
        """The times (T,) of rows in ns, rising, and their fields."""
        begin, after = _clock(rows, stamped), np.array([after for *_, after in rows.at_ns], dtype=np.int64)
        fields = {n: np.array(values) for n, values in rows.fields.items()}
        if rows.plan:
            at, fields, replaced = carried_out(begin, begin + after, fields)
            if replaced:
                self.notes.append(f"{name}: {replaced} points left out that a later trajectory replaced")
            return at, fields
        order = np.argsort(begin, kind="stable")
        return begin[order], {n: v[order] for n, v in fields.items()}

    def _by_stamps(self) -> dict[str, bool]:
        """Whether the stamps of each topic are its times, else the times of logging. All topics are on one clock: where stamps
        of some are off those of others, or off the logging of topics without any, none are taken."""
        apart = {topic: _stamps_apart_s(list(kinds.values())) for topic, kinds in self.topics.items()}
        for topic, off in apart.items():
            if off is not None and abs(off) > STAMP_APART_S:
                self.notes.append(
                    f"{topic}: its stamps are {off:.4g} s off the time of logging, which is taken instead"
                )
                apart[topic] = None
        stamped = {topic: off is not None for topic, off in apart.items()}
        seen = {topic: off or 0.0 for topic, off in apart.items() if not self._is_plan(topic)}
        if not any(stamped.values()) or not seen or max(seen.values()) - min(seen.values()) <= CLOCKS_APART_S:
            return stamped
        first, last = min(seen, key=lambda t: seen[t]), max(seen, key=lambda t: seen[t])
        self.notes.append(
            f"stamps of {last} and {first} are {seen[last] - seen[first]:.4g} s further apart than their logging, so that their "
            "clocks differ: the times of logging are taken for all topics"
        )
        return dict.fromkeys(stamped, False)

    def _is_plan(self, topic: str) -> bool:
        """Whether a topic is stamped with when something is to begin, which tells nothing about a clock."""
        return any(r.plan and any(stamp is not None for stamp, *_ in r.at_ns) for r in self.topics[topic].values())


def _stamps_apart_s(kinds: Sequence[_Rows]) -> float | None:
    """By how much the stamps of a topic are ahead of its logging; None where a message has none."""
    at = [(stamp, log) for rows in kinds for stamp, log, _ in rows.at_ns]
    if any(stamp is None for stamp, _ in at):
        return None
    return float(np.median([((stamp or 0) - log) / 1e9 for stamp, log in at]))


def _clock(rows: _Rows, stamped: bool) -> Any:
    """The times (T,) of messages in ns, row by row."""
    return np.array([stamp if stamped and stamp else log for stamp, log, _ in rows.at_ns], dtype=np.int64)


def _rows(message: Any) -> Iterator[tuple[int | None, int | None, dict[str, Any], dict[str, tuple[str, ...]]]]:
    """(stamp, how long after it, fields, names of list fields) of a message; a trajectory gives one for each point, of others
    nothing is after the stamp."""
    stamp = _stamp(message)
    flat: dict[str, Any] = {}
    parts: dict[str, tuple[str, ...]] = {}
    points = _get(message, "points")
    if _joints(message) and isinstance(points, Sequence) and points and _get(points[0], "time_from_start") is not None:
        for point in points:
            flat, parts = {}, {}
            _flatten(point, "", _joints(message), flat, parts, 0)
            after = _nanoseconds(_get(point, "time_from_start")) or 0
            flat = {k: v for k, v in flat.items() if not k.startswith("time_from_start")}
            yield stamp, after, flat, parts
        return
    _flatten(message, "", (), flat, parts, 0)
    yield stamp, None, flat, parts


def _fields(value: Any) -> Mapping[str, Any] | None:
    if isinstance(value, Mapping):
        return {str(k): v for k, v in value.items()}
    named = getattr(value, "__dataclass_fields__", None)
    return None if named is None else {n: getattr(value, n) for n in named if not n.startswith("_")}


def _get(value: Any, name: str) -> Any:
    inner = _fields(value)
    return None if inner is None else inner.get(name)


def _joints(message: Any) -> tuple[str, ...]:
    for key in ("joint_names", "name", "names"):
        found = _get(message, key)
        if isinstance(found, (list, tuple)) and found and all(isinstance(n, str) for n in found):
            return tuple(found)
    return ()


def _stamp(message: Any) -> int | None:
    """The stamp of a message in ns, where it has one that was set."""
    for holder in (_get(message, "header"), message):
        for key in ("stamp", "timestamp", "time"):
            found = _nanoseconds(_get(holder, key))
            if found:
                return found
    return None


def _nanoseconds(value: Any) -> int | None:
    """ns of a time or a duration: seconds and nanoseconds by any of their names."""
    inner = _fields(value)
    if inner is None:
        return None
    whole = next((inner[k] for k in ("sec", "secs", "seconds") if k in inner), None)
    part = next((inner[k] for k in ("nanosec", "nsecs", "nsec", "nanos") if k in inner), None)
    if not isinstance(whole, (int, float)) or not isinstance(part, (int, float)):
        return None
    if not (abs(whole) < LATEST_NS / 1e9 and abs(part) < LATEST_NS):
        return None
    return int(whole) * 10**9 + int(part)


def _flatten(
    value: Any,
    before: str,
    joints: tuple[str, ...],
    into: dict[str, Any],
    parts: dict[str, tuple[str, ...]],
    depth: int,
) -> None:
    inner = _fields(value) or {}
    joints = _joints(value) or joints
    for key, entry in inner.items():
        name = f"{before}{key}"
        if _LEFT_OUT.search(name) or (key in ("stamp", "timestamp") and _nanoseconds(entry) is not None):
            continue
        if isinstance(entry, (bool, int, float, np.integer, np.floating, np.bool_)):
            into[name] = float(entry)
        elif _fields(entry) is not None:
            if depth < 6 and key != "header":
                _flatten(entry, f"{name}.", joints, into, parts, depth + 1)
        elif isinstance(entry, (list, tuple, np.ndarray)) and 0 < len(entry) <= WIDEST:
            _list(entry, name, joints, into, parts, depth)


def _list(
    entry: Any, name: str, joints: tuple[str, ...], into: dict[str, Any], parts: dict[str, tuple[str, ...]], depth: int
) -> None:
    first = entry[0]
    if _fields(first) is not None:
        # A list of things with a name each: joints {name, position, ...}.
        label = _get(first, "name") or _get(first, "joint") or _get(first, "id")
        if depth >= 6 or label is None:
            return
        labels = tuple(str(_get(e, "name") or _get(e, "joint") or _get(e, "id")) for e in entry)
        for key, sample in (_fields(first) or {}).items():
            if isinstance(sample, (int, float)) and not isinstance(sample, bool):
                into[f"{name}.{key}"] = np.array([float(_get(e, key) or 0.0) for e in entry])
                parts[f"{name}.{key}"] = labels
        return
    if isinstance(first, (str, bytes)):
        return
    into[name] = np.asarray(entry, dtype=np.float64)
    if len(entry) == len(joints):
        parts[name] = joints
