"""The hypothesis genome: what it can say, and that equal meanings decode to equal hypotheses."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from ee_dist.effects import apply, term
from ee_dist.evolution.ga import SCALE
from ee_dist.recovery.genome import ACTIVE, LENGTH, choice, decode, first_hypotheses, neighbours
from ee_dist.recovery.walking import WALKING
from ee_dist.robots.quadruped import quadruped

ROBOT = quadruped()
SITUATIONS = [s.effect for s in WALKING.situations]
genomes = arrays(np.int16, (LENGTH,), elements=st.integers(-SCALE, SCALE))


def gene(situation: str, where: int, options: int, much: int, active: int = SCALE) -> list[int]:
    def middle(index: int, n: int) -> int:
        return next(v for v in range(-SCALE, SCALE + 1) if choice(v, n) == index and choice(v + 5, n) == index)

    return [active, middle(SITUATIONS.index(situation), 6), middle(where, options), much]


def genome(*genes: list[int]) -> np.ndarray:
    dormant = [-SCALE, 0, 0, 0]
    rows = [*genes, *[dormant] * (4 - len(genes))]
    return np.array(rows, dtype=np.int16).ravel()


def test_choices_have_equal_shares():
    for options in (2, 6, 8, 9):
        counts = np.bincount([choice(v, options) for v in range(-SCALE, SCALE + 1)])
        assert len(counts) == options
        assert counts.max() - counts.min() <= 1


def test_dormant_genes_say_nothing():
    assert decode(genome(), ROBOT) == ()


def test_every_situation_can_be_said():
    said = {
        "part_lost": (term("part_lost", "upper_front_left"), genome(gene("part_lost", 0, 8, 0))),
        "part_mass": (term("part_mass", "body", change=2.0), genome(gene("part_mass", 0, 9, SCALE))),
        "motor_weak": (term("motor_weak", "knee_front_left", loss=0.5), genome(gene("motor_weak", 1, 8, 0))),
        "sensor_failing": (
            term("sensor_failing", "angle_front_right", loss=0.5),
            genome(gene("sensor_failing", 5, 8, 0)),
        ),
        "joint_jam": (term("joint_jam", "hip_rear_right", loss=0.5), genome(gene("joint_jam", 6, 8, 0))),
        "floor_tilt": (term("floor_tilt", "floor", sideways_deg=30.0), genome(gene("floor_tilt", 0, 8, SCALE))),
    }
    assert set(said) == set(SITUATIONS)
    for wanted, g in said.values():
        assert decode(g, ROBOT) == (wanted,)


def test_a_lost_leg_takes_its_lower_part_motors_and_masses_with_it():
    alone = genome(gene("part_lost", 0, 8, 0))
    more = genome(
        gene("part_lost", 0, 8, 0), gene("part_lost", 1, 8, 0), gene("motor_weak", 1, 8, 50), gene("part_mass", 2, 9, 0)
    )
    assert decode(more, ROBOT) == decode(alone, ROBOT)


def test_the_first_of_two_changes_of_one_kind_at_one_place_counts():
    twice = genome(gene("motor_weak", 3, 8, 0), gene("motor_weak", 3, 8, 60))
    assert decode(twice, ROBOT) == decode(genome(gene("motor_weak", 3, 8, 0)), ROBOT)


@settings(max_examples=200, deadline=None)
@given(genomes)
def test_every_genome_decodes_to_a_model(g):
    hypothesis = decode(g, ROBOT)
    assert len(hypothesis) <= 4
    apply(ROBOT, hypothesis)
    assert hypothesis == decode(g.copy(), ROBOT)


@settings(max_examples=100, deadline=None)
@given(genomes, st.permutations(range(4)))
def test_the_order_of_genes_at_different_places_does_not_matter(g, order):
    parts = decode(g, ROBOT)
    active = sum(choice(int(g[4 * k]), 2) for k in range(4))
    if len(parts) == active:  # no two genes speak of the same place
        assert decode(g.reshape(4, 4)[list(order)].ravel(), ROBOT) == parts


def test_the_first_hypotheses_cover_the_space_and_mostly_say_one_thing():
    genomes = first_hypotheses(2000, np.random.default_rng(0))
    assert genomes.shape == (2000, LENGTH)
    assert (genomes.min(), genomes.max()) == (-SCALE, SCALE)
    active = (np.vectorize(lambda v: choice(v, 2))(genomes[:, ::4]) == 1).sum(axis=1)
    assert np.allclose(np.bincount(active, minlength=5) / 2000, ACTIVE, atol=0.03)
    said = {t.effect for g in genomes[:200] for t in decode(g, quadruped())}
    assert said == set(SITUATIONS)
    for column in (1, 2, 3):
        assert np.abs(np.histogram(genomes[:, column], bins=10, range=(-100.5, 100.5))[0] - 200).max() <= 12
    assert np.array_equal(
        first_hypotheses(50, np.random.default_rng(3)), first_hypotheses(50, np.random.default_rng(3))
    )


def test_neighbours_differ_in_one_term_and_reach_every_place():
    robot = quadruped()
    (genome,) = first_hypotheses(1, np.random.default_rng(1))
    here = set(decode(genome, robot))
    around = [set(decode(g, robot)) for g in neighbours(genome, robot)]
    assert len({frozenset(h) for h in around}) == len(around)
    assert all(len(here - h) <= 1 and len(h - here) <= 1 for h in around)
    single = {(t.effect, t.target) for h in around for t in h - here}
    every = {(t.effect, t.target) for g in first_hypotheses(4000, np.random.default_rng(0)) for t in decode(g, robot)}
    assert single | {(t.effect, t.target) for t in here} == every
