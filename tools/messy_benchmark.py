"""Is the verdict right about robots that are a little wrong everywhere, as all real ones are?

    python tools/messy_benchmark.py --size middle --cases 60 --robot servo_pendulum --seed 0 --out messy.jsonl
    python tools/messy_benchmark.py --report messy.jsonl

Every part's mass, every joint's friction, offset, gain and delay are off by draws of the ``--size``; on top of that a hidden
effect of the catalogue, larger than all that is wrong at its joint together, except in every fourth robot. ``improve
effect=auto`` sees three motions; two others are held out from all of it. Scored are the name of the hidden effect, wrong
names, the error on the motions held out, and whether 95 % intervals hold what is true. ``--out`` takes each case once it is done
and leaves out those that it has, so that a benchmark of many hours goes on where it was stopped.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import numpy as np
from benchmarks.arm6 import desk_arm_6
from benchmarks.cases import tried

from ee_dist.discrepancy.accounts.of_improve import may_be_nothing
from ee_dist.discrepancy.accounts.ranges import as_loads
from ee_dist.discrepancy.draw import draw
from ee_dist.discrepancy.importance import added, shares
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term, term
from ee_dist.effects.groups import members_of
from ee_dist.engines.contract import EngineError
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import Config, EngineConfig, EvaluatorConfig
from ee_dist.tasks.wiring import close_evaluators, engine_maker, evaluator_of
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

ARM = "desk_arm_6"
WAYS: dict[str, Callable[..., Problem]] = {"open_loop": OpenLoop, "free_run": FreeRun}
SIZES = {"small": 0.25, "middle": 0.5, "large": 1.0}
"""Shares of the large draws: friction of 3 to 11 % of a drive's torque limit, masses off by up to 20 %, offsets of 20 mrad,
gains off by up to 10 %, delays of up to 10 ms."""
ATTEMPTS = 40
"""Draws of a hidden effect until one stands out."""
SETTINGS = ("robot", "size", "by", "seed", "noise", "seconds", "beyond")
"""What makes a case another one."""


@dataclass(frozen=True)
class Motions:
    """What is recorded: ``fitted`` for the search, ``held`` for the last word."""

    fitted: tuple[Excitation, ...]
    held: tuple[Excitation, ...]


def motions(robot: Robot, seconds: float) -> Motions:
    if robot.free_base:
        plan = (("multisine", 0.4, 1, "stand"), ("steps", 0.3, 2, "floor"), ("slow_sines", 0.6, 3, "stand"))
        other = (("fast_sines", 0.3, 4, "stand"), ("multisine", 0.3, 9, "floor"))
    else:
        plan = (("multisine", 0.5, 1, "floor"), ("steps", 0.4, 2, "floor"), ("slow_sines", 0.5, 3, "floor"))
        other = (("fast_sines", 0.25, 4, "floor"), ("multisine", 0.6, 9, "floor"))
    fitted, held = (tuple(Excitation(k, seconds, a, n, on) for k, a, n, on in some) for some in (plan, other))
    return Motions(fitted, held)


def mess(robot: Robot, size: float, rng: np.random.Generator, beyond: bool) -> dict[str, list[Term]]:
    """What is wrong by joint (and, under "", at the parts); ``beyond``: also with what the search does not ask everywhere."""
    found: dict[str, list[Term]] = {"": []}
    for drive in robot.drives:
        limit = drive.torque_limit if np.isfinite(drive.torque_limit) else 1.0
        found[drive.joint] = [
            term("coulomb_friction", drive.joint, torque_nm=size * limit * float(rng.uniform(0.03, 0.11))),
            term("viscous_friction", drive.joint, damping_nm_s_rad=size * limit * float(rng.uniform(0.0, 0.035))),
            term("zero_offset", drive.joint, offset_rad=size * float(rng.normal(0, 0.02))),
            term("command_gain", drive.joint, change=size * float(rng.uniform(-0.1, 0.1))),
            term("command_delay", drive.joint, delay_s=size * float(rng.uniform(0.0, 0.01))),
        ]
        if beyond:
            found[drive.joint] += [
                term("backlash", drive.joint, gap_rad=size * float(rng.uniform(0.0, 0.015))),
                term("deadband", drive.joint, half_width_rad=size * float(rng.uniform(0.0, 0.006))),
                term("load_friction", drive.joint, share=size * float(rng.uniform(0.0, 0.15))),
                term(
                    "stribeck_friction",
                    drive.joint,
                    torque_nm=size * limit * float(rng.uniform(0.0, 0.03)),
                    speed_rad_s=0.2,
                ),
            ]
    for part in robot.parts[0 if robot.free_base else 1 :]:
        found[""].append(term("part_mass", part.name, change=size * float(rng.uniform(-0.2, 0.2))))
    return found


@dataclass
class Case:
    """``wrong``: names without a doubt, ``doubted``: wrong ones that are told with one. ``ratio``: error over the noise floor on
    motions held out from everything, ``before`` the same without the search;
    ``held``: 1 for each interval that holds the truth, 0 for each that does not."""

    index: int
    truth: str
    terms: list[str] = field(default_factory=list)
    within: bool = False
    wrong: list[str] = field(default_factory=list)
    doubted: list[str] = field(default_factory=list)
    shared: bool = False
    verdict: str = ""
    before: float = float("nan")
    ratio: float = float("nan")
    held: list[int] = field(default_factory=list)
    seconds: float = 0.0


class Bench:
    def __init__(self, args: argparse.Namespace) -> None:
        self.args = args
        robot = desk_arm_6() if args.robot == ARM else with_noise(load_robot(args.robot)[0], args.noise)
        self.robot, self.size = robot, SIZES[args.size]
        self.config = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
        self.engine = engine_maker(self.config, alone=True)()
        self.motions = motions(robot, args.seconds)

    def trials(self, hidden: Hypothesis, plan: Sequence[Excitation], seed: Sequence[int]) -> tuple[MeasuredTrial, ...]:
        return tuple(tried(self.engine, self.robot, hidden, e, [*seed, k], k) for k, e in enumerate(plan))

    def problem(self, trials: Sequence[MeasuredTrial]) -> Problem:
        return WAYS[self.args.by](trials, self.robot, evaluator_of(self.config))

    def case(self, index: int) -> Case:
        rng = np.random.default_rng([self.args.seed, index])
        began = time.monotonic()
        close_evaluators()
        wrong = mess(self.robot, self.size, rng, self.args.beyond)
        everywhere = tuple(t for terms in wrong.values() for t in terms)
        hidden: Hypothesis = ()
        if (index + 1) % 4:
            hidden = self.standing_out(wrong, everywhere, rng)
        truth = (*everywhere, *hidden)
        problem = self.problem(self.trials(truth, self.motions.fitted, [self.args.seed, index, 0]))
        other = self.problem(self.trials(truth, self.motions.held, [self.args.seed, index, 1]))
        result = improve(problem, pool_of(problem))
        found = Case(index, "; ".join(map(str, hidden)), [str(t) for t in result.terms], verdict=result.verdict)
        before, after, true = (error(r) for r in other.residuals([(), result.terms, truth]))
        found.before, found.ratio = before / true, after / true
        self.score(found, result, truth, hidden)
        found.seconds = time.monotonic() - began
        return found

    def standing_out(
        self, wrong: dict[str, list[Term]], everywhere: Hypothesis, rng: np.random.Generator
    ) -> Hypothesis:
        """An effect whose mark is larger than that of all the mess at its joint. Empty where none was drawn."""
        problem = self.problem(self.trials(everywhere, self.motions.fitted, [self.args.seed, 0, 2]))
        for _ in range(ATTEMPTS):
            chosen, drawn = draw(self.robot, rng)
            here = tuple(wrong.get(chosen.target, wrong[""]))
            rest = tuple(t for t in everywhere if t not in here)
            try:
                base, mine, without = problem.residuals([everywhere, (*everywhere, drawn), rest])
            except EngineError:
                continue
            mark, beside = float(((base - mine) ** 2).sum()), float(((base - without) ** 2).sum())
            if np.isfinite(mark) and mark > beside and chosen.effect.family in problem.families:
                return (drawn,)
        return ()

    def score(self, found: Case, result: Improvement, truth: Hypothesis, hidden: Hypothesis) -> None:
        """A name that the model has in the end is wrong where nothing of the kind is at any of its joints, and is told without a
        doubt: neither tied with others, nor one that less depends on than is left unexplained, nor one of which it is said
        that no value is told from neutral."""
        steps = [r for r in result.ladder if r.added]
        named = {t.name for t in result.terms} | {name for r in steps for name in r.tied_with}
        named |= {t.term.name for t in result.twins} | {t.name for t in as_loads(self.robot, result.terms)}
        found.within = all(self.covers(named, h) for h in hidden)
        at = {(t.effect, t.target) for t in truth}
        doubted = {t.name for s in shares(result, self.robot) if s.doubted for t in s.terms}
        doubted |= {t.name for rung in steps if rung.tied_with for t in rung.added} | {t.name for t in result.twins}
        doubted |= {t.name for t in result.terms if may_be_nothing(result, (t,))}
        for t in added(result):
            if not any((t.effect, p) in at for p in (t.target, *self.places(t))):
                (found.doubted if t.name in doubted else found.wrong).append(t.name)
        found.shared = any(len(self.places(t)) > 1 for t in result.terms)
        for p in result.parameters:
            t = result.terms[p.term]
            true = [
                dict(x.values)[p.name] - self.beside(result, t, x.target, p.name)
                for x in truth
                if x.effect == t.effect and x.target in self.places(t)
            ]
            if true and np.isfinite(p.high - p.low) and len(true) == len(self.places(t)):
                found.held.append(int(p.low <= float(np.mean(true)) <= p.high))

    def beside(self, result: Improvement, term: Term, place: str, name: str) -> float:
        """What other terms of the same effect say of a place: friction that all joints share counts at each of them."""
        others = (t for t in result.terms if t is not term and t.effect == term.effect and place in self.places(t))
        return float(sum(dict(t.values)[name] for t in others))

    def places(self, t: Term) -> tuple[str, ...]:
        allowed = tuple({*self.robot.motor_names, *(p.name for p in self.robot.parts), *self.robot.sensor_names})
        return members_of(self.robot, t.target, allowed) or (t.target,)

    def covers(self, named: set[str], hidden: Term) -> bool:
        return hidden.name in named or any(f"{hidden.name.split('@')[0]}@each" in n for n in named)


def run(bench: Bench, done: set[int]) -> Iterator[Case]:
    for k in range(bench.args.cases):
        if k not in done:
            try:
                yield bench.case(k)
            except EngineError as problem:
                print(f"{k + 1:4d}  skipped: {problem}", flush=True)


def settings_of(args: argparse.Namespace) -> dict[str, object]:
    # With another catalogue the same seed hides something else.
    effects = sum(not e.mistake and e.seen_at is None for e in CATALOGUE.values())
    return {name: getattr(args, name) for name in SETTINGS} | {"effects": effects}


def kept(path: Path) -> list[tuple[dict[str, object], Case]]:
    """The cases of a file with what was asked for them."""
    found = []
    for line in path.read_text(encoding="utf-8").splitlines():
        row = json.loads(line)
        found.append((row["settings"], Case(**row["case"])))
    return found


def report(title: str, cases: Sequence[Case]) -> Mapping[str, float]:
    hidden = [c for c in cases if c.truth]
    ratios = sorted(c.ratio for c in cases)
    held = [h for c in cases for h in c.held]

    def share(values: Sequence[bool | int]) -> float:
        return float(np.mean(values)) if values else float("nan")

    found: dict[str, float] = {
        "cases": len(cases),
        "with a hidden effect": len(hidden),
        "hidden within names": share([c.within for c in hidden]),
        "cases with a wrong name": share([bool(c.wrong) for c in cases]),
        "cases with a doubted one": share([bool(c.doubted) for c in cases]),
        "error over floor, before": float(np.median([c.before for c in cases])),
        "error over floor, median": float(np.median(ratios)),
        "error over floor, 90 %": float(np.quantile(ratios, 0.9)),
        "intervals hold": share(held),
        "intervals": len(held),
        "seconds, median": float(np.median([c.seconds for c in cases])),
    }
    print(f"\n{title}")
    for key, value in found.items():
        print(f"  {key:<28}{value:.3g}")
    return found


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--size", choices=tuple(SIZES), default="middle")
    parser.add_argument("--robot", default="servo_pendulum", help=f"by name or file; {ARM} is built in here")
    parser.add_argument("--by", choices=tuple(WAYS), default="open_loop")
    parser.add_argument("--cases", type=int, default=60)
    parser.add_argument(
        "--beyond", action="store_true", help="backlash, deadband, friction by load and Stribeck at every joint too"
    )
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--noise", type=float, default=0.001, help="share of each channel's range")
    parser.add_argument("--seconds", type=float, default=4.0, help="length of a trial")
    parser.add_argument(
        "--out", type=Path, help="a line of JSON for each case; those that are there are not made again"
    )
    parser.add_argument("--report", type=Path, nargs="+", help="only count what these files hold, by robot and size")
    args = parser.parse_args()
    if args.report:
        groups: dict[str, list[Case]] = {}
        for path in args.report:
            for settings, case in kept(path):
                title = f"{settings['robot']}, {settings['size']}, {settings['by']}, noise {settings['noise']}"
                groups.setdefault(title, []).append(case)
        for title, cases in sorted(groups.items()):
            report(title, cases)
        return 0
    there = kept(args.out) if args.out and args.out.exists() else []
    cases = [case for settings, case in there if settings == settings_of(args)]
    for case in run(Bench(args), {c.index for c in cases}):
        cases.append(case)
        if args.out:
            with args.out.open("a", encoding="utf-8") as out:
                out.write(json.dumps({"settings": settings_of(args), "case": asdict(case)}) + "\n")
        mark = "found" if case.truth and case.within else "missed" if case.truth else "-"
        print(f"{case.index + 1:4d}/{args.cases}  {case.truth or 'nothing more':<64.64} {mark:<7}"
              f"{case.before:6.2f} -> {case.ratio:5.2f} x floor {case.seconds:5.0f} s  "
              f"{'wrong: ' + ', '.join(case.wrong) if case.wrong else ''}"
              f"{'  doubted: ' + ', '.join(case.doubted) if case.doubted else ''}", flush=True)  # fmt: skip
    report(f"{args.robot}, {args.size}", cases)
    return 0


if __name__ == "__main__":
    sys.exit(main())
