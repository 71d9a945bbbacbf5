"""The repair with a map of gaits: budgets, what is chosen, what passes hand on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from ee_dist.effects import apply, term
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.evolution.archive import Judged
from ee_dist.evolution.ga import SCALE, Budget
from ee_dist.networks.dream4 import dream4
from ee_dist.recording.records import MAP, REPAIR, GenerationRecord
from ee_dist.recovery.kinds import subject_of
from ee_dist.recovery.map_search import Mapping, MapSearch
from ee_dist.recovery.observer import Observer
from ee_dist.recovery.repair import network
from ee_dist.recovery.repertoire import Repertoire
from ee_dist.robots.quadruped import quadruped
from ee_dist.trials.log import SensorLog

ROBOT = quadruped()
SMALL = Budget(population=12, generations=3, crossovers=3)


class Notes(Observer):
    def __init__(self) -> None:
        self.generations: list[GenerationRecord] = []

    def generation(self, record: GenerationRecord) -> None:
        self.generations.append(record)


@pytest.fixture(scope="module")
def engine():
    made = MuJoCoEngine(threads=1)
    yield made
    made.close()


def genomes(n: int) -> np.ndarray:
    return np.random.default_rng(n).integers(-SCALE, SCALE, size=(n, 68), endpoint=True).astype(np.int16)


def log(tipped: bool, shares: tuple[float, ...]) -> SensorLog:
    """A log of 100 rows of a body that goes 1 m, on its back or not, each foot down for its share of the time."""
    rows = np.arange(100)
    pose = np.zeros((100, 7))
    pose[:, 0] = rows / 99
    pose[:, 3 if tipped else 6] = 1.0
    pose[0, 3:] = (0, 0, 0, 1)
    sensors = np.zeros((100, 8))
    for k, share in enumerate(shares):
        sensors[:, k] = np.where(rows < 100 * share, 1.0, -1.0)
    names = ROBOT.sensor_names
    return SensorLog(
        rows * 0.01, sensors, np.zeros((100, 8)), names, ("1",) * 8, ROBOT.motor_names, base_pose=pose, travel_m=1.0
    )


def test_a_gait_is_placed_by_its_feet_on_the_floor_and_none_on_the_back_counts():
    behaviour = subject_of(ROBOT).behaviour(ROBOT)
    assert behaviour(log(False, (0.0, 0.25, 0.5, 1.0))) == pytest.approx([1.0, 1.0, 0.0, 0.25, 0.5, 1.0])
    assert behaviour(log(True, (0.0, 0.25, 0.5, 1.0)))[1] == 0.0


def test_what_feels_no_floor_is_placed_by_all_its_sensors_and_a_network_by_its_levels():
    blind = replace(ROBOT, sensors=tuple(s for s in ROBOT.sensors if s.kind != "touch"))
    assert subject_of(blind).behaviour(blind).channels == (0, 1, 2, 3)
    cells = dream4()
    assert len(subject_of(cells).behaviour(cells).channels) == len(cells.sensors)


@pytest.mark.parametrize(("first", "kept"), [(1.0, 0.2), (0.3, 0.2), (0.1, 0.9), (0.01, 0.01), (0.5, 1.0)])
def test_a_generation_simulates_no_more_than_the_papers(first, kept):
    tried, whole = Mapping(first=first, kept=kept).tried(100)
    assert 1 <= whole <= tried
    assert whole + (first * tried if tried > whole else 0) <= 100 or first == 1.0
    if (first, kept) == (0.3, 0.2):
        assert (tried, whole) == (200, 40)


def test_a_pass_follows_from_its_seed_and_costs_at_most_what_the_papers_asks_for(engine):
    model = apply(ROBOT, (term("part_lost", "upper_rear_left"),))
    found, costs = [], []
    for _ in range(2):
        evaluator, notes = CachedEvaluator(SerialEvaluator(engine)), Notes()
        repertoire = Repertoire(Mapping(), 1)
        seed = np.random.SeedSequence(3)
        repertoire.prepare(ROBOT, network(genomes(1)[0]), evaluator, SMALL, 60, seed, notes)
        mapped = evaluator.counts.copy()
        assert mapped == repertoire.cost
        found.append(
            [
                repertoire.repair(model, [network(genomes(1)[0])], evaluator, SMALL, 60, s, notes, k)
                for k, s in enumerate(seed.spawn(2), start=1)
            ]
        )
        costs.append(evaluator.counts.copy())
        whole = (SMALL.population + SMALL.generations * SMALL.population // 2) * 60
        assert mapped.asked_steps <= whole
        assert evaluator.counts.since(mapped).asked_steps <= 2 * (whole + 10 * 60)
        for phase, index in ((MAP, 0), (REPAIR, 1), (REPAIR, 2)):
            best = [g.best for g in notes.generations if (g.phase, g.pass_index) == (phase, index)]
            assert len(best) == SMALL.generations + 1 and best == sorted(best)
    assert found[0] == found[1] and costs[0] == costs[1]
    (_, first), (_, second) = found[0]
    assert second >= first, "the second pass on one model begins with what the first found"


def test_a_gait_that_the_whole_rule_refuses_is_not_chosen_where_another_one_is(engine, monkeypatch):
    search = MapSearch(ROBOT, SerialEvaluator(engine), SMALL, 20, Mapping(), Observer(), REPAIR, 0)
    some = genomes(3)
    search.archive.add(some, [Judged(3.0 - k, True, (k / 3, 0.0, 0.0, 0.0)) for k in range(3)])
    refused = {network(some[0]).key}
    asked: list[str] = []
    real = search.evaluator.evaluate

    def evaluate(jobs):
        asked[:] = [jobs[0].rollout.driver.key]
        return real(jobs)

    monkeypatch.setattr(search.evaluator, "evaluate", evaluate)
    search.subject = replace(search.subject, cheats=lambda *_: ("flying",) * (asked[0] in refused))
    assert (search.choose().genome == some[1]).all()
    refused |= {network(g).key for g in some}
    assert (search.choose().genome == some[0]).all(), "where none walks, the one that goes farthest"


@pytest.mark.parametrize("wrong", [{"bins": 0}, {"first": 0.0}, {"kept": 1.5}, {"narrow": -0.1}])
def test_impossible_settings_are_refused(wrong):
    with pytest.raises(ValueError, match=f"repair: {next(iter(wrong))} must be"):
        Mapping(**wrong)
