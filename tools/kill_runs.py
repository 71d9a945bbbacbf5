"""Kill a run at random moments, resume it, and compare it with one that nobody disturbed.

    python tools/kill_runs.py --times 30 --seed 0 --table kills.md

Each time something else is hit, by SIGKILL or SIGTERM: the run itself, a worker, the raylet, the GCS, or all of them as
when a machine fails. The hardware is a robot behind a socket (docs/examples/socket_robot.py), which counts its trials. What
must hold each time: the same digest and the same bytes of the recording, no finished trial asked for again, one line where
the run could still say one, the status that belongs to it, and no process and no temporary folder left. A moment is a share
of the processor's time that an undisturbed run takes, so that a busy machine does not shift it.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

MARK = "EE_DIST_KILLED"
SETTINGS = (
    "+scenario=8", "budget=quick", "budget.population=40", "budget.generations=5", "budget.diagnosis_population=40",
    "budget.diagnosis_generations=4", "budget.steps=200", "budget.compensating_trials=2", "budget.polish=1",
)  # fmt: skip
VICTIMS = ("run", "worker", "raylet", "gcs_server", "node")
SIGNALS = (signal.SIGKILL, signal.SIGTERM)
ROBOT = Path(__file__).parents[1] / "docs" / "examples" / "socket_robot.py"
ENDS = {"run": (-9, 143), "node": (-9, 143), "worker": (0,), "raylet": (0, 2), "gcs_server": (0, 2)}
"""Status of the run, by what was hit: killed, or asked to end; a worker is replaced; Ray is lost, or not needed any more."""
LEAVE_S = 10.0
"""How long after a run's end its processes and folders may still be going."""
LOOK_S = 0.2


class CountingRobot:
    """The robot behind its socket; ``done`` counts the trials that it finished, by number."""

    def __init__(self, engine: str) -> None:
        command = [sys.executable, str(ROBOT), "--port", "0", "--scenario", "8", "--engine", engine]
        self.process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True)
        assert self.process.stdout is not None
        self.address = self.process.stdout.readline().split()[-1]
        self.done: Counter[int] = Counter()
        threading.Thread(target=self._listen, daemon=True).start()

    def _listen(self) -> None:
        assert self.process.stdout is not None
        for said in self.process.stdout:
            words = said.split()
            if words[:1] == ["trial"] and words[2:] == ["done"]:
                self.done[int(words[1])] += 1


@dataclass
class Bench:
    """A folder of runs, all with these settings, and their temporary folder."""

    folder: Path
    settings: tuple[str, ...]
    temporary: Path = field(init=False)

    def __post_init__(self) -> None:
        self.temporary = self.folder / "t"
        self.temporary.mkdir()

    def start(self, where: str, errors: Path) -> subprocess.Popen[bytes]:
        surroundings = {**os.environ, MARK: str(self.folder), "TMPDIR": str(self.temporary)}
        with errors.open("wb") as file:
            return subprocess.Popen(
                [sys.executable, "-m", "ee_dist", *SETTINGS, *self.settings, where],
                cwd=self.folder, stdout=subprocess.DEVNULL, stderr=file, env=surroundings,
            )  # fmt: skip

    def processes(self, by_files: bool = False) -> dict[int, str]:
        """Those that a run started, and itself, by name. Some of Ray's write over their environment: ``by_files`` finds those
        too that have a file of ours open, which takes longer."""
        found = {}
        for process in Path("/proc").iterdir():
            with contextlib.suppress(OSError):
                if (
                    process.name.isdigit()
                    and int(process.name) != os.getpid()
                    and (
                        f"{MARK}={self.folder}".encode() in (process / "environ").read_bytes()
                        or (by_files and any(str(self.folder) in os.readlink(f) for f in (process / "fd").iterdir()))
                    )
                ):
                    found[int(process.name)] = (process / "comm").read_text().strip()
        return found

    def spent_s(self) -> float:
        """What they took of the processor so far, those that they waited for included."""
        ticks = 0
        for pid in self.processes():
            with contextlib.suppress(OSError):
                ticks += sum(map(int, Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[11:15]))
        return ticks / os.sysconf("SC_CLK_TCK")

    def hit(self, victim: str, number: int, run: subprocess.Popen[bytes]) -> bool:
        """Whether there was such a process."""
        there = self.processes()
        chosen = {
            "run": [run.pid],
            "worker": [p for p, name in there.items() if name.startswith("ray::_Worker")][:1],
            "raylet": [p for p, name in there.items() if name == "raylet"],
            "gcs_server": [p for p, name in there.items() if name == "gcs_server"],
            "node": list(there),
        }[victim]
        for pid in chosen:
            with contextlib.suppress(OSError):
                os.kill(pid, number)
        return bool(chosen)

    def left(self) -> list[str]:
        """Processes and folders that are still there a while after the end of all runs."""
        end = time.monotonic() + LEAVE_S
        while True:
            found = [*self.processes(by_files=True).values(), *(p.name for p in self.temporary.iterdir())]
            if not found or time.monotonic() > end:
                return found
            time.sleep(0.2)


