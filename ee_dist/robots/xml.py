"""XML of strangers: read within bounds, and without entities, which can grow without end or name other files."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from pathlib import Path
from xml.parsers import expat

from ee_dist.robots.model import RobotError
from ee_dist.robots.untrusted import check_file, told_as

LARGEST_BYTES = 50_000_000
DEEPEST = 200
"""Elements within one another: more than any robot has, and few enough for code that follows them."""

YAML = (".yaml", ".yml")


class XmlError(RobotError):
    """A file that is not well-formed XML, or that asks for more than a description of a robot needs; one line."""


def read_xml(path: str | Path, what: str = "a robot") -> tuple[ET.Element, bytes]:
    """The outermost element, and the file's bytes. Raises XmlError: no file, too large, a DTD, too deep, not XML."""
    file = Path(path)
    if file.suffix.lower() in YAML:
        raise XmlError(
            f"{file}: a YAML, where an XML file is asked for; a description of drives is given as robot.drives={file}"
        )
    with told_as(XmlError, file, what):
        if file.stat().st_size > LARGEST_BYTES:
            raise XmlError(f"{file}: {file.stat().st_size / 1e6:.0f} MB; the description of {what} has at most 50")
        check_file(file, LARGEST_BYTES)
        data = file.read_bytes()
    return element_of(file, data), data


def element_of(file: Path, data: bytes) -> ET.Element:
    """The outermost element of what stands, or would stand, in a file. Raises XmlError: too large, a DTD, too deep, not XML."""
    if len(data) > LARGEST_BYTES:
        raise XmlError(f"{file}: makes {len(data) / 1e6:.0f} MB; the description of a robot has at most 50")
    _look(file, data)
    try:
        return ET.fromstring(data)
    except (ET.ParseError, ValueError, LookupError) as error:
        raise XmlError(f"{file}: not well-formed XML: {error}") from None


def _look(file: Path, data: bytes) -> None:
    """Refuse a document type, in which entities are declared, before anything of it is expanded."""
    depth = 0

    def doctype(*_: object) -> None:
        raise XmlError(f"{file}: has a document type (<!DOCTYPE ...>), which may declare entities; take it out")

    def start(*_: object) -> None:
        nonlocal depth
        depth += 1
        if depth > DEEPEST:
            raise XmlError(f"{file}: more than {DEEPEST} elements within one another")

    def end(_: object) -> None:
        nonlocal depth
        depth -= 1

    try:
        parser = expat.ParserCreate()
        parser.StartDoctypeDeclHandler = doctype
        parser.StartElementHandler, parser.EndElementHandler = start, end
        parser.Parse(data, True)
    except (expat.ExpatError, ValueError, LookupError) as error:
        raise XmlError(f"{file}: not well-formed XML: {error}") from None
