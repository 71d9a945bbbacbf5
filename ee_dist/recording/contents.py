"""What survives in an MCAP file of ours, be it whole, cut short by a kill, or damaged.

The index of a file stands at its end, so a cut file has none: this reads from the beginning, record by record, keeps
every chunk whose checksum holds, and says whether anything was missing. An attachment or metadata whose checksum does
not hold is not passed over but refused: a robot of a wrong mass is worse than none. Sizes that a file claims are
believed only as far as the file is long, or as a recording may become.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO
from zlib import crc32

from mcap.data_stream import RecordBuilder
from mcap.exceptions import McapError
from mcap.records import Attachment, Channel, Chunk, DataEnd, Header, McapRecord, Message, Metadata, Schema
from mcap.stream_reader import StreamReader, breakup_chunk
from zstandard import ZstdError, frame_content_size

from ee_dist.basics.quoted import quoted
from ee_dist.recording import topics
from ee_dist.recording.errors import RecordingError
from ee_dist.robots.untrusted import UntrustedError, check_file

_MAGIC = b"\x89MCAP0\r\n"
_DATA_END = 1 + 8 + 4
"""Bytes of the record behind the data: opcode, length, checksum."""
_LARGEST = 2**33
"""Bytes of a file."""
_CHUNK_LIMIT = 64 * 2**20
_WHOLE_LIMIT = 4 * 2**30
"""Bytes that one chunk and all chunks of a file may unpack to; the writer's chunks are of one MiB and hold one message more."""
_DAMAGE = (McapError, ZstdError, struct.error, ValueError, OverflowError, MemoryError)
"""What the mcap library raises on bytes that make no sense; its checksum errors and UnicodeError are ValueErrors."""


@dataclass
class Contents:
    """``messages`` are (name of schema, bytes) in the order of the file. ``intact``: nothing of the file is missing;
    ``damaged``: names of attachments whose checksum does not hold; ``summed``: its metadata have checksums."""

    metadata: list[Metadata] = field(default_factory=list)
    attachments: dict[str, bytes] = field(default_factory=dict)
    messages: list[tuple[str, bytes]] = field(default_factory=list)
    damaged: list[str] = field(default_factory=list)
    summed: bool = False
    intact: bool = False


def read_contents(path: Path) -> Contents:
    """Everything whole in the file. Raises RecordingError if it is not a recording of ours or has nothing whole."""
    try:
        check_file(path, _LARGEST)
        size = path.stat().st_size
        with path.open("rb") as file:
            start = file.read(len(_MAGIC))
            file.seek(0)
            if not size:
                raise RecordingError(f"{path}: the file is empty; expected a recording (.mcap)")
            if start != _MAGIC:
                raise RecordingError(f"{path}: not an MCAP file; expected a recording written by ee_dist")
            return _read(path, file, size)
    except UntrustedError as error:
        raise RecordingError(f"{path}: {error}; expected a recording (.mcap)") from error
    except OSError as error:
        raise RecordingError(f"{path}: {_why(path, error)}") from error


class _Bounded:
    """A file that is never asked for more than it has: a damaged length must not ask for gigabytes."""

    def __init__(self, file: BinaryIO, size: int) -> None:
        self.file, self.size = file, size

    def read(self, count: int) -> bytes:
        return self.file.read(min(count, self.size - self.file.tell()))


