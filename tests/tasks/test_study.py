"""task=study and task=online, through the command line."""

from __future__ import annotations

import csv
import io
import json
import math

import numpy as np
import pytest
from rich.console import Console

from ee_dist.tasks import study
from ee_dist.tasks.results.study_page import p_text, study_page
from ee_dist.tasks.study import by_case, row, total
from ee_dist.viewing.report import write_page
from ee_dist.viewing.study_figures import distances


def test_a_sweep_becomes_a_table_and_figures(cli, tiny):
    sweep = cli("-m", "+scenario=3,9", "metric=rolling_mean,distance", "evaluator=serial", *tiny,
                "budget.compensating_trials=1")  # fmt: skip
    assert sweep.status == 0, sweep.err
    outcome = cli("task=study", f"log={sweep.folder / 'logs'}")
    assert outcome.status == 0, outcome.err
    (run,) = outcome.runs()
    with (run / "study.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert {(r["scenario"], r["metric"]) for r in rows} == {(s, m) for s in "39" for m in ("distance", "rolling_mean")}
    summary = json.loads((run / "summary.json").read_text())
    assert summary["runs"] == 4
    page = (run / "report.html").read_text().split("<body>")[1]
    assert "How far the robot went forward, diagnosed by rolling means" in page
    assert "Mann-Whitney U test, two-sided, corrected for the number of cases by Benjamini and Hochberg" in page
    restored, right = (sum(t[k] for t in summary["totals"].values()) for k in ("restored", "right"))
    head = f"Function restored in {restored} of 4 runs; the diagnosis right in {right} of 4."
    assert f"<h1>{head}</h1>" in page
    assert outcome.out.splitlines()[-1].startswith("Next: ") and head in outcome.out, (
        "the finding last, and what to do next"
    )


def test_table_counts_what_the_summaries_say():
    def summary(seed, trials, right):
        return {
            "scenario": 1, "metric": "distance", "seed": seed, "engine": "pybullet", "budget": "paper", "wall_s": 1.0,
            "restored": max(trials) >= 0.9 * 2.0, "recovered_fraction": max(trials) / 2.0,
            "distance_m": {"intact": 2.0, "after": 1.0, "trials": trials}, "result_digest": "ab" * 32,
            "diagnosis": {"found": int(right), "true": 1, "invented": 0, "right": right},
            "evaluations": {"asked": 10, "simulated": 5, "steps": 100},
        }  # fmt: skip

    (line,) = by_case([row(summary(0, [1.0, 1.9], True)), row(summary(1, [1.5, 0.5], False))])
    assert (line["restored"], line["right"], line["named"], line["runs"]) == (1, 1, 1, 2)
    assert (line["best_m"], line["last_m"]) == (1.7, 1.2)


def study_of(scenarios, seeds, metric="rolling_mean"):
    """Summaries as of a sweep: after the change every run goes shorter, the last trial farther, more so in some cases."""
    rng = np.random.default_rng(0)
    return [{
        "scenario": c, "title": f"what happens in case {c}, told at some length", "metric": metric, "seed": s,
        "engine": "pybullet", "budget": "paper", "wall_s": 1.0, "restored": True, "recovered_fraction": 1.0,
        "distance_m": {"intact": 2.0, "after": float(rng.normal(0.4, 0.3)), "trials": [1.0, float(rng.normal(1.5, 0.3))]},
        "result_digest": "ab" * 32, "diagnosis": {"found": 1, "true": 1, "invented": 0, "right": True},
        "evaluations": {"asked": 10, "simulated": 5, "steps": 100}, "dominants": {"diagnosis": [[0, 1, 2], [0, 2, 2]]},
    } for c in scenarios for s in seeds]  # fmt: skip


def test_the_test_is_corrected_for_the_number_of_cases():
    lines = by_case([row(s) for s in study_of(range(1, 11), range(5))])
    assert all(x["p"] <= x["p_corrected"] <= min(1.0, 10 * x["p"]) for x in lines)
    assert any(x["p"] < x["p_corrected"] for x in lines)
    (single,) = by_case([row(s) for s in study_of([1], [0])])
    assert math.isnan(single["p_corrected"])
    assert p_text(single) == "one run: no test"


def test_no_bar_whisker_or_dot_of_a_figure_is_cut():
    summaries = study_of([1, 2], range(4))
    summaries[0]["distance_m"]["after"] = -0.9
    figure = distances(summaries, "rolling_mean", {("rolling_mean", 1): "p = 0.03"})
    low, high = figure.layout.yaxis.range
    for trace in figure.data:
        whisker = np.array(trace.error_y.array if trace.type == "bar" else 0.0)
        assert (np.array(trace.y) - whisker).min() >= low
        assert (np.array(trace.y) + whisker).max() < high
    assert figure.layout.annotations[0].y < high
    assert figure.layout.xaxis.ticktext[0] == "1. what<br>happens in<br>case 1, told<br>at some<br>length"


def page_of(summaries):
    rows = [row(s) for s in summaries]
    return study_page(summaries, rows, by_case(rows), total(rows), "logs/sweep")


def test_the_first_lines_of_a_study_tell_what_how_sure_and_what_next():
    summaries = study_of([1, 2], range(4))
    page = page_of(summaries)
    assert page.tone == "good" and page.first[-1] == "Next: nothing has to be done."
    assert "2 of 2 cases" in page.first[1]
    summaries[5] |= {"restored": False, "recovered_fraction": 0.42, "folder": "logs/a sweep/5"}
    page = page_of(summaries)
    assert page.headline == "Function restored in 7 of 8 runs; the diagnosis right in 8 of 8." and page.tone == "open"
    assert page.first[-1] == "Not restored: 1; the worst is case 2, seed 1 at 42% of intact."
    assert "task=view" in page.following and "logs/a sweep/5" in page.following
    assert "no test" in page_of(study_of([1, 2], [0])).first[1]
    assert page_of(study_of([1, 2], [0])).first[-1].startswith("Next: more seeds")
    quick = page_of([{**s, "budget": "quick"} for s in study_of([1], range(4))])
    assert quick.tone == "open" and "without budget=quick" in quick.first[-1]
    assert "cannot be below 0.1" in page_of(study_of([1, 2], range(3))).first[1]


@pytest.mark.parametrize(("width", "dark"), [(1280, True), (400, False)], ids=["wide-dark", "narrow-light"])
def test_the_page_of_a_study_is_quiet_and_fits(window, tmp_path, width, dark):
    page = write_page(page_of(study_of(range(1, 11), range(3))), tmp_path / "report.html")
    seen = window.look(page, width, dark=dark)
    assert seen.complaints == () and seen.asked == () and seen.overflow == 0
    overlapping = (
        "(() => { const boxes = [...document.querySelectorAll('.xtick text, .annotation-text')].map((t) =>"
        "t.getBoundingClientRect()).filter((b) => b.width); return boxes.some((a, i) => boxes.slice(i + 1).some((b) =>"
        "a.left < b.right - 1 && b.left < a.right - 1 && a.top < b.bottom - 1 && b.top < a.bottom - 1)); })()"
    )
    assert window.evaluate(overlapping) is False, "no label lies on another"


def test_the_table_of_all_cases_survives_80_columns():
    out = io.StringIO()
    study._print(Console(file=out, width=80), [row(s) for s in study_of(range(1, 14), range(10))])
    lines = out.getvalue().splitlines()
    assert all(len(line) <= 80 for line in lines)
    assert "…" not in out.getvalue()
    cells = [line.split() for line in lines if line.strip()[:2].strip().isdigit()]
    assert [c[0] for c in cells] == [str(k) for k in range(1, 14)]
    assert all(len(c) == 10 for c in cells)


def test_nothing_to_study(cli, tmp_path):
    outcome = cli("task=study", f"log={tmp_path}")
    assert outcome.status == 2
    assert "no finished run below it" in outcome.err


def test_evolution_on_the_body_alone(cli, tiny):
    outcome = cli("task=online", "+scenario=3", "evaluator=serial", "task.generations_before=2",
                  "task.generations_after=3", *tiny)  # fmt: skip
    assert outcome.status == 0, outcome.err
    summary = outcome.summary()
    assert summary["body_trials_after_the_change"] == 8 + 3 * 4
    best = [d for _, d in summary["best_by_trials"]["after"]]
    assert best == sorted(best)
    assert "On the body alone: intact" in (outcome.runs()[0] / "report.html").read_text().split("<body>")[1]
