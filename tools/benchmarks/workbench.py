"""How long a move of a slider takes on the workbench, from the session to new curves, and how long a session takes to begin.

    python tools/benchmarks/workbench.py

CPU milliseconds, medians; the browser's drawing comes on top (about 20 ms for 1600 points).
"""

from __future__ import annotations

import contextlib
import io
import statistics
import tempfile
import time
from pathlib import Path

from ee_dist.discrepancy.problem import Series
from ee_dist.tasks import trial
from ee_dist.tasks.config import Config, EngineConfig, RobotConfig
from ee_dist.viewing.curves import Overlay
from ee_dist.workbench import charts
from ee_dist.workbench.session import Session
from ee_dist.workbench.thin import stretch

CASES = {
    "servo_pendulum": ("coulomb_friction@servo", "multisine:seconds=4,amplitude=0.5,seed=1"),
    "quadruped_lab": ("coulomb_friction@knee_front_left", "sway:seconds=4.2,amplitude=0.1,seed=1"),
}
MOVES = 20


def drawn(series: Series | None) -> None:
    if series is not None:
        curve = Overlay("channel", "trial", series.unit, series.times_s, series.measured, series.predicted)
        charts.overlay(stretch(curve).curve, "key")


def measure(robot: str) -> tuple[float, float, float]:
    """CPU milliseconds of a move, of a release, and of the beginning of a session."""
    effect, plan = CASES[robot]
    with tempfile.TemporaryDirectory() as folder:
        config = Config(robot=RobotConfig(name=robot), engine=EngineConfig("mujoco"), hidden=effect)
        (Path(folder) / "trial").mkdir()
        with contextlib.redirect_stdout(io.StringIO()):
            trial.run(config, trial.Options(excitations=[plan], repeats=1), Path(folder) / "trial")
        session = Session(config, "auto", Path(folder) / "bench")
        session.worker.warm = lambda: None  # type: ignore[method-assign]
        start = time.process_time()
        session.load(str(Path(folder) / "trial"), None)
        session.begin()
        begun = time.process_time() - start
        session.add(effect)
        place, entry = session.place(), session.bench.entries[0]
        name, top = entry.term.values[0][0], entry.candidate.bounds[0][1]
        moves, releases = [], []
        for k in range(MOVES):
            start = time.process_time()
            drawn(session.slide(0, {name: top * (0.2 + 0.02 * k)}, place).series)
            moves.append(time.process_time() - start)
        for k in range(3):
            session.slide(0, {name: top * (0.7 + 0.02 * k)}, place)
            start = time.process_time()
            session.release()
            releases.append(time.process_time() - start)
        session.close()
    return 1e3 * statistics.median(moves), 1e3 * statistics.median(releases), 1e3 * begun


def main() -> None:
    print(f"{'one trial of':<18}{'move':>8}{'release':>10}{'begin':>8}  (CPU ms)")
    for robot in CASES:
        move, release, begin = measure(robot)
        print(f"{robot:<18}{move:8.0f}{release:10.0f}{begin:8.0f}")


if __name__ == "__main__":
    main()
