"""Pages, tables and summary entries of compare, explain and improve by a balance of forces or by free runs."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table as Shown

from ee_dist.discrepancy.force_balance import ForceBalance
from ee_dist.discrepancy.free_run import FreeRun
from ee_dist.discrepancy.ladder import Rung, Verdict, natural, parted_most
from ee_dist.discrepancy.words import placed, told
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.robots.model import Robot
from ee_dist.tasks.summary import hypothesis_list
from ee_dist.viewing import report_figures as figures
from ee_dist.viewing.report import Section, Table


def new_terms(v: Verdict) -> Hypothesis:
    return v.model.hypothesis(v.u)[-len(v.proposal) :]


def by_trial(problem: ForceBalance | FreeRun) -> list[tuple[str, Any]]:
    trial = problem.trial_of_segment[problem.segment_of]
    return [(name, trial == k) for k, name in enumerate(problem.trials)]


def shown(problem: ForceBalance | FreeRun, value: float) -> str:
    if isinstance(problem, ForceBalance):
        return f"{value:.2%}"
    return f"{1e3 * value:.1f} {'mrad' if problem.unit == 'rad' else 'mm'}"


def account(problem: ForceBalance | FreeRun, rungs: Sequence[Rung], robot: Robot) -> list[str]:
    first, last = rungs[0], rungs[-1]
    added = [r.added for r in rungs[1:-1]]
    lines = ["Added, in this order: " + "; ".join(placed(a) for a in added) + "." if added else "Nothing was added."]
    lines.append(
        f"Held-out error ({problem.natural_name}) fell from {shown(problem, first.error_heldout)} to "
        f"{shown(problem, last.error_heldout)}; noise alone would leave {shown(problem, natural(problem, 1.0))}."
    )
    for rung in rungs[1:-1]:
        lines += tie_words(problem, rung.tried)
    lines.append("The model: " + "; ".join(told(t, robot) for t in last.hypothesis) + ".")
    return lines


def tie_words(problem: ForceBalance | FreeRun, tried: Sequence[Verdict]) -> list[str]:
    """What the measurements do not tell from the best proposal of a step, and which of them come nearest to it."""
    tied = [v for v in tried if v.tied]
    if not tied:
        return []
    names = "; ".join(f"{placed(v.name)} ({shown(problem, v.error_heldout)})" for v in tied)
    best = placed(tried[0].name)
    return [
        f"These measurements do not tell {best} ({shown(problem, tried[0].error_heldout)} held out) from: {names}. Their "
        f"predictions part most in {parted_most(problem, [tried[0], *tied])}: more trials of that kind would."
    ]


def overlay_section(
    problem: ForceBalance | FreeRun, before: Hypothesis, after: Hypothesis | None, most: int = 6
) -> Section:
    old = problem.series(before)
    new = problem.series(after) if after is not None else [None] * len(old)
    worst = sorted(range(len(old)), key=lambda k: -float(np.mean(np.abs(old[k][3] - old[k][4]))))[:most]
    items = []
    for k in sorted(worst):
        (title, unit, times, measured, predicted), better = old[k], new[k]
        thin = slice(None, None, max(1, len(times) // 1500))
        improved = None if better is None else better[4][thin]
        items.append(figures.Overlay(title, unit, times[thin], measured[thin], predicted[thin], improved))
    return Section("Measured and modelled", "The channels with most to see.", figures.overlays(items))


def ladder_section(problem: ForceBalance | FreeRun, rungs: Sequence[Rung]) -> Section:
    scale = 100.0 if isinstance(problem, ForceBalance) else 1e3
    figure = figures.ladder(
        [r.added for r in rungs[:-1]],
        [scale * r.error_fit for r in rungs[:-1]],
        [scale * r.error_heldout for r in rungs[:-1]],
        scale * natural(problem, 1.0),
    )
    unit = "%" if isinstance(problem, ForceBalance) else "mrad" if problem.unit == "rad" else "mm"
    figure.update_yaxes(title_text=f"{problem.natural_name} ({unit})")
    return Section("The ladder", "Error on data that was not fitted, from the first model to the last.", figure)


def ranking_section(
    problem: ForceBalance | FreeRun, tried: Sequence[Verdict], robot: Robot, heading: str = "Candidates"
) -> Section:
    rows = [
        (
            "; ".join(told(t, robot) for t in new_terms(v)),
            shown(problem, v.error_heldout),
            f"{v.gain:+.1%}",
            f"{v.t:.1f}",
            v.why_not or ("not told from the best" if v.tied else "earns its place"),
        )
        for v in tried
    ]
    caption = "Each fitted together with the model so far, judged on held-out data."
    return Section(heading, caption, table=Table(("effect", "held out", "gain", "t", ""), rows, (1, 2, 3)))


def candidate_entry(v: Verdict, rank: int) -> dict[str, Any]:
    return {
        **hypothesis_list(new_terms(v))[-1],
        "name": v.name,
        "error_heldout": v.error_heldout,
        "gain_heldout": v.gain,
        "t": v.t,
        "rank": rank,
        "earned": not v.why_not,
        "tied_with_best": v.tied,
        "why_not": v.why_not,
    }


def step_entry(r: Rung, start: Hypothesis) -> dict[str, Any]:
    names = r.added.split(" + ")
    new = [t for t in r.hypothesis if f"{t.effect}@{t.target}" in names]
    first = hypothesis_list(tuple(new))[0] if new else {"effect": None, "target": None, "values": {}}
    return {**first, "added": hypothesis_list(tuple(new)), "error_fit": r.error_fit, "error_heldout": r.error_heldout}


def digest_of(tried: Sequence[Verdict]) -> str:
    return hashlib.sha256(repr([(v.name, v.error_heldout) for v in tried]).encode()).hexdigest()


def print_ladder(console: Console, problem: ForceBalance | FreeRun, rungs: Sequence[Rung]) -> None:
    table = Shown(title=f"The ladder: {problem.natural_name}", title_justify="left")
    for column in ("step", "fitted", "held out"):
        table.add_column(column)
    for r in rungs[:-1]:
        table.add_row(r.added, shown(problem, r.error_fit), shown(problem, r.error_heldout))
    console.print(table)


def print_tried(console: Console, problem: ForceBalance | FreeRun, tried: Sequence[Verdict], robot: Robot) -> None:
    table = Shown(title="Proposed on top of the last model, judged on held-out data", title_justify="left")
    for column in ("effect", "held out", "gain", "t", ""):
        table.add_column(column)
    for v in tried:
        value = "; ".join(told(t, robot) for t in new_terms(v))
        table.add_row(
            value,
            shown(problem, v.error_heldout),
            f"{v.gain:+.1%}",
            f"{v.t:.1f}",
            v.why_not or ("not told from the best" if v.tied else ""),
        )
    console.print(table)
