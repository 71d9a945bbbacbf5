"""The one error of measurements."""

from __future__ import annotations

from collections.abc import Iterable

from ee_dist.basics.names import did_you_mean
from ee_dist.trials.log import LogError


class MeasurementError(LogError):
    """A measurement that cannot be used; one line: what, where, and what would be right."""


class EmptyColumnError(MeasurementError):
    """A column without a single number."""


class SeveralColumnsError(MeasurementError):
    """A name that several columns have, which says itself which there are: no row of the file is wrong."""


def nearest(name: str, allowed: Iterable[str]) -> str:
    """A hint for a name that does not exist."""
    return did_you_mean(name, allowed)
