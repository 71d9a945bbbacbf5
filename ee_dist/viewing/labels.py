"""Labels of charts, whoever draws them."""

from __future__ import annotations

from textwrap import wrap


def wrapped(name: str, width: int = 30) -> str:
    """A label of an axis in lines of some characters."""
    return "<br>".join(wrap(name, width))
