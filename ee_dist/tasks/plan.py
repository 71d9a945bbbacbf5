"""task=plan: what to record next, so that what is tied in a finished explain or improve can be told apart."""

from __future__ import annotations

import io
import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

import numpy as np
import yaml

from ee_dist.basics.files import write_whole
from ee_dist.basics.names import listed
from ee_dist.discrepancy.contenders import contenders, suspected
from ee_dist.discrepancy.measured_trial import reading_s
from ee_dist.discrepancy.plan import Contender, Plan, parting, predicted, ranked
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.robots.agree import differences
from ee_dist.robots.describe import BUILT_IN
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import command_unit
from ee_dist.robots.serial import robot_to_dict
from ee_dist.robots.untrusted import UntrustedError, json_of, text_of
from ee_dist.tasks.config import Config, ConfigError, one_of
from ee_dist.tasks.explained import LARGEST_SUMMARY, Explained, explained, fitting
from ee_dist.tasks.measurements import FEWEST_ROWS, load, with_known_noise
from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.results.commands import command, setting
from ee_dist.tasks.results.plan_page import CSV, account_of, of_plan, plan_page, show_plan
from ee_dist.tasks.results.tables import show_account
from ee_dist.tasks.summary import Stopwatch, digest_of, write_summary
from ee_dist.tasks.terminal import terminal
from ee_dist.tasks.ways import way_of
from ee_dist.tasks.wiring import evaluator_of, for_few
from ee_dist.trials.excitation import FIXTURES, Excitation
from ee_dist.trials.family import PLANNED, Limits, driven, family
from ee_dist.trials.noise import channel_range
from ee_dist.viewing.report import write_page

MOST_TIED = 6
"""Tied explanations, the best first, that the trial is to tell apart."""
SUSPECTED = 0.2
"""Share of the range worth trying at which an effect that was not found is put."""
ROBOT = "robot.yaml"


@dataclass
class Options:
    name: str = "plan"
    explained: str | None = None
    seconds: float = 6.0
    amplitude: float = 0.5
    excursion: float = math.inf
    speed: float = math.inf
    kinds: list[str] = field(default_factory=list)
    fixtures: list[str] = field(default_factory=lambda: ["stand", "floor"])
    draws: int = 2
    suspects: list[str] = field(default_factory=list)

    def __post_init__(self) -> None:
        if not 0.1 <= self.seconds <= 600:
            raise ConfigError(f"task.seconds={self.seconds:g}: must be from 0.1 to 600 s")
        if not 0 < self.amplitude <= 1:
            raise ConfigError(
                f"task.amplitude={self.amplitude:g}: must be a share of half the range, more than 0 and at most 1; "
                "task.excursion is for rad"
            )
        for key in ("excursion", "speed"):
            if not getattr(self, key) > 0:
                raise ConfigError(f"task.{key}={getattr(self, key):g}: must be more than 0")
        if not 1 <= self.draws <= 50:
            raise ConfigError(f"task.draws={self.draws}: must be from 1 to 50")
        for kind in self.kinds:
            if kind == "gait":
                raise ConfigError(
                    "task.kinds: the commands of a gait come out of a network's loop, and cannot be planned"
                )
            one_of("task.kinds", kind, PLANNED)
        for fixture in self.fixtures:
            one_of("task.fixtures", fixture, FIXTURES)
        if not self.fixtures:
            raise ConfigError("task.fixtures: name at least one of stand and floor")

    @property
    def limits(self) -> Limits:
        return Limits(self.seconds, self.amplitude, self.excursion, self.speed)


