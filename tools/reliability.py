"""How often a verdict of explain is right, by what can be seen of it: the cases that its confidence rests on.

    python tools/reliability.py --cases 300 --seed 700 --workers 2 --out cases.jsonl
    python tools/reliability.py --cases 300 --seed 701 --workers 2 --out more.jsonl --wide
    python tools/reliability.py --fit cases.jsonl --judge more.jsonl

Robots, noise, number of trials and what is hidden are drawn: of ten cases four have one effect of the catalogue, one has none,
in one the effect that is hidden is taken out of the catalogue, two have two effects, and two are a little wrong everywhere
with one effect on top. ``--wide``: more noise, up to seven trials, and the quadruped with the paper's eight sensors too. A
case that is in the file already is not done again. The last command fits a logistic regression to some cases, prints it as
ee_dist/discrepancy/confidence.py holds it, how well cases of one tenth are foretold by the others, and how well those of
the other files are.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from concurrent.futures import ProcessPoolExecutor
from dataclasses import asdict, dataclass, replace
from functools import cache
from multiprocessing import get_context
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from benchmarks.cases import tried
from benchmarks.reliability import read, report
from blind_benchmark import DETECTABLE, FIXED_BASE
from messy_benchmark import SIZES, mess

from ee_dist.discrepancy.confidence import misfit_of, signs_of
from ee_dist.discrepancy.draw import draw
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.explain import EFFECT, UNEXPLAINED, Explanation, explain
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.contract import Engine, EngineError
from ee_dist.measurements.errors import MeasurementError
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import AUTO, Config, EngineConfig, EvaluatorConfig
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.ways import way_of
from ee_dist.tasks.wiring import close_evaluators, engine_maker
from ee_dist.trials.excitation import STANDARD
from ee_dist.trials.noise import with_noise

CLEAN, UNTOUCHED, WITHHELD, PAIR, MESSY = "clean", "untouched", "withheld", "pair", "messy"
KINDS = (CLEAN, PAIR, MESSY, CLEAN, UNTOUCHED, CLEAN, WITHHELD, MESSY, CLEAN, PAIR)
ARM = str(Path(__file__).resolve().parents[1] / "docs" / "examples" / "arm.yaml")
STANDARD_SET = {"servo_pendulum": 0.6, ARM: 0.3, "quadruped_lab": 0.1}, (0.001, 0.005, 0.02, 0.05), (1, 3)
"""Robots and how often, noise as a share of each channel's range, numbers of trials."""
WIDE = {"servo_pendulum": 0.5, ARM: 0.3, "quadruped_lab": 0.1, "quadruped": 0.1}, (0.01, 0.02, 0.05, 0.1), (1, 3, 7)


@dataclass
class Case:
    """``right``: whether what was hidden is among what is named, or nothing is missing, or no explanation of one effect is right.
    ``signs`` and ``misfit``: what explain could see of it (ee_dist/discrepancy/confidence.py)."""

    index: int
    kind: str
    robot: str
    noise: float
    trials: int
    hidden: str
    mark: float
    verdict: str
    named: list[str]
    right: bool
    signs: dict[str, float] | None = None
    misfit: float = 0.0
    seconds: float = 0.0


@cache
def engine() -> Engine:
    return engine_maker(Config(engine=EngineConfig("mujoco", 1)), alone=True)()


def hidden_in(kind: str, robot: Robot, rng: np.random.Generator) -> Hypothesis:
    """What is wrong with the robot."""
    terms: Hypothesis = ()
    if kind == MESSY:
        size = float(rng.choice(list(SIZES.values())))
        terms = tuple(t for some in mess(robot, size, rng, False).values() for t in some)
    for _ in range({UNTOUCHED: 0, PAIR: 2}.get(kind, 1)):
        terms = (*terms, draw(robot, rng)[1])
    return terms


@dataclass(frozen=True)
class Drawn:
    """From what cases are drawn. ``robots``: how often each; ``noises``: shares of each channel's range."""

    seed: int
    robots: dict[str, float]
    noises: tuple[float, ...]
    trials: tuple[int, ...]


