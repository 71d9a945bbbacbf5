"""Attempts side by side: how many reached which share of the intact distance, after how many trials and simulations.

Shares of runs have Wilson intervals, means and medians of numbers bootstrap intervals over runs (percentiles of 10,000
resamples with a fixed seed), all at 95 %. A run that did not reach a share counts as infinitely many trials, so that a median
may be "more than allowed".
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Mapping, Sequence
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binomtest

from ee_dist.basics.files import write_whole
from ee_dist.rivals.attempt import SHARES, Attempt

RESAMPLES = 10_000
Interval = tuple[float, float]


def wilson(hits: int, runs: int) -> Interval:
    """95 % interval of a share of runs."""
    if not runs:
        return 0.0, 1.0
    found = binomtest(hits, runs).proportion_ci(0.95, method="wilson")
    return float(found.low), float(found.high)


def bootstrap(values: Sequence[float], of: Callable[[NDArray[np.float64]], NDArray[np.float64]]) -> Interval:
    """95 % interval of ``of`` (resamples, runs) -> (resamples,); of one run there is none: not a number."""
    if len(values) < 2:
        return math.nan, math.nan
    rng = np.random.default_rng(0)
    drawn = np.array(values)[rng.integers(0, len(values), size=(RESAMPLES, len(values)))]
    found = np.sort(of(drawn))
    return float(found[int(0.025 * RESAMPLES)]), float(found[int(0.975 * RESAMPLES) - 1])


def medians(drawn: NDArray[np.float64]) -> NDArray[np.float64]:
    """The lower middle one of each row: with infinite values there is no middle between two."""
    return np.asarray(np.sort(drawn, axis=1)[:, (drawn.shape[1] - 1) // 2], dtype=np.float64)


def means(drawn: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray(drawn.mean(axis=1), dtype=np.float64)


def common(attempts: Sequence[Attempt]) -> list[Attempt]:
    """Those of the cases (scenario and seed) on which every rival ran that ran at all: others cannot be set side by side."""
    cases = {a.rival: set[tuple[int, int]]() for a in attempts}
    for a in attempts:
        cases[a.rival].add((a.scenario, a.seed))
    shared = set.intersection(*cases.values()) if cases else set()
    return [a for a in attempts if (a.scenario, a.seed) in shared]


def table_of(attempts: Sequence[Attempt], titles: Mapping[str, str], trials: int) -> list[dict[str, Any]]:
    """A row for each rival and number of trials allowed: ``trials`` beside the first, and all that a rival made.

    The first trial after the change is the intact controller's, and counts.
    """
    rows = []
    for name, title in titles.items():
        mine = [a for a in attempts if a.rival == name]
        longest = max((len(a.trials_m) for a in mine), default=0)
        for allowed in dict.fromkeys((trials + 1, longest)) if mine else ():
            rows.append({"rival": name, "title": title, **_row(mine, allowed)})
    return rows


def _row(mine: Sequence[Attempt], allowed: int) -> dict[str, Any]:
    shares = [0.0 if math.isnan(s := a.share(allowed)) else s for a in mine]
    row: dict[str, Any] = {
        "trials_allowed": allowed,
        "runs": len(mine),
        "best_share": float(np.mean(shares)),
        "best_share_interval": bootstrap(shares, means),
    }
    for share in SHARES:
        reached = [a.reached(share, allowed) for a in mine]
        hits, key = sum(r is not None for r in reached), f"{share:.0%}".rstrip("%")
        counts = [math.inf if r is None else float(r) for r in reached]
        spent = [a.spent_until(share, allowed) for a in mine]
        simulated = [math.inf if c is None else float(c.simulated) for c in spent]
        row |= {
            f"reached_{key}": hits,
            f"reached_{key}_interval": wilson(hits, len(mine)),
            f"trials_{key}": float(medians(np.array([counts]))[0]),
            f"trials_{key}_interval": bootstrap(counts, medians),
            f"simulated_{key}": float(medians(np.array([simulated]))[0]),
        }
    last = [a.spent[min(allowed, len(a.spent)) - 1] for a in mine]
    row |= {
        "simulated_before": float(np.mean([a.before.simulated for a in mine])),
        "steps_before": float(np.mean([a.before.steps for a in mine])),
        "simulated_after": float(np.mean([c.simulated for c in last])),
        "steps_after": float(np.mean([c.steps for c in last])),
    }
    return row


def rows_of(attempts: Sequence[Attempt], trials: int) -> list[dict[str, Any]]:
    """A row for each run."""
    return [
        {
            "rival": a.rival,
            "scenario": a.scenario,
            "seed": a.seed,
            "intact_m": a.intact_m,
            "first_share": a.trials_m[0] / a.intact_m if a.intact_m > 0 else math.nan,
            "share_in_few": a.share(trials + 1),
            "trials": len(a.trials_m),
            "share": a.share(len(a.trials_m)),
            **{f"trials_to_{s:.0%}".rstrip("%"): a.reached(s) for s in SHARES},
            "simulated_before": a.before.simulated,
            "steps_before": a.before.steps,
            "simulated_after": a.after.simulated,
            "steps_after": a.after.steps,
            "no_gait": len(a.no_gait),
            "seconds": a.seconds,
        }
        for a in attempts
    ]


def write_csv(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    text = StringIO()
    if rows:
        writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)
    write_whole(path, text.getvalue())


HEAD = ("rival", "runs", "trials allowed", "best share of intact",
        *(f"{s:.0%}: runs, median trial" for s in SHARES), "simulated before", "simulated after")  # fmt: skip


def markdown(table: Sequence[Mapping[str, Any]]) -> str:
    lines = ["| " + " | ".join(HEAD) + " |", "|" + "---|" * len(HEAD)]
    for row in table:
        cells = [row["title"], str(row["runs"]), f"{row['trials_allowed']:,}",
                 f"{row['best_share']:.2f}{_interval(row['best_share_interval'], '.2f')}"]  # fmt: skip
        for share in SHARES:
            key = f"{share:.0%}".rstrip("%")
            low, high = row[f"reached_{key}_interval"]
            reached = f"{row[f'reached_{key}']}/{row['runs']} ({low:.0%}-{high:.0%})"
            median = _number(row[f"trials_{key}"]) + _interval(row[f"trials_{key}_interval"], "")
            cells.append(f"{reached}, {median}")
        for when in ("before", "after"):
            rollouts, steps = row[f"simulated_{when}"], row[f"steps_{when}"]
            cells.append(f"{rollouts:,.0f} ({steps / 1e6:.1f} M steps)")
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def by_run(attempts: Sequence[Attempt], titles: Mapping[str, str]) -> str:
    """Markdown: a line for each scenario and seed, a column for each rival: its best share, and the trials until each of
    ``SHARES``."""
    names = [n for n in titles if any(a.rival == n for a in attempts)]
    lines = ["| scenario | seed | intact (m) | " + " | ".join(titles[n] for n in names) + " |"]
    lines.append("|" + "---|" * (3 + len(names)))
    made = {(a.scenario, a.seed, a.rival): a for a in attempts}
    for scenario, seed in sorted({key[:2] for key in made}):
        cells, intact = [], math.nan
        for name in names:
            a = made.get((scenario, seed, name))
            if a is None:
                cells.append("")
                continue
            best, intact = a.share(len(a.trials_m)), a.intact_m
            until = ", ".join("-" if (r := a.reached(s)) is None else str(r) for s in SHARES)
            cells.append(f"{best:.2f} ({until})" if math.isfinite(best) else "none walks")
        lines.append(f"| {scenario} | {seed} | {intact:.2f} | " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def _number(value: float, form: str = "") -> str:
    if math.isinf(value):
        return "never"
    return format(value, form) if form else f"{value:,.0f}"


def _interval(found: Interval, form: str) -> str:
    """In brackets; nothing where there is none."""
    low, high = found
    return "" if math.isnan(low) else f" [{_number(low, form)}, {_number(high, form)}]"
