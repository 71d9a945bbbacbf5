"""How fast ee_dist is, as ratios within one run: python tools/benchmark.py [--quick] [--json FILE] [--figures FOLDER]

Whole runs come first; what the bare engine step costs is then measured on offspring of the controllers that they found, in
as many processes at once as a run has workers. Peers (a naive program, DEAP) are measured on a sample and scaled to the
evaluations that the run asked for. Ratios are taken of processor time as well as of wall time: on a machine that others use
too, only the first can be trusted.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
from pathlib import Path
from typing import Any

from benchmarks.assess import explain_rows, peer_rows, profile_rows, run_rows, speed_up_rows, step_rows
from benchmarks.costs import measure_costs
from benchmarks.explain_run import explain_catalogue
from benchmarks.figures import draw_table
from benchmarks.peers import run_peer, write_urdf
from benchmarks.profile import profile
from benchmarks.steps import StepSetting, measure_steps
from benchmarks.table import Row, as_json, markdown, put_between, show
from benchmarks.timing import machine
from benchmarks.together import at_once
from benchmarks.whole_run import RunSetting, finished_run, run_scenario
from rich.console import Console

from ee_dist.basics.cores import usable
from ee_dist.robots.quadruped import quadruped

ROOT = Path(__file__).resolve().parent.parent
DOCS = ROOT / "docs"
ENGINES = ("pybullet", "mujoco")
USUAL_START_S = 8.0
"""From the command to the first generation, where no run was measured."""
PARTS = ("runs", "steps", "profile", "peers", "explain", "costs")


def parse(arguments: list[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="small sizes: does it work; the numbers say little")
    parser.add_argument("--budget", choices=("quick", "paper"), help="of the whole runs (paper; with --quick: quick)")
    parser.add_argument("--repeat", type=int, help="samples of each step measurement (5; with --quick: 2)")
    parser.add_argument("--engines", nargs="+", choices=ENGINES, default=list(ENGINES))
    parser.add_argument("--parts", nargs="+", choices=PARTS, default=list(PARTS), help="what to measure (all)")
    parser.add_argument("--workers", nargs="+", type=int, default=[1, 2], help="workers of the whole runs (1 2)")
    parser.add_argument("--robots", type=int, help="robots a batch in the step measurement (25; with --quick: 4)")
    parser.add_argument("--steps", type=int, help="steps of it (1000; with --quick: 40)")
    parser.add_argument("--json", type=Path, metavar="FILE", help="write the table for programs")
    parser.add_argument("--figures", type=Path, metavar="FOLDER", help="draw the charts there")
    parser.add_argument("--docs", action="store_true", help="write JSON, charts and the table of docs/speed.md")
    parser.add_argument("--finished", nargs="+", type=Path, metavar="RUN", help="take these runs instead of new ones")
    options = parser.parse_args(arguments)
    defaults = {
        "budget": ("paper", "quick"),
        "repeat": (5, 2),
        "robots": (25, 4),
        "steps": (1000, 40),
    }
    for name, (usual, small) in defaults.items():
        if getattr(options, name) is None:
            setattr(options, name, small if options.quick else usual)
    if options.docs:
        options.json, options.figures = DOCS / "figures" / "speed.json", DOCS / "figures"
    return options


class Benchmark:
    """Measures part after part and collects rows; a part that cannot be measured is a note."""

    def __init__(self, options: argparse.Namespace, folder: Path, console: Console) -> None:
        self.options, self.folder, self.console = options, folder, console
        self.cores = usable()
        self.rows: list[Row] = []
        self.notes: list[str] = []
        self.data: dict[str, Any] = {"machine": machine(), "runs": [], "bare": {}, "peers": {}, "costs": {}}

    def run(self) -> None:
        for part in PARTS:
            if part in self.options.parts:
                self.console.print(f"[dim]measuring {part} ...[/dim]", highlight=False)
                getattr(self, part)()
        self._collect()

    def runs(self) -> None:
        for folder in self.options.finished or ():
            try:
                self.data["runs"].append(finished_run(folder))
            except RuntimeError as error:
                self.notes.append(str(error))
        if self.options.finished:
            return
        for engine in self.options.engines:
            for workers in self.options.workers:
                out = self.folder / f"{engine}_{workers}"
                try:
                    found = run_scenario(RunSetting(engine, self.options.budget, workers), out, ROOT)
                except RuntimeError as error:
                    self.notes.append(str(error))
                    continue
                self.data["runs"].append(found)
                self.console.print(
                    f"[dim]  {engine}, {workers} workers: {found['wall_s']:.0f} s[/dim]", highlight=False
                )

    def steps(self) -> None:
        o = self.options
        for engine in o.engines:
            runs = [r for r in self.data["runs"] if r["engine"] == engine]
            found = tuple(tuple(c) for c in runs[0]["controllers"]) if runs else ()
            setting = StepSetting(engine, o.robots, o.steps, repeat=o.repeat, controllers=found)
            processes = min(max(o.workers), self.cores)
            self.data["bare"][engine] = {
                **at_once(measure_steps, setting, processes),
                "robots": o.robots,
                "processes": processes,
            }

    def profile(self) -> None:
        self.data["profile"] = {}
        for engine in self.options.engines:
            self.data["profile"][engine] = profile(StepSetting(engine, self.options.robots, self.options.steps))

    def peers(self) -> None:
        urdf = self.folder / "quadruped.urdf"
        write_urdf(quadruped(), urdf)
        count, steps = (8, 50) if self.options.quick else (40, 1000)
        common = ("--steps", str(steps), "--processes", str(self.cores))
        sizes = {
            "naive_program": ("--evaluations", str(count)),
            "deap_program": ("--population", str(count // 2), "--generations", "2"),
        }
        for program, size in sizes.items():
            try:
                self.data["peers"][program] = run_peer(program, urdf, *size, *common)
            except RuntimeError as error:
                self.notes.append(str(error))

    def explain(self) -> None:
        self.data["explain"] = []
        for engine in self.options.engines:
            try:
                found = explain_catalogue(engine, self.options.quick, self.folder / f"explain_{engine}", ROOT)
                self.data["explain"].append(found)
            except RuntimeError as error:
                self.notes.append(f"explain with {engine}: {error}")

    def costs(self) -> None:
        for engine in self.options.engines:
            costs = measure_costs(engine, self.options.quick)
            starts = [r["first_progress_cpu_s"] for r in self.data["runs"] if r["engine"] == engine]
            # Processor time: on a machine that others use too, wall time says more about them.
            start = min((s for s in starts if s), default=USUAL_START_S)
            self.data["costs"][engine] = {**costs, "start_s": start}

    def _collect(self) -> None:
        d = self.data
        for engine, bare in d["bare"].items():
            self.rows += step_rows(engine, bare["robots"], bare["processes"], bare)
        for engine, found in d.get("profile", {}).items():
            self.rows += profile_rows(engine, self.options.robots, found)
        for run in d["runs"]:
            self.rows += run_rows(run, d["bare"].get(run["engine"]), self.cores)
        self.rows += speed_up_rows(d["runs"])
        for program, title in (("naive_program", "Naive program"), ("deap_program", "DEAP program")):
            if program in d["peers"]:
                self.rows += peer_rows(title, d["peers"][program], d["runs"], d["machine"]["shared"])
        for found in d.get("explain", []):
            self.rows += explain_rows(found)


def main(arguments: list[str] | None = None) -> int:
    options, console = parse(arguments), Console(width=None if sys.stdout.isatty() else 150)
    with tempfile.TemporaryDirectory(prefix="ee_dist_benchmark_") as folder:
        benchmark = Benchmark(options, Path(folder), console)
        benchmark.run()
    about = benchmark.data["machine"]
    title = f"ee_dist on {about['cores']} cores{', shared' if about['shared'] else ''}"
    show(console, benchmark.rows, title)
    for note in benchmark.notes:
        console.print(f"left out: {note}", highlight=False)
    content = as_json(benchmark.rows, notes=benchmark.notes, **benchmark.data)
    if options.json:
        options.json.parent.mkdir(parents=True, exist_ok=True)
        options.json.write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    if options.figures:
        for path in draw_table(content, options.figures):
            console.print(f"  {path}", highlight=False)
    if options.docs:
        put_between(
            DOCS / "speed.md",
            "benchmark",
            f"{title}; load {about['load_1_min']} at the start.\n\n{markdown(benchmark.rows)}",
        )
    return 0


if __name__ == "__main__":
    sys.exit(main())
