"""Where something goes on: the stretches in which an array of yes and no says yes."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray


def runs(yes: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """The first row and the one behind the last of each stretch of True in ``yes`` (T,), in order."""
    edges = np.flatnonzero(np.diff(np.r_[False, yes, False].astype(int))).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
