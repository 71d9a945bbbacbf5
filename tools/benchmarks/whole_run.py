"""A whole run of the command line, watched from outside: wall and processor time, memory, time to the first progress."""

from __future__ import annotations

import json
import os
import pty
import re
import select
import subprocess
import sys
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psutil

FIRST_GENERATION = re.compile(rb"repair 1 of \d+.*?\b([1-9]\d*)/\d+", re.DOTALL)
"""The bar of the first pass with at least one generation done."""
LOOK_S = 0.5
"""How often the processes are looked at."""


@dataclass
class Watched:
    """What was seen of a command. ``cpu_s`` and ``memory_mb`` are of the whole tree of processes; memory that processes
    share counts once (proportional set size)."""

    wall_s: float
    cpu_s: float
    memory_mb: float
    first_progress_s: float | None
    first_progress_cpu_s: float | None
    status: int
    output: str
    summary: dict[str, Any] = field(default_factory=dict)


class _Tree:
    """Follows the processes that a command started, by themselves or through others."""

    def __init__(self, pid: int) -> None:
        self.root = psutil.Process(pid)
        self.cpu: dict[tuple[int, float], float] = {}
        self.memory_mb = 0.0
        self.over = threading.Event()
        self.thread = threading.Thread(target=self._watch, daemon=True)
        self.thread.start()

    def _watch(self) -> None:
        count = 0
        while not self.over.is_set():
            try:
                members = [self.root, *self.root.children(recursive=True)]
            except psutil.Error:
                break
            total = 0.0
            for process in members:
                try:
                    times = process.cpu_times()
                    self.cpu[process.pid, process.create_time()] = times.user + times.system
                    if count % 20 == 0:
                        total += process.memory_full_info().pss / 1e6
                except (psutil.Error, OSError):
                    continue
            self.memory_mb = max(self.memory_mb, total)
            count += 1
            self.over.wait(LOOK_S)

    @property
    def cpu_s(self) -> float:
        """Processor time of all so far, s."""
        return sum(self.cpu.copy().values())

    def close(self) -> float:
        """Stop following. Processor time of all, s."""
        self.over.set()
        self.thread.join(5.0)
        return self.cpu_s


def watch(arguments: Sequence[str], out: Path, cwd: Path) -> Watched:
    """Run ``python -m ee_dist`` with these arguments into ``out``, as if in a terminal of ``cwd``."""
    command = [sys.executable, "-m", "ee_dist", *arguments, f"hydra.run.dir={out}"]
    leader, follower = pty.openpty()
    environment = {**os.environ, "TERM": "xterm-256color", "COLUMNS": "160", "LINES": "50"}
    began = time.monotonic()
    process = subprocess.Popen(command, stdin=follower, stdout=follower, stderr=follower, cwd=cwd, env=environment)
    os.close(follower)
    tree = _Tree(process.pid)
    output = bytearray()
    first: float | None = None
    first_cpu: float | None = None
    while True:
        ready, _, _ = select.select([leader], [], [], 0.2)
        if ready:
            try:
                piece = os.read(leader, 65536)
            except OSError:
                piece = b""
            if not piece:
                break
            output += piece
            if first is None and FIRST_GENERATION.search(plain(bytes(output[-20000:]))):
                first, first_cpu = time.monotonic() - began, tree.cpu_s
        elif process.poll() is not None:
            break
    status = process.wait()
    wall = time.monotonic() - began
    cpu = tree.close()
    os.close(leader)
    path = out / "summary.json"
    summary = json.loads(path.read_text(encoding="utf-8")) if status == 0 and path.is_file() else {}
    text = plain(bytes(output)).decode(errors="replace")
    return Watched(wall, cpu, tree.memory_mb, first, first_cpu, status, text, summary)


def plain(text: bytes) -> bytes:
    """Without the terminal's control sequences."""
    return re.sub(rb"\x1b\[[0-9;?]*[A-Za-z]", b"", text)


