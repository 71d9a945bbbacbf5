"""What survives in an MCAP file of ours, be it whole, cut short by a kill, or damaged.

The index of a file stands at its end, so a cut file has none: this reads from the beginning, record by record, keeps
every chunk whose checksum holds, and says whether anything was missing.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Chunk, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdError

from ee_dist.recording import topics
from ee_dist.recording.errors import RecordingError

_MAGIC = b"\x89MCAP0\r\n"
_DAMAGE = (McapError, ZstdError, struct.error, ValueError, OverflowError)
"""What the mcap library raises on bytes that make no sense; its checksum errors and UnicodeError are ValueErrors."""


@dataclass
class Contents:
    """``messages`` are (name of schema, bytes) in the order of the file. ``intact``: nothing of the file is missing."""

    metadata: list[Metadata] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    messages: list[tuple[str, bytes]] = field(default_factory=list)
    intact: bool = False


def read_contents(path: Path) -> Contents:
    """Everything whole in the file. Raises RecordingError if it is not a recording of ours or has nothing whole."""
    try:
        size = path.stat().st_size
        with path.open("rb") as file:
            start = file.read(len(_MAGIC))
            file.seek(0)
            if not size:
                raise RecordingError(f"{path}: the file is empty; expected a recording (.mcap)")
            if start != _MAGIC:
                raise RecordingError(f"{path}: not an MCAP file; expected a recording written by ee_dist")
            return _read(path, file, size)
    except OSError as error:
        raise RecordingError(f"{path}: {_why(path, error)}") from error


def _read(path: Path, file: BinaryIO, size: int) -> Contents:
    # No record can be longer than its file: a damaged length must not ask for gigabytes.
    reader = StreamReader(file, emit_chunks=True, record_size_limit=size)
    records = reader.records
    try:
        header = next(records)
    except _DAMAGE as error:
        raise RecordingError(f"{path}: cut off before anything was recorded") from error
    if not isinstance(header, Header) or header.profile != topics.PROFILE:
        shown = header.profile if isinstance(header, Header) else ""
        raise RecordingError(
            f"{path}: an MCAP file of something else (profile {shown!r}); expected profile {topics.PROFILE!r}"
        )
    found = Contents()
    names: dict[int, str] = {}
    channels: dict[int, int] = {}
    messages: list[Message] = []
    sound = True
    for record in _until_damage(records, found):
        inside = [record]
        if isinstance(record, Chunk):
            try:
                inside = breakup_chunk(record, validate_crc=True)
            except _DAMAGE:
                sound = False  # the chunks after it may well be whole
                continue
        for item in inside:
            if isinstance(item, Schema):
                names[item.id] = item.name
            elif isinstance(item, Channel):
                channels[item.id] = item.schema_id
            elif isinstance(item, Message):
                messages.append(item)
            elif isinstance(item, Metadata):
                found.metadata.append(item)
            elif isinstance(item, Attachment):
                found.attachments[item.name] = item.data
    # Last, because the end of a file repeats what a damaged chunk may have taken away.
    found.messages = [(names.get(channels.get(m.channel_id, 0), ""), m.data) for m in messages]
    found.intact = found.intact and sound
    return found


def _until_damage(records: Iterator[McapRecord], found: Contents) -> Iterator[McapRecord]:
    """Records up to the end of the file, which makes it ``intact``, or up to the first that is not whole."""
    while True:
        try:
            record = next(records)
        except StopIteration:
            found.intact = True
            return
        except _DAMAGE:
            return
        yield record


def _why(path: Path, error: OSError) -> str:
    if isinstance(error, FileNotFoundError):
        part = path.with_name(path.name + ".part")
        return "no such file" + (f"; there is an unfinished recording {part.name}" if part.exists() else "")
    if isinstance(error, IsADirectoryError):
        return "a folder; expected a recording (.mcap) in it"
    return f"cannot be read ({error.strerror})"
