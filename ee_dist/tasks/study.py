"""task=study: the table, the statistics and the figures of a sweep, from the summaries of its runs."""

from __future__ import annotations

import csv
import io
import math
import os
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table
from scipy.stats import false_discovery_control, mannwhitneyu

from ee_dist.basics.files import write_whole
from ee_dist.robots.untrusted import UntrustedError, json_of, text_of
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.outcome import RESTORED
from ee_dist.tasks.results.study_page import CAPTION, HEAD, cells, study_page
from ee_dist.tasks.summary import Stopwatch, digest_of, write_summary
from ee_dist.viewing.report import write_page


@dataclass
class Options:
    name: str = "study"


LARGEST = 2**28
"""Bytes of a summary."""
COLUMNS = (
    "scenario", "metric", "seed", "engine", "budget", "intact_m", "after_m", "best_m", "last_m", "recovered",
    "restored", "found", "true", "invented", "right", "asked", "simulated", "steps", "wall_s", "digest",
)  # fmt: skip


def run(config: Config, options: Options, out: Path) -> None:
    """Write study.csv, study.md, report.html and summary.json from the runs below ``config.log``. Raises ConfigError."""
    console, watch = Console(), Stopwatch()
    if not config.log:
        raise ConfigError("log=: which runs? name the folder of a sweep, such as log=logs/recover/..._sweep")
    runs = load(Path(config.log))
    rows = [row(r) for r in runs]
    table = io.StringIO(newline="")
    writer = csv.DictWriter(table, COLUMNS)
    writer.writeheader()
    writer.writerows(rows)
    write_whole(out / "study.csv", table.getvalue())
    write_whole(out / "study.md", markdown(rows))
    lines = by_case(rows)
    _print(console, rows)
    totals = total(rows)
    write_summary(out, "study", config, options, watch, digest_of(rows), {"runs": len(rows), "totals": totals})
    page = study_page(runs, rows, lines, totals, str(config.log))
    write_page(page, out / "report.html")
    for name in ("study.csv", "study.md", "report.html"):
        console.print(f"  {os.path.relpath(out / name)}", highlight=False, soft_wrap=True)
    for line in (page.headline, *page.first):
        console.print(line, highlight=False)
    if page.following:
        console.print(f"Next: {page.following}", highlight=False, markup=False, soft_wrap=True)


def load(folder: Path) -> list[dict[str, Any]]:
    """Summaries of all finished recover runs below a folder, in order, each with its own ``folder``. Raises ConfigError
    where there is none."""
    found = []
    for path in sorted(folder.rglob("summary.json")):
        try:
            content = json_of(text_of(path, LARGEST))
        except (OSError, UntrustedError) as error:
            raise ConfigError(f"{path}: not a summary ({error}); take it out of the folder") from None
        if not isinstance(content, dict):
            raise ConfigError(f"{path}: not a summary; take it out of the folder")
        if content.get("task") != "recover":
            continue
        try:
            row(content)
        except (KeyError, TypeError, ValueError) as error:
            raise ConfigError(f"{path}: a summary without {error}; take it out of the folder") from None
        found.append({**content, "folder": str(path.parent)})
    if not found:
        raise ConfigError(f"log={folder}: no finished run below it; a run is finished when it has a summary.json")
    return sorted(found, key=lambda s: (s["metric"], s["engine"], s["scenario"], s["seed"]))


def row(summary: dict[str, Any]) -> dict[str, Any]:
    """One run as a line of the table."""
    trials = summary["distance_m"]["trials"]
    evaluations = summary["evaluations"]
    # Of a robot of one's own nobody knows the truth: its runs count, its diagnoses cannot be scored.
    scored = summary["diagnosis"] or dict.fromkeys(("found", "true", "invented", "right"))
    fraction = summary["recovered_fraction"]
    return {
        **{k: summary[k] for k in ("scenario", "metric", "seed", "engine", "budget", "restored", "wall_s")},
        "intact_m": summary["distance_m"]["intact"],
        "after_m": summary["distance_m"]["after"],
        "best_m": max(trials),
        "last_m": trials[-1],
        "recovered": float("nan") if fraction is None else fraction,
        **scored,
        **{k: evaluations[k] for k in ("asked", "simulated", "steps")},
        "digest": summary["result_digest"][:12],
    }


