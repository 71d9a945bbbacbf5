"""What the paper found, and whether these runs find it: each finding as a rule on the data, with the numbers that say so.

``HOLDS`` and ``NOT`` are said only where runs are enough to say the other as well; else it is ``OPEN``. A difference is one where
the corrected p is below 0.05. That there is none takes enough runs to have shown one, and a p that is not below 0.05 before
correction either: correction makes p larger, which must not pass for sameness.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ee_dist.discrepancy.words import percents
from ee_dist.tasks.results.paired import SURE, Paired, corrected, paired, share_interval
from ee_dist.tasks.results.study_table import DISTANCE, ROLLING, Rows

HOLDS, NOT, OPEN = "holds", "does not hold", "cannot be told"
SAYABLE = range(1, 11)
"""Situations that a genome can say."""
UNCHANGED, SLOPE = 9, 10
CONTROL_FAILS = (1, 2, 4, 5, 6)
UNSAYABLE, BETTER = (11, 12, 13), (11, 12)
NAMES = {ROLLING: "rolling mean", DISTANCE: "distance"}


@dataclass(frozen=True)
class Finding:
    """``said`` is what the paper found, ``numbers`` what these runs say of it."""

    said: str
    verdict: str
    numbers: str

    def as_dict(self) -> dict[str, str]:
        return asdict(self)


def findings(
    rows: Rows,
    lines: Rows,
    between: Mapping[Any, Paired],
    summaries: Sequence[Mapping[str, Any]],
    partings: Sequence[tuple[int, int]] = (),
) -> list[Finding]:
    """All findings that runs are there for. ``lines`` as of ``by_case``, ``between`` as of ``against``, ``partings``: after how
    many steps logs of nearly equal and of different damages part, by controller."""
    tests = {(x["metric"], x["scenario"]): x["test"] for x in lines}
    found = [
        _restores(tests),
        _control(tests),
        *(_nothing(rows, m) for m in (ROLLING, DISTANCE)),
        *(_improves(tests, m) for m in (ROLLING, DISTANCE)),
        *(_hard(rows, m) for m in (ROLLING, DISTANCE)),
        _better(between),
        _dominants(summaries),
        _told_apart(rows),
        _part(partings),
    ]
    return [f for f in found if f is not None]


def _picked(tests: Mapping[tuple[str, Any], Paired], metric: str, cases: Iterable[int]) -> dict[int, Paired]:
    return {c: tests[metric, c] for c in cases if (metric, c) in tests}


def _restores(tests: Mapping[tuple[str, Any], Paired]) -> Finding | None:
    mine = _picked(tests, ROLLING, [c for c in SAYABLE if c != UNCHANGED])
    if not mine:
        return None
    gains = [c for c, t in mine.items() if t.sure and t.shift > 0]
    rest = [c for c in mine if c not in gains]
    verdict = HOLDS if not rest else NOT if any(mine[c].could_tell for c in rest) else OPEN
    return Finding(
        "With rolling means the fourth trial goes farther than the one after the change in situations 1 to 8 and 10.",
        verdict,
        f"So in {len(gains)} of {len(mine)} that were run{_of(gains)}; {_enough(mine)}. Gains: {_shifts(mine)}.",
    )


def _control(tests: Mapping[tuple[str, Any], Paired]) -> Finding | None:
    mine = _picked(tests, DISTANCE, CONTROL_FAILS)
    if not mine:
        return None
    differ = [c for c, t in mine.items() if t.sure]
    same = [c for c, t in mine.items() if t.could_tell and t.p >= SURE]
    verdict = NOT if differ else HOLDS if len(same) == len(mine) else OPEN
    return Finding(
        "With the distance metric there is no such difference in situations 1, 2, 4, 5 and 6.",
        verdict,
        f"A difference in {len(differ)} of {len(mine)} that were run{_of(differ)}; {_enough(mine)}. Gains: {_shifts(mine)}.",
    )


def _positive(test: Paired) -> str:
    """Of a finding that says that a difference is more than none."""
    if test.sure:
        return HOLDS if test.shift > 0 else NOT
    return NOT if test.could_tell else OPEN


def _nothing(rows: Rows, metric: str) -> Finding | None:
    mine = [r for r in rows if r["metric"] == metric and r["scenario"] == UNCHANGED and r["true"] is not None]
    if not mine:
        return None
    count = sum(bool(r["right"]) for r in mine)
    said = f"Where nothing breaks (9) the usual last guess is 'nothing changed', {NAMES[metric]}."
    return Finding(said, _more_than_half(count, len(mine)), f"So guessed in {_share(count, len(mine))}.")


def _improves(tests: Mapping[tuple[str, Any], Paired], metric: str) -> Finding | None:
    mine = _picked(tests, metric, [UNCHANGED])
    if not mine:
        return None
    (test,) = corrected(list(mine.values()))  # one situation by itself
    verdict = _positive(test)
    said = f"Where nothing breaks (9) the controller goes on improving, {NAMES[metric]}."
    return Finding(said, verdict, f"{_told(test)}; {_enough({UNCHANGED: test})}.")


def _hard(rows: Rows, metric: str) -> Finding | None:
    mine = [r for r in rows if r["metric"] == metric and r["scenario"] in UNSAYABLE]
    if not mine:
        return None
    count = sum(bool(r["restored"]) for r in mine)
    return Finding(
        f"Situations 11 to 13, which no genome can say, are hard, {NAMES[metric]}: most runs do not restore function.",
        _more_than_half(len(mine) - count, len(mine)),
        f"Function restored in {_share(count, len(mine))}.",
    )


def _better(between: Mapping[Any, Paired]) -> Finding | None:
    mine = {c: between[c] for c in BETTER if c in between}
    if not mine:
        return None
    if any(t.sure for t in mine.values()):
        verdict = NOT
    elif all(t.could_tell and t.p >= SURE for t in mine.values()):
        ways = {t.shift > 0 for t in mine.values()}
        verdict = OPEN if len(ways) > 1 else HOLDS if True in ways else NOT
    else:
        verdict = OPEN
    return Finding(
        "In situations 11 and 12 rolling means do better than distances, but not by more than luck.",
        verdict,
        f"Rolling mean less distance at the last trial: {_shifts(mine)}; {_enough(mine)}.",
    )


def _dominants(summaries: Sequence[Mapping[str, Any]]) -> Finding | None:
    counts: dict[tuple[str, ...], dict[str, float]] = {}
    for s in summaries:
        passes = [p[-1] for p in s["dominants"]["diagnosis"] if p]
        if passes:
            key = tuple(str(s[k]) for k in ("scenario", "seed", "engine", "budget"))
            counts.setdefault(key, {})[s["metric"]] = float(np.mean(passes))
    both = [c for c in counts.values() if ROLLING in c and DISTANCE in c]
    if not both:
        return None
    (test,) = corrected([paired([c[ROLLING] - c[DISTANCE] for c in both])])
    verdict = _positive(test)
    means = [float(np.mean([c[m] for c in both])) for m in (ROLLING, DISTANCE)]
    return Finding(
        "A diagnosis by rolling means finds many new best hypotheses, one by distances few.",
        verdict,
        f"In a pass {means[0]:.1f} by rolling means, {means[1]:.1f} by distances; one pair for each situation and seed: "
        f"{_told(test, '')}; {_enough({0: test})}.",
    )


def _told_apart(rows: Rows) -> Finding | None:
    """By what the last diagnosis names: the slope where there is one, and none where there is none."""
    known = [r for r in rows if r["metric"] == ROLLING and r["names_slope"] is not None]
    outside = [r for r in known if r["scenario"] == SLOPE]
    inside = [r for r in known if r["scenario"] in SAYABLE and r["scenario"] not in (SLOPE, UNCHANGED)]
    if not outside or not inside:
        return None
    hits, alarms = (sum(r["names_slope"] for r in group) for group in (outside, inside))
    verdicts = {_more_than_half(hits, len(outside)), _more_than_half(len(inside) - alarms, len(inside))}
    verdict = NOT if NOT in verdicts else OPEN if OPEN in verdicts else HOLDS
    return Finding(
        "Damage inside and a change outside are told apart by sensor data alone.",
        verdict,
        f"With rolling means the slope is named in {_share(hits, len(outside))} on it (10), "
        f"and in {_share(alarms, len(inside))} of damages on even ground (1 to 8).",
    )


def _part(partings: Sequence[tuple[int, int]]) -> Finding | None:
    if not partings:
        return None
    (test,) = corrected([paired([float(near - far) for near, far in partings])])
    verdict = _positive(test)
    near, far = (float(np.median([p[k] for p in partings])) for k in (0, 1))
    return Finding(
        "Logs of nearly equal damages part late (after about 150 steps), of different damages early (about 50).",
        verdict,
        f"Median over {len(partings)} controllers: after {near:.0f} and {far:.0f} steps; {_told(test, ' steps')}; "
        f"{_enough({0: test})}.",
    )


def _more_than_half(count: int, of: int) -> str:
    low, high = share_interval(count, of)
    return HOLDS if low > 0.5 else NOT if high < 0.5 else OPEN


def _share(count: int, of: int) -> str:
    low, high = share_interval(count, of)
    return f"{count} of {of} runs (95 % interval of the share: {percents(low, high)})"


def _told(test: Paired, unit: str = " m") -> str:
    if math.isnan(test.shift):
        return "no pairs"
    p = "one pair, no test" if math.isnan(test.p) else f"p = {test.p:.2g}"
    return f"{test.shift:+.2f}{unit} ({p})"


def _shifts(tests: Mapping[int, Paired]) -> str:
    return ", ".join(f"{case}: {_told(t)}" for case, t in tests.items())


def _of(cases: Sequence[int]) -> str:
    return f" ({', '.join(map(str, cases))})" if cases else ""


def _enough(tests: Mapping[int, Paired]) -> str:
    """How small p can be with so many runs, corrected."""
    least = [t.least_corrected for t in tests.values()]
    if any(math.isnan(x) for x in least):
        return "one run is no test"
    fewest = min(t.n for t in tests.values())
    told = f"with {fewest} pairs the corrected p cannot be below {max(least):.2g}"
    return told + ("" if max(least) < SURE else ", too few to tell")
