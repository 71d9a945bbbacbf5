"""The map of the best of each kind, and the offspring of its elites."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ee_dist.evolution.archive import Archive, Judged
from ee_dist.evolution.ga import SCALE
from ee_dist.evolution.variation import Steps, offspring


def genomes(n: int, length: int = 68) -> np.ndarray:
    return np.random.default_rng(n).integers(-SCALE, SCALE, size=(n, length), endpoint=True).astype(np.int16)


def test_each_cell_keeps_its_best_and_among_equals_the_older():
    archive, some = Archive(3), genomes(5)
    found = [
        Judged(1.0, True, (0.1, 0.9)),
        Judged(2.0, True, (0.2, 1.0)),
        Judged(2.0, True, (0.0, 0.7)),
        Judged(0.5, True, (0.5, 0.5)),
        Judged(1.5, True, (0.3, 0.8)),
    ]
    assert archive.add(some, found).tolist() == [True, True, False, True, False]
    assert [(e.cell, e.score) for e in archive.elites] == [((1, 0, 2), 2.0), ((1, 1, 1), 0.5)]
    assert (archive.elites[0].genome == some[1]).all()


def test_what_is_not_allowed_stands_behind_all_that_is_and_takes_no_place_of_it():
    archive = Archive(2)
    archive.add(
        genomes(3), [Judged(9.0, False, (0.1,)), Judged(-1.0, True, (0.1,)), Judged(-math.inf, False, (math.nan,))]
    )
    assert [(e.allowed, e.score) for e in archive.elites] == [(True, -1.0), (False, 9.0)]


@pytest.mark.parametrize("place", [(-0.5, 2.0), (math.nan, math.nan), (0.0, 1.0)])
def test_every_place_has_a_cell(place):
    cell = Archive(3).cell(Judged(0.0, True, place))
    assert all(0 <= b < 3 for b in cell[1:])


def test_offspring_are_genomes_that_differ_from_their_parents_and_follow_from_the_seed():
    elites = list(genomes(4))
    born = offspring(elites, 2, 60, 3, Steps(), np.random.default_rng(0))
    assert born.shape == (60, 68) and born.dtype == np.int16
    assert np.abs(born).max() <= SCALE
    different = (born[:, None] != np.array(elites)[None]).sum(axis=2).min(axis=1)
    assert (different > 0).mean() > 0.9
    assert (different <= 2).mean() > 0.3, "two values in half of them"
    assert np.array_equal(born, offspring(elites, 2, 60, 3, Steps(), np.random.default_rng(0)))


def test_a_single_elite_has_offspring_too():
    born = offspring(list(genomes(1)), 1, 8, 3, Steps(), np.random.default_rng(0))
    assert len(np.unique(born, axis=0)) == 8
