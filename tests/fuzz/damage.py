"""Damage to a file: to its bytes, and to what lies in it, packed again so that its checksums hold."""

from __future__ import annotations

import base64
import copy
import hashlib
import io
import json
import sqlite3
import struct
import tempfile
import xml.etree.ElementTree as ET
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from random import Random
from typing import Any

import yaml
from mcap.records import Attachment, Channel, Message, Metadata, Schema
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType, Writer

from ee_dist.evaluation.journal import _CRC, _HEAD, MAGIC
from ee_dist.recording import topics
from ee_dist.recording.contents import with_checksum

TEXTS = (
    b"1e999",
    b"-1",
    b"nan",
    b"1" * 400,
    b"[",
    b"{",
    b": ",
    b"~",
    b"&a *a",
    b"\n",
    b"\0",
    b'"',
    b"'",
    b"../../x",
    b"1e-320",
    b"<",
    b"0",
    b"99999999999999999999",
    b"\xff\xff\xff\xff",
    b"\xff\xff\xff\x7f",
    b"\0\0\0\0",
    b"true",
    b"null",
    b"!!python/object:os.system ",
)
VALUES: tuple[Any, ...] = (
    None,
    True,
    -1,
    0,
    1,
    1.5,
    -1e308,
    1e308,
    1e-320,
    float("nan"),
    float("inf"),
    2**63,
    10**400,
    "",
    "a",
    "x" * 3000,
    [],
    {},
    [[]],
    [None],
    {"a": 1},
    ["a", 1],
    "/dev/zero",
    "../..",
    "nan",
    "1",
    [1e308] * 9,
    {"": {}},
    "\n",
    "\0",
    "\u2028",
)
KINDS = ("flip", "flip", "cut", "insert", "repeat", "text", "move", "number", "end", "splice")
ELEMENTS = (
    "include",
    "mesh",
    "freejoint",
    "composite",
    "replicate",
    "frame",
    "mimic",
    "equality",
    "link",
    "joint",
    "plugin",
)
FOREIGN = (
    b"",
    b"\0" * 64,
    b"\x89MCAP0\r\n",
    b"PAR1PAR1",
    b"[" * 3000,
    b"{" * 3000,
    b"<a>" * 3000,
    b"\xff\xfe\xfa",
    b"null",
    b"a shopping list",
    b"PK\x05\x06" + b"\0" * 18,
    b"\x89HDF\r\n\x1a\n" + b"\0" * 600,
    b"SQLite format 3\0" + b"\0" * 100,
    b"#ROSBAG V2.0\n",
    b"MATLAB 5.0 MAT-file".ljust(124) + b"\x00\x01IM" + b"\0" * 40,
    b"\x93NUMPY\x01\x00" + b"\xff" * 20,
    b"<mujoco/>",
    b"- " * 4000,
    b"a: &a [*a]",
    b'"' + b"\\u0000" * 100 + b'"',
    b"\n" * 2000,
    b"," * 2000,
    b"#\n#\n",
    b"1,2\n3",
    b"0\n" * 50,
)


def damaged(rng: Random, content: bytes, others: tuple[bytes, ...] = ()) -> bytes:
    """A few cuts, flips, repeats, insertions; or, half of the time, such damage inside of it."""
    if rng.random() < 0.5:
        inside = deep(rng, content)
        if inside is not None:
            return inside
    return shallow(rng, content, others)


def shallow(rng: Random, content: bytes, others: tuple[bytes, ...] = ()) -> bytes:
    found = bytearray(content)
    for _ in range(rng.randint(1, 4)):
        place = rng.randint(0, max(len(found) - 1, 0))
        kind = rng.choice(KINDS)
        if kind == "flip" and found:
            found[place] ^= 1 << rng.randint(0, 7)
        elif kind == "cut":
            del found[place : place + rng.randint(1, 64)]
        elif kind == "insert":
            found[place:place] = bytes(rng.randint(0, 255) for _ in range(rng.randint(1, 8)))
        elif kind == "repeat":
            found[place:place] = found[place : place + rng.choice((1, 8, 64, 512))]
        elif kind == "text":
            found[place : place + rng.randint(0, 3)] = rng.choice(TEXTS)
        elif kind == "move" and found:
            other, size = rng.randint(0, len(found) - 1), rng.choice((1, 4, 8, 32))
            found[place : place + size] = found[other : other + size]
        elif kind == "number" and len(found) > 8:
            place = min(place, len(found) - 8)
            found[place : place + 4] = struct.pack("<I", rng.choice((0, 1, 255, 2**16, 2**31 - 1, 2**31, 2**32 - 1)))
        elif kind == "end":
            del found[place:]
        elif kind == "splice" and others:
            other_file = rng.choice(others)
            found[place:] = other_file[min(place, len(other_file)) :]
    return bytes(found)


