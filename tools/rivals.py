"""Ways to walk again, on the same broken robots: hardware trials and simulations until 70, 90 and 100 % of the intact distance.

    python tools/rivals.py --scenarios 3,8 --seeds 0 --rivals all --out logs/rivals

Each run (a rival, a scenario, a seed) is one JSON file in OUT, and a run that is there is not made again: a study that was
stopped goes on with the same command. What was simulated is in OUT too, and shared. Ends with table.md, table.csv, runs.csv,
rivals.json and rivals.png (a page where there is no browser) of all runs in OUT with these settings; table and figure are of the
cases (scenario and seed) on which every rival ran that ran at all.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import asdict, fields
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import yaml
from benchmarks.figures import save
from benchmarks.rival_run import attempt

from ee_dist.basics.files import write_whole
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.installed import installed
from ee_dist.evaluation.journal import Journal, JournaledEvaluator
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.rivals.attempt import Attempt, attempt_of
from ee_dist.rivals.roster import ROSTER
from ee_dist.rivals.setting import Allowance, RivalError
from ee_dist.rivals.tally import by_run, common, markdown, rows_of, table_of, write_csv
from ee_dist.tasks.compose import config_folder
from ee_dist.tasks.config import BudgetConfig, Config, ConfigError, EngineConfig, MetricConfig, ScenarioConfig
from ee_dist.tasks.wiring import build_robot, engine_maker
from ee_dist.viewing.rivals_figure import by_trials

PACKAGES = {"mujoco": ("mujoco", "numpy", "numba"), "pybullet": ("pybullet", "numpy", "numba")}


def numbers(text: str) -> list[int]:
    return [int(n) for n in text.split(",")]


def settings_of(args: argparse.Namespace, scenario: int, seed: int) -> Config:
    """As ``task=recover`` would have them. Raises ConfigError for a setting that cannot be."""
    plain = yaml.safe_load((config_folder() / "budget" / f"{args.budget}.yaml").read_text(encoding="utf-8"))
    known = {f.name: type(f.default) for f in fields(BudgetConfig)}
    for entry in args.change:
        key, _, value = entry.partition("=")
        if key not in known:
            raise ConfigError(f"--change {entry}: no such setting of a budget; there are: {', '.join(known)}")
        plain[key] = known[key](value)
    case = yaml.safe_load((config_folder() / "scenario" / f"{scenario}.yaml").read_text(encoding="utf-8"))
    return Config(
        seed=seed,
        engine=EngineConfig(args.engine, 1),
        metric=MetricConfig(),
        budget=BudgetConfig(**plain),
        scenario=ScenarioConfig(**case),
    )


class Study:
    """The files of one folder, and the simulations that its runs share."""

    def __init__(self, args: argparse.Namespace) -> None:
        self.args, self.out = args, Path(args.out)
        self.out.mkdir(parents=True, exist_ok=True)
        self.allowance = Allowance(args.body_trials, args.map_trials, args.map_evaluations, not args.single)
        first = settings_of(args, args.scenarios[0], args.seeds[0])
        versions = {n: installed().get(n) for n in PACKAGES[args.engine]}
        kept = hashlib.sha256(repr((args.engine, versions)).encode()).hexdigest()[:8]
        self.engine = engine_maker(first, alone=True)()
        # To open it beside a study that runs would cut off what that is just writing.
        self.journal = None if args.only_write else Journal(self.out / f"simulated_{kept}.bin")
        self.evaluator = CachedEvaluator(JournaledEvaluator(SerialEvaluator(self.engine), self.journal))
        self.robot = build_robot(first)
        self.digest = hashlib.sha256(
            repr((kept, asdict(first.budget), asdict(first.metric), asdict(self.allowance))).encode()
        ).hexdigest()[:8]

    def path(self, rival: str, scenario: int, seed: int) -> Path:
        return self.out / f"{rival}_scenario{scenario}_seed{seed}_{self.digest}.json"

    def runs(self) -> Iterator[tuple[Attempt, bool]]:
        """Every run that is asked for, and whether it is new."""
        for seed in self.args.seeds:
            for scenario in self.args.scenarios:
                config = settings_of(self.args, scenario, seed)
                assert config.scenario is not None
                for rival in self.args.rivals:
                    file = self.path(rival, scenario, seed)
                    if file.is_file():
                        yield attempt_of(json.loads(file.read_text(encoding="utf-8"))), False
                        continue
                    found = attempt(
                        rival, config, self.robot, config.scenario.hidden(), self.evaluator, self.engine, self.allowance
                    )
                    write_whole(file, json.dumps(found.as_dict()) + "\n")
                    yield found, True

    def found(self) -> list[Attempt]:
        """All runs in the folder with these settings, those of earlier commands too."""
        files = sorted(self.out.glob(f"*_scenario*_seed*_{self.digest}.json"))
        return [attempt_of(json.loads(f.read_text(encoding="utf-8"))) for f in files]

    def close(self) -> None:
        self.evaluator.close()
        if self.journal is not None:
            self.journal.close()


def told(found: Attempt) -> str:
    best = found.share(len(found.trials_m))
    reached = " ".join(f"{found.reached(s) or '-':>5}" for s in (0.7, 0.9, 1.0))
    return (
        f"scenario {found.scenario:2d} seed {found.seed} {found.rival:<18} {len(found.trials_m):5d} trials, best {best:5.0%} of "
        f"{found.intact_m:.2f} m, trials to 70/90/100 %: {reached}; {found.before.simulated:,} + {found.after.simulated:,} "
        f"simulated, {found.seconds:.0f} s"
    )


def write(found: Sequence[Attempt], trials: int, out: Path) -> list[Path]:
    """Table and figure of the cases on which all of these rivals ran, and every run."""
    titles = {name: entry.title for name, entry in ROSTER.items()}
    shared = common(found)
    cases = sorted({(a.scenario, a.seed) for a in shared})
    head = f"Cases that every rival has ({len(cases)}): {', '.join(f'scenario {n} seed {s}' for n, s in cases)}\n\n"
    table = table_of(shared, titles, trials)
    written = [out / name for name in ("table.md", "table.csv", "runs.csv", "rivals.json")]
    write_whole(written[0], head + markdown(table) + "\n" + by_run(found, titles))
    write_csv(written[1], table)
    write_csv(written[2], rows_of(found, trials))
    write_whole(written[3], json.dumps({"table": table, "runs": [a.as_dict() for a in found]}) + "\n")
    curves = {titles[name]: [a.curve() for a in shared if a.rival == name] for name in titles}
    return [*written, save(by_trials({t: c for t, c in curves.items() if c}), out / "rivals.png")]


def main(arguments: list[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--scenarios", type=numbers, default=[3, 8], help="of the paper, such as 1,3,8")
    parser.add_argument("--seeds", type=numbers, default=[0])
    parser.add_argument("--rivals", default="all", help=f"all, or of {', '.join(ROSTER)}")
    parser.add_argument("--out", default="logs/rivals")
    parser.add_argument("--budget", choices=("paper", "quick"), default="paper")
    parser.add_argument("--change", nargs="*", default=[], metavar="KEY=VALUE", help="of the budget: population=32")
    parser.add_argument("--engine", choices=tuple(PACKAGES), default="mujoco")
    parser.add_argument("--body-trials", type=int, default=Allowance.body_trials, help="of evolution on the body")
    parser.add_argument("--map-trials", type=int, default=Allowance.map_trials, help="of the map of gaits")
    parser.add_argument(
        "--map-evaluations", type=int, default=0, help="0: as many as all repair passes of the loop ask for"
    )
    parser.add_argument("--single", action="store_true", help="no pairs on the list of faults")
    parser.add_argument("--only-write", action="store_true", help="the table of what is there, no new runs")
    args = parser.parse_args(arguments)
    args.rivals = list(ROSTER) if args.rivals == "all" else args.rivals.split(",")
    unknown = [r for r in args.rivals if r not in ROSTER]
    if unknown:
        parser.error(f"--rivals {unknown[0]}: no such rival; there are: {', '.join(ROSTER)}")
    try:
        study = Study(args)
    except (ConfigError, ValueError) as error:
        parser.error(str(error))
    try:
        for found, new in () if args.only_write else study.runs():
            print(told(found) + ("" if new else " (was there)"), flush=True)
        plan = settings_of(args, args.scenarios[0], args.seeds[0]).budget.plan()
        for path in write(study.found(), plan.compensating_trials, study.out):
            print(f"  {path}")
    except RivalError as error:
        print(error, file=sys.stderr)
        return 1
    finally:
        study.close()
    print((study.out / "table.md").read_text(encoding="utf-8"))
    return 0


if __name__ == "__main__":
    sys.exit(main())
