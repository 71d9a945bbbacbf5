"""Text from a file that somebody else wrote: bounded before it takes memory, and no deeper than anything reads it.

A file may be a device without end, a list nested ten thousand deep, or a few lines of YAML that name one another until
they stand for terabytes. Each is refused with a reason, before more than the bounds below is taken.
"""

from __future__ import annotations

import json
import stat
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import yaml

from ee_dist.basics.plain_yaml import load_yaml

LARGEST = 4 * 2**20
"""Bytes of a description, a model or a mapping; ours have a few thousand."""
DEEPEST = 64
LONGEST_INTEGER = 1000
"""Bits; with a few more it is no floating-point number any more, and arithmetic fails on it."""
MOST = 500_000
"""Values in one file, those counted again that YAML names more than once."""


class UntrustedError(ValueError):
    """What is wrong with a file, without its name: for the reader to put in front."""


@contextmanager
def told_as(kind: type[Exception], file: Path, what: str) -> Iterator[None]:
    """Why the file cannot be read is raised as an error of this kind, in one line that says ``what`` is expected."""
    try:
        yield
    except FileNotFoundError:
        raise kind(f"{file}: no such file; expected {what}") from None
    except UntrustedError as error:
        raise kind(f"{file}: {error}; expected {what}") from None
    except OSError as error:
        raise kind(f"{file}: cannot be read ({error.strerror}); expected {what}") from None


def text_of(path: Path, largest: int = LARGEST) -> str:
    """The text of an ordinary file. Raises UntrustedError, and OSError as ``open`` does."""
    check_file(path, largest)
    with path.open("rb") as file:
        content = file.read(largest + 1)
    if len(content) > largest:
        raise UntrustedError(f"larger than the {largest >> 20} MiB that such a file may have")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        raise UntrustedError("not a text in UTF-8") from None


def check_file(path: Path, largest: int) -> None:
    """Raises UntrustedError for a device, a pipe or a file that is too large, and OSError as ``stat`` does."""
    found = path.stat()
    if stat.S_ISDIR(found.st_mode):
        raise UntrustedError("a folder; expected a file")
    if not stat.S_ISREG(found.st_mode):
        raise UntrustedError("not an ordinary file")
    if found.st_size > largest:
        raise UntrustedError(f"{found.st_size >> 20} MiB; such a file may have {largest >> 20} MiB")


def yaml_of(path: Path, load: Callable[[str], Any] = load_yaml) -> Any:
    """Plain data out of a file of YAML. Raises UntrustedError, and OSError as ``open`` does."""
    return plain_of(text_of(path), load)


def plain_of(text: str, load: Callable[[str], Any] = load_yaml) -> Any:
    """Plain data out of YAML. Raises UntrustedError."""
    try:
        _check_depth(text)
        return bounded(load(text))
    except UntrustedError:
        raise
    except (yaml.YAMLError, ValueError) as error:
        raise UntrustedError(f"not YAML: {' '.join(str(error).split())[:300]}") from None
    except (RecursionError, MemoryError):
        raise UntrustedError("nested too deep") from None


def _check_depth(text: str) -> None:
    """Raises UntrustedError before the parser, whose time grows with the square of the depth, gets deep."""
    depth = 0
    for event in yaml.parse(text, Loader=getattr(yaml, "CSafeLoader", yaml.SafeLoader)):
        if isinstance(event, yaml.CollectionStartEvent):
            depth += 1
        elif isinstance(event, yaml.CollectionEndEvent):
            depth -= 1
        if depth > DEEPEST:
            raise UntrustedError(f"nested deeper than {DEEPEST} levels")


def json_of(text: str | bytes) -> Any:
    """Plain data out of JSON. Raises UntrustedError."""
    try:
        return bounded(json.loads(text))
    except UntrustedError:
        raise
    except (RecursionError, MemoryError):
        raise UntrustedError("nested too deep") from None
    except ValueError as error:
        raise UntrustedError(f"not JSON: {error}") from None


def bounded(data: Any) -> Any:
    """The data, if it is neither too deep nor too much, nor any of its numbers too long. Raises UntrustedError."""
    left, count = [(data, 0)], 0
    while left:
        item, depth = left.pop()
        count += 1
        if count > MOST:
            raise UntrustedError(f"stands for more than {MOST} values")
        if depth > DEEPEST:
            raise UntrustedError(f"nested deeper than {DEEPEST} levels")
        if isinstance(item, dict):
            left += [(v, depth + 1) for v in item.values()]
        elif isinstance(item, (list, tuple, set)):
            left += [(v, depth + 1) for v in item]
        elif isinstance(item, int) and item.bit_length() > LONGEST_INTEGER:
            raise UntrustedError(f"a whole number of some {item.bit_length() * 3 // 10} digits")
    return data