def deep(rng: Random, content: bytes) -> bytes | None:
    """Damage to what the file holds; None where it is not taken apart."""
    for sign, inner in DEEP:
        if content.startswith(sign):
            try:
                return inner(rng, content)
            except Exception:  # it only looks like a file of that kind
                return None
    return None


def plain(rng: Random, data: Any) -> Any:
    """Plain data with something in it replaced, left out, doubled or renamed."""
    data = copy.deepcopy(data)
    for _ in range(rng.randint(1, 3)):
        if not isinstance(data, (dict, list)):
            return rng.choice(VALUES)
        holder: Any = data
        while True:
            keys = list(holder) if isinstance(holder, dict) else list(range(len(holder)))
            if not keys:
                break
            key = rng.choice(keys)
            if isinstance(holder[key], (dict, list)) and holder[key] and rng.random() < 0.75:
                holder = holder[key]
                continue
            kind = rng.choice(("value", "value", "value", "gone", "name", "twice", "wrapped"))
            if kind == "value":
                holder[key] = rng.choice(VALUES)
            elif kind == "gone":
                del holder[key]
            elif kind == "name" and isinstance(holder, dict):
                holder[rng.choice(("", "x", 3, None, True, "effect", "version"))] = holder.pop(key)
            elif kind == "twice" and isinstance(holder, list):
                holder += holder[:8]
            else:
                holder[key] = [holder[key]]
            break
    return data


def _json(rng: Random, content: bytes) -> bytes:
    data = json.loads(content)
    if isinstance(data, dict) and set(data) >= {"payload", "digest"}:
        truth = json.loads(zlib.decompress(base64.b64decode(data["payload"])[::-1]))
        payload = base64.b64encode(zlib.compress(json.dumps(plain(rng, truth), default=str).encode())[::-1]).decode()
        return json.dumps(data | {"payload": payload, "digest": hashlib.sha256(payload.encode()).hexdigest()}).encode()
    return json.dumps(plain(rng, data), skipkeys=True).encode()


def _yaml(rng: Random, content: bytes) -> bytes:
    data = yaml.safe_load(content)
    if not isinstance(data, (dict, list)):
        raise ValueError("a text")
    return yaml.safe_dump(plain(rng, data), allow_unicode=True).encode("utf-8", "replace")


def _xml(rng: Random, content: bytes) -> bytes:
    root = ET.fromstring(content)
    for _ in range(rng.randint(1, 3)):
        every = list(root.iter())
        parents = {child: parent for parent in every for child in parent}
        one, other = rng.choice(every), rng.choice(every)
        kind = rng.choice(("value", "value", "value", "gone", "name", "tag", "copy", "text", "new"))
        if kind == "value" and one.attrib:
            one.set(rng.choice(list(one.attrib)), _xml_text(rng))
        elif kind == "gone" and one.attrib:
            del one.attrib[rng.choice(list(one.attrib))]
        elif kind == "name" and one.attrib:
            one.set(rng.choice(("name", "class", "joint", "type", "link", "xyz", "size", "file")), _xml_text(rng))
        elif kind == "tag":
            one.tag = other.tag
        elif kind == "copy":
            one.append(copy.deepcopy(other))
        elif kind == "text":
            one.text = _xml_text(rng)
        elif kind == "new":
            new = rng.choice(ELEMENTS)
            ET.SubElement(one, new, {"name": _xml_text(rng), "file": "x.stl"})
        elif one in parents:
            parents[one].remove(one)
    return ET.tostring(root)


def _xml_text(rng: Random) -> str:
    return rng.choice(
        (
            "",
            "0",
            "-1",
            "nan",
            "inf",
            "1e308",
            "1e-320",
            "1 2",
            "1 2 3",
            "0 0 0",
            "a",
            "x" * 3000,
            "../../x",
            "/dev/zero",
            "1e5 1e5 1e5",
            "ball",
            "free",
            "mesh",
            "9" * 30,
            "prismatic",
            "fixed",
            "base",
            "turn",
            "upper",
            "true",
            "degree",
            "2147483648",
            "hfield",
        )
    )


def _npz(rng: Random, content: bytes) -> bytes:
    with zipfile.ZipFile(io.BytesIO(content)) as source:
        members = {n: source.read(n) for n in source.namelist()}
    name = rng.choice(sorted(members))
    members[name] = shallow(rng, members[name])
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w") as target:
        for n, data in members.items():
            target.writestr(n, data)
    return out.getvalue()


def _sqlite(rng: Random, content: bytes) -> bytes:
    with tempfile.NamedTemporaryFile(suffix=".db3") as file:
        Path(file.name).write_bytes(content)
        with sqlite3.connect(file.name) as base:
            tables = [r[0] for r in base.execute("select name from sqlite_master where type='table'")]
            table = rng.choice([t for t in tables if t in ("messages", "topics", "message_definitions")] or tables)
            columns = [r[1] for r in base.execute(f"pragma table_info({table})")]
            column = rng.choice(columns)
            rows = base.execute(f"select rowid, {column} from {table}").fetchall()
            row, value = rng.choice(rows)
            new: Any = rng.choice((None, -1, 2**62, "", "x"))
            if isinstance(value, bytes):
                new = shallow(rng, value)
            elif isinstance(value, str) and rng.random() < 0.8:
                new = shallow(rng, value.encode()).decode("utf-8", "replace")
            base.execute(f"update {table} set {column} = ? where rowid = ?", (new, row))
        base.close()
        return Path(file.name).read_bytes()


