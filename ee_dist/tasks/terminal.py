"""The terminal that every verb writes to."""

from __future__ import annotations

from rich.console import Console


def terminal(width: int | None = None) -> Console:
    """A console that takes no text for markup: brackets and colons in a user's names stay what they are."""
    return Console(width=width, markup=False, emoji=False)
