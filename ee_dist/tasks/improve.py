"""task=improve: add what is missing to the model, fit everything together, show the error fall, write the model file."""

from __future__ import annotations

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml

from ee_dist.basics.files import write_whole
from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.at_limit import often_at_limit
from ee_dist.discrepancy.calibrated_away import calibrated_away
from ee_dist.discrepancy.evidence.holdout import in_turn
from ee_dist.discrepancy.explain import explain, gained_untouched
from ee_dist.discrepancy.improve import MOST, improve
from ee_dist.discrepancy.ladder import Improvement, Rung
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, parse, shared
from ee_dist.discrepancy.search.search import Progress, quiet
from ee_dist.discrepancy.ways.open_loop.calibration import unmodelled_by
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.discrepancy.ways.open_loop.unmodelled import to_entries
from ee_dist.discrepancy.weighed_up import weighed_up
from ee_dist.effects.model_file import write_model
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import AUTO, Config, ConfigError
from ee_dist.tasks.held_apart import HeldApart
from ee_dist.tasks.measurements import Measurements, load, load_held_out, of_held_out
from ee_dist.tasks.pool import check, chosen
from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.results.commands import asked, command, planning
from ee_dist.tasks.results.labels import refused_heading, step_phrase
from ee_dist.tasks.results.pages import improve_page
from ee_dist.tasks.results.scenes import improve_scene
from ee_dist.tasks.results.story import links
from ee_dist.tasks.results.summaries import of_improvement, of_read
from ee_dist.tasks.results.tables import show_account, show_candidates, show_ladder, show_last_word
from ee_dist.tasks.summary import Stopwatch, write_summary
from ee_dist.tasks.terminal import terminal
from ee_dist.tasks.unfinished import keep_so_far
from ee_dist.tasks.ways import known_way, open_loop, undriven, way_of
from ee_dist.viewing.report import write_page


@dataclass
class Options:
    name: str = "improve"
    by: str = AUTO
    without: list[str] = field(default_factory=list)
    only: list[str] = field(default_factory=list)
    most: int = MOST
    calibrate: bool = False
    rerun: bool = True

    def __post_init__(self) -> None:
        known_way(self.by)
        if self.most < 1:
            raise ConfigError(f"task.most={self.most}: must be 1 or more")


def run(config: Config, options: Options, out: Path, told: Progress = quiet) -> tuple[Problem, Improvement, Account]:
    """Write model.yaml, summary.json, report.html and improve.rrd into ``out``; ``told`` hears of the progress. Raises
    ConfigError, EffectError, LogError."""
    console, watch, measured = terminal(), Stopwatch(), load(config)
    held_out = load_held_out(config)
    wanted = effects_of(config.effect, measured.robot)
    for key in ("without", "only"):
        if wanted is not None and getattr(options, key) and not options.calibrate:
            raise ConfigError(
                f"task.{key}: chooses among what effect=auto may add; effect={config.effect} says it already"
            )
    way = way_of(measured, options.by)
    check(measured.robot, options.without, options.only)
    for remark in measured.remarks:
        console.print(remark, highlight=False, markup=False)
    if options.calibrate and way.name != OpenLoop.way:
        if silent := undriven(measured):
            raise ConfigError(
                f"task.calibrate: a robot is calibrated by what it does on its commands, and trial {silent} holds none; import "
                "it with its commands, or leave task.calibrate out"
            )
        raise ConfigError(f"task.calibrate: there is no calibration for task.by={way.name}; use task.by={OpenLoop.way}")
    with SearchProgress(console, told) as progress:
        problem = way.searched(measured, config, progress)
        if problem.doubts:
            # It may decide everything, and a search takes minutes.
            progress.note(f"Before anything is believed: {problem.doubts}")
        # What it tells goes to people alone: the search is given the problem, which has none of these trials.
        apart = None if held_out is None else HeldApart(held_out, way, config, problem)
        pool = chosen(problem, options.without, options.only)
        calibration = None
        if options.calibrate:
            found, calibration = calibrated(measured, config, pool, wanted, options.most, progress)
        else:
            climbed = telling(problem, progress, measured, apart)
            found = improve(
                problem, pool, measured.model, wanted, most=options.most, progress=progress, climbed=climbed
            )
    also = problem.other_errors(found.ladder[0].terms, found.terms) if len(found.ladder) > 1 else ()
    also = (*also, *problem.spoiled(found.terms), *way.instead(bool(found.left)))
    word = None if apart is None else apart.word(found.terms, found.ladder)
    found = weighed_up(found, problem, word)
    found = replace(found, at_limit=often_at_limit(problem, found.terms))
    first, last = found.ladder[0], found.ladder[-1]
    fell = last.error_heldout < first.error_heldout
    farther = problem.farther_off(first.terms, found.terms, fell) if len(found.ladder) > 1 else ""
    warnings = (*measured.remarks, *([f"{farther}."] if farther else []))
    account = improve_account(problem, found, planning(out, problem.robot), also, word).warned(warnings)
    path = out / "model.yaml"
    out.mkdir(parents=True, exist_ok=True)
    write_model(path, measured.source, measured.folder, found.terms, account.words)
    # What was fitted is shown already: what was held out is looked at next, where something was.
    improved = replace(config, model=str(path))
    account = account.followed(command(asked("compare", of_held_out(improved) or improved, options.by)))
    if calibration is not None:
        write_whole(
            path.with_suffix(".calibration.yaml"),
            "# What the model beside this file leaves on an untouched robot, and the energy that the most promising effect\n"
            "# takes off it.\n" + yaml.safe_dump(calibration, sort_keys=False),
        )
    digest = hashlib.sha256(repr([(r.terms, r.error_heldout) for r in found.ladder]).encode()).hexdigest()
    told_all = of_read(measured.read) | of_improvement(problem, found, account, str(path), word)
    write_summary(out, "improve", config, options, watch, digest, told_all)
    story = links(out, measured.files, config.model)
    write_page(improve_page(problem, measured, found, account, story, word), out / "report.html")
    if options.rerun:
        improve_scene(problem, found, account, measured.model, out / "improve.rrd", word)
    show_ladder(console, problem, found, word)
    show_last_word(console, word)
    show_candidates(console, problem, found.refused, refused_heading(problem, found))
    show_account(console, account, out)
    return problem, found, account