def total(rows: list[dict[str, Any]]) -> dict[str, Any]:
    """Counts over all runs, for each metric."""
    found = {}
    for metric in sorted({r["metric"] for r in rows}):
        mine = [r for r in rows if r["metric"] == metric]
        found[metric] = {
            "runs": len(mine),
            "restored": sum(bool(r["restored"]) for r in mine),
            "scored": sum(r["true"] is not None for r in mine),
            "right": sum(bool(r["right"]) for r in mine),
            "true_among_believed": _named(mine),
        }
    return found


def _named(rows: list[dict[str, Any]]) -> int:
    """Runs whose truth is known and whose diagnosis has all of it."""
    return sum(r["true"] is not None and r["found"] == r["true"] for r in rows)


def by_case(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """A line for each scenario and metric. ``p`` is of the last trial against the one after the change (Mann-Whitney, two
    sides), ``p_corrected`` that for as many cases as the metric has (Benjamini and Hochberg); with one run there is none."""
    groups: dict[tuple[str, int], list[dict[str, Any]]] = defaultdict(list)
    for r in rows:
        groups[r["metric"], r["scenario"]].append(r)
    lines: list[dict[str, Any]] = []
    for (metric, scenario), mine in sorted(groups.items()):
        after, last = ([r[k] for r in mine] for k in ("after_m", "last_m"))
        p = float(mannwhitneyu(last, after, alternative="two-sided").pvalue) if len(mine) > 1 else float("nan")
        lines.append({
            "metric": metric,
            "scenario": scenario,
            "runs": len(mine),
            **{k: float(np.mean([r[k] for r in mine])) for k in ("intact_m", "after_m", "best_m", "last_m", "recovered")},
            "restored": sum(bool(r["restored"]) for r in mine),
            "scored": sum(r["true"] is not None for r in mine),
            "right": sum(bool(r["right"]) for r in mine),
            "named": _named(mine),
            "p": p,
            "p_corrected": float("nan"),
        })  # fmt: skip
    for metric in {x["metric"] for x in lines}:
        tested = [x for x in lines if x["metric"] == metric and math.isfinite(x["p"])]
        if tested:
            for x, corrected in zip(tested, false_discovery_control([x["p"] for x in tested]), strict=True):
                x["p_corrected"] = float(corrected)
    return lines


SHORT = ("case", "runs", "intact", "after", "best", "last", "restored", "right", "named", "p")
"""Heads of the table for a terminal of 80 columns."""


def markdown(rows: list[dict[str, Any]]) -> str:
    """The table for a document, each metric and the totals."""
    parts = []
    for metric, counts in total(rows).items():
        lines = [x for x in by_case(rows) if x["metric"] == metric]
        parts.append(f"### {metric}\n")
        parts.append("| " + " | ".join(HEAD) + " |\n|" + "---|" * len(HEAD))
        parts += ["| " + " | ".join(cells(x)) + " |" for x in lines]
        n, scored = counts["runs"], counts["scored"]
        parts.append(
            f"\nRestored ({RESTORED:.0%} of intact or more in one of the compensating trials): {counts['restored']} of {n}. "
            f"Diagnosis right (every true effect at its place and no other): {counts['right']} of {scored}; "
            f"all true effects named: {counts['true_among_believed']} of {scored}. {CAPTION.split('. ', 1)[1]}\n"
        )
    return "\n".join(parts) + "\n"


def _print(console: Console, rows: list[dict[str, Any]]) -> None:
    for metric, counts in total(rows).items():
        table = Table(
            title=f"{metric}, distances in m", box=SIMPLE, padding=(0, 1, 0, 0), pad_edge=False, title_justify="left"
        )
        for name in SHORT:
            table.add_column(name, justify="right", no_wrap=True)
        for line in by_case(rows):
            if line["metric"] == metric:
                table.add_row(*cells(line))
        console.print(table)
        n, scored = counts["runs"], counts["scored"]
        console.print(f"restored {counts['restored']}/{n}, diagnosis right {counts['right']}/{scored}, "
                      f"all true effects named {counts['true_among_believed']}/{scored}", highlight=False)  # fmt: skip
    console.print(CAPTION.split(". ", 1)[1], style="dim", highlight=False)
