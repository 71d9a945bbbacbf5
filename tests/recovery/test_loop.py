"""The loop: who is asked what, in which order, and that it finds a change it can say."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from ee_dist.effects import term
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.evolution.ga import Budget
from ee_dist.recording.records import (
    EVOLVED,
    HARDWARE,
    HINDSIGHT,
    POLISHED,
    PREDICTION,
    PRUNED,
    GenerationRecord,
    HypothesisRecord,
    TrialRecord,
)
from ee_dist.recovery import loop
from ee_dist.recovery.diagnosis import Judge, believe, diagnose, polish, prune
from ee_dist.recovery.genome import decode, first_hypotheses
from ee_dist.recovery.loop import Plan, recover
from ee_dist.recovery.metrics import RollingMean
from ee_dist.recovery.observer import Observer
from ee_dist.robots.quadruped import quadruped

ROBOT = quadruped()
SEED = np.random.SeedSequence(0)
SMALL = Budget(population=12, generations=2, crossovers=3)


class Notes(Observer):
    def __init__(self) -> None:
        self.passes: list[tuple[str, int]] = []
        self.generations: list[GenerationRecord] = []
        self.said: list[HypothesisRecord] = []
        self.trials: list[TrialRecord] = []

    def pass_started(self, phase: str, pass_index: int, generations: int) -> None:
        self.passes.append((phase, pass_index))

    def generation(self, record: GenerationRecord) -> None:
        self.generations.append(record)

    def hypotheses(self, records: Sequence[HypothesisRecord]) -> None:
        self.said.extend(records)

    def trial(self, record: TrialRecord) -> None:
        self.trials.append(record)


@pytest.fixture(scope="module")
def engine():
    made = PyBulletEngine()
    yield made
    made.close()


@pytest.fixture(scope="module")
def finished(engine):
    hidden = (term("part_lost", "upper_rear_left"),)
    notes = Notes()
    plan = Plan(repair=SMALL, diagnosis=Budget(population=100, generations=8), compensating_trials=2, steps=120)
    changed = PhysicalRobot(engine, ROBOT, hidden, SEED)
    result = recover(
        ROBOT, PhysicalRobot(engine, ROBOT, (), SEED), changed, RollingMean(), plan,
        CachedEvaluator(SerialEvaluator(engine)), np.random.SeedSequence(1), notes,
    )  # fmt: skip
    return result, notes, changed


def test_passes_and_trials_come_in_the_papers_order(finished):
    result, notes, changed = finished
    assert notes.passes == [("repair", 0), ("diagnosis", 0), ("repair", 1), ("diagnosis", 1), ("repair", 2)]
    hardware = [(t.index, t.name) for t in notes.trials if t.source == HARDWARE]
    assert hardware == [(0, "intact"), (1, "after the change"), (2, "trial 1"), (3, "trial 2")]
    said = [(t.index, t.source) for t in notes.trials]
    before, after = [i for i, s in said if s == PREDICTION], [i for i, s in said if s == HINDSIGHT]
    assert (before, after) == ([0, 1, 2, 3], [1, 2]), "each trial is forecast, each diagnosed one explained"
    assert all(said.index((k, PREDICTION)) < said.index((k, HARDWARE)) for k in before)
    assert all(said.index((k, HINDSIGHT)) > said.index((k, HARDWARE)) for k in after)
    assert changed.trials == 3, "one right after the change, two compensating"
    assert len(result.trials) == len(result.hypotheses) == 2


def test_restarts_begin_with_the_intact_gait_and_the_last_pass_with_all(engine, monkeypatch):
    seen: list[int] = []

    def spy(model, database, *rest):
        seen.append(len(database))
        return _some_controller(), 0.0

    monkeypatch.setattr(loop, "repair", spy)
    few = Budget(population=8, generations=1, crossovers=2)
    for restarts in (0, 2, 5):
        plan = Plan(repair=few, diagnosis=few, compensating_trials=3, steps=80, polish=0, restarts=restarts)
        robots = [PhysicalRobot(engine, ROBOT, (), SEED) for _ in range(2)]
        evaluator = CachedEvaluator(SerialEvaluator(engine))
        recover(ROBOT, *robots, RollingMean(), plan, evaluator, np.random.SeedSequence(1), Observer())
    assert seen == [0, 1, 2, 3, 0, 1, 1, 3, 0, 1, 1, 3]


def test_an_intact_robot_does_what_its_model_says(finished):
    result, notes, _ = finished
    measured, predicted = (
        next(t for t in notes.trials if t.index == 0 and t.source == s) for s in (HARDWARE, PREDICTION)
    )
    assert measured.log.sensors.tobytes() == predicted.log.sensors.tobytes()
    assert result.intact == result.expected[0]


def test_a_lost_leg_is_found_and_the_repair_then_keeps_its_promise(finished):
    result, _, _ = finished
    assert result.hypotheses[-1] == (term("part_lost", "upper_rear_left"),)
    assert result.errors[-1] == 0.0
    assert result.trials[-1] == result.expected[-1], (
        "on the right model a controller does on the body what it did there"
    )


def test_a_prediction_is_what_the_pass_that_chose_the_controller_expected(finished):
    result, notes, _ = finished
    forecast = {t.index: t for t in notes.trials if t.source == PREDICTION}
    assert [forecast[k].believed for k in range(4)] == [(), (), *result.hypotheses]
    expected = [result.expected[0], *result.expected]
    assert [forecast[k].log.travel_m for k in range(4)] == expected
    hindsight = {t.index: t.believed for t in notes.trials if t.source == HINDSIGHT}
    assert hindsight == dict(enumerate(result.hypotheses, start=1))


def test_the_last_population_is_different_and_sorted(finished):
    _, notes, _ = finished
    for k in range(2):
        last = [h for h in notes.said if h.stage == EVOLVED and h.pass_index == k]
        assert 1 < len(last) <= 10
        assert not any(h.final for h in last)
        assert len({h.terms for h in last}) == len(last)
        assert [h.error for h in last] == sorted(h.error for h in last)


def test_what_the_loop_acts_on_is_told_as_final_and_nothing_else_is(finished):
    result, notes, _ = finished
    assert [(h.pass_index, h.terms, h.error) for h in notes.said if h.final] == [
        (k, h, e) for k, (h, e) in enumerate(zip(result.hypotheses, result.errors, strict=True))
    ]


@pytest.mark.parametrize(
    ("polishing", "parsimony", "stages"),
    [(2, 0.1, [POLISHED, PRUNED]), (2, 0.0, [POLISHED]), (0, 0.1, [PRUNED]), (0, 0.0, [EVOLVED])],
)
def test_stages_that_are_left_out_are_not_told(weak, polishing, parsimony, stages):
    notes = Notes()
    belief = believe(weak, [], SMALL, polishing, parsimony, np.random.SeedSequence(0), notes, 0)
    population = [h for h in notes.said if h.stage == EVOLVED and not h.final]
    told = notes.said[notes.said.index(population[-1]) + 1 :]
    assert [h.stage for h in told] == stages
    assert [h.final for h in told] == [False] * (len(stages) - 1) + [True]
    assert (told[-1].terms, told[-1].error) == (belief.hypothesis, belief.error)
    assert population[0].error >= told[0].error


def test_repair_fitness_never_falls_within_a_pass(finished):
    _, notes, _ = finished
    for k in range(3):
        best = [g.best for g in notes.generations if g.phase == "repair" and g.pass_index == k]
        assert best == sorted(best)


def judge_of(engine, hidden):
    """It remembers what it simulated, as that of a run does: to polish anew for more rounds costs the last of them."""
    controller = _some_controller()
    log = PhysicalRobot(engine, ROBOT, hidden, SEED).trial(controller, 100)
    return Judge(ROBOT, [(controller, log)], RollingMean(), CachedEvaluator(SerialEvaluator(engine)))


@pytest.fixture(scope="module")
def weak(engine):
    return judge_of(engine, (term("motor_weak", "knee_front_left", loss=0.5),))


def _some_controller():
    from ee_dist.engines.drivers import Network

    rng = np.random.default_rng(5)
    return Network(tuple(float(v) for v in np.round(rng.uniform(-1, 1, 68), 2)))


def test_the_truth_has_no_error_and_others_have(engine):
    truth = (term("motor_weak", "knee_front_left", loss=0.5),)
    errors = judge_of(engine, truth).errors([truth, (), (term("motor_weak", "knee_front_left", loss=0.6),)])
    assert errors[0] == 0.0
    assert (errors[1:] > 0).all()


def test_pruning_drops_what_explains_nothing_and_keeps_the_rest(engine):
    truth = (term("part_lost", "upper_rear_left"),)
    judge = judge_of(engine, truth)
    idle = (term("joint_jam", "knee_front_left", loss=0.01), *truth)
    error = float(judge.errors([idle])[0])
    assert prune(judge, idle, error, 0.1) == (truth, 0.0)
    needed = (term("motor_weak", "knee_front_left", loss=0.5), *truth)
    judge = judge_of(engine, needed)
    assert prune(judge, needed, float(judge.errors([needed])[0]), 0.1) == (needed, 0.0)


def test_polishing_finds_the_bottom_of_the_valley_and_never_climbs(engine):
    truth = (term("motor_weak", "knee_front_left", loss=0.5),)
    judge = judge_of(engine, truth)
    (start,) = first_hypotheses(1, np.random.default_rng(2))
    before = float(judge.errors([decode(start, ROBOT)])[0])
    assert polish(judge, start, before, 0) == (start, before)
    errors = [polish(judge, start, before, rounds)[1] for rounds in (1, 4, 12)]
    assert before > errors[0] >= errors[1] >= errors[2]
    genome, error = polish(judge, start, before, 12)
    fresh = judge_of(engine, truth)
    assert error == float(fresh.errors([decode(genome, ROBOT)])[0]) == 0.0
    assert prune(judge, decode(genome, ROBOT), error, 0.1)[0] == truth


def test_nothing_broken_is_diagnosed_as_nothing(engine):
    judge = judge_of(engine, ())
    notes = Notes()
    genome, error = diagnose(judge, [], Budget(population=60, generations=3, crossovers=10), SEED, notes, 0)
    pruned, error = prune(judge, decode(genome, ROBOT), error, 0.1)
    assert (pruned, error) == ((), 0.0)


def test_hardware_hides_its_truth():
    engine = PyBulletEngine()
    hidden = (term("motor_weak", "knee_front_left", loss=0.5),)
    body = PhysicalRobot(engine, ROBOT, hidden, SEED)
    assert not hasattr(body, "__dict__")
    public = [getattr(body, name) for name in ("trials",)]
    assert hidden not in public
    assert body.reveal() == hidden
    engine.close()
