"""The repair with a map of gaits by the command line: what it leaves, one digest, a resume, and a gene network."""

from __future__ import annotations

import json

import pytest

from ee_dist.evaluation.ray_apart import stop_ray
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.recording.reader import read_run
from ee_dist.recording.records import DIAGNOSIS, MAP, REPAIR
from ee_dist.tasks.summary import config_digest
from ee_dist.tasks.wiring import close_evaluators

GAITS = (
    "+scenario=8",
    "engine=mujoco",
    "repair=gaits",
    "repair.map_passes=1",
    "budget.compensating_trials=1",
    "budget.polish=1",
)


@pytest.fixture
def own_ray():
    yield
    close_evaluators()
    stop_ray()


def test_a_run_tells_its_map_and_has_one_digest_wherever_it_runs(cli, tiny, own_ray):
    close_evaluators()  # what runs before this one simulated is not simulated again
    outcome = cli(*tiny, *GAITS, "evaluator=serial")
    assert outcome.status == 0, outcome.err
    summary = outcome.summary()
    repair = summary["repair"]
    assert repair["name"] == "gaits"
    assert repair["map"]["kinds"] >= 1
    assert repair["before"]["asked"] > repair["map"]["asked"] > 0
    for name in ("asked", "simulated", "steps"):
        assert repair["before"][name] + repair["after"][name] == summary["evaluations"][name]
    (folder,) = outcome.runs()
    run = read_run(folder / "recovery.mcap")
    assert run.complete and "repair:\n  name: gaits" in run.attachments["config.yaml"].decode()
    assert {g.phase for g in run.generations} == {REPAIR, DIAGNOSIS, MAP}
    assert [g.generation for g in run.generations if g.phase == MAP] == [0, 1, 2]
    assert "map of the intact robot: best" in outcome.out
    again = cli(*tiny, *GAITS, "evaluator=ray", "evaluator.workers=2", "evaluator.chunk=3").summary()
    assert again["result_digest"] == summary["result_digest"]


def test_a_stopped_run_goes_on_to_the_same_bytes(cli, tiny, tmp_path, monkeypatch):
    whole = cli(*tiny, *GAITS, "evaluator=serial", f"hydra.run.dir={tmp_path}/whole")
    assert whole.status == 0, whole.err
    close_evaluators()
    real, calls = SerialEvaluator.evaluate, [0]

    def evaluate(self, jobs):
        calls[0] += 1
        if calls[0] == 6:
            raise RuntimeError("the power went, in the map")
        return real(self, jobs)

    monkeypatch.setattr(SerialEvaluator, "evaluate", evaluate)
    assert cli(*tiny, *GAITS, "evaluator=serial", f"hydra.run.dir={tmp_path}/run").status == 1
    close_evaluators()
    assert cli(*tiny, *GAITS, "evaluator=serial", f"resume={tmp_path}/run").status == 0
    one, other = (json.loads((tmp_path / n / "summary.json").read_text()) for n in ("whole", "run"))
    assert one["result_digest"] == other["result_digest"]
    assert (tmp_path / "whole" / "recovery.mcap").read_bytes() == (tmp_path / "run" / "recovery.mcap").read_bytes()


def test_a_gene_network_is_mapped_by_the_levels_of_its_genes(cli):
    outcome = cli(
        "+system=gene_network", "+scenario=knockout", "repair=gaits", "repair.map_passes=1", "budget.population=16",
        "budget.generations=3", "budget.crossovers=4", "budget.diagnosis_population=24", "budget.diagnosis_generations=2",
        "budget.compensating_trials=1", "budget.polish=1",
    )  # fmt: skip
    assert outcome.status == 0, outcome.err
    assert outcome.summary()["repair"]["map"]["kinds"] > 1
    assert "map of the intact network" in outcome.out


def test_the_papers_repair_leaves_the_digest_of_the_settings_as_it_was():
    from ee_dist.tasks.config import Config, RepairConfig
    from ee_dist.tasks.recover import Options

    plain = config_digest(Config(), Options())
    assert plain == "d75922d88a9a77e56ef2c2e2f491c7afbdd4b6cc27b6d31455e3d397dda2b9c3"
    gaits = config_digest(Config(repair=RepairConfig(name="gaits")), Options())
    assert plain != gaits
    assert gaits != config_digest(Config(repair=RepairConfig(name="gaits", bins=2)), Options())
