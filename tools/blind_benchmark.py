"""Does explain find what is wrong? Hidden effects are drawn over the whole catalogue, tried, explained blind, and scored.

    python tools/blind_benchmark.py --cases 100 --seed 0 --engine mujoco --json blind.json

Every tenth robot is untouched (``--untouched``). An effect whose whole mark on the logs is below the noise is said to be
too small and is left out of the scores. ``--withhold`` takes the drawn effect out of the catalogue: right is then
``unexplained``, or an effect with the rest flagged. ``--two`` hides two effects and runs ``improve effect=auto``: both are
found where the model that it ends with has them, and within ties where it has what it says cannot be told from them.
``--robot`` and ``--by`` take another robot and another way of comparing. ``--by every`` judges each case by every way, of the
same trials: effects are then drawn among those that all of them can tell.
``--cross-engine`` tries the robot in the other engine, after calibrating the model on an untouched robot there.
``--workers`` runs cases side by side; a case is the same whoever runs it. ``--only`` repeats some of them, by number.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections import defaultdict
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from multiprocessing import get_context
from pathlib import Path
from typing import Any

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from benchmarks.cases import seldom, tried

from ee_dist.discrepancy.draw import draw
from ee_dist.discrepancy.explain import EFFECT, UNEXPLAINED, explain
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, candidates
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.ways.open_loop.unmodelled import from_entries
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.contract import Engine, EngineError
from ee_dist.measurements.errors import MeasurementError
from ee_dist.robots.describe import load_robot
from ee_dist.robots.instruments import with_motor_torques
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import AUTO, Config, EngineConfig, EvaluatorConfig
from ee_dist.tasks.improve import calibrated
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.ways import WAYS, way_of
from ee_dist.tasks.wiring import close_evaluators, engine_maker
from ee_dist.trials.excitation import STANDARD, Excitation
from ee_dist.trials.noise import with_noise

FIXED_BASE = (
    Excitation("multisine", 4.2, 0.2, 1),
    Excitation("steps", 3.6, 0.15, 2),
    Excitation("slow_sines", 4.2, 0.2, 3),
    Excitation("fast_sines", 1.8, 0.05, 4),
)
"""Trials of a robot that is bolted to the world, well inside its range."""
EVERY = "every"
DETECTABLE = 30.0
"""Energy (sum of squares in standard deviations) of an effect's mark below which no search over 400 candidates can tell
it from luck: about 2 ln(435) + 3 standard deviations."""


@dataclass
class Case:
    """``mark``: energy that the hidden effect adds to the residual; ``beside``: energy between the residual of what was
    named and that of the truth. ``ratio``: held-out error over the noise floor."""

    index: int
    family: str
    truth: list[str]
    shown: str
    mark: float
    too_small: bool
    verdict: str = ""
    named: list[str] = field(default_factory=list)
    first: bool = False
    within: bool = False
    both: bool = False
    flagged: bool = False
    ratio: float = float("nan")
    beside: float = float("nan")
    value_error: float = float("nan")
    seconds: float = 0.0
    by: str = ""


def measured(
    engine: Engine, robot: Robot, hidden: Hypothesis, seed: Sequence[int], every: int = 1
) -> tuple[MeasuredTrial, ...]:
    """The standard trials of a robot with a hidden change: what the recording of each would hold. ``every``: rows from one
    reading of the sensors to the next, of a robot that is bolted down."""
    if robot.free_base:
        return tuple(tried(engine, robot, hidden, e, [*seed, k], k) for k, e in enumerate(STANDARD))
    return tuple(seldom(tried(engine, robot, hidden, e, [*seed, k], k), every) for k, e in enumerate(FIXED_BASE))


class Bench:
    """One run of the benchmark: the robot in one engine, its model in the same or the other, and the verbs' own code."""

    def __init__(self, args: argparse.Namespace) -> None:
        self.args = args
        robot, _ = load_robot(args.robot)
        self.ways = tuple(WAYS) if args.by == EVERY else (args.by,)
        if "force_balance" in self.ways:
            robot = with_motor_torques(robot)
        self.robot = with_noise(robot, args.noise)
        self.config = Config(engine=EngineConfig(args.engine, 1), evaluator=EvaluatorConfig("serial"))
        other = {"mujoco": "pybullet", "pybullet": "mujoco"}[args.engine] if args.cross_engine else args.engine
        self.engine = engine_maker(Config(engine=EngineConfig(other, 1)), alone=True)()
        # What the model has and is known to leave; no trials yet.
        self.known = Measurements(self.robot, (), (), (), self.robot.name, Path())

    @property
    def before(self) -> Hypothesis:
        return self.known.model

    @cached_property
    def told(self) -> frozenset[str]:
        """Names of the candidates that all ways can tell."""
        trials = measured(self.engine, self.robot, (), [self.args.seed, 999_998], self.args.read_every)
        pools = (pool_of(self.problem(trials, by)) for by in self.ways)
        return frozenset.intersection(*(frozenset(c.name for c in pool) for pool in pools))

    def problem(self, trials: Sequence[MeasuredTrial], by: str) -> Problem:
        known = replace(self.known, trials=tuple(trials))
        # What was simulated for another case is of no use for this one.
        close_evaluators()
        return way_of(known, by).make(known, self.config).searched

    def calibrate(self) -> None:
        """As ``task=improve task.calibrate=true`` does it, on an untouched robot of the other engine."""
        trials = measured(self.engine, self.robot, (), [self.args.seed, 999_999], self.args.read_every)
        plain = replace(self.known, trials=trials)
        found, content = calibrated(plain, self.config, candidates(self.robot))
        self.known = replace(
            self.known,
            model=found.terms,
            unmodelled=from_entries(content["unmodelled"], self.robot.sensor_names),
            gained=content["gained"],
            calibrated_by=content["way"],
        )
        print(f"calibrated on an untouched robot: {'; '.join(map(str, self.before)) or 'nothing to add'}; an effect "
              f"takes {self.known.gained:.0f} off it", flush=True)  # fmt: skip

    def cases(self, index: int) -> list[Case]:
        """One hidden change, tried once and judged by every way asked for."""
        rng = np.random.default_rng([self.args.seed, index])
        drawn: list[Candidate] = []
        hidden: Hypothesis = ()
        if (index + 1) % self.args.untouched or self.args.two or self.args.withhold:
            for _ in range(2 if self.args.two else 1):
                chosen, hidden_term = draw(self.robot, rng)
                while len(self.ways) > 1 and chosen.name not in self.told:
                    chosen, hidden_term = draw(self.robot, rng)
                drawn.append(chosen)
                hidden = (*hidden, hidden_term)
        trials = measured(self.engine, self.robot, hidden, [self.args.seed, index], self.args.read_every)
        return [self._case(index, drawn, hidden, trials, by) for by in self.ways]

    def _case(
        self, index: int, drawn: list[Candidate], hidden: Hypothesis, trials: Sequence[MeasuredTrial], by: str
    ) -> Case:
        began = time.monotonic()
        problem = self.problem(trials, by)
        base, true = problem.residuals([self.before, (*self.before, *hidden)])
        mark = float(((base - true) ** 2).sum()) if np.isfinite(true).all() else float("inf")
        names = [c.name for c in drawn]
        found = Case(
            index,
            drawn[0].effect.family if drawn else "untouched",
            names,
            "; ".join(map(str, hidden)),
            mark,
            bool(drawn) and mark < DETECTABLE,
            by=problem.way,
        )
        if self.args.two:
            self._two(found, problem, names)
        else:
            self._one(found, problem, drawn, hidden, true)
        found.seconds = time.monotonic() - began
        return found

    def _one(self, found: Case, problem: Problem, drawn: list[Candidate], hidden: Hypothesis, true: np.ndarray) -> None:
        pool = pool_of(problem)
        if self.args.withhold:
            pool = [c for c in pool if c.effect.name != drawn[0].effect.name]
        x = explain(problem, pool, self.before)
        found.verdict, found.named, found.flagged = x.verdict, [j.name for j in x.tied], bool(x.left)
        found.first = bool(found.named) and found.named[:1] == found.truth
        found.within = bool(set(found.truth) & set(found.named))
        after = x.best.error_heldout if x.best is not None else x.baseline_error
        found.ratio = after / x.noise_floor
        if x.best is not None:
            found.beside = float(((x.best.residual - true) ** 2).sum())
        for judged in x.tied:
            if drawn and judged.name == drawn[0].name and drawn[0].size:
                at = drawn[0].shares(dict(hidden[0].values))
                found.value_error = float(abs(judged.own[0] - at[0]))

    def _two(self, found: Case, problem: Problem, names: list[str]) -> None:
        result = improve(problem, pool_of(problem), self.before, None, most=4)
        found.named = [t.name for t in result.terms]
        errors = [r.error_heldout for r in result.ladder]
        kept = set(found.named)
        twins = {t for rung in result.ladder if kept & {a.name for a in rung.added} for t in rung.tied_with}
        found.both, found.within = set(names) <= kept, set(names) <= kept | twins
        found.first = found.both and len(found.named) == 2
        found.verdict = f"{len(found.named)} effects"
        found.ratio = errors[-1] / result.noise_floor
        found.flagged = all(b < a for a, b in pairwise(errors))


