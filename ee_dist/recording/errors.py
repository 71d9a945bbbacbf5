"""The one error of recordings."""

from __future__ import annotations


class RecordingError(ValueError):
    """A recording that cannot be written or read; one line: what, where, and what would be right."""
