"""Writes a run into an MCAP file as it goes: what a killed run leaves is everything up to its last trial.

The file is called ``<path>.part`` until ``finish``, so that a name without ``.part`` is the promise of a whole run.
"""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import TracebackType
from typing import Any

from mcap.well_known import MessageEncoding
from mcap.writer import CompressionType, Writer
from mcap_protobuf.schema import register_schema

from ee_dist.recording import codec, schemas, topics
from ee_dist.recording.clock import RunClock, offsets_ns
from ee_dist.recording.contents import with_checksum
from ee_dist.recording.errors import RecordingError
from ee_dist.recording.forms import FILES, form_of
from ee_dist.recording.records import GenerationRecord, HypothesisRecord, TrialRecord
from ee_dist.robots.system import System

_MEDIA_TYPES = {".json": "application/json", ".yaml": "application/yaml", ".csv": "text/csv", ".txt": "text/plain"}


class RunWriter:
    """Records a run at ``path``. The same records, in the same order, give the same bytes.

    ``metadata`` are short strings, ``attachments`` files by name. A folder that does not exist is made. A file of an
    earlier run at ``path`` is replaced at ``finish``, its unfinished ``.part`` at once. As a context manager it
    finishes at the end of the block; on an exception it leaves the ``.part`` with all that was recorded, not marked
    complete. Every method raises RecordingError if the file cannot be written or is closed already.
    """

    def __init__(
        self,
        path: str | Path,
        robot: System,
        metadata: Mapping[str, str] | None = None,
        attachments: Mapping[str, bytes] | None = None,
    ) -> None:
        self.path = Path(path)
        self.part = self.path.with_name(self.path.name + ".part")
        self._robot, self._form = robot, form_of(robot)
        self._clock = RunClock()
        self._trials = 0
        self._channels: dict[str, int] = {}
        self._schemas: dict[str, int] = {}
        metadata, attachments = dict(metadata or {}), dict(attachments or {})
        _check_texts(metadata)
        for name in FILES.keys() & attachments.keys():
            raise RecordingError(f"{self.path}: the attachment name {name} is taken by the robot; use another")
        try:
            self.path.parent.mkdir(parents=True, exist_ok=True)
            self._file = self.part.open("wb")
        except OSError as error:
            raise RecordingError(
                f"{self.path.parent}: no recording can be written there ({error.strerror}); name a writable folder"
            ) from error
        self._open = True
        self._mcap: Any = Writer(self._file, compression=CompressionType.ZSTD, enable_data_crcs=True)
        with self._writing():
            self._mcap.start(profile=topics.PROFILE, library=topics.LIBRARY)
            self._note(topics.FORMAT_RECORD, {"format": topics.FORMAT})
            self._note(topics.RUN_RECORD, metadata)
            self._attach(self._form.file, self._form.write(robot).encode())
            for name, data in sorted(attachments.items()):
                self._attach(name, data)
            self._save()

    # -- records -----------------------------------------------------------------------------------------------------

    def trial(self, record: TrialRecord) -> None:
        """Record a trial; when this returns, it and all before it survive a kill and a loss of power."""
        if record.source not in topics.SOURCES:
            raise RecordingError(
                f"trial {record.name!r}: no source {record.source!r}; there are: {', '.join(topics.SOURCES)}"
            )
        number = self._trials
        header = codec.trial_message(number, record, self._form.command_units(self._robot))
        offsets = offsets_ns(record.log.times_s)
        start = self._clock.trial(record.index, int(offsets.max(initial=0)))
        self._trials += 1
        with self._writing():
            self._add(topics.trial_topic(record.source), header, start)
            channel = self._channel(topics.rows_topic(record.source), schemas.Row)
            for row, (offset, data) in enumerate(
                zip(offsets.tolist(), codec.row_messages(number, record.log), strict=True)
            ):
                self._mcap.add_message(channel, start + offset, data, start + offset, row)
            length = int(offsets.max(initial=0))
            for topic, log_time, message in self._form.pictures(record, self._robot, start, length):
                self._add(topic, message, log_time)
            self._save()

    def hypothesis(self, record: HypothesisRecord) -> None:
        """Record a hypothesis; it survives a kill from the next trial or ``flush`` on."""
        with self._writing():
            self._add(topics.HYPOTHESIS_TOPIC, codec.hypothesis_message(record), self._clock.now_ns)

    def hypotheses(self, records: Iterable[HypothesisRecord]) -> None:
        """Record several hypotheses, in their order."""
        for record in records:
            self.hypothesis(record)

    def generation(self, record: GenerationRecord) -> None:
        """Record a generation; it survives a kill from the next trial or ``flush`` on."""
        if record.phase not in topics.PHASES:
            raise RecordingError(f"generation: no phase {record.phase!r}; there are: {', '.join(topics.PHASES)}")
        with self._writing():
            self._add(topics.generation_topic(record.phase), codec.generation_message(record), self._clock.generation())

    # -- the file ----------------------------------------------------------------------------------------------------

    def flush(self) -> None:
        """Bring everything so far to the disk (about a millisecond)."""
        with self._writing():
            self._save()

    def finish(self, metadata: Mapping[str, str] | None = None, *, complete: bool = True) -> None:
        """Add the last metadata, mark the run complete, close the file and give it its name.

        ``complete=False`` makes a sound file of a run that did not reach its end.
        """
        metadata = dict(metadata or {})
        _check_texts(metadata)
        with self._writing():
            if metadata:
                self._note(topics.RUN_RECORD, metadata)
            self._mcap.flush()
            self._note(topics.STATUS_RECORD, {"complete": "true" if complete else "false"})
            self._mcap.finish()
            self._file.flush()
            os.fsync(self._file.fileno())
            self._open = False
            self._file.close()
            os.replace(self.part, self.path)
            _sync_folder(self.path.parent)

    def abandon(self) -> None:
        """Close the ``.part`` with what was recorded and without marking it complete; without any record, remove it.
        Never raises."""
        if self._open:
            self._open = False
            with suppress(OSError, ValueError):
                self._save()
            with suppress(OSError):
                self._file.close()
                if not self._channels:
                    self.part.unlink()

    def __enter__(self) -> RunWriter:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if kind is not None:
            self.abandon()
        elif self._open:
            self.finish()

    # -- details -----------------------------------------------------------------------------------------------------

    @contextmanager
    def _writing(self) -> Iterator[None]:
        if not self._open:
            raise RecordingError(f"{self.path}: this recording is closed; open another one")
        try:
            yield
        except OSError as error:
            self.abandon()
            kept = "; what was recorded before is kept there" if self._channels else ""
            raise RecordingError(f"{self.part}: cannot be written ({error.strerror}){kept}") from error

    def _save(self) -> None:
        self._mcap.flush()
        self._file.flush()
        os.fsync(self._file.fileno())

    def _note(self, name: str, metadata: Mapping[str, str]) -> None:
        self._mcap.add_metadata(name, with_checksum(name, dict(sorted(metadata.items()))))

    def _attach(self, name: str, data: bytes) -> None:
        self._mcap.add_attachment(0, 0, name, _MEDIA_TYPES.get(Path(name).suffix, "application/octet-stream"), data)

    def _add(self, topic: str, message: Any, log_time: int) -> None:
        channel = self._channel(topic, type(message))
        self._mcap.add_message(channel, log_time, message.SerializeToString(deterministic=True), log_time)

    def _channel(self, topic: str, kind: Any) -> int:
        if topic not in self._channels:
            name = kind.DESCRIPTOR.full_name
            if name not in self._schemas:
                self._schemas[name] = register_schema(self._mcap, kind)
            self._channels[topic] = self._mcap.register_channel(topic, MessageEncoding.Protobuf, self._schemas[name])
        return self._channels[topic]


def _check_texts(metadata: Mapping[str, str]) -> None:
    for key, value in metadata.items():
        if not isinstance(key, str) or not isinstance(value, str):
            raise RecordingError(f"metadata: {key!r} is {value!r}; expected text for both")


def _sync_folder(folder: Path) -> None:
    """Make a new name survive a loss of power; where the system cannot, the file is safe under its old name."""
    with suppress(OSError):
        handle = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(handle)
        finally:
            os.close(handle)
