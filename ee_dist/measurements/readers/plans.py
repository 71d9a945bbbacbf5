"""Trajectories that are sent ahead: what was asked for at last, where one replaces the rest of another."""

from __future__ import annotations

from typing import Any

import numpy as np

from ee_dist.trials.log import Array


def carried_out(start_ns: Any, at_ns: Any, fields: dict[str, Array]) -> tuple[Any, dict[str, Array], int]:
    """The times (K,) in ns and the fields of the points that were not replaced, and how many were. ``start_ns`` (T,) is when the
    trajectory of each point begins, ``at_ns`` (T,) when the point is to be reached; both in ns.

    A trajectory replaces what is left of the one before. From where that was when the new one began, and not from its last
    point, the way goes to the first new point.
    """
    widths = {n: v.reshape(len(v), -1).shape[1] for n, v in fields.items()}
    values = np.concatenate([v.reshape(len(v), -1) for v in fields.values()], axis=1)
    times: list[int] = []
    points: list[Array] = []
    replaced = 0
    order = np.lexsort((at_ns, start_ns))
    for k, row in enumerate(order):
        start, at = int(start_ns[row]), int(at_ns[row])
        if not k or start != int(start_ns[order[k - 1]]):
            ahead: tuple[int, Array] | None = None
            while times and times[-1] >= start:
                ahead = times.pop(), points.pop()
                replaced += 1
            if times and at > start:
                points.append(_between(times[-1], points[-1], ahead, start))
                times.append(start)
        times.append(at)
        points.append(values[row])
    cuts = np.cumsum(list(widths.values()))[:-1]
    parts = np.split(np.stack(points), cuts, axis=1)
    shaped = {n: p.reshape(len(p), *fields[n].shape[1:]) for n, p in zip(fields, parts, strict=True)}
    return np.array(times, dtype=np.int64), shaped, replaced


def _between(before_ns: int, before: Array, ahead: tuple[int, Array] | None, at_ns: int) -> Array:
    """On the straight line to the point ahead; where there is none, the last point holds."""
    if ahead is None or ahead[0] <= before_ns:
        return before
    share = (at_ns - before_ns) / (ahead[0] - before_ns)
    return np.asarray(before + share * (ahead[1] - before))
