"""Records to protobuf messages and back, bit for bit.

An optional array cannot be told from an empty one by its rows, so the trial message lists those that are there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import EVERY, Hypothesis, Term
from ee_dist.engines.drivers import Commands, Network
from ee_dist.recording import schemas
from ee_dist.recording.errors import RecordingError
from ee_dist.recording.records import GenerationRecord, HypothesisRecord, TrialRecord
from ee_dist.trials.log import Array, SensorLog

_ALWAYS = ("sensors", "commands")
_TABLES = ("base_pose", "joints", "torques", "external")
_SERIES = "supply_v"
_FILLED = "filled"


# -- to messages -----------------------------------------------------------------------------------------------------


def trial_message(number: int, record: TrialRecord, units: Mapping[str, str]) -> Any:
    """The ``Trial`` ahead of the rows; ``units`` are those of commands, by drive. Raises RecordingError for the driver."""
    log = record.log
    return schemas.Trial(
        id=number,
        index=record.index,
        name=record.name,
        source=record.source,
        driver=_driver_message(record),
        believed=_term_messages(record.believed),
        rows=len(log),
        sensor_names=log.sensor_names,
        sensor_units=log.sensor_units,
        motor_names=log.motor_names,
        motor_units=[units.get(name, "") for name in log.motor_names],
        recorded=[name for name in (*_TABLES, _SERIES) if getattr(log, name) is not None],
        travel_m=log.travel_m,
        not_recorded=record.not_recorded,
    )


def row_messages(number: int, log: SensorLog) -> Iterator[bytes]:
    """The ``Row`` messages of a log, serialised."""
    tables = {n: _rows(getattr(log, n)) for n in (*_ALWAYS, *_TABLES) if getattr(log, n) is not None}
    columns: dict[str, list[Any]] = {"time_s": _rows(log.times_s), **tables}
    if log.supply_v is not None:
        columns[_SERIES] = _rows(log.supply_v)
    if log.filled is not None:
        columns[_FILLED] = log.filled.tolist()
    names = tuple(columns)
    for values in zip(*columns.values(), strict=True):
        yield schemas.Row(trial_id=number, **dict(zip(names, values, strict=True))).SerializeToString(
            deterministic=True
        )


def _rows(values: Array) -> list[Any]:
    return np.asarray(values, dtype=np.float64).tolist()


def hypothesis_message(record: HypothesisRecord) -> Any:
    terms = _term_messages(record.terms)
    return schemas.Hypothesis(
        pass_index=record.pass_index,
        generation=record.generation,
        rank=record.rank,
        error=record.error,
        final=bool(record.final),
        stage=record.stage,
        terms=terms,
        text="; ".join(_text(t) for t in terms),
    )


def generation_message(record: GenerationRecord) -> Any:
    return schemas.Generation(**{name: getattr(record, name) for name in GenerationRecord.__dataclass_fields__})


def _driver_message(record: TrialRecord) -> Any:
    driver = record.driver
    if isinstance(driver, Network):
        return schemas.Driver(kind="network", values=driver.weights)
    if isinstance(driver, Commands):
        values = np.asarray(driver.values, dtype=np.float64)
        if values.ndim == 2:
            rows, columns = values.shape
            return schemas.Driver(kind="commands", values=values.ravel().tolist(), rows=rows, columns=columns)
    raise RecordingError(
        f"trial {record.name!r}: a driver {type(driver).__name__} cannot be recorded; "
        "expected a Network, or Commands (T, M) such as those of the log"
    )


def _term_messages(terms: Hypothesis) -> list[Any]:
    return [
        schemas.Term(
            effect=t.effect,
            target=t.target,
            values=[schemas.Value(name=k, value=v, unit=_unit(t.effect, k)) for k, v in t.values],
        )
        for t in terms
    ]


def _unit(effect: str, parameter: str) -> str:
    entry = EVERY.get(effect)
    return next((p.unit for p in entry.parameters if p.name == parameter), "") if entry else ""


def _text(term: Any) -> str:
    text: str = term.effect + (f" at {term.target}" if term.target else "")
    values = ", ".join(
        f"{v.name} {v.value:.4g}" + (f" {v.unit}" if v.unit not in ("", "1") else "") for v in term.values
    )
    return text + (f" ({values})" if values else "")


# -- from messages ---------------------------------------------------------------------------------------------------


class TrialBuilder:
    """Gathers the rows of one trial message."""

    def __init__(self, message: Any) -> None:
        self._message = message
        self._names = (*_ALWAYS, *(n for n in _TABLES if n in message.recorded))
        self._times: list[float] = []
        self._supply: list[float] = []
        self._filled: list[bool] = []
        self._flat: dict[str, list[float]] = {n: [] for n in self._names}

    def add(self, row: Any) -> None:
        self._times.append(row.time_s)
        self._supply.append(row.supply_v)
        self._filled.append(row.filled)
        for name in self._names:
            self._flat[name].extend(getattr(row, name))

    @property
    def whole(self) -> bool:
        """Whether every row has come."""
        return len(self._times) == int(self._message.rows)

    def record(self) -> TrialRecord:
        """Raises ValueError if the rows do not fit their trial."""
        m, rows = self._message, len(self._times)
        widths = {"sensors": len(m.sensor_names), "base_pose": 7}
        tables = {n: _table(v, rows, widths.get(n, len(m.motor_names))) for n, v in self._flat.items()}
        log = SensorLog(
            times_s=np.array(self._times, dtype=np.float64),
            sensor_names=tuple(m.sensor_names),
            sensor_units=tuple(m.sensor_units),
            motor_names=tuple(m.motor_names),
            supply_v=np.array(self._supply, dtype=np.float64) if _SERIES in m.recorded else None,
            filled=np.array(self._filled, dtype=bool) if any(self._filled) else None,
            travel_m=m.travel_m,
            **tables,
        )
        believed = _terms(m.believed)
        return TrialRecord(m.index, m.name, m.source, _driver(m.driver), log, believed, tuple(m.not_recorded))


def hypothesis_record(message: Any) -> HypothesisRecord:
    m = message
    return HypothesisRecord(m.pass_index, m.generation, m.rank, _terms(m.terms), m.error, m.final, m.stage)


def generation_record(message: Any) -> GenerationRecord:
    return GenerationRecord(**{name: getattr(message, name) for name in GenerationRecord.__dataclass_fields__})


def _driver(message: Any) -> Network | Commands:
    if message.kind == "network":
        return Network(tuple(message.values))
    if message.kind == "commands":
        return Commands(_table(message.values, message.rows, message.columns))
    raise ValueError(f"no driver of kind {message.kind!r}")


def _terms(messages: Sequence[Any]) -> Hypothesis:
    return tuple(Term(m.effect, m.target, tuple((v.name, v.value) for v in m.values)) for m in messages)


def _table(flat: Sequence[float], rows: int, columns: int) -> Array:
    return np.array(flat, dtype=np.float64).reshape(rows, columns)
