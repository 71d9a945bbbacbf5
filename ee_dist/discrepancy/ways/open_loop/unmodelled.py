"""What a calibrated model is known to leave on an untouched robot: it widens the scale of each channel in each trial.

No model is perfect, and where it is wrong depends on what the robot does: a model that follows the legs in the air may
lose them in a gait. What an untouched robot shows beyond noise in a trial says nothing about what is wrong with another
robot in the same trial.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from ee_dist.trials.log import Array

Unmodelled = Mapping[str, Array]
"""By name of the trial: (2, S) standard deviations of block means, in the units of the channels, and of the logarithm of
the roughness of windows."""
VALUES = ("deviation", "roughness")


def of_trial(unmodelled: Unmodelled, name: str, channels: int) -> Array:
    """(2, S) of a trial; for one that the calibration did not see, the largest of those it saw."""
    if name in unmodelled:
        return unmodelled[name]
    return np.max([np.zeros((2, channels)), *unmodelled.values()], axis=0)


def to_entries(unmodelled: Unmodelled, names: Sequence[str], units: Sequence[str]) -> list[dict[str, object]]:
    """Plain data for a file."""
    return [
        {
            "trial": trial,
            "channels": {
                n: {"deviation": float(v), "roughness": float(r), "unit": u}
                for n, v, r, u in zip(names, *values, units, strict=True)
            },
        }
        for trial, values in unmodelled.items()
    ]


def from_entries(
    entries: Sequence[Mapping[str, Mapping[str, Mapping[str, float]]]], names: Sequence[str]
) -> Unmodelled:
    """The inverse. Raises KeyError, TypeError or ValueError for data of another shape."""
    return {
        str(e["trial"]): np.array([[float(e["channels"].get(n, {}).get(v, 0.0)) for n in names] for v in VALUES])
        for e in entries
    }
