"""What was simulated, on the disk as soon as it is known: a run that was killed asks for it again and simulates nothing twice.

A file of entries, each a key, a value and a checksum; whatever a kill left half-written at its end is cut off. Values
are numbers and small arrays of numbers: what a search needs of a rollout. Others are simulated again.
"""

from __future__ import annotations

import os
import struct
from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, BinaryIO
from zlib import crc32

import numpy as np

from ee_dist.evaluation.jobs import Evaluator, Job

MAGIC = b"ee_dist journal 1\n"
LARGEST = 4096
"""Numbers in one value; larger ones are quicker to simulate again than to keep by the thousand."""
MOST = 2**30
"""Bytes of a journal; beyond, nothing more is noted."""
_HEAD = struct.Struct("<32sbII")
_CRC = struct.Struct("<I")


class Journal:
    """Values by key, in memory and in the file at ``path``. Raises OSError where that cannot be written."""

    def __init__(self, path: Path) -> None:
        self.values: dict[str, Any] = {}
        self._file: BinaryIO = path.open("a+b")
        self._size = self._load()

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
            key, value = entry
            self.values[key] = value
            good = self._file.tell()
        self._file.truncate(good)
        self._file.seek(good)
        return good

    def _entry(self) -> tuple[str, Any] | None:
        head = self._file.read(_HEAD.size)
        if len(head) < _HEAD.size:
            return None
        key, dimensions, rows, columns = _HEAD.unpack(head)
        scalar, flat = dimensions == -1, dimensions < 2
        if (
            dimensions not in (-1, 1, 2)
            or not 0 < rows * columns <= LARGEST
            or (flat and columns > 1)
            or (scalar and rows > 1)
        ):
            return None
        content = self._file.read(8 * rows * columns)
        told = self._file.read(_CRC.size)
        if len(told) < _CRC.size or _CRC.unpack(told)[0] != crc32(head + content):
            return None
        numbers = np.frombuffer(content, dtype=np.float64)
        value: Any = float(numbers[0]) if dimensions == -1 else numbers.reshape((rows, columns)[:dimensions]).copy()
        return key.hex(), value

    def note(self, found: Sequence[tuple[str, Any]]) -> None:
        """Keep these; when this returns they survive a kill and a loss of power."""
        wrote = False
        for key, value in found:
            packed = _packed(key, value)
            if packed is not None and key not in self.values and self._size + len(packed) <= MOST:
                self._file.write(packed)
                self.values[key], self._size, wrote = value, self._size + len(packed), True
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
    if isinstance(value, float):
        dimensions, numbers = -1, np.array([value])
    elif isinstance(value, np.ndarray) and value.dtype == np.float64 and value.ndim in (1, 2) and value.size <= LARGEST:
        dimensions, numbers = value.ndim, value
    else:
        return None
    rows, columns = numbers.shape if numbers.ndim == 2 else (len(numbers), 1)
    if not rows * columns:
        return None
    body = _HEAD.pack(bytes.fromhex(key), dimensions, rows, columns) + np.ascontiguousarray(numbers).tobytes()
    return body + _CRC.pack(crc32(body))


class JournaledEvaluator:
    """Asks ``inner`` for what the journal does not know, and counts all as simulated, as an undisturbed run does."""

    def __init__(self, inner: Evaluator, journal: Journal | None = None) -> None:
        self.inner, self.journal = inner, journal
        self.counts = inner.counts

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        if self.journal is None:
            return self.inner.evaluate(jobs)
        known, keys, before = self.journal.values, [job.key for job in jobs], self.counts.copy()
        fresh = [k for k, key in enumerate(keys) if key not in known]
        found: list[Any] = [known.get(key) for key in keys]
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