def _mcap(rng: Random, content: bytes) -> bytes:
    """One record changed, and the file written again: its checksums hold. Of ours, those of metadata too."""
    ours: list[Any] = list(StreamReader(io.BytesIO(content), emit_chunks=False).records)
    kinds = [k for k in (Message, Attachment, Metadata, Schema, Channel) if any(isinstance(r, k) for r in ours)]
    kind = rng.choice(kinds)
    chosen = rng.choice([r for r in ours if isinstance(r, kind)])
    out = io.BytesIO()
    writer = Writer(out, compression=CompressionType.NONE)
    writer.start(profile=ours[0].profile, library=ours[0].library)
    schemas: dict[int, int] = {0: 0}
    channels: dict[int, int] = {}
    for record in ours:
        hit = record is chosen
        if isinstance(record, Schema):
            data = shallow(rng, record.data) if hit else record.data
            name = rng.choice((record.name, "", "ee_dist.Row", "x")) if hit else record.name
            schemas[record.id] = writer.register_schema(name, record.encoding, data)
        elif isinstance(record, Channel):
            encoding = (
                rng.choice((record.message_encoding, "json", "protobuf", "cdr", "ros1", ""))
                if hit
                else record.message_encoding
            )
            topic = rng.choice((record.topic, "", "/" * 300)) if hit else record.topic
            channels[record.id] = writer.register_channel(
                topic, encoding, schemas.get(record.schema_id, 0), record.metadata
            )
        elif isinstance(record, Message):
            data = (_message(rng, record.data)) if hit else record.data
            at = rng.choice((record.log_time, 0, 2**63, 2**64 - 1)) if hit else record.log_time
            writer.add_message(channels[record.channel_id], at, data, record.publish_time, record.sequence)
        elif isinstance(record, Attachment):
            writer.add_attachment(
                0, 0, record.name, record.media_type, _message(rng, record.data) if hit else record.data
            )
        elif isinstance(record, Metadata):
            told = {k: v for k, v in record.metadata.items() if k != topics.CHECKSUM}
            if hit and told:
                key = rng.choice(sorted(told))
                told[key] = _message(rng, told[key].encode()).decode("utf-8", "replace")
            writer.add_metadata(
                record.name, with_checksum(record.name, told) if topics.CHECKSUM in record.metadata else told
            )
    writer.finish()
    return out.getvalue()


def _message(rng: Random, data: bytes) -> bytes:
    return (deep(rng, data) if data[:1] in (b"{", b"[") and rng.random() < 0.7 else None) or shallow(rng, data)


def _journal(rng: Random, content: bytes) -> bytes:
    key, dimensions = bytes(32), rng.choice((-1, 0, 1, 2, 3, -2))
    rows, columns = rng.choice((0, 1, 2, 2**31)), rng.choice((0, 1, 3, 2**31))
    body = _HEAD.pack(key, dimensions, rows, columns) + bytes(8 * rng.choice((0, 1, 2, 3, 6)))
    return content + body + _CRC.pack(zlib.crc32(body))


def _cells(rng: Random, content: bytes) -> bytes:
    """A text of lines: cells, lines, signs."""
    lines = content.decode("utf-8", "replace").split("\n")
    for _ in range(rng.randint(1, 4)):
        place = rng.randint(0, len(lines) - 1)
        cells = lines[place].split(",")
        kind = rng.choice(("value", "value", "gone", "twice", "swap", "sign"))
        if kind == "value":
            cells[rng.randint(0, len(cells) - 1)] = rng.choice(
                ("", "x", "1e999", "-1", "nan", "[1, 2]", '"', "1;2", "9" * 400, "#", "\t")
            )
            lines[place] = ",".join(cells)
        elif kind == "gone":
            lines[place] = ""
        elif kind == "twice":
            lines.insert(place, lines[place])
        elif kind == "swap":
            other = rng.randint(0, len(lines) - 1)
            lines[place], lines[other] = lines[other], lines[place]
        else:
            lines = [line.replace(",", ";") for line in lines]
    return "\n".join(lines).encode()


DEEP: tuple[tuple[bytes, Callable[[Random, bytes], bytes]], ...] = (
    (b"PK", _npz), (b"\x89MCAP", _mcap), (b"SQLite", _sqlite), (MAGIC, _journal), (b"<", _xml), (b"{", _json), (b"[", _json),
    (b"t,", _cells), (b"+", _cells), (b"task=", _cells), (b"", _yaml),
)  # fmt: skip
"""By how a file begins."""
