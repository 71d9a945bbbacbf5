"""task=compare: how far a model is from what was measured, and where it fails."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.at_limit import often_at_limit
from ee_dist.discrepancy.base_model import residual_as_it_is
from ee_dist.discrepancy.compare import Comparison, compare
from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.discrepancy.problem import Problem
from ee_dist.tasks.config import AUTO, Config
from ee_dist.tasks.measurements import load
from ee_dist.tasks.results.commands import asked, command
from ee_dist.tasks.results.pages import compare_page
from ee_dist.tasks.results.scenes import compare_scene
from ee_dist.tasks.results.story import links
from ee_dist.tasks.results.summaries import of_comparison
from ee_dist.tasks.results.tables import show_account, show_comparison
from ee_dist.tasks.summary import Stopwatch, write_summary
from ee_dist.tasks.terminal import terminal
from ee_dist.tasks.unfinished import note_nothing
from ee_dist.tasks.ways import known_way, way_of
from ee_dist.tasks.wiring import for_few
from ee_dist.viewing.report import write_page


@dataclass
class Options:
    name: str = "compare"
    by: str = AUTO
    rerun: bool = True

    def __post_init__(self) -> None:
        known_way(self.by)


def run(config: Config, options: Options, out: Path) -> tuple[Problem, Comparison, Account]:
    """Write summary.json, report.html and compare.rrd into ``out``. Raises ConfigError, LogError, RecordingError."""
    note_nothing()  # it is over in seconds
    console, watch, measured = terminal(), Stopwatch(), load(config)
    way = way_of(measured, options.by)
    problem = way.make(measured, for_few(config))
    residual = residual_as_it_is(problem, measured.model)
    found = replace(compare(problem, residual), at_limit=often_at_limit(problem, measured.model))
    left = leftovers(problem, residual)
    account = compare_account(problem, found, left).warned(measured.remarks)
    if not account.good:
        account = account.followed(command(asked("explain", config, options.by)))
    remarks = problem.remarks(measured.model)
    digest = hashlib.sha256(np.ascontiguousarray(residual).tobytes()).hexdigest()
    out.mkdir(parents=True, exist_ok=True)
    summary = {**of_comparison(problem, found, account, measured.model, left), "remarks": remarks}
    write_summary(out, "compare", config, options, watch, digest, summary)
    story = links(out, measured.files, config.model)
    page = compare_page(problem, measured, found, account, residual, remarks, story)
    write_page(page, out / "report.html")
    if options.rerun:
        compare_scene(problem, found, account, measured.model, out / "compare.rrd")
    show_comparison(console, problem, found)
    apart = [f"Left out of this: {listed(measured.held_out)}."] if measured.held_out else []
    console.print(f"By {way.name}: {way.why}.", *apart, *remarks, sep="\n", highlight=False, markup=False)
    show_account(console, account, out)
    return problem, found, account
