"""What no walk from a hypothesis comes to: one effect alone, or a term less, by every amount."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.effects import term
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.drivers import Network
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.evolution.ga import Genomes
from ee_dist.recovery.diagnosis import Judge, reconsider
from ee_dist.recovery.genome import GENE_LENGTH, LENGTH, alone, at_all_amounts, decode, neighbours
from ee_dist.recovery.metrics import RollingMean
from ee_dist.robots.quadruped import quadruped

ROBOT = quadruped()
HEAVY = (term("part_mass", "body", change=2.0),)


def genome_of(*wanted: str) -> Genomes:
    """Genes of the first genomes that say each of these, ``EFFECT at PLACE (...)``, alone."""
    genes = {" ".join(str(t) for t in decode(g, ROBOT)): g[:GENE_LENGTH] for g in alone(ROBOT)}
    genome = np.zeros(LENGTH, dtype=np.int16)
    genome[::GENE_LENGTH] = -1
    for k, name in enumerate(wanted):
        genome[k * GENE_LENGTH : (k + 1) * GENE_LENGTH] = genes[name]
    return genome


BALANCED = genome_of("part_mass at body (change 1.8)", "joint_jam at hip_front_left (loss 0.2)")
"""Three times the mass told as a little less, with a jam that makes up for the difference."""


@pytest.fixture(scope="module")
def judge() -> Judge:
    rng = np.random.default_rng(5)
    controller = Network(tuple(float(v) for v in np.round(rng.uniform(-1, 1, 68), 2)))
    engine = MuJoCoEngine(1)
    log = PhysicalRobot(engine, ROBOT, HEAVY, np.random.SeedSequence(0)).trial(controller, 100)
    return Judge(ROBOT, [(controller, log)], RollingMean(), CachedEvaluator(SerialEvaluator(engine)))


def said_by(genomes: list[Genomes]) -> set[Hypothesis]:
    return {decode(g, ROBOT) for g in genomes}


def test_alone_says_one_effect_at_a_time_and_each_that_a_neighbour_of_nothing_says() -> None:
    said = said_by(alone(ROBOT))
    assert all(len(h) <= 1 for h in said)
    dormant = np.full(LENGTH, -1, dtype=np.int16)
    places = {(t.effect, t.target) for h in said for t in h}
    assert places == {(t.effect, t.target) for g in neighbours(dormant, ROBOT) for t in decode(g, ROBOT)}


def test_all_amounts_are_those_of_all_terms_and_of_all_but_one() -> None:
    before = BALANCED.copy()
    said = said_by(at_all_amounts(BALANCED, ROBOT))
    assert (before == BALANCED).all()
    mass, jam = decode(BALANCED, ROBOT)[::-1]
    assert (mass.effect, jam.effect) == ("part_mass", "joint_jam")
    of = {len(h): [g for g in said if len(g) == len(h)] for h in said}
    assert set(of) <= {0, 1, 2}
    assert all(mass in h or jam in h for h in of[2]), "one amount at a time"
    alone_at = {t.values for h in of[1] for t in h if t.target == "body"}
    assert len(alone_at) == 201 and HEAVY in said
    assert at_all_amounts(np.full(LENGTH, -1, dtype=np.int16), ROBOT) == []


def test_terms_that_make_up_for_a_wrong_amount_give_way_to_the_one_that_is_right(judge: Judge) -> None:
    assert HEAVY not in said_by(neighbours(BALANCED, ROBOT)), "no step of a polish comes to it"
    error = float(judge.errors([decode(BALANCED, ROBOT)])[0])
    genome, found = reconsider(judge, BALANCED, error, 1)
    assert (decode(genome, ROBOT), found) == (HEAVY, 0.0)


def test_what_leaves_nothing_is_not_reconsidered(judge: Judge) -> None:
    genome = genome_of("part_mass at body (change 2)")
    before = judge.evaluator.counts.asked
    assert reconsider(judge, genome, 0.0, 8) == (genome, 0.0)
    assert judge.evaluator.counts.asked == before
