"""Gives back what ``writer.py`` was given, bit for bit; of a cut file, every record that is whole."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from google.protobuf.message import DecodeError

from ee_dist.basics.quoted import one_line
from ee_dist.recording import codec, schemas, topics
from ee_dist.recording.contents import Contents, damage, read_contents
from ee_dist.recording.errors import RecordingError
from ee_dist.recording.forms import FILES, FORMS
from ee_dist.recording.records import HARDWARE, HypothesisRecord, RunRecord, TrialRecord
from ee_dist.recording.upgrade import Record, upgraded
from ee_dist.robots.model import Robot, RobotError

ANY = tuple(FORMS)
"""All kinds of systems that a recording may be of."""


def read_run(path: str | Path, kinds: tuple[type, ...] = (Robot,)) -> RunRecord:
    """The run recorded in a file, whole or cut.

    ``complete`` says that the run reached its end and nothing of it is missing. A trial of which rows are missing is
    left out. Raises RecordingError if the file is not a recording, is too new, lacks its robot, or has another system than
    one of these ``kinds`` (``ANY`` are all).
    """
    run = read_with_order(Path(path))[0]
    if not isinstance(run.robot, kinds):
        raise RecordingError(f"{path}: a recording of {run.robot.name}, which is no robot; expected that of a robot")
    return run


def read_with_order(path: Path) -> tuple[RunRecord, list[Record]]:
    """The run, and its records in the order in which they were written. Raises RecordingError as ``read_run`` does."""
    contents, version, metadata, status = _read(path)
    if contents.damaged:
        raise damage(path, f"attachment {contents.damaged[0]!r:.60}")
    name = next((f for f in FILES if f in contents.attachments), None)
    if name is None:
        raise RecordingError(f"{path}: cut off before its robot was recorded; nothing can be recovered")
    try:
        run = RunRecord(FILES[name].read(contents.attachments.pop(name)), metadata, contents.attachments)
    except (RobotError, UnicodeError, RecursionError) as error:
        raise RecordingError(f"{path}: the attachment {name} is not a robot of ours: {error}") from error
    records = list(_records(path, contents))
    if version == topics.FIRST_FORMAT:
        records = upgraded(records)
    for record in records:
        if isinstance(record, TrialRecord):
            run.trials.append(record)
        elif isinstance(record, HypothesisRecord):
            run.hypotheses.append(record)
        else:
            run.generations.append(record)
    run.complete = contents.intact and status.get("complete") == "true"
    return run, records


def read_logs(path: str | Path) -> list[TrialRecord]:
    """The hardware trials of a recording, in the order of the file. Raises RecordingError if there is none.

    They have checksums of their own: a damaged robot or settings beside them do no harm here.
    """
    path = Path(path)
    contents = _read(path)[0]
    found = [r for r in _records(path, contents) if isinstance(r, TrialRecord) and r.source == HARDWARE]
    if not found:
        raise RecordingError(f"{path}: no whole hardware trial in it; expected at least one")
    return found


def _read(path: Path) -> tuple[Contents, str, dict[str, str], dict[str, str]]:
    """The contents, the version of the format, the metadata of the run and its status."""
    contents = read_contents(path)
    merged: dict[str, dict[str, str]] = {}
    for record in contents.metadata:
        merged.setdefault(record.name, {}).update(record.metadata)
    version = merged.get(topics.FORMAT_RECORD, {}).get("format")
    if version is None:
        raise RecordingError(f"{path}: cut off before anything was recorded")
    if version not in (topics.FIRST_FORMAT, topics.FORMAT):
        raise RecordingError(
            f"{path}: recorded in format {one_line(version)}; this version reads formats "
            f"{topics.FIRST_FORMAT} and {topics.FORMAT}"
        )
    return contents, version, merged.get(topics.RUN_RECORD, {}), merged.get(topics.STATUS_RECORD, {})


def _records(path: Path, contents: Contents) -> Iterator[Record]:
    try:
        yield from _decoded(contents.messages)
    except (DecodeError, ValueError) as error:
        raise RecordingError(f"{path}: a message that contradicts its schema ({error})") from error


def _decoded(messages: Iterable[tuple[str, bytes]]) -> Iterator[Record]:
    """Whole records. Messages of other schemas are passed over, and rows whose trial message is lost."""
    building: dict[int, codec.TrialBuilder] = {}
    for schema, data in messages:
        if schema == "ee_dist.Row":
            row = schemas.Row.FromString(data)
            builder = building.get(row.trial_id)
            if builder is None:
                continue
            builder.add(row)
            if builder.whole:
                yield building.pop(row.trial_id).record()
        elif schema == "ee_dist.Trial":
            header = schemas.Trial.FromString(data)
            builder = codec.TrialBuilder(header)
            if builder.whole:
                yield builder.record()
            else:
                building[header.id] = builder
        elif schema == "ee_dist.Hypothesis":
            yield codec.hypothesis_record(schemas.Hypothesis.FromString(data))
        elif schema == "ee_dist.Generation":
            yield codec.generation_record(schemas.Generation.FromString(data))
