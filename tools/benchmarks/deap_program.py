"""The same evolution with DEAP, its evaluations spread by ``multiprocessing`` as DEAP's documentation shows it.

``toolbox.register("map", pool.map)`` is all the parallelism there is. The robot, its world and the evaluation are those of
naive_program.py; half of the population breeds as many offspring, by mutation of 1 % of the weights or one-point crossover.

    python deap_program.py robot.urdf --population 20 --generations 2 --steps 1000 --processes 2
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import random
import sys
import time

import numpy as np
from deap import algorithms, base, creator, tools
from naive_program import WEIGHTS, evaluate, load, processor_s

creator.create("FitnessMax", base.Fitness, weights=(1.0,))
creator.create("Individual", list, fitness=creator.FitnessMax)


def fitness(individual: list[float], steps: int) -> tuple[float]:
    """Forward distance, m, as DEAP wants it."""
    return (evaluate((np.array(individual), steps)),)


def weight() -> float:
    """A random weight of two decimals."""
    return round(random.uniform(-1, 1), 2)


def mutate(individual: list[float], indpb: float) -> tuple[list[float]]:
    """New values for a share ``indpb`` of the weights."""
    for k in range(len(individual)):
        if random.random() < indpb:
            individual[k] = weight()
    return (individual,)


def main() -> int:
    parser = argparse.ArgumentParser(description="the paper's evolution of a controller with DEAP")
    parser.add_argument("urdf")
    parser.add_argument("--population", type=int, default=20)
    parser.add_argument("--generations", type=int, default=2)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    random.seed(0)
    toolbox = base.Toolbox()
    toolbox.register("individual", tools.initRepeat, creator.Individual, weight, n=WEIGHTS)
    toolbox.register("population", tools.initRepeat, list, toolbox.individual)
    toolbox.register("evaluate", fitness, steps=options.steps)
    toolbox.register("mate", tools.cxOnePoint)
    toolbox.register("mutate", mutate, indpb=0.01)
    toolbox.register("select", tools.selTournament, tournsize=3)
    with multiprocessing.Pool(options.processes, initializer=load, initargs=(options.urdf,)) as pool:
        toolbox.register("map", pool.map)
        before, own = processor_s(pool, options.processes), time.process_time()
        began = time.perf_counter()
        half = options.population // 2
        _, log = algorithms.eaMuPlusLambda(
            toolbox.population(options.population),
            toolbox,
            mu=half,
            lambda_=half,
            cxpb=0.48,
            mutpb=0.52,
            ngen=options.generations,
            verbose=False,
        )
        wall, own = time.perf_counter() - began, time.process_time() - own
        cpu = processor_s(pool, options.processes) - before + own
    count = sum(log.select("nevals"))
    asked = options.population + half * options.generations
    json.dump(
        {"evaluations": count, "asked": asked, "steps": count * options.steps, "wall_s": wall, "cpu_s": cpu},
        sys.stdout,
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
