"""task=study: the paper's figures, a table with paired tests, and its findings beside ours, from the runs of a sweep."""

from __future__ import annotations

import csv
import io
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from ee_dist.basics.files import write_whole
from ee_dist.discrepancy.words import percent
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.outcome import RESTORED
from ee_dist.tasks.results.findings import findings
from ee_dist.tasks.results.study_logs import controllers, doubted, parting, shown
from ee_dist.tasks.results.study_page import Extra, study_page
from ee_dist.tasks.results.study_runs import FILE, kept, runs_of, summaries
from ee_dist.tasks.results.study_sections import TEST, brief, cells, head
from ee_dist.tasks.results.study_table import COLUMNS, Rows, against, by_case, once, plain, row, total
from ee_dist.tasks.summary import Stopwatch, digest_of, write_summary
from ee_dist.tasks.terminal import terminal
from ee_dist.tasks.wiring import evaluator_of, for_few
from ee_dist.viewing.parting_figures import Parting
from ee_dist.viewing.report import write_page


@dataclass
class Options:
    name: str = "study"
    earlier: list[str] = field(default_factory=list)


SHORT = ("case", "runs", "intact", "after", "last", "restored", "right", "named", "doubt", "p")
"""Heads of the table for a terminal of 80 columns."""


def run(config: Config, options: Options, out: Path) -> None:
    """Write study.csv, study.md, runs.json, report.html and summary.json from the runs below ``config.log`` and those that
    ``options.earlier`` studies keep. Raises ConfigError."""
    console, watch = terminal(), Stopwatch()
    if not config.log and not options.earlier:
        raise ConfigError("log=: which runs? name the folder of a sweep, such as log=logs/recover/..._sweep")
    told_by = summaries(Path(config.log)) if config.log else {}
    every = runs_of(told_by, [Path(e) for e in options.earlier])
    runs = once(every)
    if len(runs) < len(every):
        console.print(f"{len(every) - len(runs)} of {len(every)} runs are there twice and count once.", highlight=False)
    few = for_few(config)
    for told in runs:
        if "doubt" not in told:
            told["doubt"] = doubted(told, evaluator_of(few, told["engine"]))
    rows = [row(r) for r in runs]
    table = io.StringIO(newline="")
    writer = csv.DictWriter(table, COLUMNS)
    writer.writeheader()
    writer.writerows(rows)
    write_whole(out / "study.csv", table.getvalue())
    lines, between, totals = by_case(rows), against(rows), total(rows)
    write_whole(out / "study.md", markdown(rows, lines, totals))
    write_whole(out / FILE, kept(runs))
    _print(console, lines, totals)
    parted = _partings(few, runs)
    found = findings(rows, lines, between, runs, [(p.near, p.far) for p in parted])
    write_summary(out, "study", config, options, watch, digest_of(_decisive(rows)), {
        "runs": len(rows),
        "totals": totals,
        "cases": [plain(x) for x in lines],
        "rolling_mean_against_distance": [{"scenario": c, **t.as_dict()} for c, t in between.items()],
        "logs_part_after_steps": [{"nearly_equal": p.near, "different": p.far} for p in parted],
        "findings": [f.as_dict() for f in found],
    })  # fmt: skip
    extra = Extra(shown(runs), parted, between, found, _links(told_by, out))
    where = " and ".join([*([config.log] if config.log else []), *options.earlier])
    page = study_page(runs, rows, lines, totals, where, extra)
    write_page(page, out / "report.html")
    for name in ("study.csv", "study.md", FILE, "report.html"):
        console.print(f"  {os.path.relpath(out / name)}", highlight=False, soft_wrap=True)
    for line in (page.headline, *page.first):
        console.print(line, highlight=False)
    if page.following:
        console.print(f"Next: {page.following}", highlight=False, markup=False, soft_wrap=True)


def _decisive(rows: Sequence[Mapping[str, Any]]) -> list[dict[str, Any]]:
    """Rows without what says where and how long they were computed: the digest of a study is of its runs' results."""
    return [{k: v for k, v in r.items() if k not in ("wall_s", "folder", "command")} for r in rows]


def _partings(few: Config, runs: Sequence[Mapping[str, Any]]) -> list[Parting]:
    """When logs of damages part under the intact controllers: the only rollouts of a study, three for each."""
    found = []
    for engine, robot, controller, steps in controllers(runs):
        parted = parting(robot, controller, steps, evaluator_of(few, engine))
        if parted is not None:
            found.append(parted)
    return found


def _links(told_by: Mapping[Path, dict[str, Any]], out: Path) -> list[tuple[str, str]]:
    """Runs of evolution on the body alone (the paper's Fig. 1) that lie below the folder too: each has a page of its own."""
    found = []
    for path, told in told_by.items():
        page = path.parent / "report.html"
        if told.get("task") == "online" and page.is_file():
            name = f"Evolution on the body alone, without a model (the paper's Fig. 1), scenario {told.get('scenario')}"
            found.append((f"{name}, seed {told.get('seed')}", os.path.relpath(page, out)))
    return found


def markdown(rows: Rows, lines: Rows, totals: Mapping[str, Any]) -> str:
    """The table for a document, each metric and the totals."""
    parts, heads = [], head(rows)
    for metric, counts in totals.items():
        parts.append(f"### {metric}\n")
        parts.append("| " + " | ".join(heads) + " |\n|" + "---|" * len(heads))
        parts += ["| " + " | ".join(cells(x)) + " |" for x in lines if x["metric"] == metric]
        n, scored = counts["runs"], counts["scored"]
        parts.append(
            f"\nRestored ({percent(RESTORED)} of intact or more in one of the compensating trials): {counts['restored']} of {n}. "
            f"Diagnosis right (every true effect at its place and no other): {counts['right']} of {scored}; "
            f"all true effects named: {counts['true_among_believed']} of {scored}. {TEST}\n"
        )
    return "\n".join(parts) + "\n"


def _print(console: Console, lines: Rows, totals: Mapping[str, Any]) -> None:
    for metric, counts in totals.items():
        table = Table(
            title=f"{metric}, distances in m", box=SIMPLE, padding=(0, 1, 0, 0), pad_edge=False, title_justify="left"
        )
        for name in SHORT:
            table.add_column(name, justify="right", no_wrap=True)
        for line in lines:
            if line["metric"] == metric:
                table.add_row(*brief(line))
        console.print(table)
        n, scored = counts["runs"], counts["scored"]
        console.print(f"restored {counts['restored']}/{n}, diagnosis right {counts['right']}/{scored}, "
                      f"all true effects named {counts['true_among_believed']}/{scored}", highlight=False)  # fmt: skip
    console.print(TEST, style="dim", highlight=False)
