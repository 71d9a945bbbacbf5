"""The page of study: what became of the runs, the picture that proves it, and the tables."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from ee_dist.tasks.outcome import RESTORED
from ee_dist.tasks.results.commands import command, setting
from ee_dist.viewing.report import Page, Section, Table
from ee_dist.viewing.study_figures import METRICS, distances, dominants

Rows = Sequence[dict[str, Any]]
CAPTION = (
    "Bars are means over runs, whiskers standard deviations, dots the runs. p: last trial against the trial after the change, "
    "Mann-Whitney U test, two-sided, corrected for the number of cases by Benjamini and Hochberg."
)
HEAD = (
    "case", "runs", "intact (m)", "after (m)", "best trial (m)", "last trial (m)", "restored", "diagnosis right",
    "truth named", "p (corrected)",
)  # fmt: skip
EACH = ("case", "metric", "seed", "engine", "budget", "intact (m)", "after (m)", "best trial (m)", "last trial (m)",
        "restored", "diagnosis right", "digest")  # fmt: skip
QUICK = "quick"
"""The budget that only shows that every part works."""
SURE = 0.05
"""Of a test, corrected: what counts as more than luck."""
TERMS = (
    ("Case", "What happens to the robot: one of the situations of the paper, by its number (+scenario=NUMBER)."),
    ("Intact", "How far the robot goes forward before anything happens to it, with a controller evolved for it."),
    ("After the change", "The same controller on the changed robot: how much of its function is lost."),
    ("Compensating trial", "A trial with a controller that was evolved on what the robot believes of itself by then."),
    ("Restored", f"One of the compensating trials goes {RESTORED:.0%} of the intact distance or farther, walking."),
    ("Diagnosis right", "The last diagnosis names every true effect at its place, and no other."),
    ("Truth named", "It names every true effect at its place, whatever else it names."),
    ("p", "How often luck alone would part the last trials from those right after the change as far as this."),
    ("Rolling mean, distance", "How the logs of model and robot are compared in a diagnosis: by the means of short stretches "
        "of the sensors' courses, or by how far the robot went."),
    ("Dominant", "A hypothesis that is better than all before it in its diagnosis pass."),
)  # fmt: skip


def p_text(line: dict[str, Any]) -> str:
    """What the test says of a case, for a figure."""
    if not math.isfinite(line["p_corrected"]):
        return "one run: no test"
    return "p < 0.001" if line["p_corrected"] < 0.001 else f"p = {line['p_corrected']:.2g}"


def cells(line: dict[str, Any]) -> list[str]:
    """A case as a row of the table."""
    n, p = line["runs"], "-" if math.isnan(line["p_corrected"]) else f"{line['p_corrected']:.2g}"
    return [
        str(line["scenario"]), str(n), *(f"{line[k]:.2f}" for k in ("intact_m", "after_m", "best_m", "last_m")),
        f"{line['restored']}/{n}",
        *(f"{line[k]}/{line['scored']}" if line["scored"] else "-" for k in ("right", "named")), p,
    ]  # fmt: skip


def study_page(summaries: Rows, rows: Rows, lines: Rows, totals: dict[str, Any], where: str) -> Page:
    """``summaries`` of recover runs below the folder ``where`` (each with its ``folder``), the ``rows`` made of them in the
    same order, the ``lines`` of their cases, and the ``totals`` by metric."""
    metrics = sorted(totals)
    tests = {(x["metric"], x["scenario"]): p_text(x) for x in lines}
    restored, runs = sum(t["restored"] for t in totals.values()), len(rows)
    right, scored = sum(t["right"] for t in totals.values()), sum(t["scored"] for t in totals.values())
    named = sum(t["true_among_believed"] for t in totals.values())
    head = f"Function restored in {restored} of {_count(runs, 'run')}"
    head += (
        f"; the diagnosis right in {right} of {scored}." if scored else "; what had happened to the robot is not known."
    )
    budgets, engines, seeds = (sorted({str(r[k]) for r in rows}) for k in ("budget", "engine", "seed"))
    page = Page(
        f"Study: {_count(runs, 'run')}",
        f"{_count(len({r['scenario'] for r in rows}), 'case')}, {'seed' if len(seeds) == 1 else 'seeds'} {', '.join(seeds)}; "
        f"budget {', '.join(budgets)}; {', '.join(engines)}; {where}",
        head,
        tone="good" if restored == runs and right == scored and QUICK not in budgets else "open",
        first=[_distances(rows), _sure(lines), *_open(rows, named, scored), *_advice(rows, lines, budgets)],
        terms=TERMS,
        foot=f"ee_dist. {CAPTION}",
    )
    figures = [
        Section(_heading(m), CAPTION, distances([s for s in summaries if s["metric"] == m], m, tests)) for m in metrics
    ]
    page.proof = figures[0]
    worst = _worst(rows)
    if worst is not None and summaries[worst].get("folder"):
        page.following = command(["task=view", setting("log", summaries[worst]["folder"])])
    titles = {s["scenario"]: s.get("title") or "" for s in summaries}
    for k, metric in enumerate(metrics):
        mine = [x for x in lines if x["metric"] == metric]
        told = [[f"{c[0]}. {titles[x['scenario']]}".strip(), *c[1:]] for x, c in ((x, cells(x)) for x in mine)]
        table = Table(HEAD, told, tuple(range(1, len(HEAD))))
        if k:
            page.sections.append(figures[k])
        page.sections.append(Section(f"By case, {METRICS.get(metric, metric)}", "", None, table))
    caption = "New best hypotheses found so far in a diagnosis pass, mean over passes and runs."
    page.sections.append(
        Section("Dominants: how evolution goes on finding better hypotheses", caption, dominants(summaries))
    )
    each = [_run(r) for r in rows]
    page.sections.append(Section("All runs", "", None, Table(EACH, each, (0, 2, 5, 6, 7, 8)), folded=True))
    return page


def _run(row: dict[str, Any]) -> list[str]:
    metres = [f"{row[k]:.3f}" for k in ("intact_m", "after_m", "best_m", "last_m")]
    about = [str(row["scenario"]), row["metric"].replace("_", " "), str(row["seed"]), row["engine"], row["budget"]]
    return [*about, *metres, _yes(row["restored"]), _yes(row["right"]), row["digest"]]


def _heading(metric: str) -> str:
    return f"How far the robot went forward, {METRICS.get(metric, metric)}"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _yes(value: bool | None) -> str:
    return "not known" if value is None else "yes" if value else "no"


def _mean(rows: Rows, key: str) -> float:
    return sum(float(r[key]) for r in rows) / len(rows)


def _distances(rows: Rows) -> str:
    intact, after, best = (_mean(rows, k) for k in ("intact_m", "after_m", "best_m"))
    return (
        f"Distance, mean of all runs: intact {intact:.2f} m, after the change {after:.2f} m, best trial {best:.2f} m."
    )


def _sure(lines: Rows) -> str:
    """In how many cases the last trials are farther than luck would make them."""
    tested = [x for x in lines if math.isfinite(x["p_corrected"])]
    if not tested:
        return "How sure: one run for each case, which is no test; more seeds are (seed=0,1,2,...)."
    what = "case" if len({x["metric"] for x in tested}) == 1 else "pair"
    of = "" if what == "case" else " of case and metric"
    clear = sum(x["p_corrected"] < SURE and x["last_m"] > x["after_m"] for x in tested)
    told = (
        f"How sure: in {clear} of {_count(len(tested), what)}{of} the last trial goes farther than the one after the change by "
        f"more than luck (p < {SURE:g}, Mann-Whitney U test, corrected)"
    )
    fewest = min(x["runs"] for x in tested)
    # With n runs a side the two-sided test cannot say less than 2 in all orders of them.
    least = 2 / math.comb(2 * fewest, fewest)
    return told + (f"; with {fewest} runs a case p cannot be below {least:.2g}." if least >= SURE else ".")


def _share(row: dict[str, Any]) -> float:
    return float(row["recovered"]) if math.isfinite(row["recovered"]) else -1.0


def _worst(rows: Rows) -> int | None:
    """The run to look at: that which was restored least, or else one with a wrong diagnosis; None where there is neither."""
    missed = [k for k, r in enumerate(rows) if not r["restored"]]
    wrong = [k for k, r in enumerate(rows) if r["right"] is False]
    return min(missed or wrong, key=lambda k: _share(rows[k]), default=None)


def _open(rows: Rows, named: int, scored: int) -> list[str]:
    """What is left to look at."""
    said = []
    missed, worst = [r for r in rows if not r["restored"]], _worst(rows)
    if missed and worst is not None:
        share = f" at {_share(rows[worst]):.0%} of intact" if _share(rows[worst]) >= 0 else ""
        said.append(
            f"Not restored: {len(missed)}; the worst is case {rows[worst]['scenario']}, seed {rows[worst]['seed']}{share}."
        )
    if scored and named < scored:
        said.append(f"All true effects were named in {named} of {scored}.")
    return said


def _advice(rows: Rows, lines: Rows, budgets: Sequence[str]) -> list[str]:
    """What to do next, where no run is named that went wrong."""
    if QUICK in budgets:
        return ["Next: the same without budget=quick, whose gaits hardly evolve, so that shares of intact say little."]
    if _worst(rows) is not None:
        return []
    if any(not x["p_corrected"] < SURE for x in lines):
        return ["Next: more seeds (seed=0,1,2,...), where p is to tell more."]
    return ["Next: nothing has to be done."]
