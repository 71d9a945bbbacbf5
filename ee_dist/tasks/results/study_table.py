"""The table of a study: runs as rows, situations as lines with paired tests, totals by metric. Plain data in and out."""

from __future__ import annotations

import math
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Term
from ee_dist.recovery.doubt import sayable
from ee_dist.recovery.walking import WALKING
from ee_dist.tasks.results.commands import command
from ee_dist.tasks.results.paired import Paired, corrected, paired

Row = dict[str, Any]
Rows = Sequence[dict[str, Any]]
COLUMNS = (
    "scenario", "metric", "seed", "engine", "budget", "intact_m", "after_m", "best_m", "last_m", "trials", "recovered",
    "restored", "found", "true", "invented", "right", "doubt", "sayable", "names_slope", "asked", "simulated", "steps",
    "wall_s", "digest", "folder", "command",
)  # fmt: skip
MEANS = ("intact_m", "after_m", "best_m", "last_m", "recovered")
ROLLING, DISTANCE = "rolling_mean", "distance"
PAPER = "paper"
"""The repair that needs no mention."""


def row(summary: Mapping[str, Any]) -> Row:
    """One run as a row. Raises KeyError, TypeError, ValueError for what is no summary of a robot's run."""
    trials = summary["distance_m"]["trials"]
    evaluations = summary["evaluations"]
    # Of a robot of one's own nobody knows the truth: its runs count, its diagnoses cannot be scored.
    scored = summary["diagnosis"] or dict.fromkeys(("found", "true", "invented", "right"))
    fraction = summary["recovered_fraction"]
    doubt, truth = summary.get("doubt"), summary.get("truth")
    return {
        **{k: summary[k] for k in ("scenario", "metric", "seed", "engine", "budget", "restored", "wall_s")},
        "intact_m": summary["distance_m"]["intact"],
        "after_m": summary["distance_m"]["after"],
        "best_m": max(trials),
        "last_m": trials[-1],
        "trials": len(trials),
        "recovered": float("nan") if fraction is None else fraction,
        **{k: scored[k] for k in ("found", "true", "invented", "right")},
        "doubt": None if doubt is None else bool(doubt["said"]),
        "names_slope": _names_slope(summary),
        "sayable": None if truth is None else sayable(tuple(map(_term, truth)), WALKING),
        **{k: evaluations[k] for k in ("asked", "simulated", "steps")},
        "digest": summary["result_digest"],
        "folder": summary.get("folder", ""),
        "command": summary.get("command") or repeated(summary),
    }


def _names_slope(summary: Mapping[str, Any]) -> bool | None:
    """Whether the last diagnosis has a tilted floor in it; None where the summary has none."""
    told = summary.get("hypotheses")
    return None if not told else any(t["effect"] == "floor_tilt" for t in told[-1])


def _term(entry: Mapping[str, Any]) -> Term:
    return Term(entry["effect"], entry["target"], tuple(entry["values"].items()))


def repeated(summary: Mapping[str, Any]) -> str:
    """The command of a run whose settings are not beside it: what its summary tells of them."""
    metric, *repair = str(summary["metric"]).split(", ")
    words = [f"+scenario={summary['scenario']}", f"metric={metric}", f"seed={summary['seed']}", *repair]
    return command([*words, f"engine={summary['engine']}", f"budget={summary['budget']}"])


def method(summary: Mapping[str, Any]) -> str:
    """What runs are counted together by: the metric, and the repair where it is not the paper's."""
    how = summary.get("repair", {}).get("name", PAPER)
    return summary["metric"] if how == PAPER else f"{summary['metric']}, repair={how}"


def total(rows: Rows) -> dict[str, Any]:
    """Counts over all runs, for each metric. A doubt is false where the diagnosis is right and the genome can say the truth;
    it is missed where one of both is not so."""
    found = {}
    for metric in sorted({r["metric"] for r in rows}):
        mine = [r for r in rows if r["metric"] == metric]
        told = [r for r in mine if r["doubt"] is not None and r["true"] is not None]
        wrong = [r for r in told if not (r["right"] and r["sayable"])]
        found[metric] = {
            "runs": len(mine),
            "restored": sum(bool(r["restored"]) for r in mine),
            "scored": sum(r["true"] is not None for r in mine),
            "right": sum(bool(r["right"]) for r in mine),
            "true_among_believed": _named(mine),
            "doubt": {
                "right": len(told) - len(wrong),
                "false": sum(r["doubt"] for r in told) - sum(r["doubt"] for r in wrong),
                "wrong": len(wrong),
                "missed": sum(not r["doubt"] for r in wrong),
                "unsayable": sum(not r["sayable"] for r in told),
                "missed_unsayable": sum(not r["doubt"] for r in told if not r["sayable"]),
            },
        }
    return found


