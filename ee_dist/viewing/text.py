"""Texts in a scene, in signs that the viewer has."""

from __future__ import annotations

import rerun as rr

_KNOWN = ((0x20, 0x52F), (0x2010, 0x2044), (0x2190, 0x2193), (0x2260, 0x2265), (0x25A0, 0x25A1), (0x25CF, 0x25CF))
"""Latin, Greek, Cyrillic, and a few signs. Rerun 0.41 stops with a panic at one that its fonts lack (seen without a screen)."""


def readable(text: str) -> str:
    """The text with a question mark in place of each sign that would end the viewer, such as of a user's file name."""
    return "".join(c if c == "\n" or any(low <= ord(c) <= high for low, high in _KNOWN) else "?" for c in text)


def document(text: str) -> rr.TextDocument:
    """A Markdown document."""
    return rr.TextDocument(readable(text), media_type=rr.MediaType.MARKDOWN)
