"""The genetic algorithm against the paper's numbers, and ask/tell that refuses to be called out of order."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.evolution.ga import SCALE, Budget, GeneticAlgorithm, values


def run(ga: GeneticAlgorithm, fitness) -> GeneticAlgorithm:
    while not ga.done:
        ga.tell(fitness(values(ga.ask())))
    return ga


def sphere(x: np.ndarray) -> np.ndarray:
    return -np.square(x - 0.37).sum(axis=1)


def seeded(seed: int = 0, length: int = 16, budget: Budget | None = None, seeds=None) -> GeneticAlgorithm:
    return GeneticAlgorithm(length, budget or Budget(generations=10), np.random.SeedSequence(seed), seeds)


def test_asks_for_the_whole_population_then_for_half():
    ga = seeded()
    sizes = []
    while not ga.done:
        g = ga.ask()
        sizes.append(len(g))
        ga.tell(sphere(values(g)))
    assert sizes == [200] + [100] * 10, "the paper: 200 genomes, then 100 offspring in each generation"


def test_best_never_gets_worse_and_search_beats_chance():
    ga = seeded(budget=Budget(generations=30))
    best = []
    while not ga.done:
        ga.tell(sphere(values(ga.ask())))
        best.append(ga.scores[0])
    assert all(b >= a for a, b in pairwise(best))
    chance = sphere(values(np.random.default_rng(1).integers(-SCALE, SCALE + 1, size=(3200, 16)))).max()
    assert best[-1] > chance


def test_genomes_have_two_decimals_within_one():
    ga = run(seeded(), sphere)
    v = values(ga.genomes)
    assert np.abs(v).max() <= 1.0
    assert np.array_equal(np.round(v, 2), v)


def test_survivors_are_the_best_half_and_keep_their_scores():
    ga = seeded(budget=Budget(population=20, generations=3, crossovers=2))
    ga.tell(sphere(values(ga.ask())))
    survivors, scores = ga.genomes[:10].copy(), ga.scores[:10].copy()
    ga.ask()
    assert np.array_equal(ga.genomes[:10], survivors)
    assert np.array_equal(ga.scores[:10], scores)


def test_mutation_and_clones_come_at_the_papers_rate():
    # Without crossover an offspring is a clone of a parent with probability 0.99 ** 68 = 0.505.
    budget = Budget(population=2000, generations=1, crossovers=0)
    ga = seeded(3, 68, budget)
    ga.ask()
    ga.tell(np.arange(2000.0))
    parents = {g.tobytes() for g in ga.genomes[:1000]}
    clones = np.mean([g.tobytes() in parents for g in ga.ask()])
    # A mutated value is the same by chance once in 201 times, which the bound covers.
    assert 0.45 < clones < 0.57


def test_crossover_keeps_every_value_at_its_place():
    budget = Budget(population=200, generations=1, mutation=0.0, crossovers=24)
    ga = seeded(5, 12, budget)
    ga.ask()
    ga.tell(np.arange(200.0))
    parents = ga.genomes[:100].copy()
    children = ga.ask()
    for column in range(12):
        assert set(children[:, column]) <= set(parents[:, column])
    known = {p.tobytes() for p in parents}
    crossed = sum(c.tobytes() not in known for c in children)
    assert 20 <= crossed <= 48, "24 pairs can make at most 48 children that no parent equals"


def test_tournaments_favour_the_better():
    budget = Budget(population=400, generations=1, mutation=0.0, crossovers=0)
    ga = seeded(7, 30, budget)
    ga.ask()
    ga.tell(np.arange(400.0)[::-1])
    rank = {g.tobytes(): k for k, g in enumerate(ga.genomes[:200])}
    mean = np.mean([rank[g.tobytes()] for g in ga.ask()])
    # The lowest of three ranks out of 200 is 49.5 on average; without selection it would be 99.5.
    assert 40 < mean < 60


def test_database_seeds_replace_the_first_of_the_population():
    seeds = np.full((3, 16), 37, dtype=np.int16)
    ga = seeded(0, seeds=seeds)
    assert np.array_equal(ga.ask()[:3], seeds)


def test_dominants_count_new_bests():
    ga = seeded(0, 4, Budget(population=4, generations=3, tournament=2, crossovers=0))
    for scores in ([1.0, 2.0, 0.0, 0.0], [1.0, 2.0], [3.0, 0.0], [3.0, 0.0]):
        ga.ask()
        ga.tell(np.array(scores))
    assert ga.dominants == 2, "the first best and 3.0; equals do not count"


@pytest.mark.parametrize("call", ["tell", "ask"])
def test_out_of_turn(call):
    ga = seeded()
    if call == "ask":
        ga.ask()
        with pytest.raises(RuntimeError, match="tell comes first"):
            ga.ask()
    else:
        with pytest.raises(RuntimeError, match="ask comes first"):
            ga.tell(np.zeros(200))


def test_wrong_scores():
    ga = seeded()
    ga.ask()
    with pytest.raises(ValueError, match=r"expected \(200,\)"):
        ga.tell(np.zeros(7))
    with pytest.raises(ValueError, match="NaN"):
        ga.tell(np.full(200, np.nan))


@pytest.mark.parametrize(
    "wrong", [{"population": 7}, {"generations": 0}, {"tournament": 0}, {"mutation": 1.5}, {"crossovers": 51}]
)
def test_budget_says_what_is_wrong(wrong):
    with pytest.raises(ValueError, match=next(iter(wrong))):
        Budget(**wrong)


@settings(max_examples=20, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_same_seed_same_search(seed):
    budget = Budget(population=12, generations=4, crossovers=3)
    a, b = (run(seeded(seed, 8, budget), sphere) for _ in range(2))
    assert np.array_equal(a.genomes, b.genomes)
    assert np.array_equal(a.scores, b.scores)
