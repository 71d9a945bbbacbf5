"""``task=explain`` over the whole catalogue on three trials, through the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from benchmarks.whole_run import watch

HIDDEN = "motor_weak@knee_front_left"
TRIALS = (
    "multisine:seconds=4.8,amplitude=0.5,seed=1",
    "steps:seconds=4.2,amplitude=0.35,seed=2",
    "slow_sines:seconds=4.8,amplitude=0.6,seed=3",
)
QUICK_TRIALS = ("multisine:seconds=1.2,amplitude=0.5,seed=1",)


def explain_catalogue(engine: str, quick: bool, out: Path, cwd: Path) -> dict[str, Any]:
    """Seconds that the explanation took and what it said. Raises RuntimeError where the command line cannot do it."""
    excitations = ",".join(f"'{e}'" for e in (QUICK_TRIALS if quick else TRIALS))
    tried = watch(
        ["task=trial", f"engine={engine}", f"+hidden={HIDDEN}", f"task.excitations=[{excitations}]"],
        out / "trials",
        cwd,
    )
    logs = sorted((out / "trials").glob("*.mcap"))
    if tried.status or not logs:
        raise RuntimeError(f"task=trial: {_last(tried.output)}")
    seen = watch(["task=explain", f"engine={engine}", f"measured={out / 'trials'}"], out / "explained", cwd)
    if seen.status or not seen.summary:
        raise RuntimeError(f"task=explain: {_last(seen.output)}")
    candidates = seen.summary.get("candidates") or [{}]
    return {
        "engine": engine,
        "trials": 1 if quick else len(TRIALS),
        "wall_s": seen.wall_s,
        "cpu_s": seen.cpu_s,
        "memory_mb": seen.memory_mb,
        "verdict": seen.summary.get("verdict"),
        "first": f"{candidates[0].get('effect')}@{candidates[0].get('target')}",
    }


def _last(output: str) -> str:
    return (output.strip().splitlines() or ["no output"])[-1].strip()
