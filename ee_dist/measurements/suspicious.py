"""What looks wrong in a channel, said before anybody fits a model to it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.quoted import quoted
from ee_dist.basics.runs import runs
from ee_dist.measurements import signals
from ee_dist.measurements.report import CLIPPED, STUCK_AT
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
SLOW, CREEPING = 0.1, 1.5
"""Share of the steps of quick rows, and times the step of its encoder, up to which a joint stands or creeps."""
MANY, OFTEN, FEW_SPIKES = 10, 0.98, 10
"""Different numbers that a goal which moves has, share of all steps that are usual, and rows at which it may be elsewhere by
accident;"""
SPIKE, SPIKE_SHARE, SAME_AGAIN = 8.0, 0.2, 0.25
"""how far that is, times a usual step and as a share of where it usually is, and by what share of it the rows around it may
differ."""
LEAST_ROUND = 0.005
"""rad (m) that the round of an encoder has at least: of a motor's behind a gear of a thousand."""
ROLLS, MOST_ROLLS = 0.85, 0.1
"""Share of where a position is by which it jumps as it begins anew, and at what share of all rows at most."""
BRIEFEST_S = 0.1
"""What a record of a motion lasts at least."""
CLOCKS, MOST_APART = 1.03, 15.0
"""Times as long as another that a clock lasts from which one of the two is wrong, and up to which they tell of the same thing."""


def suspicions(name: str, values: Array, turn: float = TURN, asked: bool = False) -> list[str]:
    """Sentences about one series (T,): stuck, clipped, a wrapped counter or angle; ``turn`` is a whole turn in its numbers.
    ``asked``: a command, which may well rest at its largest value, however it came there, and is held at its last goal to the end
    as long as anybody likes, as that of a step response."""
    found: list[str] = []
    spread = float(np.ptp(values))
    if spread == 0:
        return [f"{name}{STUCK_AT}{values[0]:.6g} for the whole record"]
    run, start = _longest_run(values)
    if run > STUCK_SHARE * len(values) and not (asked and start + run == len(values)):
        found.append(f"{name}: does not change for {run} rows of {len(values)}, from row {start}")
    for edge, what in () if asked else ((values.max(), "highest"), (values.min(), "lowest")):
        at = values == edge
        share = float(np.mean(at))
        if share > CLIPPED_SHARE and len(np.unique(values)) > 20 and _cut_off(values, at, spread):
            found.append(f"{name}{CLIPPED}{100 * share:.0f} % of the rows are at the {what} value, {edge:.6g}")
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


def spike_suspicion(name: str, commands: Array) -> str | None:
    """Whether a goal (T,) is somewhere else for a single row, and back in the next: what is no step of any motion."""
    steps = np.diff(commands)
    if len(steps) < 20 or len(np.unique(commands)) < MANY:
        return None
    there, back = steps[:-1], steps[1:]
    usual = float(np.quantile(np.abs(steps), OFTEN))
    low, high = np.quantile(commands, [1 - OFTEN, OFTEN])
    far = np.minimum(np.abs(there), np.abs(back)) > max(SPIKE * usual, SPIKE_SHARE * float(high - low))
    rows = np.flatnonzero(far & (np.abs(there + back) < SAME_AGAIN * np.abs(there))) + 1
    if not 0 < len(rows) <= FEW_SPIKES:
        return None
    first = int(rows[0])
    return (
        f"{name}: elsewhere for a single row at {len(rows)} of {len(commands)} rows (row {first}: {commands[first]:.4g} between "
        f"{commands[first - 1]:.4g} and {commands[first + 1]:.4g}): was that sent, or only written? drop the row if not"
    )


def time_suspicion(median_s: float, length_s: float, declared: str) -> str | None:
    """Whether the time column looks as if its unit were another one, in which it is a record that somebody would keep."""
    if median_s >= 0.5 and length_s >= 1e3 * BRIEFEST_S:
        return (
            f"time: a row every {median_s:g} s and {length_s:g} s in all: is the column in ms rather than {declared!r}?"
        )
    if median_s < 2e-6:
        return (
            f"time: a row every {median_s:g} s and {length_s:g} s in all: is the column in s rather than {declared!r}?"
        )
    return None


def clock_suspicion(name: str, length_s: float, others: Mapping[str, float]) -> str | None:
    """Whether another column that is called a time and rises with these rows lasts longer or less long, in whatever unit it is:
    ``others`` has by column how far it goes."""
    for other, goes in others.items():
        ratio = min((length_s / (goes * unit) for unit in (1.0, 1e-3, 1e-6, 1e-9)), key=lambda r: abs(np.log(r)))
        if CLOCKS < max(ratio, 1 / ratio) < MOST_APART:
            return (
                f"time: {quoted(name)} lasts {length_s:.4g} s, {quoted(other)} of the same rows {length_s / ratio:.4g} s "
                f"({1 / ratio:.3g} times as long): which of them is right? speeds and delays go by it"
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


def repeat_suspicion(readings: Array, moving: Array | None = None) -> str | None:
    """Whether now and then a row (of T, S) of readings that move before and after is the one before, in each of two columns or
    more: it was written before anything new was read. ``moving``: positions (T, J) of joints that move far, by which it is told
    that they move; a robot that stands, or creeps from one step of its encoder to the next, repeats its readings too."""
    if readings.shape[1] < 2 or len(readings) < 10:
        return None
    same = np.all(np.diff(readings, axis=0) == 0, axis=1)
    # At rest, and where sensors are read seldom, rows repeat for longer, or nearly always.
    alone = same[1:-1] & ~same[:-2] & ~same[2:]
    if moving is not None:
        steps = np.abs(np.diff(moving, axis=0))
        finest = np.min(steps, axis=0, initial=np.inf, where=steps > 0)
        least = np.maximum(SLOW * np.nanquantile(steps, OFTEN, axis=0), CREEPING * finest)
        alone &= (np.minimum(steps[:-2], steps[2:]) > least).any(axis=1)
    share = float(alone.mean())
    if not STALE < share < SELDOM:
        return None
    return (
        f"{100 * share:.0f} % of the rows repeat the row before in all {readings.shape[1]} columns of sensors, while these move: "
        "they were written before anything new was read, and count as readings all the same; drop them from the file if you can"
    )


def rolled_over(name: str, numbers: Array, size: float = 1.0) -> str | None:
    """Whether an encoder begins anew now and then: a sentence. ``size``: of one of its numbers, rad (m). A joint that stands and
    trembles has rounds of nothing."""
    found = round_of(numbers)
    if found is None or found[1] * size < LEAST_ROUND:
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
    if not 0 < len(jumps) <= MOST_ROLLS * len(steps) or usual > 0.2 * spread:
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
        certain = between_units(ahead.slope, POSITION_RATIOS)
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


def between_units(ratio: float, ratios: Sequence[float]) -> bool:
    """Whether a ratio is one between two units."""
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
    entered = 0
    for first, last in runs(at):
        before = first - (last - first)
        if last - first >= 5 and before >= 0 and abs(values[before] - values[first]) > CLIPPED_DROP * spread:
            entered += 1
    return entered >= 2
