"""What compare has to say."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.basics.names import counted
from ee_dist.discrepancy.accounts.account import (
    CONTENT,
    Account,
    advised,
    beside_floor,
    curves_of,
    error_name,
    left_text,
    slower,
)
from ee_dist.discrepancy.assumed import assumed_text
from ee_dist.discrepancy.at_limit import limit_lines
from ee_dist.discrepancy.compare import Comparison
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.problem import TIMES_NOISE, Problem
from ee_dist.discrepancy.words import plain

PARTS = "Measurement and prediction first differ clearly, three values in a row far beyond the noise"
CLOSE = 1.1
"""Times the noise floor up to which a model is nearly right."""
MANY, SOONEST = 8, 3
"""Trials that are too many for each to be told, and how many of them are."""


def compare_account(problem: Problem, found: Comparison, left: Sequence[Leftover]) -> Account:
    """What compare has to say; ``left``: where more than noise is."""
    ratio = found.error / found.noise_floor if found.noise_floor else float("inf")
    off = problem.told(found.error)
    lines = [f"Error: {found.definition}. Noise floor: {found.floor_source}.", *assumed_text(problem.robot)]
    lines += [problem.shared_by_trials] * bool(problem.shared_by_trials)
    lines += beside_floor(found.error, found.noise_floor, bool(left))
    first = zip(problem.numbers, problem.trials, found.parted_s.values(), strict=False)
    lines.append(f"{PARTS}: {_parted([(s, f'{k}. {t} at {s:.2f} s') for k, t, s in first if s is not None])}.")
    if left:
        lines.append(left_text(left, False))
    if ratio < CLOSE and not left:
        what = "beyond what may be noise" if found.unsure else "above the noise"
        head = f"The model agrees with the measurements: nothing is left {what}."
    else:
        # The largest error, or, where the errors are all small, the place that noise explains least.
        place = left[0].channel if left and ratio < CLOSE else found.channels[0].name if found.channels else ""
        own = next((problem.told(c.normalised) for c in found.channels if c.name == place), off)
        # The place has an error of its own: that of the model is over all channels.
        alone = own == off
        where = f", most of all at {plain(place)}{'' if alone else f' ({own} there)'}" if place else ""
        how = "The model is nearly right, and more than noise is left" if ratio < CLOSE else "The model is off"
        least = problem.natural(found.noise_floor)
        times = _times(problem.natural(found.error) / least) if least else "far more than"
        in_noise = problem.natural_unit == TIMES_NOISE
        head = f"{how}{where}: {problem.natural_name} {off}{'' if alone else ' in all'}"
        head += "." if in_noise else f", {times} what noise alone would leave."
    floor = problem.told(found.noise_floor)
    error = f"{error_name(problem)}: model {off}, noise floor {floor}."
    # A channel that agrees to the last digit is a command that no sensor comes into: there is nothing to compare.
    compared = [c for c in found.channels if c.normalised > 0] or found.channels
    names = {c.name for c in compared}
    places = counted(sum(channel in names for _, channel in problem.curves), "curve")
    of = f"{places} ({counted(len(compared), 'channel')} in {counted(len(problem.trials), 'trial')})"
    sure = (
        f"How sure: {curves_of(left)} of {of} differ{'s' if curves_of(left) == 1 else ''} by more than noise"
        if left
        else f"How sure: none of {of} differs by more than noise"
        if ratio < CLOSE
        else f"How sure: none of {of} stands out by itself, and all together they are more than noise"
    )
    sure += f"; the noise floor is {found.floor_source}."
    settled = ratio < CLOSE and not left
    advice = "" if not settled else slower(found.unsure) if found.unsure else CONTENT
    good = settled and not found.unsure
    # Where the model agrees its limits are those of the robot.
    warnings, notes = limit_lines([] if settled else found.at_limit)
    return Account(
        head, error, sure, (*notes, *lines, *problem.notes), good, advised(problem, advice), warnings=warnings
    )


def _times(ratio: float) -> str:
    return f"{ratio:.3g} times" if abs(ratio - 1) >= 0.005 else "about"


def _parted(when: Sequence[tuple[float, str]]) -> str:
    """When they did, (s, in words) of each trial; of many trials those that did first, and the summary has all."""
    if len(when) < MANY:
        return "; ".join(told for _, told in when) or "nowhere"
    soonest = [told for _, told in sorted(when, key=lambda w: w[0])[:SOONEST]]
    return f"in {len(when)} trials, soonest in {'; '.join(soonest)} (all in summary.json, parted_s)"
