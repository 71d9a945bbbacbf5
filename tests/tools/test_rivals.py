"""The command that runs the rivals side by side, on sizes too small to say anything about them."""

from __future__ import annotations

import json
import sys

import numpy as np
import pytest

from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.recovery.loop import recover
from ee_dist.recovery.observer import Observer
from ee_dist.recovery.repair import network
from ee_dist.rivals.ledger import Ledger
from ee_dist.rivals.roster import ROSTER
from ee_dist.robots.quadruped import quadruped

TINY = ["population=8", "generations=2", "crossovers=2", "diagnosis_population=8", "diagnosis_generations=1",
        "compensating_trials=2", "steps=80", "polish=0"]  # fmt: skip
COMMAND = ["--scenarios", "3", "--seeds", "1", "--budget", "quick", "--change", *TINY, "--body-trials", "11",
           "--map-trials", "3", "--map-evaluations", "30", "--single"]  # fmt: skip


def study(out, *more):
    import rivals

    assert rivals.main([*COMMAND, "--out", str(out), *more]) == 0
    found = {}
    for file in out.glob("*_scenario3_seed1_*.json"):
        content = json.loads(file.read_text(encoding="utf-8"))
        assert content.pop("seconds") >= 0.0
        found[content["rival"]] = content
    return found


@pytest.fixture(scope="module")
def done(tmp_path_factory):
    out = tmp_path_factory.mktemp("rivals")
    return study(out), out


def test_every_rival_runs_to_its_end_and_the_table_has_them_all(done):
    found, out = done
    assert set(found) == set(ROSTER)
    for content in found.values():
        assert len(content["trials_m"]) == sum(row[0] for row in content["spent"])
        assert content["truth"][0]["effect"] == "part_lost"
    table = (out / "table.md").read_text(encoding="utf-8")
    assert all(entry.title in table for entry in ROSTER.values())
    assert len((out / "runs.csv").read_text(encoding="utf-8").splitlines()) == 1 + len(ROSTER)
    assert len(json.loads((out / "rivals.json").read_text(encoding="utf-8"))["runs"]) == len(ROSTER)
    assert (out / "rivals.png").is_file() or (out / "rivals.html").is_file()


def test_trials_are_counted_and_all_begin_with_the_same_one(done):
    found, _ = done
    trials = {name: len(content["trials_m"]) for name, content in found.items()}
    with_model = ("loop", "bayes", "bayes_beside", "no_diagnosis", "random_hypotheses")
    assert {trials[n] for n in with_model} == {3}, "one right after the change, two compensating"
    assert trials["trial_and_error"] == 4
    assert 1 <= trials["body_alone"] <= 11
    assert len({content["trials_m"][0] for content in found.values()}) == 1
    assert len({content["intact_m"] for content in found.values()}) == 1
    for name in ("body_alone", "trial_and_error"):
        assert found[name]["after"]["simulated"] == 0, f"{name} simulates nothing after the change"
    assert found["trial_and_error"]["before"]["asked"] > found["loop"]["before"]["asked"] > 0
    assert found["loop"]["after"]["simulated"] > 0


def test_the_same_command_gives_the_same_result_elsewhere(done, tmp_path):
    found, _ = done
    some = ("bayes", "trial_and_error", "body_alone", "random_hypotheses")
    again = study(tmp_path, "--rivals", ",".join(some))
    assert {n: again[n] for n in some} == {n: found[n] for n in some}, "whoever ran before"


def test_a_study_goes_on_where_it_was_stopped(done, capsys):
    found, out = done
    (file,) = out.glob("bayes_scenario3_*.json")
    file.unlink()
    assert study(out) == found
    told = capsys.readouterr().out
    assert told.count("(was there)") == len(ROSTER) - 1


def test_a_table_can_be_written_beside_a_study_that_runs(done, capsys):
    found, out = done
    (journal,) = out.glob("simulated_*.bin")
    with journal.open("ab") as other:
        other.write(b"half an entry")
    before = journal.read_bytes()
    assert study(out, "--only-write") == found
    assert journal.read_bytes() == before
    assert ROSTER["loop"].title in capsys.readouterr().out


def test_the_loop_is_the_loop(done):
    from rivals import settings_of

    class Args:
        budget, change, engine = "quick", TINY, "mujoco"

    config, robot, engine = settings_of(Args, 3, 1), quadruped(), MuJoCoEngine(threads=1)
    search, *rest = np.random.SeedSequence(1).spawn(3)
    assert config.scenario is not None
    bodies = [PhysicalRobot(engine, robot, h, s) for h, s in zip(((), config.scenario.hidden()), rest, strict=True)]
    evaluator = CachedEvaluator(SerialEvaluator(engine))
    result = recover(robot, *bodies, config.metric.build(), config.budget.plan(), evaluator, search, Observer())
    mine = done[0]["loop"]
    assert mine["trials_m"] == [result.after, *result.trials]
    spent = mine["before"]["simulated"] + mine["after"]["simulated"]
    assert spent == evaluator.counts.simulated, "a rival is charged as if it were alone"
    engine.close()


def test_announced_trials_are_the_same_trials():
    from benchmarks.rival_run import Watched

    engine, robot, seed = MuJoCoEngine(threads=1), quadruped(), np.random.SeedSequence(0)
    drivers = [network(g) for g in np.random.default_rng(0).integers(-100, 101, (3, 68)).astype(np.int16)]
    ledger = Ledger(CachedEvaluator(SerialEvaluator(engine)))
    told, untold = (Watched(PhysicalRobot(engine, robot, (), seed), engine, robot, ledger) for _ in range(2))
    told.announce(drivers, 60)
    for driver in drivers:
        a, b = told.trial(driver, 60), untold.trial(driver, 60)
        assert a.sensors.tobytes() == b.sensors.tobytes() and a.travel_m == b.travel_m
    assert told.physical.trials == untold.physical.trials == 3
    assert told.trials_m == untold.trials_m and told.no_gait == untold.no_gait
    engine.close()


def test_without_ribs_the_others_are_there_and_the_absent_is_named(tmp_path, monkeypatch, capsys):
    import rivals

    monkeypatch.setitem(sys.modules, "ribs.archives", None)
    assert rivals.main([*COMMAND, "--out", str(tmp_path), "--rivals", "no_diagnosis,trial_and_error"]) == 1
    assert "pip install 'ee_dist[rivals]'" in capsys.readouterr().err
    assert len(list(tmp_path.glob("no_diagnosis_*.json"))) == 1


@pytest.mark.parametrize(
    ("words", "said"),
    [(["--rivals", "luck"], "no such rival"), (["--change", "size=3"], "no such setting of a budget")],
)
def test_a_mistake_is_told_in_a_line(tmp_path, words, said, capsys):
    import rivals

    with pytest.raises(SystemExit):
        rivals.main(["--out", str(tmp_path), *words])
    assert said in capsys.readouterr().err
