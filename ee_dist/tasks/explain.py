"""task=explain: which missing effect explains what was measured, ranked, with held-out evidence and in words."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from ee_dist.discrepancy.candidates import candidates
from ee_dist.discrepancy.explain import Explanation, explain
from ee_dist.discrepancy.separate import ENOUGH, Proposal, proposals
from ee_dist.discrepancy.words import explanation_text, told
from ee_dist.robots.model import Robot
from ee_dist.tasks import measured_robot
from ee_dist.tasks.config import Config
from ee_dist.tasks.measured import load, problem_of
from ee_dist.tasks.pictures import explain_page, write_pictures
from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.summary import Stopwatch, hypothesis_list, write_summary
from ee_dist.tasks.wiring import evaluator_of
from ee_dist.viewing.report import write_page


@dataclass
class Options:
    name: str = "explain"
    by: str = "open_loop"
    without: list[str] = field(default_factory=list)
    rerun: bool = True


def run(config: Config, options: Options, out: Path) -> None:
    """Write report.html, explain.rrd and summary.json into ``out``. Raises ConfigError, LogError, RecordingError."""
    if measured_robot.elsewhere(options.by):
        measured_robot.run_explain(config, options, out)
        return
    console, watch = Console(), Stopwatch()
    measured = load(config)
    evaluator = evaluator_of(config)
    pool = candidates(measured.robot, options.without)
    console.print(
        f"{len(measured.trials)} trials of {measured.robot.name}; {len(pool)} candidate explanations.", highlight=False
    )
    with SearchProgress(console) as progress:
        problem = problem_of(measured, evaluator)
        found = explain(problem, pool, measured.model, progress=progress)
        tied = [(*measured.model, *c.hypothesis) for c in found.tied]
        ahead = proposals(measured.robot, tied[:5], evaluator) if len(tied) > 1 else []
    best = ahead[0] if ahead else None
    words = explanation_text(found, measured.robot, best)
    out.mkdir(parents=True, exist_ok=True)
    write_page(explain_page(problem, measured, found, words), out / "report.html")
    if options.rerun:
        after = measured.model if found.best is None else (*measured.model, *found.best.hypothesis)
        write_pictures(problem, after, out / "explain.rrd", "explain")
    _print(console, found, words, measured.robot)
    digest = hashlib.sha256(repr([(c.hypothesis, c.error_heldout) for c in found.candidates]).encode()).hexdigest()
    write_summary(out, "explain", config, options, watch, digest, summary(found, words, best))
    wall, _ = watch.read()
    counts = evaluator.counts
    work = f"{counts.simulated:,} rollouts, {counts.steps / 1e6:.1f} million robot-steps, {wall:.0f} s."
    console.print(f"\n{work} Digest {digest[:16]}.", highlight=False)
    for file in ("report.html", "explain.rrd", "summary.json")[:: 1 if options.rerun else 2]:
        console.print(f"  {os.path.relpath(out / file)}", highlight=False, soft_wrap=True)


def summary(found: Explanation, words: list[str], ahead: Proposal | None) -> dict[str, Any]:
    """The part of summary.json that explain documents."""
    worth = ahead is not None and ahead.separation >= ENOUGH
    return {
        "verdict": found.verdict,
        "baseline_error": found.baseline_error,
        "noise_floor": found.noise_floor,
        "noise_floor_source": found.floor_source,
        "model": hypothesis_list(found.before),
        "candidates": [
            {**hypothesis_list(c.hypothesis)[-1], "name": c.name, "error_fit": c.error_fit, "error_heldout": c.error_heldout,
             "gain_heldout": c.gain, "interval": list(c.interval), "rank": c.rank, "tied_with": c.tied_with,
             "earned": c.earned, "why_not": c.why_not} for c in found.candidates
        ],
        "left": [{"trial": g.trial, "channel": g.channel, "deviations": g.z, "slow": g.trend} for g in found.left],
        "next_trial": {**ahead.excitation.as_dict(), "separation": ahead.separation} if ahead is not None and worth else None,
        "words": words,
    }  # fmt: skip


def _print(console: Console, found: Explanation, words: list[str], robot: Robot) -> None:
    if found.candidates:
        table = Table(title="Candidate effects, judged on data they were not fitted to", title_justify="left")
        for column, side in (
            ("", "right"),
            ("effect", "left"),
            ("error", "right"),
            ("gain", "right"),
            ("95 % interval", "right"),
            ("", "left"),
        ):
            table.add_column(column, justify=side)  # type: ignore[arg-type]
        ties = set(found.best.tied_with) if found.best else set()
        for c in found.candidates:
            note = "best" if c is found.best else "tied" if c.name in ties else "" if c.earned else c.why_not
            table.add_row(str(c.rank), told(c.hypothesis[-1], robot), f"{c.error_heldout:.3f}", f"{c.gain:.1%}",
                          f"{max(c.interval[0], -9.99):.1%} to {c.interval[1]:.1%}", note)  # fmt: skip
        console.print(table)
    for paragraph in words:
        console.print(paragraph, highlight=False)
