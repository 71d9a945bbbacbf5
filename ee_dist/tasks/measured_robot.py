"""compare, explain and improve by a balance of measured forces or by free runs: ``task.by=force_balance`` or ``free_run``.

The problems and the ladder are those of ``discrepancy``; here they are put together, told and written down. Both suit
robots on a fixed base whose joints were measured; ``task.by=open_loop`` is the way for everything else.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from ee_dist.discrepancy.candidates import candidates, parse
from ee_dist.discrepancy.force_balance import ForceBalance
from ee_dist.discrepancy.free_run import FreeRun
from ee_dist.discrepancy.ladder import Proposal, Rule, Rung, Verdict, climb, natural
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.remains import describe, remains
from ee_dist.discrepancy.words import told
from ee_dist.effects.catalogue import CATALOGUE
from ee_dist.effects.model_file import write_model
from ee_dist.engines.one_joint import OneJointEngine, fits
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import Config, ConfigError, one_of
from ee_dist.tasks.measured import Measurements, load
from ee_dist.tasks.measured_pages import (
    account,
    by_trial,
    candidate_entry,
    digest_of,
    ladder_section,
    new_terms,
    overlay_section,
    print_ladder,
    print_tried,
    ranking_section,
    shown,
    step_entry,
    tie_words,
)
from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.summary import Stopwatch, hypothesis_list, write_summary
from ee_dist.tasks.wiring import evaluator_of
from ee_dist.viewing.report import Page, Section, Table, write_page

OPEN_LOOP, FORCE_BALANCE, FREE_RUN = "open_loop", "force_balance", "free_run"
WAYS = (OPEN_LOOP, FORCE_BALANCE, FREE_RUN)
WINDOW_S = 0.5
"""Length of the windows that compare re-starts from the measured state."""
JUDGED = 6
"""Candidates that are fitted and judged in a step of free runs; a balance of forces judges all."""


def elsewhere(by: str) -> bool:
    """Whether ``task.by`` asks for this module. Raises ConfigError for an unknown way."""
    return one_of("task.by", by, WAYS) != OPEN_LOOP


def problem_of(
    measured: Measurements, config: Config, by: str, windows_s: float | None = None
) -> ForceBalance | FreeRun:
    """Raises MeasurementError where the logs lack what the way needs, ConfigError for a robot that moves about."""
    robot = measured.robot
    if robot.free_base:
        raise ConfigError(f"task.by={by}: {robot.name} moves about; use task.by=open_loop")
    if by == FORCE_BALANCE:
        return ForceBalance(measured.trials, robot)
    evaluator = SerialEvaluator(OneJointEngine(1024), 1024) if fits(robot) else evaluator_of(config)
    return FreeRun(measured.trials, robot, evaluator, windows_s=windows_s)


# -- the verbs -------------------------------------------------------------------------------------------------------


def run_compare(config: Config, options: Any, out: Path) -> None:
    """How far the model is off: in all, by trial, from windows re-started, and what is left where."""
    console, watch, measured = Console(), Stopwatch(), load(config)
    problem = problem_of(measured, config, options.by)
    residual = problem.residuals([measured.model])[0]
    rows = [(t, shown(problem, natural(problem, error(residual[m])))) for t, m in by_trial(problem)]
    words = [f"{problem.natural_name}: {shown(problem, natural(problem, error(residual)))} over all trials."]
    rest: dict[str, Any] = {}
    if isinstance(problem, FreeRun):
        windows = problem_of(measured, config, options.by, WINDOW_S)
        again = natural(windows, error(windows.residuals([measured.model])[0]))
        words.append(f"Re-started from the measured state every {WINDOW_S:g} s: {shown(problem, again)}.")
        rest["error_windows"] = again
    else:
        unit = "N" if measured.robot.joint(problem.channels[0]).kind == "slide" else "N.m"
        for k in range(len(problem.channels)):
            words += describe(remains(problem, measured.model, k), unit, "m" if unit == "N" else "rad")
    page = Page(
        f"compare: {measured.robot.name}",
        problem.error_definition,
        words,
        sections=[
            overlay_section(problem, measured.model, None),
            Section("Trials", table=Table(("trial", problem.natural_name), rows, (1,))),
        ],
    )
    floor, source = problem.noise_floor()
    found = {
        "error": error(residual),
        "error_natural": natural(problem, error(residual)),
        "natural": problem.natural_name,
        "error_definition": problem.error_definition,
        "noise_floor": floor,
        "noise_floor_source": source,
        "trials": [{"name": t, "error": v} for t, v in rows],
        "words": words,
        **rest,
    }
    _finish(
        console,
        "compare",
        config,
        options,
        watch,
        out,
        page,
        words,
        found,
        hashlib.sha256(residual.tobytes()).hexdigest(),
    )


def run_explain(config: Config, options: Any, out: Path) -> None:
    """Every effect on top of the model, all refitted together, judged on held-out data."""
    console, watch, measured = Console(), Stopwatch(), load(config)
    problem = problem_of(measured, config, options.by)
    pool = proposals(measured.robot, options.without)
    with SearchProgress(console) as progress:
        rungs = climb(problem, measured.model, pool, replace(_rule(problem), steps=0), progress)
        tried = _tried(problem, rungs[0], pool, progress)
    found = tried[0] if tried and not tried[0].why_not else None
    words = [f"The model, refitted: {shown(problem, rungs[0].error_heldout)} held out ({problem.natural_name})."]
    if found is None:
        words.append("No effect earns its place on held-out data.")
    else:
        entry = CATALOGUE[found.proposal[-1].effect.name]
        value = "; ".join(told(t, measured.robot) for t in new_terms(found))
        words.append(f"Missing: {value}. {entry.physics}")
        words.append(
            f"It takes {found.gain:.0%} off the held-out error ({found.t:.1f} standard errors). Its mark: {entry.signature}"
        )
        words += tie_words(problem, tried)
    page = Page(
        f"explain: {measured.robot.name}",
        problem.error_definition,
        words,
        "good" if found else "open",
        sections=[
            ranking_section(problem, tried, measured.robot),
            overlay_section(problem, measured.model, rungs[0].hypothesis),
        ],
    )
    summary = {
        "baseline_error": rungs[0].error_heldout,
        "natural": problem.natural_name,
        "noise_floor": natural(problem, 1.0),
        "verdict": "effect" if found else "unexplained",
        "words": words,
        "candidates": [candidate_entry(v, k + 1) for k, v in enumerate(tried)],
    }
    print_tried(console, problem, tried, measured.robot)
    _finish(console, "explain", config, options, watch, out, page, words, summary, digest_of(tried))


def run_improve(config: Config, options: Any, out: Path) -> None:
    """Add what was asked for, or (auto) what earns its place, refit all, write the model file."""
    if not config.effect:
        raise ConfigError("effect=: which? effect=auto, or a name such as effect=coulomb_friction@servo")
    console, watch, measured = Console(), Stopwatch(), load(config)
    problem = problem_of(measured, config, options.by)
    rule = replace(_rule(problem), steps=options.most)
    if config.effect == "auto":
        pool = proposals(measured.robot, options.without)
    else:
        asked = config.effect if isinstance(config.effect, (list, tuple)) else str(config.effect).split(";")
        pool = [tuple(parse(measured.robot, str(a)) for a in asked)]
        rule = replace(rule, share=-np.inf, t=-np.inf, steps=1)
    with SearchProgress(console) as progress:
        rungs = climb(problem, measured.model, pool, rule, progress)
    last = rungs[-1]
    words = account(problem, rungs, measured.robot)
    out.mkdir(parents=True, exist_ok=True)
    write_model(out / "model.yaml", measured.source, measured.folder, last.hypothesis, words)
    page = Page(
        f"improve: {measured.robot.name}",
        problem.error_definition,
        words,
        "good" if len(rungs) > 2 else "open",
        sections=[
            ladder_section(problem, rungs),
            ranking_section(problem, last.tried, measured.robot, "What did not earn its place at the end"),
            overlay_section(problem, rungs[0].hypothesis, last.hypothesis),
        ],
    )
    summary = {
        "ladder": [step_entry(r, measured.model) for r in rungs[:-1]],
        "natural": problem.natural_name,
        "words": words,
        "noise_floor": natural(problem, 1.0),
        "model": str(out / "model.yaml"),
        "model_terms": hypothesis_list(last.hypothesis),
        "not_earned": [candidate_entry(v, k + 1) for k, v in enumerate(last.tried)],
    }
    print_ladder(console, problem, rungs)
    print_tried(console, problem, last.tried, measured.robot)
    _finish(
        console,
        "improve",
        config,
        options,
        watch,
        out,
        page,
        words,
        summary,
        digest_of(last.tried) + repr(last.hypothesis),
    )


def proposals(robot: Robot, without: Sequence[str] = ()) -> list[Proposal]:
    """Effects on body, drives and surroundings one by one, and friction by load as a family, linear and quadratic."""
    pool = [c for c in candidates(robot, without) if c.effect.family in ("body", "drive", "world") and c.size]
    named = {c.name: c for c in pool}
    pairs = [(named.get(f"load_friction@{m}"), named.get(f"quadratic_friction@{m}")) for m in robot.motor_names]
    return [*((c,) for c in pool), *((a, b) for a, b in pairs if a is not None and b is not None)]


def _rule(problem: ForceBalance | FreeRun) -> Rule:
    return Rule(judged=JUDGED) if problem.rugged else Rule()


def _tried(problem: ForceBalance | FreeRun, rung: Rung, pool: Sequence[Proposal], progress: Any) -> list[Verdict]:
    from ee_dist.discrepancy.ladder import cross_fit, folds_of, judge_all

    rule = _rule(problem)
    folds = folds_of(problem, rule.folds)
    present = {c.name for c in rung.fit.model.parts}
    current = cross_fit(problem, [(rung.fit.model, rung.fit.u)], folds, progress)[0][1]
    return judge_all(
        problem, rung.fit, current, [p for p in pool if not present & {c.name for c in p}], folds, rule, progress
    )


def _finish(
    console: Console,
    task: str,
    config: Config,
    options: Any,
    watch: Stopwatch,
    out: Path,
    page: Page,
    words: Sequence[str],
    summary: dict[str, Any],
    digest: str,
) -> None:
    out.mkdir(parents=True, exist_ok=True)
    write_page(page, out / "report.html")
    write_summary(out, task, config, options, watch, hashlib.sha256(digest.encode()).hexdigest(), summary)
    for line in words:
        console.print(line, highlight=False, markup=False)
    for file in sorted(p.name for p in out.iterdir() if p.is_file() and p.suffix in (".html", ".json", ".yaml")):
        console.print(f"  {os.path.relpath(out / file)}", highlight=False, soft_wrap=True)