def one(index: int, drawn: Drawn) -> Case | str:
    """One case; in words, where it cannot be simulated or compared."""
    seed = drawn.seed
    rng = np.random.default_rng([seed, index])
    kind, name = KINDS[index % len(KINDS)], str(rng.choice(list(drawn.robots), p=list(drawn.robots.values())))
    noise, count = float(rng.choice(drawn.noises)), int(rng.choice(drawn.trials))
    robot = with_noise(load_robot(name)[0], noise)
    hidden, began = hidden_in(kind, robot, rng), time.monotonic()
    plan = (STANDARD if robot.free_base else (*FIXED_BASE, *(replace(e, seed=e.seed + 10) for e in FIXED_BASE)))[:count]
    try:
        trials = [tried(engine(), robot, hidden, e, [seed, index, k], k) for k, e in enumerate(plan)]
        known = Measurements(robot, tuple(trials), (), (), robot.name, Path())
        close_evaluators()
        config = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
        problem = way_of(known, AUTO).make(known, config).searched
        base, true = problem.residuals([(), hidden])
        mark = float(((base - true) ** 2).sum()) if np.isfinite(true).all() else float("inf")
        pool = [c for c in pool_of(problem) if kind != WITHHELD or c.effect.name != hidden[-1].effect]
        found = explain(problem, pool)
    except (EngineError, MeasurementError) as error:
        return f"{index}: {error}"
    shown = "; ".join(map(str, hidden[-2 if kind == PAIR else -1 :]))
    case = Case(index, kind, robot.name, noise, count, shown, mark, found.verdict, [j.name for j in found.tied], False)
    case.right, case.misfit = is_right(found, kind, robot, hidden, mark), misfit_of(found)
    signs = signs_of(found)
    case.signs = None if signs is None else asdict(signs)
    case.seconds = time.monotonic() - began
    return case


def is_right(found: Explanation, kind: str, robot: Robot, hidden: Hypothesis, mark: float) -> bool:
    if found.verdict == EFFECT:
        return any(there(j, robot, hidden) for j in found.tied)
    if found.verdict == UNEXPLAINED:
        return kind != CLEAN and mark >= DETECTABLE
    return mark < DETECTABLE


def there(judged: Judged, robot: Robot, hidden: Hypothesis) -> bool:
    """Whether all that is named is in the robot."""
    truth = {(t.effect, t.target) for t in hidden}
    return all((c.effect.name, at) in truth for c in judged.proposal.parts for at in c.members(robot) or (c.target,))


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--cases", type=int, default=20)
    parser.add_argument("--seed", type=int, default=700)
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--wide", action="store_true", help="more noise, more trials, and the paper's quadruped too")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--fit", type=Path, nargs="+", help="files of cases to fit to")
    parser.add_argument("--judge", type=Path, nargs="*", default=[], help="files of cases to foretell")
    args = parser.parse_args()
    if args.fit:
        report(read(args.fit), read(args.judge))
        return 0
    if args.out is None:
        parser.error("--out: where the cases go")
    drawn = Drawn(args.seed, *(WIDE if args.wide else STANDARD_SET))
    done = {case["index"] for case in read([args.out] if args.out.exists() else [])}
    todo = [k for k in range(args.cases) if k not in done]
    with ProcessPoolExecutor(args.workers, get_context("spawn")) as pool, args.out.open("a", encoding="utf-8") as out:
        for case in pool.map(one, todo, [drawn] * len(todo)):
            if isinstance(case, str):
                print(f"skipped: {case}", flush=True)
                continue
            out.write(json.dumps(asdict(case)) + "\n")
            out.flush()
            how = "right" if case.right else "WRONG"
            print(
                f"{case.index:4d} {case.kind:<9} {case.robot:<14} {case.noise:<5g} {case.trials} {case.hidden:<70.70} "
                f"{case.verdict:<15} {how:<5} {case.seconds:4.0f} s",
                flush=True,
            )
    return 0


if __name__ == "__main__":
    sys.exit(main())
