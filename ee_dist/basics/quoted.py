"""A value out of somebody's file, as a message shows it: never longer than anybody reads."""

from __future__ import annotations

import reprlib
from typing import Any

LONGEST = 80
"""Characters of a value in a message; its beginning and its end are what people recognise it by."""

_short = reprlib.Repr()
_short.maxlevel = 3
_short.maxstring = _short.maxother = _short.maxlong = LONGEST


def quoted(value: Any) -> str:
    """Like ``repr``, with the middle left out of what is long; takes no longer for a value of megabytes."""
    return one_line(_short.repr(value))


def one_line(text: str, longest: int = LONGEST) -> str:
    """A text that may hold line breaks, as one short line."""
    return short(" ".join(text.split()), longest)


def short(text: str, longest: int = 300) -> str:
    """A text with the middle left out of what is long."""
    half = (longest - 3) // 2
    return text if len(text) <= longest else f"{text[:half]}...{text[-half:]}"
