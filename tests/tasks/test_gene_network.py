"""The loop on a gene network, by the command line: the same run, recording, scene and digest as for a robot."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from rerun.chunk import RrdReader
from schemas import validated

from ee_dist.effects.catalogue import apply, from_dict
from ee_dist.engines.contract import Rollout
from ee_dist.engines.kinetics.engine import KineticsEngine
from ee_dist.evaluation.ray_apart import stop_ray
from ee_dist.networks.dream4 import dream4
from ee_dist.recording.errors import RecordingError
from ee_dist.recording.reader import ANY, read_run
from ee_dist.recording.records import DIAGNOSIS, HARDWARE, PREDICTION, REPAIR
from ee_dist.tasks.wiring import close_evaluators

NETWORK = ("+system=gene_network", "+scenario=knockout")
SMALL = (
    *NETWORK, "budget.population=16", "budget.generations=3", "budget.crossovers=4", "budget.diagnosis_population=24",
    "budget.diagnosis_generations=2", "budget.compensating_trials=1", "budget.polish=1",
)  # fmt: skip


@pytest.fixture
def own_ray() -> Iterator[None]:
    """Ray, which stays for the next run of a process, is ended with the test: others begin without it."""
    yield
    close_evaluators()
    stop_ray()


def test_a_run_leaves_what_a_robots_run_leaves_and_one_digest_wherever_it_runs(cli, own_ray):
    outcome = cli(*SMALL)
    assert outcome.status == 0, outcome.err
    summary = outcome.summary()
    assert (summary["scenario"], summary["engine"]) == ("knockout", "kinetics")
    assert summary["truth"] == [{"effect": "gene_knockout", "target": "G10", "values": {}}]
    assert summary["agreement"]["intact"] == summary["expected"][0] <= 1.0
    assert "what the network believed" in outcome.out and "distance" not in outcome.out and " m " not in outcome.out
    (folder,) = outcome.runs()
    run = read_run(folder / "recovery.mcap", ANY)
    assert run.complete and run.robot == dream4()
    assert {g.phase for g in run.generations} == {REPAIR, DIAGNOSIS}
    assert {t.index for t in run.trials if t.source == PREDICTION} == {0, 1, 2}
    hardware = {t.index: t for t in run.trials if t.source == HARDWARE}
    truth = [from_dict({"effect": t["effect"], "target": t["target"]}) for t in summary["truth"]]
    last = hardware[2]
    (again,) = KineticsEngine().rollout([Rollout(apply(run.robot, truth), last.driver, len(last.log))])
    assert again.sensors.tobytes() == last.log.sensors.tobytes(), "the recorded controller does it again"
    with pytest.raises(RecordingError, match="of dream4_size10_1, which is no robot"):
        read_run(folder / "recovery.mcap")
    chunks = [(c.entity_path, c.to_record_batch()) for c in RrdReader(folder / "recovery.rrd").stream().to_chunks()]
    drawn = {path: batch for path, batch in chunks if "Scalars:scalars" in batch.schema.names or path == "/network"}
    assert {"/network", "/sensors/level_G4/wanted", "/sensors/level_G4/measured", "/commands/stimulus_G9"} <= set(drawn)
    wanted = np.concatenate(drawn["/sensors/level_G4/wanted"].column("Scalars:scalars").to_pylist())
    assert np.nanmax(wanted) == 0.5 and np.nanmin(wanted) == 0.3
    alone = cli("task=view", f"log={folder / 'recovery.mcap'}", "task.open=false", "task.rebuild=true")
    assert alone.status == 0 and list(alone.folder.glob("logs/view/*/recovery.rrd"))
    refused = cli("task=compare", f"measured={folder / 'recovery.mcap'}")
    assert refused.status == 2 and "which is no robot" in refused.err
    same = [
        ("evaluator.cache=false", "evaluator.chunk=3"),
        ("evaluator=ray", "evaluator.workers=2", "evaluator.chunk=5"),
    ]
    digests = {cli(*SMALL, *extra).summary()["result_digest"] for extra in same}
    assert digests == {summary["result_digest"]}
    assert cli(*SMALL, "seed=1").summary()["result_digest"] not in digests


def test_every_scenario_runs_with_the_other_metric_noise_and_another_wanted_gene(cli):
    outcome = cli(
        "-m", "+system=gene_network", "+scenario=altered_rate,lost_link,two_faults", "metric=distance", "noise=0.02",
        *SMALL[2:], "hydra.sweep.subdir=${hydra.job.num}", "budget.steps=60",
        "system.output=G2", "system.levels=[[2,0.5]]", "system.stimulated=[G1,G8]",
    )  # fmt: skip
    assert outcome.status == 0, outcome.err
    truths = {s["scenario"]: s["truth"] for s in (validated(run / "summary.json") for run in outcome.runs())}
    assert {name: len(truth) for name, truth in truths.items()} == {"altered_rate": 1, "lost_link": 1, "two_faults": 2}


@pytest.mark.slow
def test_a_hidden_knockout_is_found_and_the_function_restored_in_nine_of_ten_seeds(cli):
    outcome = cli("-m", *NETWORK, "seed=range(10)")
    assert outcome.status == 0, outcome.err
    runs = [validated(folder / "summary.json") for folder in outcome.runs()]
    assert len(runs) == 10
    good = [r for r in runs if r["restored"] and r["diagnosis"]["right"] and len(r["agreement"]["trials"]) <= 4]
    assert len(good) >= 9
    broken = [r for r in runs if r["agreement"]["after"] < 0.9 * r["agreement"]["intact"]]
    assert len(broken) >= 9, "the fault is one that hurts"
