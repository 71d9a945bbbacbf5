"""task=study and task=online, through the command line."""

from __future__ import annotations

import csv
import io
import json
import math

import numpy as np
from rich.console import Console

from ee_dist.tasks import study
from ee_dist.tasks.study import by_case, p_text, row
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
    page = (run / "figures.html").read_text()
    assert "How far the robot went forward, diagnosed by rolling means" in page
    assert "Dominants: new best hypotheses" in page
    assert "Mann-Whitney U test, two-sided, corrected for the number of cases by Benjamini and Hochberg" in page
    assert "sendDataToCloud" not in page.split("config")[-1]
    assert "https://cdn" not in page.split("<body>")[1][:200], "the page must open offline"
    assert json.loads((run / "summary.json").read_text())["runs"] == 4


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
    assert (outcome.runs()[0] / "online.html").stat().st_size > 100_000
