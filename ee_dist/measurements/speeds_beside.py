"""Measured speeds beside the change of their positions: another sign, scale or pace, other joints, or a time that stood still."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements import signals
from ee_dist.measurements.suspicious import UNLIKE, between_units
from ee_dist.trials.log import Array

RATIOS = tuple(r**k for r in (180 / np.pi, 1000.0, 30 / np.pi, 2 * np.pi) for k in (1, -1))
"""Between units of speed: degrees and radians, milli and one, turns a minute or a second and radians."""
QUICK, STALLED, FEW_STALLS, MOST_STALLS = 0.3, 4.0, 3, 0.1
"""Share of a joint's higher speeds from which a row tells how long it took, times its own that a row takes before which a logger
stood still, and of how few and of what share of all rows that is told."""
SHORT_S, LONGER_S = 0.04, 0.5
"""Means over which speeds are held against the change of positions."""
PACE, CLEAR, ALIKE = 0.05, 0.95, 1.15
"""Share by which speeds must be off the change of their positions to be told (clocks and encoders are ten times as good);
correlation from which a joint tells it, and the largest ratio between two joints that are off by the same."""
MOST_OFF = 5.0
"""Times that a rate may be off: by more it is a unit (9.5 for turns in a minute, 57 for degrees)."""


def speed_suspicion(name: str, speed: Array, position: Array, step_s: float) -> tuple[str, bool] | None:
    """Whether a measured speed is the derivative of its position, in sign and scale: a sentence, and whether it is certain
    (a ratio between two units) enough to stop."""
    derived = np.gradient(position, step_s)
    a, b = speed - speed.mean(), derived - derived.mean()
    power = float(b @ b)
    if power == 0 or float(a @ a) == 0:
        return None
    correlation = float(a @ b / np.sqrt(power * float(a @ a)))
    slope = float(a @ b / power)
    if correlation < -0.5:
        return (
            f"{name}: runs against the change of its position (correlation {correlation:.2f}): a swapped sign?",
            False,
        )
    if correlation > 0.8 and not 0.5 < slope < 2.0:
        certain = correlation > 0.9 and between_units(slope, RATIOS)
        return f"{name}: is {slope:.3g} times the change of its position: another unit of one of the two?", certain
    return None


def stall_suspicion(speed: Array, position: Array, step_s: float) -> str | None:
    """Whether a logger stood still now and then and its times do not say so: at a few rows positions (T, J) go many times as far
    as speeds say, at all others as far."""
    moving = signals.lively(speed, position)
    if len(speed) < 3 or not moving:
        return None
    way = 0.5 * (speed[1:, moving] + speed[:-1, moving])
    mean = np.abs(way)
    quick = mean > QUICK * np.quantile(mean, 0.95, axis=0)
    gone = np.diff(position[:, moving], axis=0) * np.sign(way)
    # A position that rolls over jumps against the motion: that is no time that went by.
    with_it = gone > 0
    rows = (quick & with_it).any(axis=1)
    if not rows.any():
        return None
    # Time passes for all joints alike, and what goes far tells it best.
    times = np.sum(gone, axis=1, where=with_it)[rows] / (np.sum(mean, axis=1, where=with_it)[rows] * step_s)
    late = times > STALLED
    if late.sum() < FEW_STALLS or late.mean() > MOST_STALLS or not 1 / ALIKE < np.median(times) < ALIKE:
        return None
    missing = float((times[late] - 1).sum()) * step_s
    if missing < PACE * len(times) * step_s:
        return None
    return (
        f"time: at {int(late.sum())} rows positions go {np.median(times[late]):.0f} times as far as the speeds say (median), at "
        f"the others as far: the logger stood still before them, {missing:.3g} s in all, and the times do not say so. Speeds by "
        "these times and forces there are wrong: log the time of each reading, or add what is missing to the times"
    )


def pace_suspicion(speed: Array, position: Array, step_s: float, rate_hz: float) -> str | None:
    """Whether measured speeds (T, J) are at all joints alike another number of times the change of their positions than one: then
    the time or the speeds are off by that. ``rate_hz``: of the readings.

    Noise, rounding and lags take from a correlation what they may add to or take off a ratio, so that joints that are slow or
    coarsely read tell nothing, and what one tells lies between ratio * correlation and ratio / correlation.
    """
    ratios = _pace(speed, position, step_s, SHORT_S)
    if not ratios:
        return None
    # What goes to and fro between two readings is less in the change of a position than in a speed; over longer it is not.
    longer = _pace(speed, position, step_s, LONGER_S)
    if longer is not None and not longer:
        return None
    low, high, ratio = min(ratios.values()), max(ratios.values()), float(np.median([*ratios.values()]))
    joints = f"{len(ratios)} joints ({low:.3g} to {high:.3g})" if len(ratios) > 1 else "the joint"
    return (
        f"speeds: {ratio:.3g} times the change of the positions at {joints}: either the time is off (rows would come at "
        f"{rate_hz * ratio:.4g} Hz, not {rate_hz:.4g}), or the speeds are scaled by that"
    )


def scales_suspicion(joints: Sequence[str], speed: Array, position: Array, step_s: float) -> str | None:
    """Whether measured speeds (T, J) are at some of the ``joints`` surely another number of times the change of their positions
    than one, and at others not, or by another number: a scale of these columns."""
    both = [_fits(speed, position, step_s, over_s) for over_s in (SHORT_S, LONGER_S)]
    known = {k: both[0][k][0] for k in both[0] if k in both[1]}
    off = [k for k in known if all(_off(*of[k]) for of in both)]
    if not off:
        return None
    groups: list[list[int]] = []
    for k in sorted(off, key=lambda k: known[k]):
        if groups and known[k] < ALIKE * known[groups[-1][0]]:
            groups[-1].append(k)
        else:
            groups.append([k])
    told = [f"{float(np.median([known[k] for k in g])):.3g} times at {listed([joints[k] for k in g])}" for g in groups]
    right = [joints[k] for k in known if k not in off]
    told += [f"as much at {listed(right)}"] if right else []
    return (
        f"speeds are, of the change of the positions, {'; '.join(told)}: the speeds of these columns, or their positions, are "
        "scaled by that, and commands of the same unit with them"
    )


def exchanged_suspicions(
    names: Sequence[str], joints: Sequence[str], speed: Array, position: Array, step_s: float
) -> list[str]:
    """Lines on speeds (T, J), called ``names``, that are the change of the position (T, J) of another of the ``joints`` and not
    of their own."""
    changes, found = signals.change(position, step_s), []
    for k in signals.lively(speed, position):
        fits = [abs(signals.relation(changes[:, [j]], speed[:, [k]]).correlation) for j in range(len(joints))]
        other = int(np.argmax(fits))
        if fits[k] < UNLIKE and fits[other] > CLEAR:
            found.append(
                f"{names[k]}: is the change of the position of {joints[other]}, not of {joints[k]}: exchanged columns, of the "
                "positions or of the speeds?"
            )
    return found


def _off(ratio: float, correlation: float) -> bool:
    return ratio * correlation > 1 + PACE or ratio / correlation < 1 / (1 + PACE)


def _pace(speed: Array, position: Array, step_s: float, over_s: float) -> dict[int, float] | None:
    """The times that speeds are the change of positions, by joint, both smoothed over ``over_s`` twice, where these are alike and
    surely not one; empty where they are not, None where that cannot be told."""
    moving, fits = signals.lively(speed, position), _fits(speed, position, step_s, over_s)
    if not fits or 2 * len(fits) <= len(moving):
        return None
    ratios = {k: ratio for k, (ratio, _) in fits.items()}
    least, most = min(x * r for x, r in fits.values()), max(x / r for x, r in fits.values())
    low, high, ratio = min(ratios.values()), max(ratios.values()), float(np.median([*ratios.values()]))
    surely = least > 1 + PACE or most < 1 / (1 + PACE)
    return ratios if surely and high / low <= ALIKE and 1 / MOST_OFF < ratio < MOST_OFF else {}


def _fits(speed: Array, position: Array, step_s: float, over_s: float) -> dict[int, tuple[float, float]]:
    """The times that a speed is the change of its position, and the correlation of the two, both smoothed over ``over_s`` twice,
    by the joints that tell it."""
    width = max(3, round(over_s / step_s))
    if len(speed) < max(3, 2 * width):
        return {}
    # Differences over two rows are means by Simpson's rule of what lies between; both are smoothed alike then.
    both = (speed[:-2] + 4 * speed[1:-1] + speed[2:]) / 6, (position[2:] - position[:-2]) / (2 * step_s)
    measured, change = (signals.smooth(signals.smooth(x, width), width) for x in both)
    found = {}
    for k in signals.lively(speed, position):
        if (r := signals.relation(change[:, [k]], measured[:, [k]]).correlation) > CLEAR:
            found[k] = (float(np.std(measured[:, k]) / np.std(change[:, k])), r)
    return found
