"""How far cores help: python tools/scaling.py --json BENCHMARK.json [--figure OUT.png] [--check] [--out FILE]

Takes measured costs and the generations of a measured run from what tools/benchmark.py wrote, and simulates the wall time of
one run and of a study of 260 runs (13 scenarios x 2 metrics x 10 seeds) on 1 to 10,000 cores. --check measures 1 and 2 workers
and a cluster of two nodes on this machine and sets them beside the model's prediction.
"""

from __future__ import annotations

import argparse
import itertools
import json
import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from benchmarks.figures import save, scaling_chart
from benchmarks.scaling_model import Costs, Generation, generations, limit_s, simulate, study
from benchmarks.table import put_between
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

NAMES = {"pybullet": "PyBullet", "mujoco": "MuJoCo"}
CORES = (1, 2, 4, 8, 16, 32, 64, 100, 200, 500, 1000, 2000, 5000, 10000)
DOCS = Path(__file__).resolve().parent.parent / "docs"
STUDY_RUNS = 260
WORTH = 0.05
"""More cores are worth it while doubling them takes this share off the wall time."""


def curves(trace: Sequence[Generation], costs: Costs, cores: Sequence[int], runs: int) -> list[dict[str, Any]]:
    """A row for each number of cores: one run with its parts, and the study."""
    rows = []
    for count in cores:
        one = simulate(trace, costs, count)
        wall, beside = study(trace, costs, count, runs)
        rows.append(
            {
                "cores": count,
                "run_s": one.wall_s,
                **{f"{part}_s": seconds for part, seconds in one.parts.items()},
                "busy": one.busy,
                "study_s": wall,
                "side_by_side": beside,
            }
        )
    return rows


def stops_at(rows: Sequence[Mapping[str, Any]], key: str) -> int:
    """Cores beyond which the next size takes off less than ``WORTH`` of the wall time."""
    for here, following in itertools.pairwise(rows):
        if following[key] > here[key] * (1.0 - WORTH):
            return int(here["cores"])
    return int(rows[-1]["cores"])


def show(console: Console, engine: str, rows: Sequence[Mapping[str, Any]], least_s: float) -> None:
    """The table of one engine."""
    table = Table(box=SIMPLE, title=f"{engine}: wall time (s) by cores", title_justify="left")
    for name in ("cores", "one run", "start", "search", "work", "waiting", "busy", "260 runs", "side by side"):
        table.add_column(name, justify="right")
    for r in rows:
        parts = [f"{r[f'{p}_s']:,.1f}" for p in ("start", "search", "work", "waiting")]
        table.add_row(
            f"{r['cores']:,}",
            f"{r['run_s']:,.1f}",
            *parts,
            f"{r['busy']:.0%}",
            f"{r['study_s']:,.0f}",
            str(r["side_by_side"]),
        )
    console.print(table)
    console.print(
        f"One run stops falling at about {stops_at(rows, 'run_s'):,} cores (limit {least_s:.1f} s: generations follow one "
        f"another), the study at about {stops_at(rows, 'study_s'):,}.",
        highlight=False,
    )


def markdown(result: Mapping[str, Any]) -> str:
    """The tables of docs/speed.md."""
    lines: list[str] = []
    for engine, rows in result["curves"].items():
        lines += [f"**{NAMES[engine]}**", "", "| cores | one run, s | start | search | work | waiting | 260 runs, s |"]
        lines.append("|" + "---:|" * 7)
        for r in rows:
            parts = " | ".join(f"{r[f'{p}_s']:,.1f}" for p in ("start", "search", "work", "waiting"))
            lines.append(f"| {r['cores']:,} | {r['run_s']:,.1f} | {parts} | {r['study_s']:,.0f} |")
        lines += [
            "",
            f"One run stops falling at about {stops_at(rows, 'run_s'):,} cores, the study at about "
            f"{stops_at(rows, 'study_s'):,}: doubling the cores beyond takes off less than 5 %.",
            "",
        ]
        found = result["check"].get(engine)
        if found:
            lines += [
                f"Check, a repair pass on warm workers: 2 workers are {found['speed_up_measured']:.2f} times as fast as 1 "
                f"(predicted {found['speed_up_predicted']:.2f}; two processes that share nothing: "
                f"{found['speed_up_possible']:.2f}), two nodes {found['speed_up_two_nodes']:.2f} times; "
                f"{'the same result in all' if found['same_result'] else 'the results differ'}.",
                "",
            ]
    return "\n".join(lines).rstrip()


def traces(content: Mapping[str, Any]) -> dict[str, list[Generation]]:
    """The generations of the measured run of each engine; an engine without a run has those of another."""
    found = {r["engine"]: generations(r["generations"]) for r in content["runs"]}
    if not found:
        raise SystemExit("scaling: the JSON has no runs; make it with tools/benchmark.py --json FILE")
    return {engine: found.get(engine, next(iter(found.values()))) for engine in content["costs"]}


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument(
        "--json", type=Path, default=DOCS / "figures" / "speed.json", help="from tools/benchmark.py --json"
    )
    parser.add_argument("--docs", action="store_true", help="write the chart and the table of docs/speed.md")
    parser.add_argument("--figure", type=Path, help="draw the chart there (PNG)")
    parser.add_argument("--out", type=Path, help="write the curves for programs")
    parser.add_argument(
        "--check", action="store_true", help="measure 1 and 2 workers and two nodes too (a minute or two)"
    )
    options = parser.parse_args(arguments)
    if options.docs:
        options.figure = DOCS / "figures" / "speed_scaling.png"
    content = json.loads(options.json.read_text(encoding="utf-8"))
    console, lines = Console(width=None if sys.stdout.isatty() else 120), {}
    result: dict[str, Any] = {"curves": {}, "check": {}}
    for engine, trace in traces(content).items():
        costs = Costs.of(content["costs"][engine])
        rows = curves(trace, costs, CORES, STUDY_RUNS)
        show(console, NAMES[engine], rows, limit_s(trace, costs))
        result["curves"][engine] = rows
        lines[f"one run, {NAMES[engine]}"] = [r["run_s"] for r in rows]
        lines[f"{STUDY_RUNS} runs, {NAMES[engine]}"] = [r["study_s"] for r in rows]
        if options.check:
            from benchmarks.scaling_check import CheckSetting, check

            result["check"][engine] = found = check(CheckSetting(engine), costs)
            console.print(
                f"Check: 2 workers measured {found['speed_up_measured']:.2f} x, two nodes {found['speed_up_two_nodes']:.2f} x, "
                f"predicted {found['speed_up_predicted']:.2f} x, two processes that share nothing "
                f"{found['speed_up_possible']:.2f} x; same result: {found['same_result']}.",
                highlight=False,
            )
    if options.docs:
        put_between(DOCS / "speed.md", "scaling", markdown(result))
    if options.figure:
        measured = [(r["workers"], r["wall_s"]) for r in content["runs"]]
        console.print(f"  {save(scaling_chart(CORES, lines, {'measured runs': measured}), options.figure)}")
    if options.out:
        options.out.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
