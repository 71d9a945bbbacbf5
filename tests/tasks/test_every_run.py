"""The main job in every scenario, in sweeps, and wherever it is evaluated."""

from __future__ import annotations

import json
from itertools import cycle

import pytest

METRICS = ("rolling_mean", "distance")
POLISHED = 8
"""The scenario whose diagnoses are polished too, by either metric: what is tried there is the same for all."""


@pytest.mark.parametrize(("scenario", "metric"), [*zip(range(1, 14), cycle(METRICS), strict=False), (8, METRICS[0])])
def test_every_scenario_runs_with_either_metric(cli, scenario, metric):
    outcome = cli(
        f"+scenario={scenario}", f"metric={metric}", "evaluator=serial", "budget=quick", "budget.population=4",
        "budget.generations=1", "budget.diagnosis_population=4", "budget.diagnosis_generations=1", "budget.crossovers=1",
        "budget.compensating_trials=1", "budget.steps=62", "budget.tournament=2",
        f"budget.polish={int(scenario == POLISHED)}",
    )  # fmt: skip
    assert outcome.status == 0, outcome.err
    assert outcome.summary()["scenario"] == scenario


def test_a_sweep_gives_each_job_its_own_folder(cli, tiny):
    outcome = cli("-m", "+scenario=1,9", "seed=0,1", "evaluator=serial", *tiny, "budget.compensating_trials=1")
    assert outcome.status == 0, outcome.err
    summaries = [json.loads((run / "summary.json").read_text()) for run in outcome.runs()]
    assert {(s["scenario"], s["seed"]) for s in summaries} == {(1, 0), (1, 1), (9, 0), (9, 1)}
    assert len({s["result_digest"] for s in summaries}) == 4
    names = [run.name for run in outcome.runs()]
    assert sum("scenario-1" in name for name in names) == sum("scenario-9" in name for name in names) == 2
    assert not [name for name in names if set("'+ ") & set(name)], "a shell must take them as they are"


def test_a_run_that_goes_wrong_does_not_stop_the_sweep(cli, tiny):
    """The others are made; the end says which is missing, and what makes it."""
    once = ("budget.compensating_trials=1", "hydra.sweep.dir=logs/all")
    outcome = cli("-m", "+scenario=9", "seed=0,-1,1", "evaluator=serial", *tiny, *once)
    assert outcome.status == 2
    assert [json.loads((run / "summary.json").read_text())["seed"] for run in outcome.runs()] == [0, 1]
    first, last = outcome.err.strip().splitlines()
    assert "seed=-1" in first
    assert "1 of 3 runs ended early: logs/all/" in last
    assert "resume=logs/all" in last


def test_the_runs_of_a_sweep_go_side_by_side_with_the_same_digests(cli, tiny):
    sweep = ["-m", "+scenario=1,9", "evaluator=serial", *tiny, "budget.compensating_trials=1"]
    digests = []
    for launcher in ([], ["hydra/launcher=joblib", "hydra.launcher.n_jobs=2"]):
        outcome = cli(*sweep, *launcher)
        assert outcome.status == 0, outcome.err
        summaries = [json.loads((run / "summary.json").read_text()) for run in outcome.runs()]
        digests.append({(s["scenario"], s["result_digest"]) for s in summaries})
    assert digests[0] == digests[1]
    assert len(digests[0]) == 2


@pytest.mark.parametrize(("engine", "workers"), [("pybullet", 3), ("mujoco", 2)])
def test_one_digest_wherever_it_runs_and_another_for_another_seed(cli, tiny, engine, workers):
    """A generation in any pieces, and once with polish, the largest batch of a run."""
    base = ["+scenario=3", f"engine={engine}", *tiny, "budget.compensating_trials=1"]
    here, pieces = ["evaluator=serial"], ["evaluator=serial", "evaluator.cache=false", "evaluator.chunk=3"]
    # Ray is started once, for the run that has all parts: it takes as long as three runs.
    elsewhere = ["evaluator=ray", f"evaluator.workers={workers}", "evaluator.chunk=1", "evaluator.cache=false"]
    digests = {cli(*base, *extra).summary()["result_digest"] for extra in (here, pieces)}
    assert len(digests) == 1
    polished = {cli(*base, "budget.polish=1", *extra).summary()["result_digest"] for extra in (here, elsewhere)}
    assert len(polished) == 1 and polished != digests
    assert cli(*base, *here, "seed=1").summary()["result_digest"] not in digests
