"""task=compare: how far a model is from what was measured, and where it fails."""

from __future__ import annotations

import hashlib
import os
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.table import Table

from ee_dist.discrepancy.locate import Comparison, compare
from ee_dist.tasks import measured_robot
from ee_dist.tasks.config import Config
from ee_dist.tasks.measured import Measurements, load, problem_of
from ee_dist.tasks.pictures import compare_page, write_pictures
from ee_dist.tasks.summary import Stopwatch, hypothesis_list, write_summary
from ee_dist.tasks.wiring import evaluator_of
from ee_dist.viewing.report import write_page


@dataclass
class Options:
    name: str = "compare"
    by: str = "open_loop"
    rerun: bool = True


def run(config: Config, options: Options, out: Path) -> None:
    """Write report.html, compare.rrd and summary.json into ``out``. Raises ConfigError, LogError, RecordingError."""
    if measured_robot.elsewhere(options.by):
        measured_robot.run_compare(config, options, out)
        return
    console, watch = Console(), Stopwatch()
    measured = load(config)
    problem = problem_of(measured, evaluator_of(config))
    residual = problem.residuals([measured.model])[0]
    found = compare(problem, residual)
    out.mkdir(parents=True, exist_ok=True)
    write_page(compare_page(problem, measured, found, residual), out / "report.html")
    if options.rerun:
        write_pictures(problem, measured.model, out / "compare.rrd", "compare")
    _print(console, found, measured)
    digest = hashlib.sha256(np.ascontiguousarray(residual).tobytes()).hexdigest()
    write_summary(
        out, "compare", config, options, watch, digest, {**summary(found), "model": hypothesis_list(measured.model)}
    )
    names = ("report.html", "compare.rrd", "summary.json") if options.rerun else ("report.html", "summary.json")
    for file in names:
        console.print(f"  {os.path.relpath(out / file)}", highlight=False, soft_wrap=True)


def summary(found: Comparison) -> dict[str, object]:
    """The part of summary.json that compare documents."""
    return {
        "error": found.error,
        "error_definition": found.definition,
        "noise_floor": found.noise_floor,
        "noise_floor_source": found.floor_source,
        "channels": [
            {"name": c.name, "unit": c.unit, "rmse": c.rmse, "normalised": c.normalised, "worst_trial": c.worst_trial,
             "worst_from_s": c.worst_from_s, "worst_to_s": c.worst_to_s} for c in found.channels
        ],
        "regimes": [{"name": r.name, "error": r.error, "share": r.share, "values": r.values} for r in found.regimes],
        "parted_s": found.parted_s,
    }  # fmt: skip


def _print(console: Console, found: Comparison, measured: Measurements) -> None:
    console.print(
        f"Error {found.error:.3f}, noise floor {found.noise_floor:.3f} ({found.floor_source}).\n"
        f"[dim]Error: {found.definition}.[/dim]",
        highlight=False,
    )
    table = Table(title="Where it fails: channels", title_justify="left")
    for column, side in (("channel", "left"), ("rmse", "right"), ("error", "right"), ("worst", "left")):
        table.add_column(column, justify=side)  # type: ignore[arg-type]
    for c in found.channels[:8]:
        where = f"{c.worst_trial}, {c.worst_from_s:.1f} to {c.worst_to_s:.1f} s"
        table.add_row(c.name, f"{c.rmse:.4g} {c.unit}", f"{c.normalised:.2f}", where)
    console.print(table)
    table = Table(title="Where it fails: regimes", title_justify="left")
    for column, side in (("regime", "left"), ("error", "right"), ("share of excess", "right"), ("of data", "right")):
        table.add_column(column, justify=side)  # type: ignore[arg-type]
    for r in sorted(found.regimes, key=lambda r: -r.error):
        table.add_row(r.name, f"{r.error:.2f}", f"{r.share:.0%}", f"{r.values:.0%}")
    console.print(table)
    parted = [f"{t} at {s:.2f} s" for t, s in found.parted_s.items() if s is not None]
    console.print("Prediction and measurement part: " + ("; ".join(parted) or "nowhere"), highlight=False)