def report(cases: Sequence[Case], args: argparse.Namespace) -> dict[str, Any]:
    """Print a table for each way; return what goes into the JSON."""
    ways = list(dict.fromkeys(c.by for c in cases))
    found = {}
    for by in ways:
        print(f"\nby {by}:")
        found[by] = scored([c for c in cases if c.by == by], args)
    settings = {k: v for k, v in vars(args).items() if k != "json"}
    shown = found[ways[0]] if len(ways) == 1 else {"by": found}
    return {"settings": settings, **shown, "cases": [asdict(c) for c in cases]}


def scored(cases: Sequence[Case], args: argparse.Namespace) -> dict[str, Any]:
    """The table of cases judged by one way."""
    real = [c for c in cases if c.truth and not c.too_small]
    untouched = [c for c in cases if not c.truth]
    small = [c for c in cases if c.too_small]

    def share(values: Sequence[bool]) -> float:
        return float(np.mean(values)) if values else float("nan")

    groups: dict[str, list[Case]] = defaultdict(list)
    for c in real:
        groups[c.family].append(c)
    print(
        f"\n{'family':<10}{'cases':>6}{'within ties':>13}{'first':>8}{'value error':>13}{'error/floor':>13}{'<= 1.3':>8}"
    )
    for name, some in [*groups.items(), ("all", real)]:
        values = [c.value_error for c in some if np.isfinite(c.value_error)]
        ratios = [c.ratio for c in some]
        print(f"{name:<10}{len(some):>6}{share([c.within for c in some]):>13.0%}{share([c.first for c in some]):>8.0%}"
              f"{np.median(values) if values else float('nan'):>13.3f}{np.median(ratios) if ratios else float('nan'):>13.2f}"
              f"{share([r <= 1.3 for r in ratios]):>8.0%}")  # fmt: skip
    alarms = [c for c in untouched if c.verdict != "nothing_missing"]
    print(f"untouched: {len(untouched)}, false alarms {len(alarms)}")
    print(f"too small to detect (mark below {DETECTABLE:g}): {len(small)}: {'; '.join(c.shown for c in small) or '-'}")
    flagged = share([c.verdict == UNEXPLAINED or (c.verdict == EFFECT and c.flagged) for c in real])
    if args.withhold:
        print(f"withheld: unexplained, or an effect with the rest flagged: {flagged:.0%}")
        silent = [c for c in real if c.verdict != UNEXPLAINED and not c.flagged]
        twins = sum(c.beside < DETECTABLE for c in silent)
        print(f"not flagged: {len(silent)}, of which {twins} name a twin of the truth: one that differs from it by less than "
              f"what makes a case too small ({DETECTABLE:g})")  # fmt: skip
        seen = len(real) - twins
        right = len(real) - len(silent)
        print(f"of the {seen} that left something to be flagged: {right / seen if seen else float('nan'):.0%}")
        for c in silent:
            print(f"  {c.index + 1}: {c.shown} -> {c.verdict} {', '.join(c.named)} (mark {c.mark:.0f}, beside the truth "
                  f"{c.beside:.0f}, error/floor {c.ratio:.2f})")  # fmt: skip
    if args.two:
        both, falls = share([c.both for c in real]), share([c.flagged for c in real])
        print(f"two effects: both found {both:.0%}, ladder falls at each step {falls:.0%}")
    if not args.withhold:
        print("missed:")
        for c in real:
            if not c.within:
                print(f"  {c.index + 1}: {c.shown} -> {c.verdict} {', '.join(c.named)} "
                      f"(mark {c.mark:.0f}, error/floor {c.ratio:.2f})")  # fmt: skip
    return {
        "within_ties": share([c.within for c in real]),
        "first": share([c.first for c in real]),
        "false_alarms": share([c in alarms for c in untouched]),
        "within_1.3_of_floor": share([c.ratio <= 1.3 for c in real]),
        "flagged": flagged,
        "too_small": len(small),
    }


