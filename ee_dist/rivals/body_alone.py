"""Evolution on the body alone: no model, and every evaluation a hardware trial (Bongard and Lipson 2004, Fig. 1).

The same algorithm as in a repair pass (population 200, worst half replaced, tournaments of 3, 1 % mutation, 24 crossovers),
started as a repair pass is: from the intact robot's controller and its relatives. Survivors are not tried again, nor is a
genome that was tried before: the body answers alike. It ends at the trials that it is allowed, or with the
generation in which a trial went as far as the intact robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.drivers import weight_count
from ee_dist.evolution.ga import GeneticAlgorithm
from ee_dist.recovery.repair import genome_of, network, relatives
from ee_dist.rivals.setting import Setting, announce, intact_controller

ENOUGH = 1.0
"""Share of the intact distance at which it ends."""


def body_alone(setting: Setting) -> Sequence[Hypothesis]:
    best = intact_controller(setting)
    bar = ENOUGH * setting.value(setting.intact, best)
    robot, plan, allowed = setting.robot, setting.plan, setting.allowance.body_trials
    length, population = weight_count(len(robot.sensors), len(robot.drives)), plan.repair.population
    start, stream = setting.streams()[1].spawn(2)
    first = relatives(genome_of(best)[None, :], population, np.random.default_rng(start))
    # Copies are not tried again, so there may be more generations than trials suggest; not without end.
    generations = max(1, 4 * allowed // population)
    ga = GeneticAlgorithm(length, replace(plan.repair, generations=generations), stream, first)
    known: dict[bytes, float] = {}
    while not ga.done:
        genomes = ga.ask()
        fresh = list({g.tobytes(): g for g in genomes if g.tobytes() not in known}.values())
        fresh = fresh[: allowed - len(known)]
        announce(setting.changed, [network(g) for g in fresh], plan.steps)
        for genome in fresh:
            known[genome.tobytes()] = setting.value(setting.changed, network(genome))
        if not all(g.tobytes() in known for g in genomes):
            break
        ga.tell(np.array([known[g.tobytes()] for g in genomes]))
        if ga.scores[0] >= bar:
            break
    return []
