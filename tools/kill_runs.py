"""Kill a run at random moments, resume it, and compare it with one that nobody disturbed.

    python tools/kill_runs.py --times 30 --engine mujoco             # about ten minutes

Each time something else is killed: the run itself, a worker, the raylet, the GCS, or all of them, as when a machine fails.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

MARK = "EE_DIST_KILLED"
SETTINGS = (
    "+scenario=8", "budget=quick", "budget.population=60", "budget.generations=6", "budget.diagnosis_population=40",
    "budget.diagnosis_generations=5", "budget.steps=300", "budget.compensating_trials=2",
)  # fmt: skip
VICTIMS = ("run", "worker", "raylet", "gcs_server", "node")


def start(folder: Path, *arguments: str) -> subprocess.Popen[bytes]:
    return subprocess.Popen(
        [sys.executable, "-m", "ee_dist", *SETTINGS, *arguments],
        cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, env={**os.environ, MARK: str(folder)},
    )  # fmt: skip


def processes(folder: Path) -> dict[int, str]:
    """Those that a run started, and itself, by name."""
    found = {}
    for process in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if process.name.isdigit() and f"{MARK}={folder}".encode() in (process / "environ").read_bytes():
                found[int(process.name)] = (process / "comm").read_text().strip()
    return found


def kill(victim: str, run: subprocess.Popen[bytes], folder: Path) -> bool:
    """Whether there was such a process to kill."""
    there = processes(folder)
    chosen = {
        "run": [run.pid],
        "worker": [p for p, name in there.items() if name.startswith("ray::_Worker")][:1],
        "raylet": [p for p, name in there.items() if name == "raylet"],
        "gcs_server": [p for p, name in there.items() if name == "gcs_server"],
        "node": list(there),
    }[victim]
    for pid in chosen:
        with contextlib.suppress(OSError):
            os.kill(pid, signal.SIGKILL)
    return bool(chosen)


def summary(folder: Path) -> dict[str, object]:
    found: dict[str, object] = json.loads((folder / "summary.json").read_text())
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--times", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--engine", choices=("mujoco", "pybullet"), default="mujoco")
    parser.add_argument("--evaluator", choices=("ray", "serial"), default="ray")
    given = parser.parse_args()
    rng, settings = random.Random(given.seed), (f"engine={given.engine}", f"evaluator={given.evaluator}")
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        began = time.monotonic()
        if start(folder, *settings, "hydra.run.dir=whole").wait():
            sys.exit("the undisturbed run failed")
        length = time.monotonic() - began
        wrong = over = 0
        for k in range(given.times):
            out, where, victim = folder / f"run_{k}", f"hydra.run.dir=run_{k}", rng.choice(VICTIMS)
            run = start(folder, *settings, where)
            with contextlib.suppress(subprocess.TimeoutExpired):
                run.wait(rng.uniform(0.1, 0.95) * length)
            hit = run.poll() is None and kill(victim, run, folder)
            status = run.wait()
            if status and (out / "config").is_dir():
                where = f"resume=run_{k}"
            again = start(folder, *settings, where).wait() if status else 0
            same = again == 0 and summary(out)["result_digest"] == summary(folder / "whole")["result_digest"]
            same = same and (out / "recovery.mcap").read_bytes() == (folder / "whole" / "recovery.mcap").read_bytes()
            time.sleep(1.0)
            left = processes(folder)
            wrong, over = wrong + (not same), over + bool(left)
            what = "the same" if same else "DIFFERENT"
            remains = ", ".join(left.values()) or "nothing"
            print(f"{k + 1:3} {victim if hit else 'nothing':10} status {status:4}, {what}, left: {remains}", flush=True)
        print(f"{given.times - wrong} of {given.times} the same, {over} left processes behind")
        return 1 if wrong or over else 0


if __name__ == "__main__":
    sys.exit(main())
