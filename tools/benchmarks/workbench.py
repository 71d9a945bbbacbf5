"""How long the workbench takes, as a person at the browser has it, beside what it aims at:

    python tools/benchmarks/workbench.py [start] [slider] [long]

start: from the command to the first page. slider: from a move of the mouse on a slider to redrawn curves on the screen. long:
20 trials of 60 s at 500 Hz. Without a word all three. Wall milliseconds in headless Chromium, of which other programs on
the machine are a part, and CPU milliseconds of the workbench's process. Needs Chromium.
"""

from __future__ import annotations

import os
import re
import sys
import tempfile
import time
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "workbench"))

from page_driver import Bench, Person

from benchmarks.workbench_logs import LONG, PENDULUM, QUADRUPED, Log, written
from ee_dist.recording.reader import read_run

MOVES, FEW = 40, 10
FIRST_PAGE_MS = 3000.0
SLIDE_MS = {"pendulum": 100.0, "quadruped": 300.0}
PATIENCE_S = 600.0
FLUID_MS = 300.0
"""What a hand that zooms or asks for another curve may have to wait."""
COMPLETE = (
    "parseFloat(document.querySelector('.number').innerText) > 0 && "
    "[...document.querySelectorAll('.js-plotly-plot')].filter("
    "(p) => p.calcdata?.length && p.querySelector('.main-svg')).length > 4"
)
"""The error is there, and more than four charts are drawn with what there is to see in them."""
KNOWN = "parseFloat(document.querySelector('.number').innerText) > 0"
SETTLED = (
    f"{KNOWN} && [...document.querySelectorAll('.js-plotly-plot')].find((p) => p.offsetParent && "
    "p.data?.[0]?.name === 'measured').data[0].x.length > 400"
)
"""More points than a curve has while a hand is on a slider."""
LAUNCH = (
    "import sys, time; from nicegui import ui; print('toolkit', time.time(), time.process_time(), flush=True); "
    "import runpy; sys.argv[0] = 'ee_dist'; runpy.run_module('ee_dist', run_name='__main__', alter_sys=True)"
)
WATCH = """((kind) => {
  const plot = [...document.querySelectorAll('.js-plotly-plot')].find((p) => p.offsetParent && p.data?.[0]?.name === 'measured');
  const values = () => JSON.stringify(plot.data.map((d) => [d.x, d.y]));
  const seen = values();
  window.redrawn = new Promise((done) => {
    let begun = null;
    addEventListener(kind, (e) => { begun = e.timeStamp; }, {capture: true, once: true});
    const look = () => {
      if (begun === null || values() === seen) return;
      plot.removeListener('plotly_afterplot', look);
      // A message from within a frame is read when that frame is on the screen.
      requestAnimationFrame(() => { const after = new MessageChannel();
        after.port1.onmessage = () => done(performance.now() - begun); after.port2.postMessage(0); });
    };
    plot.on('plotly_afterplot', look);
  });
})(%r)"""
PLACE = """(() => { const all = [...document.querySelectorAll(%r)].map((e) => e.getBoundingClientRect());
  const r = all.find((r) => r.width); return [r.x, r.y, r.width, r.height]; })()"""
SHOWN = """(() => { const p = [...document.querySelectorAll('.js-plotly-plot')].find(
  (p) => p.offsetParent && p.data?.[0]?.name === 'measured');
  return [p.calcdata[0].map((c) => c.x), ...p.layout.xaxis.range]; })()"""


class Timed(Bench):
    """The workbench by a launcher that says when the toolkit was imported."""

    program = ("-c", LAUNCH)

    @property
    def imported(self) -> tuple[float, float]:
        """When that was, and the CPU seconds that the process had used by then."""
        found = next(line.split() for line in self.lines if line.startswith("toolkit "))
        return float(found[1]), float(found[2])