def numbers_of(args: argparse.Namespace) -> list[int]:
    """The cases that are run, counted from 0."""
    return [k - 1 for k in args.only] if args.only else list(range(args.cases))


def run(bench: Bench) -> Iterator[list[Case] | str]:
    """All cases in their order; for one that cannot be simulated or compared, what was said of it."""
    numbers = numbers_of(bench.args)
    if bench.args.workers < 2:
        yield from (attempt(bench, k) for k in numbers)
        return
    settings = (bench.args, bench.known)
    with ProcessPoolExecutor(bench.args.workers, get_context("spawn"), _start, settings) as pool:
        yield from pool.map(_attempt, numbers)


def attempt(bench: Bench, index: int) -> list[Case] | str:
    try:
        return bench.cases(index)
    except (EngineError, MeasurementError) as problem:
        return str(problem)


_here: list[Bench] = []
"""The bench of a worker process."""


def _start(args: argparse.Namespace, known: Measurements) -> None:
    bench = Bench(args)
    bench.known = known
    _here.append(bench)


def _attempt(index: int) -> list[Case] | str:
    return attempt(_here[0], index)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--only", type=int, nargs="+", metavar="K", help="of the cases these, counted from 1")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--noise", type=float, default=0.02, help="share of each channel's range")
    parser.add_argument("--untouched", type=int, default=10, metavar="K", help="every K-th robot is untouched (1: all)")
    parser.add_argument("--robot", default="quadruped_lab", help="by name, or a file that describes it (.yaml, .urdf)")
    parser.add_argument("--by", choices=(AUTO, EVERY, *WAYS), default=AUTO, help="the way of comparing")
    parser.add_argument("--engine", choices=("mujoco", "pybullet"), default="mujoco")
    parser.add_argument(
        "--read-every", type=int, default=1, metavar="N", help="sensors are read in every N-th row only"
    )
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--json", type=Path)
    for flag in ("withhold", "two", "cross-engine"):
        parser.add_argument(f"--{flag}", action="store_true")
    args = parser.parse_args()
    if args.untouched < 1:
        parser.error(f"--untouched {args.untouched}: every which robot? 1 or more")
    if min(numbers_of(args), default=0) < 0:
        parser.error("--only: cases are counted from 1")
    bench = Bench(args)
    if not bench.robot.drives:
        parser.error(
            f"--robot {args.robot}: has no drives, so that nothing moves it; name a description (.yaml) that does"
        )
    cases: list[Case] = []
    if args.cross_engine:
        bench.calibrate()
    began = time.monotonic()
    numbers = numbers_of(args)
    for done, (k, found) in enumerate(zip(numbers, run(bench), strict=True), 1):
        if isinstance(found, str):
            print(f"{k + 1:4d}/{args.cases}  skipped: {found}", flush=True)
            continue
        cases += found
        left = (time.monotonic() - began) / done * (len(numbers) - done)
        for case in found:
            mark = "small" if case.too_small else "first" if case.first else "tied" if case.within else case.verdict
            print(f"{k + 1:4d}/{args.cases}  {case.shown or 'untouched':<78.78}  {case.by:<13} {mark:<16} {case.ratio:5.2f} x "
                  f"floor {case.seconds:5.0f} s, {left / 60:.0f} min left", flush=True)  # fmt: skip
    result = report(cases, args)
    if args.json:
        args.json.write_text(json.dumps(result, indent=1, default=str) + "\n", encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