def telling(
    problem: Problem, progress: SearchProgress, measured: Measurements, apart: HeldApart | None = None
) -> Callable[[Rung], None]:
    """Says every step of the ladder when it is taken, as the table at the end will, and keeps its model where a run keeps what
    it would go on from. The search gets no answer: what is said of trials held ``apart`` decides nothing in it."""

    def climbed(rung: Rung) -> None:
        on = "data held out" if apart is None else in_turn(rung.held_out)
        there = "" if apart is None else apart.told(rung.model)
        told = f"{step_phrase(rung, problem)}: {problem.told(rung.error_heldout)} on {on}{there and f'; {there}'}"
        notes = ("Not the end of the search: more may come, and what came first may go again. Its last step:", told)
        # First kept, then told: who stops a search because of what it says finds that.
        keep_so_far(lambda path: write_model(path, measured.source, measured.folder, rung.model, notes), there)
        progress.note(told)

    return climbed


def effects_of(asked: Any, robot: Robot) -> list[Candidate] | None:
    """None for ``auto``, an empty list for ``none``; otherwise the effects named. Raises ConfigError, EffectError."""
    if not asked:
        raise ConfigError(
            "effect=: which? effect=auto, effect=none to fit what the model has, or a name such as "
            "effect=coulomb_friction@knee_front_left"
        )
    if asked in ("auto", "none"):
        return None if asked == "auto" else []
    return [parse(robot, str(a)) for a in (asked if isinstance(asked, (list, tuple)) else str(asked).split(";"))]


def calibrated(
    measured: Measurements,
    config: Config,
    pool: list[Candidate],
    wanted: list[Candidate] | None = None,
    most: int = MOST,
    progress: Progress = quiet,
) -> tuple[Improvement, dict[str, Any]]:
    """The model of an untouched robot, with what one of its joints has far more of than those like it, and what goes into a
    file beside it: what it still leaves on each channel in each trial beyond noise, and how much of that an effect takes off
    although nothing is wrong."""
    robot, problem = measured.robot, open_loop(measured, config)
    found = improve(problem, shared(pool, robot), measured.model, wanted, most=most, progress=progress)
    found.odd = calibrated_away(problem, found.terms, pool, progress)
    unmodelled = unmodelled_by(problem, found.residual)
    again = open_loop(replace(measured, unmodelled=unmodelled, model=found.terms), config)
    gained = gained_untouched(explain(again, pool, found.terms, progress=progress))
    entries = to_entries(unmodelled, robot.sensor_names, [s.unit for s in robot.sensors])
    return found, {"way": OpenLoop.way, "gained": gained, "unmodelled": entries}
