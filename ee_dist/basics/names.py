"""The nearest names to one that does not exist: the end of many messages."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

CUTOFF = 0.4
"""Likeness, from 0 to 1, from which a name is worth proposing."""
MOST = 3
LISTED = 400
"""Characters of a list of names; a file of somebody's may have thousands."""
LONGEST = 100
"""Characters of a name that is looked for: likeness costs the square of them."""


def nearest(name: str, allowed: Iterable[str], cutoff: float = CUTOFF) -> list[str]:
    """Names like it, the most alike first; none where none is near."""
    return difflib.get_close_matches(str(name)[:LONGEST], [str(a) for a in allowed], n=MOST, cutoff=cutoff)


def listed(names: Iterable[str], otherwise: str = "none") -> str:
    """The names with commas, as many as a message bears."""
    every = [_plain(str(n)) for n in names]
    text = ", ".join(every)
    if len(text) <= LISTED:
        return text or otherwise
    whole = text[:LISTED].rpartition(", ")[0]
    if not whole:
        return f"{text[:LISTED]} ..."
    return f"{whole} and {len(every) - whole.count(', ') - 1} more"


def did_you_mean(name: str, allowed: Iterable[str], otherwise: str = "", cutoff: float = CUTOFF) -> str:
    """``did you mean a or b?``; where nothing is near ``otherwise``, or all names."""
    names = [str(a) for a in allowed]
    near = nearest(name, names, cutoff)
    return f"did you mean {listed_or(near)}?" if near else otherwise or f"there are: {listed(names)}"


def listed_or(names: list[str]) -> str:
    """A few names with "or"."""
    return " or ".join(_plain(n) if len(n) <= LONGEST else f"{_plain(n[:LONGEST])}..." for n in names)


def counted(number: int, what: str, many: str = "") -> str:
    """``1 tendon``, ``2 tendons``; ``many`` where that is no plain plural."""
    return f"{number} {what if number == 1 else many or what + 's'}"


def _plain(name: str) -> str:
    """As it is, but for signs that end a line or cannot be seen, which a file's names may have."""
    return name if name.isprintable() else repr(name)[1:-1]
