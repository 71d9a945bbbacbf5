"""The one error of measurements."""

from __future__ import annotations

import difflib
from collections.abc import Iterable

from ee_dist.trials.log import LogError


class MeasurementError(LogError):
    """A measurement that cannot be used; one line: what, where, and what would be right."""


def nearest(name: str, allowed: Iterable[str]) -> str:
    """A hint for a name that does not exist."""
    names = [str(a) for a in allowed]
    near = difflib.get_close_matches(name, names, n=3, cutoff=0.4)
    return f"did you mean {' or '.join(near)}?" if near else f"there are: {', '.join(names) or 'none'}"
