"""Does a calibration tell that the robot it was made on was not in order, and only then?

    python tools/calibration_benchmark.py --robot quadruped_lab --size middle --honest 20 --faulty 10 --seed 0 --json odd.json

Every part's mass, every joint's friction, offset, gain and delay are off by draws of the ``--size`` (as in messy_benchmark.py).
A faulty robot has besides an effect of the catalogue at one joint that has others like it, or at a sensor of it, whose
mark is ``--times`` as large as that of all that is wrong at that joint together, at least. Each is calibrated on as task=improve
task.calibrate=true does it; counted are warnings, and those that name the joint of the fault. ``--cross-engine`` measures in
the other engine.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from benchmarks.arm6 import desk_arm_6
from benchmarks.cases import tried, write_cases
from messy_benchmark import ARM, SIZES, mess, motions

from ee_dist.discrepancy.calibrated_away import ALIKE, FAMILIES, calibrated_away
from ee_dist.discrepancy.draw import draw
from ee_dist.discrepancy.improve import MOST, improve
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.search.candidates import parse, shared
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import Hypothesis, Term
from ee_dist.effects.groups import like_joints
from ee_dist.engines.contract import EngineError
from ee_dist.robots.describe import load_robot
from ee_dist.tasks.config import Config, EngineConfig, EvaluatorConfig
from ee_dist.tasks.wiring import close_evaluators, engine_maker, evaluator_of
from ee_dist.trials.noise import with_noise

ATTEMPTS = 200
"""Draws of a fault until one stands out."""


@dataclass
class Case:
    """``fault``: what is hidden at ``joint``, empty in an honest robot; ``warned``: what was told, by joint."""

    index: int
    fault: str = ""
    joint: str = ""
    warned: dict[str, str] = field(default_factory=dict)
    model: list[str] = field(default_factory=list)
    seconds: float = 0.0
    check_seconds: float = 0.0


class Bench:
    def __init__(self, args: argparse.Namespace) -> None:
        self.args = args
        self.robot = desk_arm_6() if args.robot == ARM else with_noise(load_robot(args.robot)[0], args.noise)
        self.config = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
        other = "pybullet" if args.cross_engine else "mujoco"
        self.engine = engine_maker(Config(engine=EngineConfig(other, 1)), alone=True)()
        self.plan = motions(self.robot, args.seconds).fitted
        self.wanted = None if args.effect == "auto" else [parse(self.robot, e) for e in args.effect.split(";")]
        self.joints = {j for names in like_joints(self.robot, ALIKE) for j in names}

    def trials(self, hidden: Hypothesis, seed: Sequence[int]) -> tuple[MeasuredTrial, ...]:
        return tuple(tried(self.engine, self.robot, hidden, e, [*seed, k], k) for k, e in enumerate(self.plan))

    def case(self, index: int, faulty: bool) -> Case:
        rng, began = np.random.default_rng([self.args.seed, index]), time.monotonic()
        close_evaluators()
        wrong = mess(self.robot, SIZES[self.args.size], rng, False)
        truth = tuple(t for terms in wrong.values() for t in terms)
        found = Case(index)
        if faulty:
            fault = self.standing_out(wrong, truth, rng)
            truth, found.fault, found.joint = (*truth, fault), str(fault), self.joint_of(fault)
        problem = OpenLoop(self.trials(truth, [self.args.seed, index, 0]), self.robot, evaluator_of(self.config))
        pool = pool_of(problem)
        model = improve(problem, shared(pool, self.robot), wanted=self.wanted, most=self.args.most)
        found.model, middle = [str(t) for t in model.terms], time.monotonic()
        odd = calibrated_away(problem, model.terms, pool)
        found.warned = {
            o.joint: f"{o.term} ({o.times:.1f} times, {o.deviations:.1f} deviations, share {o.share:.2f})" for o in odd
        }
        found.seconds, found.check_seconds = time.monotonic() - began, time.monotonic() - middle
        return found

    def joint_of(self, t: Term) -> str:
        return next((s.target for s in self.robot.sensors if s.name == t.target), t.target)

    def standing_out(self, wrong: dict[str, list[Term]], everywhere: Hypothesis, rng: np.random.Generator) -> Term:
        """Raises RuntimeError where no draw stands out."""
        problem = OpenLoop(self.trials(everywhere, [self.args.seed, 0, 2]), self.robot, evaluator_of(self.config))
        for _ in range(ATTEMPTS):
            chosen, drawn = draw(self.robot, rng)
            joint = self.joint_of(drawn)
            if chosen.effect.family not in FAMILIES or joint not in self.joints:
                continue
            rest = tuple(t for t in everywhere if t not in wrong[joint])
            try:
                base, mine, without = problem.residuals([everywhere, (*everywhere, drawn), rest])
            except EngineError:
                continue
            mark, beside = float(((base - mine) ** 2).sum()), float(((base - without) ** 2).sum())
            if np.isfinite(mark) and mark > self.args.times**2 * beside:
                return drawn
        raise RuntimeError("no fault that was drawn stands out")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--robot", default="quadruped_lab")
    parser.add_argument("--size", choices=SIZES, default="middle")
    parser.add_argument("--honest", type=int, default=20)
    parser.add_argument("--faulty", type=int, default=10)
    parser.add_argument(
        "--times", type=float, default=1.0, help="how large a fault's mark is beside its joint's others"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--seconds", type=float, default=4.0, help="length of each of the three motions")
    parser.add_argument("--effect", default="auto", help="what is calibrated, as effect= of improve takes it")
    parser.add_argument("--most", type=int, default=MOST, help="shared effects that are calibrated, as task.most")
    parser.add_argument("--noise", type=float, default=0.005, help="of the sensors, share of their range")
    parser.add_argument("--cross-engine", action="store_true", help="the robot is simulated in PyBullet")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    bench, cases = Bench(args), []
    for index in range(args.honest + args.faulty):
        case = bench.case(index, index >= args.honest)
        cases.append(case)
        told = "; ".join(case.warned.values()) or "no warning"
        print(f"{index:3d}  {case.fault or 'honest'}: {told}  [{case.seconds:.0f} s]", flush=True)
    honest, faulty = [c for c in cases if not c.fault], [c for c in cases if c.fault]
    found = {
        "false_warnings": sum(bool(c.warned) for c in honest),
        "honest": len(honest),
        "found": sum(c.joint in c.warned for c in faulty),
        "found_first": sum(next(iter(c.warned), "") == c.joint for c in faulty),
        "faulty": len(faulty),
    }
    print(", ".join(f"{k}: {v}" for k, v in found.items()))
    write_cases(args, found, cases)


if __name__ == "__main__":
    main()