@dataclass(frozen=True)
class RunSetting:
    """One run of scenario 8."""

    engine: str
    budget: str
    workers: int
    evaluator: str = "ray"

    @property
    def arguments(self) -> list[str]:
        return [
            "+scenario=8",
            f"engine={self.engine}",
            f"budget={self.budget}",
            f"evaluator={self.evaluator}",
            f"evaluator.workers={self.workers}",
        ]


def run_scenario(setting: RunSetting, out: Path, cwd: Path) -> dict[str, Any]:
    """The numbers of one run. Raises RuntimeError with the last line of a run that failed."""
    seen = watch(setting.arguments, out, cwd)
    if seen.status or not seen.summary:
        last = (seen.output.strip().splitlines() or ["no output"])[-1]
        raise RuntimeError(f"{' '.join(setting.arguments)}: {last}")
    return {
        **finished_run(out, setting.workers),
        "wall_s": seen.wall_s,
        "cpu_s": seen.cpu_s,
        "memory_mb": seen.memory_mb,
        "first_progress_s": seen.first_progress_s,
        "first_progress_cpu_s": seen.first_progress_cpu_s,
    }


def finished_run(folder: Path, workers: int = 1) -> dict[str, Any]:
    """The numbers of a run of the past, of ``evaluator=serial`` if its processor time is to be complete.

    Raises RuntimeError where ``folder`` has none.
    """
    path = folder / "summary.json"
    if not path.is_file():
        raise RuntimeError(f"{folder}: no finished run there (summary.json)")
    summary = json.loads(path.read_text(encoding="utf-8"))
    evaluations = summary["evaluations"]
    trace, whole_steps = workload(folder / "recovery.mcap", evaluations)
    return {
        "engine": summary["engine"],
        "scenario": summary["scenario"],
        "budget": summary["budget"],
        "workers": workers,
        "wall_s": summary["wall_s"],
        "cpu_s": summary["cpu_s"],
        "memory_mb": None,
        "first_progress_s": None,
        "first_progress_cpu_s": None,
        "asked": evaluations["asked"],
        "simulated": evaluations["simulated"],
        "whole_steps": whole_steps,
        "asked_steps": evaluations["asked_steps"],
        "steps": evaluations["steps"],
        "digest": summary["result_digest"],
        "generations": trace,
        "controllers": controllers(folder / "recovery.mcap"),
    }


def workload(recording: Path, evaluations: dict[str, int]) -> tuple[list[dict[str, Any]], int]:
    """The generations of a run (phase, rollouts asked and simulated, steps of each), and the robot-steps that the run
    would have had if every rollout asked for had run a whole trial."""
    from ee_dist.recording.reader import read_run
    from ee_dist.recording.records import HARDWARE, REPAIR

    run = read_run(recording)
    full = max(len(t.log) for t in run.trials if t.source == HARDWARE)
    repair_steps = sum(g.asked for g in run.generations if g.phase == REPAIR) * full
    looks = sum(g.asked * (g.pass_index + 1) for g in run.generations if g.phase != REPAIR)
    header = round((evaluations["asked_steps"] - repair_steps) / looks) if looks else full
    trace = []
    for g in run.generations:
        repairing = g.phase == REPAIR
        trials = 1 if repairing else g.pass_index + 1
        trace.append(
            {
                "phase": g.phase,
                "asked": g.asked * trials,
                "simulated": g.simulated,
                "steps": full if repairing else min(header, full),
            }
        )
    return trace, evaluations["asked"] * full


def controllers(recording: Path) -> list[list[float]]:
    """The controllers that the run tried on hardware."""
    from ee_dist.engines.drivers import Network
    from ee_dist.recording.reader import read_run
    from ee_dist.recording.records import HARDWARE

    trials = [t for t in read_run(recording).trials if t.source == HARDWARE and isinstance(t.driver, Network)]
    return [list(t.driver.weights) for t in trials if isinstance(t.driver, Network)]
