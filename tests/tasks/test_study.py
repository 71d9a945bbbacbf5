"""task=study and task=online, through the command line."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import shlex
import shutil

import numpy as np
import pytest
from rich.console import Console

from ee_dist.tasks import study
from ee_dist.tasks.results.study_logs import pair_to_show
from ee_dist.tasks.results.study_page import seeds_for, study_page
from ee_dist.tasks.results.study_sections import last_name, p_text
from ee_dist.tasks.results.study_table import by_case, method, once, repeated, row, total
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
    assert re.search(
        r"<h2>The first trial goes [\d.]+ m (farther|less far) than the one after the change, diagnosed by", page
    )
    assert "Wilcoxon signed rank test, exact, two-sided, corrected for the number of cases by Holm" in page
    for heading in ("What the paper found", "New best hypotheses in a diagnosis pass", "One run, case 3, seed 0",
                    "Path of the body from above", "Logs of nearly equal damages part after", "The doubt caught"):  # fmt: skip
        assert heading in page, heading
    assert all(f["verdict"] == "cannot be told" for f in summary["findings"]), "of one seed"
    assert all(f" +scenario={r['scenario']} " in r["command"] + " " and len(r["digest"]) == 64 for r in rows)
    assert {r["digest"] for r in rows} == {
        json.loads((f / "summary.json").read_text())["result_digest"] for f in sweep.runs()
    }
    (again,) = {r["command"] for r in rows if (r["scenario"], r["metric"]) == ("9", "distance")}
    once_more = cli(*shlex.split(again)[3:])
    assert once_more.summary()["result_digest"] in {r["digest"] for r in rows}, "the command repeats the run"
    restored, right = (sum(t[k] for t in summary["totals"].values()) for k in ("restored", "right"))
    head = f"Function restored in {restored} of 4 runs; the diagnosis right in {right} of 4."
    assert f"<h1>{head}</h1>" in page
    assert outcome.out.splitlines()[-1].startswith("Next: ") and head in outcome.out, (
        "the finding last, and what to do next"
    )


def test_a_study_grows_from_one_to_the_next(cli, tiny, tmp_path):
    sweep = cli("-m", "+scenario=3", "seed=0,1", "evaluator=serial", *tiny, "budget.compensating_trials=1")
    first, second = (run.parent / run.name for run in sweep.runs())
    whole = cli("task=study", f"log={first.parent}")
    part = cli("task=study", f"log={first}")
    assert (whole.status, part.status) == (0, 0), part.err
    shutil.rmtree(first)
    grown = cli("task=study", f"log={second}", f"task.earlier=[{part.runs()[0]}]")
    assert grown.status == 0, grown.err
    assert grown.summary()["result_digest"] == whole.summary()["result_digest"], "the same runs make the same study"
    shutil.rmtree(second)
    alone = cli("task=study", f"task.earlier=[{grown.runs()[0] / 'runs.json'}]")
    assert alone.summary()["result_digest"] == whole.summary()["result_digest"], "and keep it without their folders"
    assert "task=view" not in alone.out.splitlines()[-1], "nothing to view is left of them"

    for content, said in (
        ('{"runs": [{"scenario": 3}]}', "a run without"),
        ("[]", "not the runs.json of a study"),
        ("{", "not the runs.json of a study"),
    ):
        (tmp_path / "runs.json").write_text(content)
        wrong = cli("task=study", f"task.earlier=[{tmp_path}]")
        assert wrong.status == 2 and said in wrong.err and len(wrong.err.splitlines()) == 1, wrong.err
    empty = tmp_path / "empty"
    empty.mkdir()
    nothing = cli("task=study", f"log={empty}", f"task.earlier=[{grown.runs()[0]}]")
    assert nothing.status == 2 and "no finished run below it" in nothing.err, "a folder that is named counts"


def test_runs_that_repair_in_another_way_are_counted_apart():
    told = {"scenario": 8, "metric": "rolling_mean", "seed": 2, "engine": "mujoco", "budget": "paper"}
    assert method(told) == method({**told, "repair": {"name": "paper"}}) == "rolling_mean"
    other = method({**told, "repair": {"name": "gaits"}})
    assert other == "rolling_mean, repair=gaits"
    words = shlex.split(repeated({**told, "metric": other}))
    assert {"metric=rolling_mean", "repair=gaits", "+scenario=8"} <= set(words)


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


def test_a_run_that_is_there_twice_counts_once():
    runs = study_of([1], range(3))
    assert once([*runs, runs[1]]) == runs


def test_doubts_are_counted_against_the_truth():
    """Said of a right diagnosis: false. Not said of a wrong one, or of a truth that no genome can say: missed."""
    leg = {"effect": "part_lost", "target": "upper_rear_left", "values": {}}
    lighter = {"effect": "part_mass", "target": "body", "values": {"change": -0.5}}
    cases = [(True, leg, False), (True, leg, True), (False, leg, True), (False, leg, False), (True, lighter, False)]
    rows = []
    for k, (right, truth, said) in enumerate(cases):
        (summary,) = study_of([1], [k])
        diagnosis = {"found": int(right), "true": 1, "invented": 0, "right": right}
        rows.append(row(summary | {"diagnosis": diagnosis, "truth": [truth], "doubt": {"said": said}}))
    assert total(rows)["rolling_mean"]["doubt"] == {
        "right": 2, "false": 1, "wrong": 3, "missed": 2, "unsayable": 1, "missed_unsayable": 1,
    }  # fmt: skip
    (line,) = by_case(rows)
    assert (line["doubts"], line["doubts_told"]) == (2, 5)


def test_the_run_to_show_is_of_situation_five_and_of_both_metrics():
    runs = study_of([3, 5], [0, 1]) + study_of([3], [0, 1], "distance") + study_of([5], [1], "distance")
    assert [(s["metric"], s["scenario"], s["seed"]) for s in pair_to_show(runs)] == [
        ("rolling_mean", 5, 1),
        ("distance", 5, 1),
    ]
    runs = study_of([3, 5], [0]) + study_of([3], [0], "distance")
    assert [s["scenario"] for s in pair_to_show(runs)] == [3, 3], "the first that both have"
    assert [s["scenario"] for s in pair_to_show(study_of([3, 5], [0]))] == [5], "of one metric alone"


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


def test_runs_of_one_seed_with_other_settings_are_one_pair():
    runs = study_of([1], range(4))
    gain = [s["distance_m"]["trials"][-1] - s["distance_m"]["after"] for s in runs]
    variants = [{**s, "budget": budget} for s in runs for budget in ("paper", "quick", "small")]
    (line,) = by_case([row(s) for s in variants])
    assert (line["runs"], line["test"].n) == (12, 4)
    assert line["test"].low == pytest.approx(min(gain)) and line["test"].high == pytest.approx(max(gain))


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


def test_the_first_lines_of_a_study_tell_what_how_sure_and_what_next(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    summaries = study_of([1, 2], range(8))
    page = page_of(summaries)
    assert page.tone == "good" and page.first[-1] == "Next: nothing has to be done."
    assert "2 of 2 cases" in page.first[1]
    summaries[9] |= {"restored": False, "recovered_fraction": 0.42, "folder": "logs/a sweep/5"}
    assert page_of(summaries).following.startswith("python -m ee_dist +scenario=2"), "nothing to view is there"
    (tmp_path / "logs/a sweep/5").mkdir(parents=True)
    page = page_of(summaries)
    assert (
        page.headline == "Function restored in 15 of 16 runs; the diagnosis right in 16 of 16." and page.tone == "open"
    )
    assert page.first[-1] == "Not restored: 1; the worst is case 2, seed 1 at 42 % of intact."
    assert "task=view" in page.following and "logs/a sweep/5" in page.following
    assert "no test" in page_of(study_of([1, 2], [0])).first[1]
    assert page_of(study_of([1, 2], [0])).first[-1].startswith("Next: more seeds")
    assert page_of(study_of([1, 2], [0])).first[-1].endswith("with 2 cases p can fall below 0.05 from 7 seeds on.")
    assert (seeds_for(1), seeds_for(13)) == (6, 10)
    quick = page_of([{**s, "budget": "quick"} for s in study_of([1], range(4))])
    assert quick.tone == "open" and "without budget=quick" in quick.first[-1]
    assert "cannot be below 0.5" in page_of(study_of([1, 2], range(3))).first[1], "0.25, of two cases"
    assert (
        last_name([{"trials": 4}] * 2) == "fourth trial" and last_name([{"trials": 4}, {"trials": 2}]) == "last trial"
    )


@pytest.mark.parametrize(("width", "dark"), [(1280, True), (400, False)], ids=["wide-dark", "narrow-light"])
@pytest.mark.parametrize("runs", [1, 3])
def test_the_page_of_a_study_is_quiet_and_fits(window, tmp_path, width, dark, runs):
    page = write_page(page_of(study_of(range(1, 14), range(runs))), tmp_path / "report.html")
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
    rows = [row(s) for s in study_of(range(1, 14), range(10))]
    study._print(Console(file=out, width=80), by_case(rows), total(rows))
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
