"""The terminal that every verb writes to."""

from __future__ import annotations

import os
import sys

from rich.console import Console

WIDTH = "COLUMNS"


def terminal(width: int | None = None) -> Console:
    """A console that takes no text for markup: brackets and colons in a user's names stay what they are.

    No wider than the window that it writes to, whatever the environment says: a shell may have exported the width that it had
    before. What is too wide wraps, and of a live line one more row would stay at each turn of its wheel.
    """
    console = Console(width=width, markup=False, emoji=False)
    window = _window()
    if width is not None or not window or console.width <= window:
        return console
    # Left out and not corrected: without it the console follows the window when that is made narrower or wider.
    told = {name: value for name, value in os.environ.items() if name != WIDTH}
    return Console(markup=False, emoji=False, _environ=told)


def _window() -> int:
    """Columns of the window that standard output is; 0 where it is none, or does not tell."""
    try:
        return os.get_terminal_size(sys.stdout.fileno()).columns
    except (OSError, ValueError, AttributeError):
        return 0
