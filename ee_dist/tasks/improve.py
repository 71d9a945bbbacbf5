"""task=improve: add what is missing to the model, fit everything together, show the error fall, write the model file."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import yaml
from rich.console import Console
from rich.table import Table

from ee_dist.discrepancy.candidates import Candidate, candidates, parse, shared
from ee_dist.discrepancy.explain import explain, gained_untouched
from ee_dist.discrepancy.improve import Improvement, improve
from ee_dist.discrepancy.open_loop import OpenLoop
from ee_dist.discrepancy.screen import Progress
from ee_dist.discrepancy.unmodelled import to_entries, unmodelled_by
from ee_dist.discrepancy.words import left_text, tie_text, told
from ee_dist.effects.model_file import write_model
from ee_dist.evaluation.jobs import Evaluator
from ee_dist.robots.model import Robot
from ee_dist.tasks import measured_robot
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.measured import Measurements, load, problem_of
from ee_dist.tasks.pictures import improve_page, write_pictures
from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.summary import Stopwatch, hypothesis_list, write_summary
from ee_dist.tasks.wiring import evaluator_of
from ee_dist.viewing.report import write_page


@dataclass
class Options:
    name: str = "improve"
    by: str = "open_loop"
    without: list[str] = field(default_factory=list)
    most: int = 6
    calibrate: bool = False
    rerun: bool = True

    def __post_init__(self) -> None:
        if self.most < 1:
            raise ConfigError(f"task.most={self.most}: must be 1 or more")


def run(config: Config, options: Options, out: Path) -> None:
    """Write model.yaml, report.html, improve.rrd and summary.json into ``out``. Raises ConfigError, EffectError, LogError."""
    if measured_robot.elsewhere(options.by):
        measured_robot.run_improve(config, options, out)
        return
    console, watch = Console(), Stopwatch()
    measured = load(config)
    evaluator = evaluator_of(config)
    wanted = effects_of(config.effect, measured.robot)
    with SearchProgress(console) as progress:
        problem = problem_of(measured, evaluator)
        base = problem.residuals([measured.model])[0]
        pool = candidates(measured.robot, options.without)
        if options.calibrate:
            pool = shared(pool, measured.robot)
        found = improve(problem, pool, measured.model, wanted, most=options.most, progress=progress)
        calibration = calibrated(problem, measured, evaluator, found, options, progress) if options.calibrate else None
    words = improvement_text(found, measured.robot)
    out.mkdir(parents=True, exist_ok=True)
    path = out / "model.yaml"
    write_model(path, measured.source, measured.folder, found.terms, words)
    if calibration is not None:
        path.with_suffix(".calibration.yaml").write_text(
            "# What the model beside this file leaves on an untouched robot, and the energy that the most promising effect\n"
            "# takes off it.\n" + yaml.safe_dump(calibration, sort_keys=False),
            encoding="utf-8",
        )
    write_page(improve_page(problem, measured, found, words, base), out / "report.html")
    if options.rerun:
        write_pictures(problem, found.terms, out / "improve.rrd", "improve")
    _print(console, found, words, measured.robot)
    digest = hashlib.sha256(repr([(r.terms, r.error_heldout) for r in found.ladder]).encode()).hexdigest()
    write_summary(
        out, "improve", config, options, watch, digest, {**summary(found), "model": str(path), "words": words}
    )
    for file in sorted(p.name for p in out.iterdir() if p.is_file()):
        console.print(f"  {os.path.relpath(out / file)}", highlight=False, soft_wrap=True)


def effects_of(asked: Any, robot: Robot) -> list[Candidate] | None:
    """None for ``auto``; otherwise the effects named. Raises ConfigError, EffectError."""
    if not asked:
        raise ConfigError("effect=: which? effect=auto, or a name such as effect=coulomb_friction@knee_front_left")
    if asked == "auto":
        return None
    return [parse(robot, str(a)) for a in (asked if isinstance(asked, (list, tuple)) else str(asked).split(";"))]


def improvement_text(found: Improvement, robot: Robot) -> list[str]:
    """What was done and how good it is, in sentences."""
    first, last = found.ladder[0], found.ladder[-1]
    lines = []
    if len(found.ladder) == 1:
        lines.append(
            f"Nothing was added: {found.stopped}. Error {first.error_heldout:.3f}, noise floor {found.noise_floor:.3f}."
        )
    else:
        added = "; ".join(told(t, robot) for t in found.terms[-sum(len(r.added) for r in found.ladder) :])
        lines.append(f"Added: {added}.")
        lines.append(
            f"Held-out error fell from {first.error_heldout:.3f} to {last.error_heldout:.3f}; noise alone would leave "
            f"{found.noise_floor:.3f} ({found.floor_source})."
        )
        lines += [
            tie_text(told(rung.added[0]).split(" (")[0], others)
            for k, rung in enumerate(found.ladder)
            if (others := found.ties(k))
        ]
        lines.append(f"Stopped because {found.stopped}.")
    flagged = [p for p in found.parameters if p.flag]
    lines += [f"{told(found.terms[p.term]).split(' (')[0]}, {p.name.replace('_', ' ')}: {p.flag}." for p in flagged]
    lines.append(left_text(found.left, True) if found.left else "Nothing is left above the noise.")
    return lines


def calibrated(
    problem: OpenLoop,
    measured: Measurements,
    evaluator: Evaluator,
    found: Improvement,
    options: Options,
    progress: Progress,
) -> dict[str, Any]:
    """What the calibrated model still leaves on each channel in each trial beyond noise, and how much of that an effect
    takes off although nothing is wrong."""
    robot = measured.robot
    unmodelled = unmodelled_by(problem, found.residual)
    again = problem_of(replace(measured, unmodelled=unmodelled, model=found.terms), evaluator)
    pool = candidates(robot, options.without)
    gained = gained_untouched(explain(again, pool, found.terms, progress=progress))
    entries = to_entries(unmodelled, robot.sensor_names, [s.unit for s in robot.sensors])
    return {"gained": gained, "unmodelled": entries}


def summary(found: Improvement) -> dict[str, Any]:
    """The part of summary.json that improve documents."""

    def rung(index: int) -> dict[str, Any]:
        r = found.ladder[index]
        first = hypothesis_list(r.added)[0] if r.added else {"effect": None, "target": None, "values": {}}
        return {
            **first,
            "added": hypothesis_list(r.added),
            "error_fit": r.error_fit,
            "error_heldout": r.error_heldout,
            "interval": list(r.interval),
            "tied_with": found.ties(index),
        }

    return {
        "ladder": [rung(k) for k in range(len(found.ladder))],
        "noise_floor": found.noise_floor,
        "noise_floor_source": found.floor_source,
        "model_terms": hypothesis_list(found.terms),
        "parameters": [
            {
                **hypothesis_list(found.terms)[p.term],
                "name": p.name,
                "value": p.value,
                "interval": [p.low, p.high],
                "flag": p.flag,
            }
            for p in found.parameters
        ],
        "stopped": found.stopped,
        "left": [{"trial": g.trial, "channel": g.channel, "deviations": g.z, "slow": g.trend} for g in found.left],
    }


def _print(console: Console, found: Improvement, words: Sequence[str], robot: Robot) -> None:
    table = Table(title="The ladder", title_justify="left")
    for column, side in (("step", "left"), ("error fitted", "right"), ("error held out", "right")):
        table.add_column(column, justify=side)  # type: ignore[arg-type]
    for k, r in enumerate(found.ladder):
        name = "; ".join(told(t, robot) for t in r.added) if k else "the model as it was"
        table.add_row(name, f"{r.error_fit:.3f}", f"{r.error_heldout:.3f}")
    table.add_section()
    table.add_row("noise floor", "", f"{found.noise_floor:.3f}")
    console.print(table)
    for p in found.parameters:
        interval = f"[{p.low:.4g}, {p.high:.4g}]"
        console.print(
            f"  {told(found.terms[p.term]).split(' (')[0]}: {p.name} = {p.value:.4g}, 95 % {interval} {p.flag}",
            highlight=False,
            markup=False,
        )
    for paragraph in words:
        console.print(paragraph, highlight=False)
