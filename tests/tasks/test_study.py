"""task=study and task=online, through the command line."""

from __future__ import annotations

import csv
import json

from ee_dist.tasks.study import by_case, row


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
    assert "Forward distance" in page
    assert "Dominants" in page
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
