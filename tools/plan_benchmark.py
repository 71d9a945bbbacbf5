"""Does a planned trial tell apart what one trial leaves tied, more often than any other trial of the same length?

    python tools/plan_benchmark.py --cases 15 --seed 0 --json plan.json

Robots with a hidden effect of the catalogue are tried once, with a calm random motion; those whose explanation is tied with
others are cases. Each is tried once more: as ``task=plan`` would have it, and with random motions of the same
length and limits. Both trials are explained together; a tie is told apart where the best explanation has no tie any more,
and less so where fewer of the others are left. Each physical effect is hidden from all but the robot.
"""

from __future__ import annotations

import argparse
import os
import sys
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from benchmarks.cases import tried, write_cases

from ee_dist.discrepancy.contenders import contenders
from ee_dist.discrepancy.draw import draw
from ee_dist.discrepancy.explain import EFFECT, Explanation, explain
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.plan import predicted, ranked
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.contract import EngineError
from ee_dist.robots.describe import load_robot
from ee_dist.tasks.config import Config, EngineConfig, EvaluatorConfig
from ee_dist.tasks.plan import MOST_TIED
from ee_dist.tasks.wiring import close_evaluators, engine_maker, evaluator_of
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.family import PLANNED, Limits, family
from ee_dist.trials.noise import with_noise


@dataclass
class Case:
    """Names of what is tied, the best first: after one trial, after the planned one too, after a random one instead."""

    index: int
    truth: str
    first: str
    before: list[str]
    planned: str = ""
    expected: float = 0.0
    enough: bool = False
    after_planned: list[str] = field(default_factory=list)
    after_random: list[list[str]] = field(default_factory=list)
    seconds: float = 0.0

    def told(self, after: Sequence[str]) -> bool:
        return len(after) == 1

    def right(self, after: Sequence[str]) -> bool:
        """Whether it is told, and named."""
        return self.told(after) and after[0] == self.truth


class Bench:
    def __init__(self, args: argparse.Namespace) -> None:
        self.args = args
        self.robot = with_noise(load_robot(args.robot)[0], args.noise)
        self.config = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
        self.engine = engine_maker(self.config, alone=True)()
        self.limits = Limits(args.seconds, args.amplitude)

    def random_motion(self, rng: np.random.Generator) -> Excitation:
        """Any kind that moves, any amplitude within the limits."""
        kinds = [k for k in PLANNED if k != "rest"]
        fixture = str(rng.choice(["stand", "floor"])) if self.robot.free_base else "floor"
        amplitude = round(float(rng.uniform(0.05, 1.0)) * self.limits.amplitude, 4)
        return Excitation(str(rng.choice(kinds)), self.limits.seconds, amplitude, int(rng.integers(1000)), fixture)

    def trial(self, hidden: Hypothesis, excitation: Excitation, seed: Sequence[int]) -> MeasuredTrial:
        return tried(self.engine, self.robot, hidden, excitation, seed)

    def explained(self, trials: Sequence[MeasuredTrial]) -> tuple[OpenLoop, Explanation]:
        problem = OpenLoop(trials, self.robot, evaluator_of(self.config))
        return problem, explain(problem, pool_of(problem))

    def case(self, index: int) -> Case | None:
        """None where one trial leaves nothing tied."""
        rng, began = np.random.default_rng([self.args.seed, index]), time.monotonic()
        close_evaluators()
        chosen, drawn = draw(self.robot, rng)
        first = self.random_motion(rng)
        if first.amplitude > self.args.first * self.limits.amplitude:
            first = Excitation(
                first.kind, first.seconds, round(self.args.first * first.amplitude, 4), first.seed, first.fixture
            )
        measured = self.trial((drawn,), first, [self.args.seed, index, 0])
        problem, found = self.explained([measured])
        if found.verdict != EFFECT or len(found.tied) < 2:
            return None
        tied = [(*found.fixed, *j.hypothesis) for j in found.tied[:MOST_TIED]]
        case = Case(index, chosen.name, str(first), names(found))
        rivals = contenders(problem, tied)
        wanted = family(self.robot, self.limits, seed=index)
        evaluator = evaluator_of(self.config)
        plan = ranked(
            len(tied), predicted(self.robot, rivals.contenders, wanted, evaluator, rivals.left, len(problem.segments))
        )
        case.planned, case.expected, case.enough = str(plan.best.excitation), plan.best.separation, plan.enough
        others = [self.random_motion(rng) for _ in range(self.args.random)]
        for k, excitation in enumerate((plan.best.excitation, *others), start=1):
            again = self.trial((drawn,), excitation, [self.args.seed, index, k])
            after = names(self.explained([measured, again])[1])
            if k == 1:
                case.after_planned = after
            else:
                case.after_random.append(after)
        case.seconds = time.monotonic() - began
        return case