def cpu_s(pid: int) -> float:
    """User and system seconds of a process with its threads."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def peak_mb(pid: int) -> float:
    """Of the memory that a process had at any time."""
    status = Path(f"/proc/{pid}/status").read_text()
    return int(re.search(r"VmHWM:\s+(\d+) kB", status)[1]) / 1e3


def row(what: str, figures: str, aim_ms: float | None = None, got_ms: float | None = None) -> None:
    aim = "" if aim_ms is None or got_ms is None else f"aim {aim_ms:.0f} ms: {'met' if got_ms <= aim_ms else 'MISSED'}"
    print(f"{what:<62}{figures:<58}{aim}", flush=True)


def opened(log: Log, folder: Path) -> Timed:
    written(log, folder / "trial.mcap")
    return Timed(folder, f"measured={folder / 'trial.mcap'}", "engine=mujoco", "hydra.run.dir=bench")


def first_page(bench: Timed, person: Person, begun: float) -> float:
    """Milliseconds from the import of the toolkit to the page with all that it shows; it prints what lies between."""
    pid = bench.process.pid
    stamps = {"toolkit imported": bench.imported, "answers": (time.time(), cpu_s(pid))}
    with person.unwatched():
        person.go(bench.address)
        stamps["page loaded"] = (time.time(), cpu_s(pid))
        person.wait(COMPLETE, PATIENCE_S)
    stamps["complete"] = (time.time(), cpu_s(pid))
    told = ", ".join(f"{name} {t - begun:.1f} ({cpu:.1f})" for name, (t, cpu) in stamps.items())
    print(f"    seconds from the command, and CPU seconds of the workbench: {told}")
    return 1e3 * (stamps["complete"][0] - bench.imported[0])


def start(folder: Path) -> None:
    with Person() as person:
        bench = opened(PENDULUM, folder)
        begun = time.time()
        with bench:
            took = first_page(bench, person, begun)
            row("first page, after the import of the toolkit", f"{took:.0f} ms", FIRST_PAGE_MS, took)
            person.go("about:blank")
            with person.unwatched():
                again = time.time()
                person.go(bench.address)
                person.wait(COMPLETE)
                row("the page once more, in another tab", f"{1e3 * (time.time() - again):.0f} ms")


def redrawn(person: Person, kind: str, act: Callable[[], None]) -> float:
    """Milliseconds from an event to other curves on the screen."""
    person.evaluate(WATCH % kind)
    act()
    return float(person.evaluate("window.redrawn"))


@dataclass(frozen=True)
class Took:
    """Some acts one after the other: wall milliseconds of each; CPU milliseconds of the workbench and bytes of one."""

    wall_ms: list[float]
    cpu_ms: float
    received: float

    def __str__(self) -> str:
        most = np.quantile(self.wall_ms, 0.95)
        figures = (
            f"median {self.median:.0f} ms, 95 % {most:.0f} ms, CPU {self.cpu_ms:.0f} ms, {self.received / 1e3:.0f} kB"
        )
        return f"{figures} ({len(self.wall_ms)} times)"

    @property
    def median(self) -> float:
        return float(np.median(self.wall_ms))


def timed(bench: Bench, person: Person, kind: str, acts: Iterable[Callable[[], None]]) -> Took:
    received, spent = person.received(), cpu_s(bench.process.pid)
    took = [redrawn(person, kind, act) for act in acts]
    cpu = 1e3 * (cpu_s(bench.process.pid) - spent) / len(took)
    return Took(took, cpu, (person.received() - received) / len(took))


def slider(log: Log, folder: Path) -> None:
    with opened(log, folder) as bench, Person() as person:
        person.go(bench.address)
        person.wait(COMPLETE)
        slid(bench, person, log, MOVES, SLIDE_MS[log.name])


def slid(bench: Bench, person: Person, log: Log, count: int, aim_ms: float | None = None) -> None:
    """The slider of an effect that is added by hand, dragged; then let go of."""
    person.open("Add")
    x, y, width, height = person.wait(PLACE % "input[aria-label^='Add an effect']")
    person.press(x + width / 2, y + height / 2)
    wanted = log.effect.replace("@", " at ").replace("_", " ")
    person.type(wanted)
    person.click(wanted, "[role=option]")
    person.click("Add", "main button")
    person.wait("[...document.querySelectorAll('.q-slider')].some((e) => e.offsetParent)", PATIENCE_S)
    person.wait(KNOWN, PATIENCE_S)
    time.sleep(2.0)
    x, y, width, height = person.evaluate(PLACE % ".q-slider")
    places = [x + width * (0.2 + 0.6 * k / count) for k in range(count + 3)]
    moves = [partial(person.mouse, "mouseMoved", at, y + height / 2) for at in places]
    person.mouse("mousePressed", places[0], y + height / 2)
    for move in moves[:3]:
        move()
        time.sleep(1.0)
    took = timed(bench, person, "mousemove", moves[3:])
    row(f"slider to curves: {log.size}", str(took), aim_ms, took.median)
    began, spent = time.time(), cpu_s(bench.process.pid)
    person.mouse("mouseReleased", places[-1], y + height / 2)
    person.wait(SETTLED, PATIENCE_S)
    figures = f"{1e3 * (time.time() - began):.0f} ms, CPU {1e3 * (cpu_s(bench.process.pid) - spent):.0f} ms"
    row("let go of: all trials compared anew, every row that is drawn", figures)


def long(folder: Path) -> None:
    """Many rows: what comes over the wire, and how soon another curve, and a stretch row by row, is there."""
    with Person() as person:
        bench = opened(LONG, folder)
        begun = time.time()
        with bench:
            took_ms = first_page(bench, person, begun)
            row(
                f"opened: {LONG.size}",
                f"{took_ms:.0f} ms, {person.received() / 1e6:.1f} MB with the toolkit's own files",
            )
            log = read_run(folder / "trial.mcap").trials[0].log
            person.evaluate("document.activeElement.blur()")
            took = timed(bench, person, "keydown", [partial(person.key, "ArrowRight", 39)] * 8)
            row("another trial, by key", str(took), FLUID_MS, took.median)
            zooms = [partial(_dragged, person, 0.5 - 0.2 / k, 0.5 + 0.2 / k) for k in (1, 2, 3, 4)]
            took = timed(bench, person, "mouseup", zooms)
            row("zoomed in, thinned anew", str(took), FLUID_MS, took.median)
            times, first, last = person.evaluate(SHOWN)
            rows = (log.times_s >= first) & (log.times_s <= last)
            shown = np.array([first <= t <= last for t in times])
            exact = shown.sum() == rows.sum() and np.allclose(np.array(times)[shown], log.times_s[rows], atol=1e-5)
            told = "every row" if exact else "NOT every row"
            row("", f"in sight then: {last - first:.2f} s, {shown.sum()} of {rows.sum()} rows, {told}")
            person.key("ArrowRight", 39)
            slid(bench, person, LONG, FEW)
            row("memory of the workbench, at most", f"{peak_mb(bench.process.pid):.0f} MB")


def _dragged(person: Person, begin: float, end: float) -> None:
    """The mouse from one place of the chart to another, as shares of its width."""
    x, y, width, height = person.evaluate(PLACE % ".js-plotly-plot .nsewdrag")
    person.mouse("mousePressed", x + begin * width, y + height / 2)
    for k in (1, 2, 3):
        person.mouse("mouseMoved", x + (begin + (end - begin) * k / 3) * width, y + height / 2)
    person.mouse("mouseReleased", x + end * width, y + height / 2)


def main() -> None:
    parts = sys.argv[1:] or ["start", "slider", "long"]
    with tempfile.TemporaryDirectory() as name:
        for part in parts:
            folder = Path(name) / part
            folder.mkdir()
            if part == "start":
                start(folder)
            elif part == "slider":
                for log in (PENDULUM, QUADRUPED):
                    (folder / log.name).mkdir()
                    slider(log, folder / log.name)
            elif part == "long":
                long(folder)
            else:
                sys.exit(f"no part {part!r}; there are: start, slider, long")


if __name__ == "__main__":
    main()
