"""YAML and JSON of strangers as plain data: nothing is executed, and aliases do not grow without end."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import yaml

from ee_dist.robots.model import RobotError

LARGEST_BYTES = 20_000_000
LARGEST_NODES = 1_000_000
"""Values that a file may stand for, aliases written out."""


def read_text(path: str | Path, what: str) -> Any:
    """What a ``.json`` or else YAML file holds. Raises RobotError in one line: no file, not what it says, too large."""
    file = Path(path)
    try:
        if file.stat().st_size > LARGEST_BYTES:
            raise RobotError(f"{file}: {file.stat().st_size / 1e6:.0f} MB; {what} has at most 20")
        text = file.read_text(encoding="utf-8")
    except FileNotFoundError:
        raise RobotError(f"{file}: no such file; expected {what}") from None
    except IsADirectoryError:
        raise RobotError(f"{file}: a folder; expected {what}") from None
    except UnicodeError as error:
        raise RobotError(f"{file}: not YAML: {error}") from None
    except OSError as error:
        raise RobotError(f"{file}: cannot be read ({error.strerror}); expected {what}") from None
    if file.suffix.lower() == ".json":
        try:
            return json.loads(text)
        except (ValueError, RecursionError) as error:
            raise RobotError(f"{file}: not JSON: {error}") from None
    try:
        node = yaml.compose(text, Loader=yaml.SafeLoader)
        if node is not None and _size(node, {}) > LARGEST_NODES:
            raise RobotError(f"{file}: its aliases stand for more than {LARGEST_NODES} values; write out what is meant")
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError) as error:
        if isinstance(error, RobotError):
            raise
        raise RobotError(f"{file}: not YAML: {' '.join(str(error).split())}") from None
    except RecursionError:
        raise RobotError(f"{file}: not YAML: its values are nested without end") from None


def _size(node: yaml.Node, known: dict[int, int]) -> int:
    """How many values a node stands for. A node within itself has no end, which is a RecursionError."""
    if id(node) in known:
        if known[id(node)] == 0:
            raise RecursionError
        return known[id(node)]
    known[id(node)] = 0
    if isinstance(node, yaml.MappingNode):
        total = 1 + sum(_size(k, known) + _size(v, known) for k, v in node.value)
    elif isinstance(node, yaml.SequenceNode):
        total = 1 + sum(_size(v, known) for v in node.value)
    else:
        total = 1
    known[id(node)] = total
    return total