def names(found: Explanation) -> list[str]:
    return [j.name for j in found.tied]


def run(bench: Bench) -> Iterator[Case]:
    found, index = 0, bench.args.start
    while found < bench.args.cases and index - bench.args.start < bench.args.robots:
        try:
            case = bench.case(index)
        except EngineError as problem:
            print(f"{index:4d}  skipped: {problem}", flush=True)
            case = None
        index += 1
        if case is not None:
            found += 1
            yield case


def report(cases: Sequence[Case], args: argparse.Namespace) -> dict[str, object]:
    after = [(c, a) for c in cases for a in c.after_random]

    def share(values: Sequence[bool]) -> float:
        return float(np.mean(values)) if values else float("nan")

    promised = [c for c in cases if c.enough]
    found: dict[str, object] = {
        "cases": len(cases),
        "tied_before": float(np.mean([len(c.before) for c in cases])),
        "told_planned": share([c.told(c.after_planned) for c in cases]),
        "told_random": share([c.told(a) for c, a in after]),
        "right_planned": share([c.right(c.after_planned) for c in cases]),
        "right_random": share([c.right(a) for c, a in after]),
        "tied_planned": float(np.mean([len(c.after_planned) for c in cases])),
        "tied_random": float(np.mean([len(a) for _, a in after])) if after else float("nan"),
        "promised": len(promised),
        "promise_kept": share([c.told(c.after_planned) for c in promised]),
    }
    print(f"\n{args.robot}: {len(cases)} cases that one trial of {args.seconds:g} s left tied")
    for key, value in found.items():
        print(f"  {key.replace('_', ' '):<16}{value:.3g}")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--cases", type=int, default=15, help="cases that are tied")
    parser.add_argument("--robot", default="servo_pendulum", help="by name or file")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--start", type=int, default=0, help="number of the first robot: a long run may go in pieces")
    parser.add_argument("--robots", type=int, default=1000, help="how many are tried at most")
    parser.add_argument("--noise", type=float, default=0.003, help="share of each channel's range")
    parser.add_argument("--seconds", type=float, default=3.0, help="length of every trial")
    parser.add_argument("--amplitude", type=float, default=0.4, help="share of half the range, at most, of every trial")
    parser.add_argument(
        "--first", type=float, default=0.2, help="share of its amplitude at which the first trial is made"
    )
    parser.add_argument("--random", type=int, default=1, help="random trials each planned one is compared with")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    bench, cases = Bench(args), []
    for case in run(bench):
        cases.append(case)
        told = ["told" if case.told(a) else f"{len(a)} left" for a in (case.after_planned, *case.after_random)]
        print(
            f"{case.index:4d} {len(cases):3d}/{args.cases}  {case.truth:<30.30} {len(case.before)} tied -> planned {told[0]:<7}"
            f" random {', '.join(told[1:]):<7}  {case.planned} ({case.expected:.1f}) {case.seconds:.0f} s",
            flush=True,
        )
    found = report(cases, args) if cases else {"cases": 0}
    write_cases(args, found, cases)
    return 0


if __name__ == "__main__":
    sys.exit(main())