def run(config: Config, options: Options, out: Path) -> Plan:
    """Write plan.csv, summary.json and report.html into ``out``, and a robot's description where it has no name. Raises
    ConfigError, EffectError, ExcitationError, LogError, RecordingError."""
    console, watch = terminal(), Stopwatch()
    found = explained(options.explained, for_few(config))
    if len(found.explanations) < 2 and not options.suspects:
        raise ConfigError(nothing_tied(found))
    measured = load(found.config)
    robot = with_known_noise(measured)
    fitting(found, robot)
    every_s = reading_s(measured.trials)
    wanted = motions(robot, options, config.seed, every_s)
    for remark in measured.remarks:
        console.print(remark, highlight=False, markup=False)
    suspects = [parse(robot, text) for text in options.suspects]
    names = [name for name, _ in found.explanations[:MOST_TIED]]
    with SearchProgress(console) as progress:
        way = way_of(measured, found.way)
        problem = way.searched(measured, found.config, progress)
        tied = [terms for _, terms in found.explanations[:MOST_TIED]]
        if way.name == OpenLoop.way:
            known = contenders(problem, tied, progress)
            rivals, left = list(known.contenders), known.left
        else:
            # Its values were not fitted to what commands alone make of the robot.
            rivals, left = [Contender(h) for h in tied], 1.0
        for chosen in suspects:
            names.append(f"{names[0]} and {chosen.name}")
            rivals.append(Contender((*rivals[0].hypothesis, *suspected(chosen, SUSPECTED))))
        evaluator = evaluator_of(found.config)
        windows = len(problem.segments)
        result = ranked(len(rivals), predicted(robot, rivals, wanted, evaluator, left, windows, progress, every_s))
        if result.best.harm:
            raise ConfigError(harmful(robot, result))
        best, models = result.best.excitation, [c.hypothesis for c in rivals]
        shown = parting(robot, models, result.closest, best, evaluator, every_s)
    out.mkdir(parents=True, exist_ok=True)
    write_whole(out / CSV, as_csv(robot, best))
    trial = ["task=trial", *robot_settings(robot, out), f"task.noise={noise_share(robot):.3g}",
             setting("engine", found.config.engine.name), f"seed={another_seed(measured.files, config.seed)}",
             f'task.excitations=["{typed(robot, best)}"]']  # fmt: skip
    explanations = list(zip(names, models, strict=True))
    account = account_of(
        robot, result, explanations, command(trial), any(c.nearby for c in rivals), len(found.explanations) - MOST_TIED,
        every_s, measured.real,
    ).warned([*measured.remarks, *rated(robot)])  # fmt: skip
    if result.enough and not measured.real:
        account = account.followed(command(trial))
    digest = digest_of([(t.excitation, [round(s, 9) for s in t.separations]) for t in result.trials])
    rest = of_plan(result, explanations, found.folder, measured.files, options.limits, account)
    rest |= {"reading_s": every_s or robot.time_step_s, "csv": CSV, "command": ["python", "-m", "ee_dist", *trial]}
    write_summary(out, "plan", found.config, options, watch, digest, rest)
    write_page(plan_page(robot, result, explanations, shown, account, measured.files), out / "report.html")
    show_plan(console, robot, result)
    show_account(console, account, out)
    return result


def nothing_tied(found: Explained) -> str:
    """Why there is nothing to plan for, in one line, and what else may be asked."""
    where = f"task.explained={found.folder}"
    more = "to look for what these measurements could not show, name it: task.suspects=[effect@target]"
    if found.task == "explain" and found.verdict != "effect":
        said = "nothing is missing" if found.verdict == "nothing_missing" else "nothing that was tried explains it"
        return f"{where}: its verdict is that {said}, so that nothing is tied; {more}"
    if found.by_name:
        names = listed(found.by_name)
        kinds = ",".join(dict.fromkeys(part.partition("@")[0] for name in found.by_name for part in name.split(" + ")))
        return (
            f"{where}: it is tied with {names}, of which it kept no values to plan with; explain keeps them: plan for a run "
            f"of task=explain on the same measurements (quick with task.only=[{kinds}] and the effect itself)"
        )
    return f"{where}: nothing is tied with {found.explanations[0][0]}: no further trial is needed to tell; {more}"


def harmful(robot: Robot, found: Plan) -> str:
    """Why none of the trials may be made, in one line, and what to do."""
    worst = listed(sorted({t.harm for t in found.trials}))
    return (
        f"{robot.name}: on each of {len(found.trials)} trials that were tried, with torques that nothing corrects, a joint "
        f"would come to harm ({worst}); allow less (task.amplitude, task.seconds, task.excursion), or record another "
        "motion with the robot's own controller in the loop"
    )


