"""The page of study: what became of the runs, the picture that proves it, and how sure that is. Its parts: study_sections.py."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from ee_dist.basics.names import counted
from ee_dist.discrepancy.words import percent
from ee_dist.tasks.outcome import RESTORED
from ee_dist.tasks.results import study_sections as parts
from ee_dist.tasks.results.commands import command, setting
from ee_dist.tasks.results.findings import HOLDS, OPEN, Finding
from ee_dist.tasks.results.paired import SURE, Paired, least_p
from ee_dist.tasks.results.study_table import ROLLING, Rows
from ee_dist.viewing.parting_figures import Parting
from ee_dist.viewing.report import Page
from ee_dist.viewing.run_figures import Told

QUICK = "quick"
"""The budget that only shows that every part works."""
TERMS = (
    ("Case", "What happens to the robot: one of the situations of the paper, by its number (+scenario=NUMBER)."),
    ("Intact", "How far the robot goes forward before anything happens to it, with a controller evolved for it."),
    ("After the change", "The same controller on the changed robot: how much of its function is lost."),
    ("Compensating trial", "A trial with a controller that was evolved on what the robot believes of itself by then."),
    ("Restored", f"One of the compensating trials goes {percent(RESTORED)} of the intact distance or farther, walking."),
    ("Right", "The last diagnosis names every true effect at its place, and no other."),
    ("Named", "It names every true effect at its place, whatever else it names."),
    ("Doubt", "The last diagnosis leaves more of the sensors' courses unexplained than noise and the rounding of magnitudes "
        "would: something is wrong that it does not say. Found without knowing the truth."),
    ("p", "How often luck alone would part the last trials from those right after the change of the same runs as far as this."),
    ("Gain", "By how much the last trial goes farther than the one after the change of the same run: the median of the means of "
        "all pairs of runs (Hodges and Lehmann), with its interval."),
    ("Rank corr.", "Whether pairs go one way: 1 if every run gains, -1 if every run loses (rank biserial, matched pairs)."),
    ("Rolling mean, distance", "How the logs of model and robot are compared in a diagnosis: by the means of short stretches "
        "of the sensors' courses, or by how far the robot went."),
    ("Dominant", "A hypothesis that is better than all before it in its diagnosis pass."),
)  # fmt: skip


@dataclass
class Extra:
    """What only recordings tell, or several metrics together: ``shown`` runs (summary, story), ``partings`` of logs, tests
    ``between`` metrics by scenario, ``findings`` of the paper, ``links`` (name, path)."""

    shown: Sequence[tuple[Mapping[str, Any], Told]] = ()
    partings: Sequence[Parting] = ()
    between: Mapping[Any, Paired] = field(default_factory=dict)
    findings: Sequence[Finding] = ()
    links: Sequence[tuple[str, str]] = ()


def study_page(
    summaries: Rows, rows: Rows, lines: Rows, totals: dict[str, Any], where: str, extra: Extra | None = None
) -> Page:
    """``summaries`` of recover runs below the folder ``where`` (each with its ``folder``), the ``rows`` made of them in the
    same order, the ``lines`` of their cases, and the ``totals`` by metric."""
    extra = extra or Extra()
    metrics = sorted(totals, key=lambda m: m != ROLLING)
    restored, runs = sum(t["restored"] for t in totals.values()), len(rows)
    right, scored = sum(t["right"] for t in totals.values()), sum(t["scored"] for t in totals.values())
    named = sum(t["true_among_believed"] for t in totals.values())
    head = f"Function restored in {restored} of {counted(runs, 'run')}"
    head += (
        f"; the diagnosis right in {right} of {scored}." if scored else "; what had happened to the robot is not known."
    )
    budgets, engines, seeds = (sorted({str(r[k]) for r in rows}) for k in ("budget", "engine", "seed"))
    page = Page(
        f"Study: {counted(runs, 'run')}",
        f"{counted(len({r['scenario'] for r in rows}), 'case')}, {'seed' if len(seeds) == 1 else 'seeds'} {', '.join(seeds)}; "
        f"budget {', '.join(budgets)}; {', '.join(engines)}; {where}",
        head,
        tone="good" if restored == runs and right == scored and QUICK not in budgets else "open",
        first=[
            _distances(rows),
            _sure(lines),
            *_held(extra.findings),
            *_doubts(totals),
            *_open(rows, named, scored),
            *_advice(rows, lines, budgets),
        ],
        terms=TERMS,
        links=extra.links,
        foot=f"ee_dist. {parts.CAPTION}",
    )
    page.proof, *figures = (parts.distance_section(m, summaries, rows, lines) for m in metrics)
    worst = _worst(rows)
    if worst is not None and summaries[worst].get("folder"):
        there = Path(summaries[worst]["folder"]).is_dir()
        # Of an earlier study its numbers may be all that is left.
        page.following = (
            command(["task=view", setting("log", summaries[worst]["folder"])]) if there else rows[worst]["command"]
        )
    page.sections = [
        *figures,
        *parts.finding_sections(extra.findings),
        *parts.case_sections(metrics, summaries, lines),
        *parts.between_sections(extra.between),
        *parts.doubt_sections(totals),
        parts.dominant_section(summaries),
        *parts.shown_sections(extra.shown),
        *parts.parting_sections(extra.partings),
        parts.run_section(rows),
    ]
    return page


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
    clear = sum(x["test"].sure and x["test"].shift > 0 for x in tested)
    told = (
        f"How sure: in {clear} of {counted(len(tested), what)}{of} the last trial goes farther than the one after the change by "
        f"more than luck (p < {SURE:g}, Wilcoxon signed rank test, corrected)"
    )
    fewest = min(x["runs"] for x in tested)
    least = max(x["test"].least_corrected for x in tested)
    return told + (f"; with {fewest} runs a case p cannot be below {least:.2g}." if least >= SURE else ".")


def _held(findings: Sequence[Finding]) -> list[str]:
    if not findings:
        return []
    held, unclear = (sum(f.verdict == v for f in findings) for v in (HOLDS, OPEN))
    rest = f"; {unclear} cannot be told with so few runs" if unclear else ""
    return [f"Of {len(findings)} findings of the paper {held} hold in these runs{rest}."]


def _doubts(totals: Mapping[str, Any]) -> list[str]:
    """How well the doubt tells wrong diagnoses from right ones, all metrics together."""
    counts = [t["doubt"] for t in totals.values() if "doubt" in t]
    right, false, wrong, missed = (sum(c[k] for c in counts) for k in ("right", "false", "wrong", "missed"))
    if not right + wrong:
        return []
    were = "1 diagnosis that was" if wrong == 1 else f"{wrong} diagnoses that were"
    return [f"Doubt was said of {wrong - missed} of {were} wrong, and of {false} of {right} right."]


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
        share = f" at {percent(_share(rows[worst]))} of intact" if _share(rows[worst]) >= 0 else ""
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
        cases = max(sum(x["metric"] == m for x in lines) for m in {x["metric"] for x in lines})
        return [
            f"Next: more seeds (seed=0,1,2,...): with {counted(cases, 'case')} p can fall below {SURE:g} from "
            f"{seeds_for(cases)} seeds on."
        ]
    return ["Next: nothing has to be done."]


def seeds_for(cases: int) -> int:
    """Runs of each case with which the test can tell anything at all, corrected for the number of cases."""
    return next(n for n in range(2, 60) if cases * least_p(n) < SURE)
