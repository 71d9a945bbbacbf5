"""CSV files of the example arm as a user's own logger might have kept them, from a simulated arm with a hidden fault.

    python tools/make_arm_csv.py --out logs/arm [--seed 0] [--fault coulomb_friction@elbow:torque_nm=0.35]

Two runs, unevenly sampled, in degrees and milliseconds, one torque with the opposite sign. The fault is written nowhere:
it is drawn from the seed unless it is given.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

import numpy as np
import pandas as pd

from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.effects.catalogue import Hypothesis, apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

ARM = Path(__file__).resolve().parents[1] / "docs" / "examples" / "arm.yaml"
FAULTS = ("coulomb_friction", "motor_weak", "backlash", "command_delay", "parallel_spring", "zero_offset")
SECONDS = 6.0


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--out", required=True, type=Path)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--fault", default=None, help="effect@joint[:parameter=value,...] instead of one drawn")
    args = parser.parse_args()
    robot, _ = load_robot(ARM)
    rng = np.random.default_rng(args.seed)
    fault = given(args.fault) if args.fault else drawn(robot, rng)
    args.out.mkdir(parents=True, exist_ok=True)
    for k, commands in enumerate((slow_sines(robot), steps(robot, rng))):
        write(args.out / f"run{k + 1}.csv", robot, fault, commands, rng)
    print(f"wrote {args.out}/run1.csv and run2.csv")
    return 0


def given(text: str) -> Hypothesis:
    place, _, values = text.partition(":")
    effect, _, target = place.partition("@")
    pairs = (v.split("=") for v in values.split(",") if v)
    return (term(effect, target, **{k: float(v) for k, v in pairs}),)


def drawn(robot: Robot, rng: np.random.Generator) -> Hypothesis:
    """One fault at one joint, at a fifth to a half of the range worth trying."""
    chosen = candidate(robot, str(rng.choice(FAULTS)), str(rng.choice(robot.motor_names)))
    u = rng.uniform(0.2, 0.5, chosen.size) * chosen.upper
    return (chosen.term(u),)


def slow_sines(robot: Robot) -> Array:
    """Each joint at its own pace, from rest."""
    t = np.arange(0, SECONDS, robot.time_step_s)
    rise = np.minimum(1.0, t / 0.5)
    return np.stack([rise * a * np.sin(w * t) for a, w in ((0.8, 2.1), (0.5, 1.6), (0.7, 2.7))], axis=1)


def steps(robot: Robot, rng: np.random.Generator) -> Array:
    """A new target for every joint each 0.75 s, reached along straight lines of 0.25 s, from rest."""
    t = np.arange(0, SECONDS, robot.time_step_s)
    times = np.arange(0, SECONDS + 0.75, 0.75)
    targets = rng.uniform(-0.6, 0.6, (len(times), len(robot.drives)))
    targets[0] = 0.0
    at = np.concatenate([times, times[1:] - 0.5])
    known = np.concatenate([targets, targets[1:]])
    order = np.argsort(at)
    return np.stack([np.interp(t, at[order], known[order, k]) for k in range(known.shape[1])], axis=1)


def write(path: Path, robot: Robot, fault: Hypothesis, commands: Array, rng: np.random.Generator) -> None:
    """Simulate, sample unevenly, and write in the logger's own units."""
    faulty = apply(replace(robot, time_step_s=robot.time_step_s), fault)
    log = MuJoCoEngine(threads=1).rollout(
        [Rollout(faulty, Commands(commands), len(commands), seed=int(rng.integers(2**31)))]
    )[0]
    keep = np.sort(rng.choice(len(log), int(0.93 * (len(log) - 1)), replace=False))
    keep = np.union1d([0], keep)
    q, tau = np.degrees(log.sensors[keep, :3]), log.sensors[keep, 3:] * (1.0, -1.0, 1.0)
    columns = {"time_ms": 1000 * log.times_s[keep]}
    columns |= {f"q{k + 1}_deg": q[:, k] for k in range(3)} | {f"tau{k + 1}": tau[:, k] for k in range(3)}
    columns |= {f"cmd{k + 1}_deg": np.degrees(log.commands[keep, k]) for k in range(3)}
    pd.DataFrame(columns).to_csv(path, index=False, float_format="%.7g")


if __name__ == "__main__":
    sys.exit(main())
