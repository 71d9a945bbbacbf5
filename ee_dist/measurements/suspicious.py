"""What looks wrong in a channel, said before anybody fits a model to it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.names import listed
from ee_dist.measurements import signals
from ee_dist.measurements.report import STUCK_AT
from ee_dist.measurements.units import TURN, TURNS_ON, UNITS
from ee_dist.trials.log import Array

CLIPPED_SHARE = 0.02
CLIPPED_DROP = 0.15
STUCK_SHARE = 0.5
COUNTERS = (8, 10, 12, 14, 16, 32)
JOINT = "the joint"
FAR, STILL, LIVELY = 3.0, 0.03, 0.15
"""Positions beyond this many times the joint's reach cannot be; a span below the second share of it is suspiciously
small, where in another unit it would be above the third."""
RATIOS = tuple(r**k for r in (180 / np.pi, 1000.0, 30 / np.pi, 2 * np.pi) for k in (1, -1))
"""Between units of speed: degrees and radians, milli and one, turns a minute or a second and radians."""

POSITION_RATIOS = tuple(r**k for r in (180 / np.pi, 1000.0) for k in (1, -1))
"""Between units of position that are taken for one another: degrees and radians, milli and one."""
AGAINST = 0.7
"""Correlation from which torques run against what a motion needs, or go with it."""
UNLIKE = 0.4
"""Correlation below which they go with it as chance has it."""
OTHER_UNIT, OTHER_SIZE = 4.0, 20.0
"""A soft drive goes only part of the way to its command, and a model may be off by a lot: beyond these it is another unit."""

QUICK_S, TOGETHER = 0.25, 0.8
"""How late a joint may come, s, that is beyond its drive's bandwidth and not the other way round; correlation of commands and
positions of the same time from which it is within."""

ROUNDED = 0.15
"""Of a step that is large, by how much a round may be off the plain number that it is taken for."""
STALE, SELDOM = 0.03, 0.45
"""Share of rows that repeat the one before by themselves from which that is told, and up to which it is no slower rate."""
ROLLS = 0.85
"""Share of where a position is by which it jumps as it begins anew."""
QUICK, STALLED, FEW_STALLS, MOST_STALLS = 0.3, 4.0, 3, 0.1
"""Share of a joint's higher speeds from which a row tells how long it took, times its own that a row takes before which a logger
stood still, and of how few and of what share of all rows that is told."""
SHORT_S, LONGER_S = 0.04, 0.5
"""Means over which speeds are held against the change of positions."""
PACE, CLEAR, ALIKE = 0.05, 0.95, 1.15
"""Share by which speeds must be off the change of their positions to be told (clocks and encoders are ten times as good);
correlation from which a joint tells it, and the largest ratio between two joints that are off by the same."""


def suspicions(name: str, values: Array, turn: float = TURN) -> list[str]:
    """Sentences about one series (T,): stuck, clipped, a wrapped counter or angle; ``turn`` is a whole turn in its numbers."""
    found: list[str] = []
    spread = float(np.ptp(values))
    if spread == 0:
        return [f"{name}{STUCK_AT}{values[0]:.6g} for the whole record"]
    run, start = _longest_run(values)
    if run > STUCK_SHARE * len(values):
        found.append(f"{name}: does not change for {run} rows of {len(values)}, from row {start}")
    for edge, what in ((values.max(), "highest"), (values.min(), "lowest")):
        at = values == edge
        share = float(np.mean(at))
        if share > CLIPPED_SHARE and len(np.unique(values)) > 20 and _cut_off(values, at, spread):
            found.append(f"{name}: clipped? {100 * share:.0f} % of the rows are at the {what} value, {edge:.6g}")
    jump = float(np.max(np.abs(np.diff(values))))
    for bits in COUNTERS:
        size = float(2**bits)
        whole = bool(np.all(values == np.round(values)))
        if whole and values.min() >= 0 and values.max() < size and jump > 0.9 * size:
            found.append(
                f"{name}: jumps by {jump:.0f}, nearly 2^{bits}: a wrapped counter? set 'signed_bits: {bits}' if it is signed"
            )
            break
    if not any("counter" in f for f in found) and 0.9 * turn < jump < 1.1 * turn and spread < 1.2 * turn:
        found.append(f"{name}: jumps by a whole turn: an angle that wraps; set 'unwrap: true'")
    return found


def time_suspicion(median_s: float, length_s: float, declared: str) -> str | None:
    """Whether the time column looks as if its unit were another one."""
    if median_s >= 0.5:
        return (
            f"time: a row every {median_s:g} s and {length_s:g} s in all: is the column in ms rather than {declared!r}?"
        )
    if median_s < 2e-6:
        return (
            f"time: a row every {median_s:g} s and {length_s:g} s in all: is the column in s rather than {declared!r}?"
        )
    return None


def unit_suspicion(
    name: str,
    values: Array,
    low: float,
    high: float,
    unit: str,
    declared: str = "",
    far: float = FAR,
    whose: str = JOINT,
) -> tuple[str, bool] | None:
    """Whether a joint position was taken for another unit than it is in (degrees for radians, millimetres for metres): a
    sentence, and whether it is certain enough to stop. ``values`` (T,) are in ``unit``; they were ``declared`` to be in
    another. ``far``: times its reach that it cannot be; ``whose`` reach that is, of a joint or of what may hardly move.
    """
    reach = max(abs(low), abs(high))
    if not (np.isfinite(reach) and reach > 0):
        return None
    seen = float(np.max(np.abs(values)))
    kind = UNITS[unit][0]
    size = UNITS.get(declared, UNITS[unit])[1]
    fits = {
        u: seen * s / size
        for u, (k, s) in UNITS.items()
        if k == kind and u not in (declared or unit, "turn", "in", "cm")
    }
    if seen > far * reach:
        least = LIVELY * reach if whose == JOINT else 0.0
        likely = [u for u, s in fits.items() if least <= s <= 1.2 * reach]
        cure = f": say unit: {' or '.join(likely)}" if likely else ""
        return (
            f"{name}: reaches {seen:.4g} {unit}, {whose} only {reach:.4g}; not in {declared or unit!r}?{cure}",
            True,
        )
    if declared and declared != unit and hardly_moves(values, low, high, unit):
        likely = [u for u, s in fits.items() if LIVELY * reach <= s <= 1.2 * reach]
        if likely:
            return (
                f"{name}: moves by {np.ptp(values):.2g} {unit} if it is in {declared!r}, though the joint reaches "
                f"{reach:.3g}: say unit: {' or '.join(likely)}"
            ), True
    return None


def hardly_moves(values: Array, low: float, high: float, unit: str) -> bool:
    """Whether a joint that ends there moves by next to nothing of its way. One without an end reaches far on paper, and yet moves
    by a turn or two."""
    reach = max(abs(low), abs(high))
    return float(np.ptp(values)) < STILL * (min(reach, TURNS_ON) if UNITS[unit][0] == "angle" else reach)


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
        certain = correlation > 0.9 and _between_units(slope, RATIOS)
        return f"{name}: is {slope:.3g} times the change of its position: another unit of one of the two?", certain
    return None


def repeat_suspicion(readings: Array) -> str | None:
    """Whether now and then a row (of T, S) of readings that move before and after is the one before, in each of two columns or
    more: it was written before anything new was read."""
    if readings.shape[1] < 2 or len(readings) < 10:
        return None
    same = np.all(np.diff(readings, axis=0) == 0, axis=1)
    # At rest, and where sensors are read seldom, rows repeat for longer, or nearly always.
    alone = same[1:-1] & ~same[:-2] & ~same[2:]
    share = float(alone.mean())
    if not STALE < share < SELDOM:
        return None
    return (
        f"{100 * share:.0f} % of the rows repeat the row before in all {readings.shape[1]} columns of sensors, while these move: "
        "they were written before anything new was read, and count as readings all the same; drop them from the file if you can"
    )


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
    with np.errstate(divide="ignore", invalid="ignore"):
        # A position that rolls over jumps against the motion: that is no time that went by.
        ratio = np.where(quick & (gone > 0), gone / (mean * step_s), np.nan)
    rows = np.isfinite(ratio).any(axis=1)
    if not rows.any():
        return None
    times = np.nanmedian(ratio[rows], axis=1)
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


def rolled_over(name: str, numbers: Array) -> str | None:
    """Whether an encoder begins anew now and then: a sentence."""
    found = round_of(numbers)
    if found is None:
        return None
    rows, jump, size = found
    return (
        f"{name}: jumps by {jump:.4g} at {rows} rows, from one end to the other against the motion: an encoder that begins anew; "
        f"set 'rolls_over: {size:g}', the numbers of one round"
    )


def round_of(numbers: Array) -> tuple[int, float, float] | None:
    """Of readings (T,) that jump now and then by one and the same amount, from one end of where they are to the other and against
    the motion: at how many rows, by how much, and the numbers of one round."""
    steps, spread = np.diff(numbers), float(np.ptp(numbers))
    jumps = np.flatnonzero(np.abs(steps) > ROLLS * spread)
    usual = float(np.quantile(np.abs(steps), 0.9)) if len(steps) else 0.0
    if not 0 < len(jumps) <= MOST_STALLS * len(steps) or usual > 0.2 * spread:
        return None
    sizes, rounds, against = np.abs(steps[jumps]), [], []
    for k in jumps:
        beside = [steps[n] for n in (k - 1, k + 1) if 0 <= n < len(steps) and n not in jumps]
        against += [np.sign(steps[k]) == -np.sign(step) for step in beside]
        rounds += [abs(steps[k]) + float(np.mean(np.abs(beside)))] if beside else []
    if not against or np.mean(against) < 0.9 or float(np.ptp(sizes)) > 4 * usual:
        return None
    size = float(np.median(rounds))
    plain = (float(f"{size:.{digits}g}") for digits in range(1, 6))
    return len(jumps), float(np.median(sizes)), next((p for p in plain if abs(p - size) < ROUNDED * usual), size)


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
    return ratios if surely and high / low <= ALIKE and 0.5 < ratio < 2 else {}


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


def command_suspicion(name: str, command: Array, position: Array, step_s: float) -> tuple[str, bool] | None:
    """Whether a joint runs away from its commands, or they are in another unit than its position: a sentence, and whether it
    is certain (a ratio between two units) enough to stop. Beyond the bandwidth of its drive a joint in order comes half a period
    late, and goes a small part of the way."""
    a, b = command - command.mean(), position - position.mean()
    size = float(np.sqrt((a @ a) * (b @ b)))
    at_once = float(a @ b) / size if size > 0 else 0.0
    ahead = signals.lead(command[:, None], position[:, None], step_s)
    late = 0.0 < ahead.lead_s <= QUICK_S and ahead.correlation > -at_once
    if at_once < -0.5 and not late:
        return f"{name}: moves against its command (correlation {at_once:.2f}): a swapped sign?", False
    if ahead.correlation > 0.9 and not 1 / OTHER_UNIT < ahead.slope < OTHER_UNIT:
        note = f"{name}: its commands are {ahead.slope:.3g} times its positions: another unit of one of the two?"
        certain = _between_units(ahead.slope, POSITION_RATIOS)
        return (note, certain) if certain or at_once > TOGETHER else None
    return None


def torque_suspicion(name: str, beside: signals.Relation, unit: str) -> tuple[str, bool] | None:
    """Whether a torque or force in ``unit`` is one, by how it goes with what the motion needs: a sentence, and whether it is
    certain (a thousand times too much or too little) enough to stop. A model may be off by a lot."""
    size = abs(beside.slope)
    if runs_against(beside):
        return (
            f"{name}: runs against what the motion needs (correlation {beside.correlation:.2f}): a swapped sign? "
            "set 'sign: -1' wherever the column is named, that of the torque or that of the joint's position"
        ), False
    if abs(beside.correlation) > 0.9 and not 1 / OTHER_SIZE < size < OTHER_SIZE:
        certain = any(0.5 < size / r < 2 for r in (1e3, 1e-3))
        cure = f"say unit: m{unit}" if certain and size > 1 else f"another unit than {unit}"
        return (
            f"{name}: is {size:.3g} times what the motion needs by the model: {cure}, or masses that are off?",
            certain,
        )
    return None


def unlike_suspicion(names: Sequence[str], found: Sequence[signals.Relation]) -> str | None:
    """Whether the torques of two joints or more go with what the motion needs at none of them."""
    if not fit_nowhere(found):
        return None
    best = max(range(len(found)), key=lambda k: abs(found[k].correlation))
    return (
        f"torques: at no joint do they go with what the motion needs by this model (best at {names[best]}, correlation "
        f"{found[best].correlation:.2f}): all friction, or is the base bolted on by another side than described, or do joints "
        "turn the other way, or have each other's columns? explain asks for each of these"
    )


def fit_nowhere(found: Sequence[signals.Relation]) -> bool:
    """Whether torques of two joints or more go with what the motion needs at none of them."""
    return len(found) > 1 and max(abs(r.correlation) for r in found) < UNLIKE


def runs_against(beside: signals.Relation) -> bool:
    """Whether a torque goes against what the motion needs, by about as much."""
    return beside.correlation < -AGAINST and 1 / OTHER_UNIT < abs(beside.slope) < OTHER_UNIT


def torques_suspicion(names: Sequence[str], found: Sequence[signals.Relation]) -> str | None:
    """Whether more torques of a robot than run clearly against what the motion needs are likely to have the other sign:
    where several do, and none goes clearly with it. ``names``: of all joints, ``found``: how theirs goes with that."""
    clear = [k for k, r in enumerate(found) if r.correlation < -AGAINST]
    others = [n for n, r in zip(names, found, strict=True) if -AGAINST <= r.correlation < 0]
    if len(clear) < 2 or not others or max(r.correlation for r in found) > AGAINST:
        return None
    return (
        f"torques: {len(clear)} run against what the motion needs, and none goes with it: likely those of "
        f"{', '.join(others)} too, of which the motion tells less"
    )


def _between_units(ratio: float, ratios: Sequence[float]) -> bool:
    return any(abs(ratio / r - 1) < 0.1 for r in ratios)


def _longest_run(values: Array) -> tuple[int, int]:
    """Length and start of the longest stretch of equal values."""
    edges = np.flatnonzero(np.r_[True, np.diff(values) != 0, True])
    lengths = np.diff(edges)
    k = int(np.argmax(lengths))
    return int(lengths[k]), int(edges[k])


def _cut_off(values: Array, at: NDArray[np.bool_], spread: float) -> bool:
    """Whether two or more stretches at the edge are entered at speed. A smooth peak nears its top slowly: as long before
    a stretch as it lasts, it is close by; a signal that is cut off is still far away."""
    edges = np.flatnonzero(np.diff(np.r_[False, at, False].astype(int)))
    entered = 0
    for first, last in zip(edges[::2], edges[1::2], strict=True):
        before = first - (last - first)
        if last - first >= 5 and before >= 0 and abs(values[before] - values[first]) > CLIPPED_DROP * spread:
            entered += 1
    return entered >= 2
