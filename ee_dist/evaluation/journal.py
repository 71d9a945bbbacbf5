"""What was simulated, on the disk as soon as it is known: a run that was killed asks for it again and simulates nothing twice.

A file of entries, each a key, a value and a checksum; whatever a kill left half-written at its end is cut off. Values
are numbers, small arrays of numbers, and records of these (a dataclass that a reduction says it returns): what a search needs
of a rollout. Others are simulated again.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import lru_cache
from itertools import chain
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO, get_type_hints
from zlib import crc32

import numpy as np

from ee_dist.evaluation.jobs import Evaluator, Job

MAGIC = b"ee_dist journal 2\n"
LARGEST = 2**16
"""Numbers in one value; larger ones are quicker to simulate again than to keep by the thousand."""
MOST = 2**30
"""Bytes of a journal; beyond, nothing more is noted."""
SMALL = 2**12
"""Bytes of an entry up to which its value is kept in memory too."""
_HEAD = struct.Struct("<32sB")
"""Key, and how many parts a record has; 0 for a value that is none."""
_PART = struct.Struct("<BBII")
"""Kind of number, dimensions (0: a number alone), rows, columns."""
_CRC = struct.Struct("<I")
_KINDS = (np.dtype("<f8"), np.dtype("<f4"), np.dtype("?"))
MOST_PARTS = 16


class Journal(Mapping[str, Any]):
    """Values by key in the file at ``path``; small ones are in memory too, larger ones are read again each time. Raises OSError
    where the file cannot be written."""

    def __init__(self, path: Path) -> None:
        self._small: dict[str, Any] = {}
        self._at: dict[str, int] = {}
        """Where in the file the entries of the others begin."""
        self._file: BinaryIO = path.open("a+b")
        self._size = self._load()

    def __getitem__(self, key: str) -> Any:
        if key in self._small:
            return self._small[key]
        self._file.seek(self._at[key])
        entry = self._entry()
        if entry is None or entry[0] != key:
            raise KeyError(key)
        return entry[1]

    def __contains__(self, key: object) -> bool:
        return key in self._small or key in self._at

    def __iter__(self) -> Iterator[str]:
        return chain(self._small, self._at)

    def __len__(self) -> int:
        return len(self._small) + len(self._at)

    def _remember(self, key: str, value: Any, begins: int, ends: int) -> None:
        if ends - begins <= SMALL:
            self._small[key] = value
        else:
            self._at[key] = begins

    def _load(self) -> int:
        """Read what is whole, cut off the rest; bytes that are left."""
        self._file.seek(0)
        if self._file.read(len(MAGIC)) != MAGIC:
            self._file.truncate(0)
            self._file.write(MAGIC)
            self._save()
            return len(MAGIC)
        good = len(MAGIC)
        while (entry := self._entry()) is not None:
            begins, good = good, self._file.tell()
            if entry[0] not in self:
                self._remember(*entry, begins, good)
        self._file.truncate(good)
        self._file.seek(good)
        return good

    def _entry(self) -> tuple[str, Any] | None:
        head = self._file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            return None
        key, count = _HEAD.unpack(head)
        read, values = [head], []
        for _ in range(max(count, 1)) if count <= MOST_PARTS else ():
            part = self._part(bool(count))
            if part is None:
                return None
            read.append(part[0])
            values.append(part[1])
        told = self._file.read(_CRC.size)
        if not values or len(told) < _CRC.size or _CRC.unpack(told)[0] != crc32(b"".join(read)):
            return None
        return key.hex(), tuple(values) if count else values[0]

    def _part(self, of_record: bool) -> tuple[bytes, Any] | None:
        """Its bytes and its value. Only a part of a record may be empty."""
        head = self._file.read(_PART.size)
        if len(head) < _PART.size:
            return None
        kind, dimensions, rows, columns = _PART.unpack(head)
        if (
            kind >= len(_KINDS)
            or dimensions > 2
            or not (0 if of_record and dimensions else 1) <= rows * columns <= LARGEST
            or (dimensions < 2 and columns != 1)
            or (not dimensions and rows != 1)
        ):
            return None
        content = self._file.read(_KINDS[kind].itemsize * rows * columns)
        if len(content) < _KINDS[kind].itemsize * rows * columns:
            return None
        numbers = np.frombuffer(content, dtype=_KINDS[kind])
        return head + content, numbers.reshape((rows, columns)[:dimensions]).copy() if dimensions else numbers[0].item()

    def note(self, found: Sequence[tuple[str, Any]]) -> None:
        """Keep these; when this returns they survive a kill and a loss of power."""
        wrote = False
        for key, value in found:
            packed = _packed(key, value)
            if packed is not None and key not in self and self._size + len(packed) <= MOST:
                self._file.write(packed)
                self._remember(key, value, self._size, self._size + len(packed))
                self._size, wrote = self._size + len(packed), True
        if wrote:
            self._save()

    def _save(self) -> None:
        self._file.flush()
        os.fsync(self._file.fileno())

    def close(self) -> None:
        self._file.close()

    def __enter__(self) -> Journal:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()


def _packed(key: str, value: Any) -> bytes | None:
    """An entry as bytes; None for a value that is not kept."""
    record = is_dataclass(value) and not isinstance(value, type)
    values = [getattr(value, f.name) for f in fields(value)] if record else [value]
    parts = [_packed_part(v) for v in values]
    whole = [p for p in parts if p is not None]
    if len(whole) < len(parts) or not 0 < len(parts) <= MOST_PARTS or (not record and np.size(value) == 0):
        return None
    body = _HEAD.pack(bytes.fromhex(key), len(parts) if record else 0) + b"".join(whole)
    return body + _CRC.pack(crc32(body))


def _packed_part(value: Any) -> bytes | None:
    array = np.asarray(value) if isinstance(value, (float, bool, np.ndarray)) else None
    if array is None or array.dtype not in _KINDS or array.ndim > 2 or array.size > LARGEST:
        return None
    rows, columns = (*array.shape, 1, 1)[:2] if array.ndim else (1, 1)
    return _PART.pack(_KINDS.index(array.dtype), array.ndim, rows, columns) + np.ascontiguousarray(array).tobytes()


@lru_cache(64)
def _record(kind: type) -> Callable[..., Any] | None:
    """What reductions of this kind say that they return, where it is a record."""
    try:
        made = get_type_hints(kind.__call__).get("return")
    except (NameError, TypeError, AttributeError):
        return None
    return made if isinstance(made, type) and is_dataclass(made) else None


def _restored(job: Job, value: Any) -> Any:
    """The value as the job's reduction gives it; None where what the journal has is of another shape."""
    if not isinstance(value, tuple):
        return value
    made = _record(type(job.reduction))
    return made(*value) if made is not None and len(fields(made)) == len(value) else None  # type: ignore[arg-type]


class JournaledEvaluator:
    """Asks ``inner`` for what the journal does not know, and counts all as simulated, as an undisturbed run does."""

    def __init__(self, inner: Evaluator, journal: Journal | None = None) -> None:
        self.inner, self.journal = inner, journal
        self.counts = inner.counts

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        if self.journal is None:
            return self.inner.evaluate(jobs)
        known, keys, before = self.journal, [job.key for job in jobs], self.counts.copy()
        found: list[Any] = [_restored(job, known.get(key)) for job, key in zip(jobs, keys, strict=True)]
        fresh = [k for k, value in enumerate(found) if value is None]
        if fresh:
            results = self.inner.evaluate([jobs[k] for k in fresh])
            self.journal.note([(keys[k], value) for k, value in zip(fresh, results, strict=True)])
            for k, value in zip(fresh, results, strict=True):
                found[k] = value
        steps = sum(j.rollout.steps for j in jobs)
        self.counts.asked, self.counts.simulated = before.asked + len(jobs), before.simulated + len(jobs)
        self.counts.steps, self.counts.asked_steps = before.steps + steps, before.asked_steps + steps
        return found

    def close(self) -> None:
        self.inner.close()