def _named(rows: Rows) -> int:
    """Runs whose truth is known and whose diagnosis has all of it."""
    return sum(r["true"] is not None and r["found"] == r["true"] for r in rows)


def by_case(rows: Rows) -> list[dict[str, Any]]:
    """A line for each scenario and metric. ``test`` is of the last trial against the one after the change, one pair for each
    seed and engine, corrected for as many cases as the metric has; ``p`` and ``p_corrected`` are its. One pair has none."""
    groups: dict[tuple[str, Any], list[Row]] = defaultdict(list)
    for r in rows:
        groups[r["metric"], r["scenario"]].append(r)
    lines: list[dict[str, Any]] = []
    for (metric, scenario), mine in sorted(groups.items(), key=lambda g: (g[0][0], _order(g[0][1]))):
        told = [r for r in mine if r["doubt"] is not None]
        lines.append({
            "metric": metric,
            "scenario": scenario,
            "runs": len(mine),
            **{k: float(np.mean([r[k] for r in mine])) for k in MEANS},
            "restored": sum(bool(r["restored"]) for r in mine),
            "scored": sum(r["true"] is not None for r in mine),
            "right": sum(bool(r["right"]) for r in mine),
            "named": _named(mine),
            "doubts_told": len(told),
            "doubts": sum(r["doubt"] for r in told),
            "test": paired(_gains(mine)),
        })  # fmt: skip
    for metric in {x["metric"] for x in lines}:
        own = [x for x in lines if x["metric"] == metric]
        for x, test in zip(own, corrected([x["test"] for x in own]), strict=True):
            x |= {"test": test, "p": test.p, "p_corrected": test.corrected}
    return lines


def _gains(rows: Rows) -> list[float]:
    """What the last trial has over the one after the change, m, by seed and engine: runs that differ in another setting only
    are no pairs of their own."""
    found: dict[tuple[Any, ...], list[float]] = defaultdict(list)
    for r in rows:
        found[r["seed"], r["engine"]].append(r["last_m"] - r["after_m"])
    return [float(np.mean(gains)) for gains in found.values()]


def against(rows: Rows) -> dict[Any, Paired]:
    """Rolling means against the distance metric, by scenario: the last trials' difference, m, one pair for each seed (and engine
    and budget) that both have, corrected for the number of scenarios."""
    groups: dict[Any, dict[str, dict[tuple[Any, ...], list[float]]]] = defaultdict(
        lambda: defaultdict(lambda: defaultdict(list))
    )
    for r in rows:
        groups[r["scenario"]][r["metric"]][r["seed"], r["engine"], r["budget"]].append(r["last_m"])
    tests = {}
    for scenario in sorted(groups, key=_order):
        ours, control = groups[scenario][ROLLING], groups[scenario][DISTANCE]
        # Runs that differ in another setting only are no pairs of their own.
        both = [float(np.mean(ours[k]) - np.mean(control[k])) for k in sorted(ours.keys() & control.keys(), key=str)]
        if both:
            tests[scenario] = paired(both)
    return dict(zip(tests, corrected(list(tests.values())), strict=True))


def once(rows: Rows) -> list[dict[str, Any]]:
    """Without runs that are there already: the same seed and result once more is no further evidence."""
    seen: dict[tuple[Any, ...], dict[str, Any]] = {}
    for s in rows:
        seen.setdefault(tuple(str(s[k]) for k in ("scenario", "metric", "seed", "engine", "result_digest")), s)
    return list(seen.values())


def _order(scenario: Any) -> tuple[bool, Any]:
    """Situations of the paper by their number, others by name behind them."""
    return (isinstance(scenario, str), scenario)


def plain(line: Mapping[str, Any]) -> dict[str, Any]:
    """A line without what is not plain data, for a summary."""
    test: Paired = line["test"]
    named = {k: v for k, v in line.items() if k not in ("test", "p", "p_corrected", "recovered")}
    share = line["recovered"]
    return {**named, "recovered": share if math.isfinite(share) else None, "last_against_after": test.as_dict()}
