"""task=online: evolution on the body alone, without a model: what the loop is measured against (the paper's Fig. 1)."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ee_dist.discrepancy.words import percent
from ee_dist.effects.catalogue import apply
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import weight_count
from ee_dist.evaluation.jobs import Evaluator, Job, Travel
from ee_dist.evolution.ga import Budget, GeneticAlgorithm, Genomes
from ee_dist.recovery.repair import network
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import BudgetConfig, Config, ConfigError, ScenarioConfig, within
from ee_dist.tasks.results.commands import command, simulated
from ee_dist.tasks.summary import Stopwatch, digest_of, write_summary
from ee_dist.tasks.terminal import terminal
from ee_dist.tasks.wiring import build_robot, evaluator_of
from ee_dist.viewing.report import Page, Section, write_page
from ee_dist.viewing.study_figures import Curve, on_the_body

MOST = 100_000
"""Generations: far beyond use."""


@dataclass
class Options:
    name: str = "online"
    generations_before: int = 40
    generations_after: int = 40

    def __post_init__(self) -> None:
        within("task.generations_before", self.generations_before, 1, MOST)
        within("task.generations_after", self.generations_after, 1, MOST)


def run(config: Config, options: Options, out: Path) -> None:
    """Write report.html and summary.json. Every evaluation counts as a trial on the body."""
    console, watch = terminal(), Stopwatch()
    if config.scenario is None:
        raise ConfigError("which scenario? add one, such as +scenario=3")
    robot = build_robot(config)
    changed = apply(robot, config.scenario.hidden())
    plan = config.budget.plan()
    evaluator = evaluator_of(config)
    first, second = np.random.SeedSequence(config.seed).spawn(2)
    length = weight_count(len(robot.sensors), len(robot.drives))
    before = _evolve(robot, length, None, options.generations_before, plan.repair, plan.steps, first, evaluator)
    # The change strikes the whole population: its controllers are tried again on the changed body.
    after = _evolve(changed, length, before[1], options.generations_after, plan.repair, plan.steps, second, evaluator)
    intact, at_change, end = before[0][-1][1], after[0][0][1], after[0][-1][1]
    lost = intact - at_change
    regained = (end - at_change) / lost if lost > 0 else float("nan")
    trials = after[0][-1][0]
    write_summary(out, "online", config, options, watch, digest_of((before[0], after[0])), {
        "scenario": config.scenario.number,
        "distance_m": {"intact": intact, "after": at_change, "end": end},
        "body_trials_after_the_change": trials,
        "regained_of_lost": regained,
        "best_by_trials": {"before": before[0], "after": after[0]},
    })  # fmt: skip
    back = f" ({percent(regained)} of what was lost)" if lost > 0 else "; the change cost nothing"
    head = (
        f"On the body alone: intact {intact:.2f} m, after the change {at_change:.2f} m, after {trials:,} further trials on the "
        f"body {end:.2f} m{back}."
    )
    write_page(_page(config, config.scenario, before[0], after[0], head, robot), out / "report.html")
    console.print(f"Scenario {config.scenario.number}: {config.scenario.title}. Seed {config.seed}.", highlight=False)
    console.print(f"  {os.path.relpath(out / 'report.html')}", highlight=False, soft_wrap=True)
    console.print(head, highlight=False)
    console.print(f"Next: {_following(config, config.scenario)}", highlight=False, soft_wrap=True)


def _following(config: Config, scenario: ScenarioConfig) -> str:
    """The loop with a model, on the same body at the same budget."""
    usual = BudgetConfig()
    budget = [] if config.budget.name == usual.name else [f"budget={config.budget.name}"]
    return command([f"+scenario={scenario.number}", f"seed={config.seed}", *budget, *simulated(config)])


def _evolve(
    body: Robot,
    length: int,
    seeds: Genomes | None,
    generations: int,
    budget: Budget,
    steps: int,
    seed: np.random.SeedSequence,
    evaluator: Evaluator,
) -> tuple[list[tuple[int, float]], Genomes]:
    """(trials so far, best distance) of each generation, and the last population."""
    sized = Budget(budget.population, generations, budget.tournament, budget.mutation, budget.crossovers)
    ga = GeneticAlgorithm(length, sized, seed, seeds)
    trials, curve = 0, []
    while not ga.done:
        genomes = ga.ask()
        trials += len(genomes)
        found = evaluator.evaluate([Job(Rollout(body, network(g), steps), Travel()) for g in genomes])
        ga.tell(np.array(found))
        curve.append((trials, float(ga.scores[0])))
    return curve, ga.genomes


def _page(config: Config, scenario: ScenarioConfig, before: Curve, after: Curve, head: str, robot: Robot) -> Page:
    figure = on_the_body(before, [(n + before[-1][0], d) for n, d in after])
    shown = "Each point is the best of a generation so far; the dotted line is the change."
    return Page(
        f"Evolution on the body: {robot.name.replace('_', ' ')}",
        f"scenario {scenario.number} ({scenario.title}); seed {config.seed}, budget {config.budget.name}, {config.engine.name}",
        head,
        first=["Every evaluation is a trial on the body: that is what the loop with a model saves."],
        following=_following(config, scenario),
        proof=Section("Best distance over the trials on the body", shown, figure),
        foot="ee_dist. Evolution on the body alone, without a model: the paper's Fig. 1.",
    )