def _read(path: Path, file: BinaryIO, size: int) -> Contents:
    reader = StreamReader(_Bounded(file, size), emit_chunks=True, record_size_limit=size)  # type: ignore[arg-type]
    records = reader.records
    try:
        header = next(records)
    except _DAMAGE as error:
        raise RecordingError(f"{path}: cut off before anything was recorded") from error
    if not isinstance(header, Header) or header.profile != topics.PROFILE:
        shown = header.profile if isinstance(header, Header) else ""
        raise RecordingError(
            f"{path}: an MCAP file of something else (profile {quoted(shown)}); expected profile {quoted(topics.PROFILE)}"
        )
    found = Contents()
    names: dict[int, str] = {}
    channels: dict[int, int] = {}
    messages: list[Message] = []
    sound, unpacked = True, 0
    for record in _until_damage(records, found):
        inside = [record]
        if isinstance(record, Chunk):
            try:
                unpacked += _unpacked_size(record)
                if unpacked > _WHOLE_LIMIT:
                    raise RecordingError(
                        f"{path}: unpacks to more than {_WHOLE_LIMIT >> 30} GiB; no recording of ours does"
                    )
                inside = breakup_chunk(record, validate_crc=True)
            except RecordingError:
                raise
            except _DAMAGE:
                sound = False  # the chunks after it may well be whole
                continue
        for item in inside:
            # The end of a file repeats schemas and channels: it gives back what a damaged chunk took away, and no more.
            if isinstance(item, Schema):
                names.setdefault(item.id, item.name)
            elif isinstance(item, Channel):
                channels.setdefault(item.id, item.schema_id)
            elif isinstance(item, Message):
                messages.append(item)
            elif isinstance(item, Metadata):
                found.metadata.append(_checked(path, item, bool(found.metadata) and found.summed))
                found.summed = found.summed or topics.CHECKSUM in item.metadata
            elif isinstance(item, Attachment):
                found.attachments[item.name] = item.data
                if not _attachment_holds(item, file):
                    found.damaged.append(item.name)
            elif isinstance(item, DataEnd):
                sound = sound and _data_holds(file, item)
    found.messages = [(names.get(channels.get(m.channel_id, 0), ""), m.data) for m in messages]
    found.intact = found.intact and sound
    return found


def _unpacked_size(chunk: Chunk) -> int:
    """Bytes that a chunk will take. Raises ValueError where it is packed as none of ours is, or claims too much."""
    if chunk.compression not in ("", "zstd"):
        raise ValueError(f"compression {quoted(chunk.compression)}")
    size = int(chunk.uncompressed_size)
    if chunk.compression:
        size = max(size, frame_content_size(chunk.data))
    if size > _CHUNK_LIMIT:
        raise ValueError(f"a chunk of {size} bytes")
    return size


def _attachment_holds(attachment: Attachment, file: BinaryIO) -> bool:
    """Whether the checksum behind it, the last four bytes that were read, is its own."""
    again: Any = RecordBuilder()
    attachment.write(again)
    place = file.tell()
    file.seek(place - 4)
    told = file.read(4)
    file.seek(place)
    return bool(told == again.end()[-4:])


def damage(path: Path, what: str) -> RecordingError:
    return RecordingError(
        f"{path}: the {what} is damaged (its checksum does not hold); fetch the file again, or use another copy"
    )


def with_checksum(name: str, metadata: Mapping[str, str]) -> dict[str, str]:
    """The metadata with a checksum of name and entries, which MCAP has none for."""
    return {**metadata, topics.CHECKSUM: _checksum(name, metadata)}


def _checked(path: Path, record: Metadata, expected: bool) -> Metadata:
    """Without its checksum. Raises RecordingError where that does not hold, or is ``expected`` and missing."""
    entries = dict(record.metadata)
    told = entries.pop(topics.CHECKSUM, None)
    # The first record tells whether the others have one; an older recording has none, and nothing but its format there.
    missing = expected or (record.name == topics.FORMAT_RECORD and set(entries) != {"format"})
    if told != _checksum(record.name, entries) and (told is not None or missing):
        raise damage(path, f"metadata record {record.name!r:.60}")
    return Metadata(name=record.name, metadata=entries)


def _checksum(name: str, metadata: Mapping[str, str]) -> str:
    return f"{crc32(repr((name, sorted(metadata.items()))).encode()):08x}"


def _data_holds(file: BinaryIO, end: DataEnd) -> bool:
    """Whether the checksum of all before ``end``, the record that was read last, holds; 0 means that there is none."""
    if not end.data_section_crc:
        return True
    place = file.tell()
    file.seek(0)
    left, found = place - _DATA_END, 0
    while left > 0 and (piece := file.read(min(left, 2**20))):
        found, left = crc32(piece, found), left - len(piece)
    file.seek(place)
    return found == end.data_section_crc


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
    return f"cannot be read ({error.strerror})"
