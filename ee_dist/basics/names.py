"""The nearest names to one that does not exist: the end of many messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

CUTOFF = 0.4
"""Likeness, from 0 to 1, from which a name is worth proposing."""
MOST = 3


def nearest(name: str, allowed: Iterable[str], cutoff: float = CUTOFF) -> list[str]:
    """Names like it, the most alike first; none where none is near."""
    return difflib.get_close_matches(str(name), [str(a) for a in allowed], n=MOST, cutoff=cutoff)


def did_you_mean(name: str, allowed: Iterable[str], otherwise: str = "", cutoff: float = CUTOFF) -> str:
    """``did you mean a or b?``; where nothing is near ``otherwise``, or all names."""
    names = [str(a) for a in allowed]
    near = nearest(name, names, cutoff)
    return f"did you mean {' or '.join(near)}?" if near else otherwise or f"there are: {', '.join(names) or 'none'}"