def motions(robot: Robot, options: Options, seed: int, every_s: float = 0.0) -> list[Excitation]:
    """The trials to choose from, of sensors that are read every ``every_s`` (0: in every row). Raises ConfigError where
    commands can drive nothing, a trial has too few readings, or within the limits nothing moves."""
    if not driven(robot):
        raise ConfigError(f"{robot.name}: it has no drive that obeys commands, so that no trial can be planned for it")
    step_s = every_s or robot.time_step_s
    rows = round(options.seconds / step_s)
    if rows < FEWEST_ROWS:
        what = f"readings, {1000 * step_s:.3g} ms apart," if every_s else "rows"
        raise ConfigError(
            f"task.seconds={options.seconds:g}: {rows} {what} of {robot.name}; at least {FEWEST_ROWS} are needed to compare"
        )
    found = family(robot, options.limits, options.kinds or PLANNED, options.fixtures, seed, options.draws)
    if not found:
        raise ConfigError(
            f"task.excursion={options.excursion:g}, task.speed={options.speed:g}: within these limits nothing moves; allow more"
        )
    return found


def rated(robot: Robot) -> list[str]:
    """A line for people on how fast the description lets commands change; none where it says nothing of it."""
    told = [
        f"{d.joint} {robot.joint(d.joint).top_speed:.3g} {unit}/s"
        for d in robot.drives
        if (unit := command_unit(robot, d))
        and d.command == "position"
        and math.isfinite(robot.joint(d.joint).top_speed)
    ]
    return [f"No command changes faster than the description lets its joint go: {', '.join(told)}."] if told else []


def noise_share(robot: Robot) -> float:
    """Noise of the sensors as task=trial takes it: the middle one of their shares of the channels' ranges."""
    return float(np.median([s.noise / channel_range(robot, s) for s in robot.sensors]))


def another_seed(files: Sequence[Path], own: int) -> int:
    """The first after the plan's ``own`` that made none of these trials, as far as that is recorded beside them: trials of one
    seed have the same noise, sample by sample, which explained together would count twice."""
    used = set()
    for file in files:
        with suppress(OSError, UntrustedError, KeyError, TypeError):
            used.add(json_of(text_of(file.parent / "summary.json", LARGEST_SUMMARY))["seed"])
    return next(seed for seed in count(own + 1) if seed not in used)


def robot_settings(robot: Robot, out: Path) -> list[str]:
    """How task=trial is told of the robot: by name, or by a description written into ``out``."""
    if robot.name in BUILT_IN and not differences(BUILT_IN[robot.name](), robot):
        return [setting("robot", robot.name)]
    write_whole(out / ROBOT, yaml.safe_dump(robot_to_dict(robot), sort_keys=False, default_flow_style=None, width=120))
    return [setting("robot.name", out / ROBOT)]


def typed(robot: Robot, e: Excitation) -> str:
    """An excitation as ``task.excitations`` takes it."""
    held = f",fixture={e.fixture}" if robot.free_base else ""
    return f"{e.kind}:seconds={e.seconds:g},amplitude={e.amplitude:g},seed={e.seed}{held}"


def as_csv(robot: Robot, e: Excitation) -> str:
    """Time and the command of every drive, a row a time step: ``time_s,knee_command_rad``. Passive joints have no column."""
    units = [command_unit(robot, d) for d in robot.drives]
    used = [k for k, unit in enumerate(units) if unit is not None]
    names = [f"{robot.drives[k].joint}_command ({units[k]})" for k in used]
    values = e.commands(robot)[:, used]
    times = np.arange(len(values)) * robot.time_step_s
    text = io.StringIO()
    text.write(",".join(["time_s", *names]) + "\n")
    np.savetxt(text, np.column_stack([times, values]), fmt="%.9g", delimiter=",")
    return text.getvalue()
