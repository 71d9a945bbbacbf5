"""Bags: ROS 1 (.bag) and ROS 2 (a folder, .db3, .mcap) by the rosbags package, other MCAP by protobuf or JSON."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers.messages import Gatherer, is_series
from ee_dist.measurements.readers.needs import needed
from ee_dist.measurements.readers.options import Options, bounded
from ee_dist.measurements.table import Recorded
from ee_dist.recording.topics import PROFILE

METADATA = "metadata.yaml"


def is_bag(folder: Path) -> bool:
    return (folder / METADATA).is_file() and any(f.suffix in (".mcap", ".db3") for f in folder.iterdir())


def read_bag(path: Path, options: Options) -> tuple[Recorded, ...]:
    """A ROS bag. Raises MeasurementError."""
    if not path.exists():
        raise FileNotFoundError(path)
    highlevel = needed("rosbags.highlevel", "ros", path)
    typesys = needed("rosbags.typesys", "ros", path)
    _no_whole_file_compression(path)
    gatherer = Gatherer(path)
    try:
        store = typesys.get_typestore(typesys.Stores.LATEST)
        with highlevel.AnyReader([path], default_typestore=store) as reader:
            wanted = [c for c in reader.connections if is_series(c.msgtype)]
            unknown = sorted({c.msgtype for c in wanted if c.msgtype not in reader.typestore.types})
            if unknown:
                gatherer.notes.append(f"left out: the bag does not define {', '.join(unknown)}")
            wanted = [c for c in wanted if c.msgtype in reader.typestore.types]
            # Without connections the library would read all of them.
            for connection, log_ns, raw in reader.messages(connections=wanted) if wanted else ():
                gatherer.add(connection.topic, log_ns, reader.deserialize(raw, connection.msgtype))
    except (MeasurementError, MemoryError, PermissionError):
        raise
    except Exception as error:  # The library raises what it stumbles upon.
        raise _damaged(path, error) from None
    return (gatherer.trial(),)


def _no_whole_file_compression(path: Path) -> None:
    """Such bags are unpacked to the disk before anybody knows how large they are."""
    folder = path / METADATA
    if path.is_dir() and folder.is_file():
        bounded(path, sum(f.stat().st_size for f in path.iterdir() if f.is_file()))
        text = folder.read_text(encoding="utf-8", errors="replace").lower()
        if "compression_mode: file" in text:
            raise MeasurementError(f"{path}: its files are compressed as a whole; unpack it first: ros2 bag convert")
    elif path.is_file():
        bounded(path, path.stat().st_size)


def read_mcap(path: Path, options: Options) -> tuple[Recorded, ...]:
    """An MCAP file with CDR, protobuf or JSON messages. Raises MeasurementError."""
    from mcap.reader import make_reader
    from mcap_protobuf.decoder import DecoderFactory

    bounded(path, path.stat().st_size)
    try:
        with path.open("rb") as file:
            reader = make_reader(file)
            if reader.get_header().profile == PROFILE:
                raise MeasurementError(f"{path}: is a recording of ours already; use it as it is: measured={path}")
            summary = reader.get_summary()
            channels = summary.channels.values() if summary else []
            encodings = {c.message_encoding for c in channels}
            if "cdr" in encodings or "ros1" in encodings:
                return read_bag(path, options)
            if summary is None or not summary.channels:
                raise MeasurementError(
                    f"{path}: cut short, or nothing in it: 'mcap recover {path.name}' saves what is whole"
                )
            gatherer = Gatherer(path)
            topics = [c.topic for c in channels if c.message_encoding in ("protobuf", "json") and _wanted(summary, c)]
            for schema, channel, message in reader.iter_messages(topics=topics) if topics else ():
                if channel.message_encoding == "json":
                    content = json.loads(message.data)
                else:
                    decode = DecoderFactory().decoder_for(channel.message_encoding, schema)
                    content = _plain(decode(message.data)) if decode else {}
                gatherer.add(channel.topic, message.log_time, content)
    except (MeasurementError, MemoryError, PermissionError, FileNotFoundError, IsADirectoryError):
        raise
    except Exception as error:  # The library raises what it stumbles upon.
        raise _damaged(path, error) from None
    return (gatherer.trial(),)


def _wanted(summary: Any, channel: Any) -> bool:
    schema = summary.schemas.get(channel.schema_id)
    return is_series(schema.name if schema else "")


def _plain(message: Any) -> dict[str, Any]:
    """A protobuf message as mappings and lists, with numbers that are zero, which the wire leaves out."""
    found: dict[str, Any] = {}
    for entry in message.DESCRIPTOR.fields:
        value = getattr(message, entry.name)
        if entry.message_type is None:
            found[entry.name] = list(value) if _repeated(entry) else value
        elif _repeated(entry):
            found[entry.name] = [_plain(v) for v in value] if not hasattr(value, "keys") else {}
        else:
            found[entry.name] = _plain(value)
    return found


def _repeated(entry: Any) -> bool:
    return bool(entry.is_repeated)


def _damaged(path: Path, error: BaseException) -> MeasurementError:
    cure = f": 'mcap recover {path.name}' saves what is whole" if path.suffix == ".mcap" else ""
    return MeasurementError(
        f"{path}: not a bag, or cut short{cure} ({type(error).__name__}: {' '.join(str(error).split())[:100]})"
    )