def digest(folder: Path) -> str:
    return str(json.loads((folder / "summary.json").read_text())["result_digest"])


def disturbed(
    bench: Bench, robot: CountingRobot, k: int, rng: random.Random, length: float
) -> dict[str, object] | None:
    """One run that is hit at a random moment, and its resumption. None where there was nothing to hit at that moment."""
    out, errors, whole = bench.folder / f"run_{k}", bench.folder / f"run_{k}.err", bench.folder / "whole"
    victim, number, moment = rng.choice(VICTIMS), rng.choice(SIGNALS), rng.uniform(0.1, 0.95) * length
    robot.done.clear()
    run = bench.start(f"hydra.run.dir={out.name}", errors)
    while run.poll() is None and bench.spent_s() < moment:
        time.sleep(LOOK_S)
    hit = run.poll() is None and bench.hit(victim, number, run)
    kept = len(robot.done)
    status = run.wait()
    said = errors.read_text(errors="replace").strip()
    lines = len(said.splitlines())
    silent = number == signal.SIGKILL and victim in ("run", "node")
    again = 0
    if status:
        begun = (out / "config").is_dir()
        again = bench.start(f"resume={out.name}" if begun else f"hydra.run.dir={out.name}", errors).wait()
    found = {
        "victim": victim,
        "signal": signal.Signals(number).name,
        "moment": f"{moment / length:.0%}",
        "status": status,
        "trials before": kept,
        "same digest": again == 0 and digest(out) == digest(whole),
        "same bytes": again == 0 and (out / "recovery.mcap").read_bytes() == (whole / "recovery.mcap").read_bytes(),
        "trials repeated": sum(robot.done.values()) - len(robot.done),
        "right status": status in ENDS[victim] and (status != -9 or number == signal.SIGKILL),
        "one line": lines == (0 if silent or not status else 1),
        "left over": ", ".join(bench.left()) or "nothing",
    }
    if hit and not right(found):
        print(said, errors.read_text(errors="replace"), sep="\n", file=sys.stderr)
    shutil.rmtree(out, ignore_errors=True)
    return found if hit else None


def right(row: dict[str, object]) -> bool:
    whole = row["same digest"] and row["same bytes"] and row["one line"] and row["right status"]
    return bool(whole) and row["trials repeated"] == 0 and row["left over"] == "nothing"


def table(rows: list[dict[str, object]]) -> str:
    """Markdown."""
    words = [
        [{True: "yes", False: "NO"}.get(v, str(v)) if isinstance(v, bool) else str(v) for v in r.values()] for r in rows
    ]
    head = ["", *rows[0]]
    body = [head, ["---"] * len(head), *([str(k + 1), *w] for k, w in enumerate(words))]
    return "".join(f"| {' | '.join(cells)} |\n" for cells in body)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--times", type=int, default=30)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--engine", choices=("mujoco", "pybullet"), default="mujoco")
    parser.add_argument("--evaluator", choices=("ray", "serial"), default="ray")
    parser.add_argument("--table", type=Path, help="also write the table there, as Markdown")
    given = parser.parse_args()
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))  # so that nothing stays behind
    rng = random.Random(given.seed)
    robot = CountingRobot(given.engine)
    # Short, so that Ray's own folder can lie in it: the system bounds the names of sockets.
    with tempfile.TemporaryDirectory(prefix="k", dir="/tmp") as name:
        settings = (f"engine={given.engine}", f"evaluator={given.evaluator}", f"hardware.address={robot.address}")
        bench = Bench(Path(name), settings)
        try:
            whole, length = bench.start("hydra.run.dir=whole", bench.folder / "whole.err"), 0.0
            while whole.poll() is None:
                length = max(length, bench.spent_s())
                time.sleep(LOOK_S)
            if whole.returncode:
                sys.exit(f"the undisturbed run failed: {(bench.folder / 'whole.err').read_text()}")
            print(f"undisturbed: {length:.1f} s of the processor, {sum(robot.done.values())} trials", flush=True)
            rows: list[dict[str, object]] = []
            k = 0
            while len(rows) < given.times:
                k += 1
                row = disturbed(bench, robot, k, rng, length)
                if row is not None:
                    rows.append(row)
                    print(len(rows), *(f"{key} {value}," for key, value in row.items()), flush=True)
        finally:
            robot.process.kill()
            for pid in bench.processes():
                with contextlib.suppress(OSError):
                    os.kill(pid, signal.SIGKILL)
    wrong = [r for r in rows if not right(r)]
    if given.table:
        given.table.write_text(table(rows), encoding="utf-8")
    print(f"{len(rows) - len(wrong)} of {len(rows)} the same, no trial repeated, nothing left over")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
