"""What to record next: which trial would tell tied explanations apart best, predicted by simulating each of them on it.

A prediction is compared as the verdict will compare it: on the channels and scales of the open-loop way, weighed by the
noise and by the spread of equally good models. Explanations whose values are not settled could come nearer to one
another once they are fitted to the new trial too: what their values make up for, within what was measured already, is no
difference (designs that discriminate between models: Atkinson and Fedorov 1975; Buzzi-Ferraris and Forzatti 1983). And a
difference counts as far as a bootstrap over windows of time would hold it to be more than chance. Where sensors were read
more seldom than the model steps, the trial to come is read as seldom: ``every_s`` everywhere here is the time between
readings, s, and 0 where there is one in every row.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from ee_dist.discrepancy.evidence.holdout import bootstrap
from ee_dist.discrepancy.measured_trial import MeasuredTrial, driver_of, read_every, setup_of
from ee_dist.discrepancy.search.search import Progress, quiet
from ee_dist.discrepancy.ways.open_loop.prediction import clean
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.discrepancy.ways.open_loop.weights import soften
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.evaluation.jobs import Evaluator, Job, Whole
from ee_dist.robots.model import Robot
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import Array, SensorLog

LIBRARY = (
    Excitation("rest", 2.0),
    Excitation("sway", 6.0, 0.1, 10),
    Excitation("multisine", 3.0, 0.3, 11),
    Excitation("multisine", 4.0, 1.0, 12, "stand"),
    Excitation("fast_sines", 1.8, 0.15, 13),
    Excitation("fast_sines", 3.0, 0.4, 14, "stand"),
    Excitation("steps", 1.8, 0.25, 15),
    Excitation("steps", 4.0, 0.6, 16, "stand"),
    Excitation("slow_sines", 9.6, 1.0, 17, "stand"),
    Excitation("gait", 1.8, 0.5, 18),
)


ENOUGH = 4.0
"""Standard deviations from which a trial is expected to tell two explanations apart."""
SHORTEST = 60
"""Readings of a trial that can be compared: a window of the open-loop way."""
TOGETHER = 400_000
"""Robot-steps that are simulated between two words on the progress."""
UNHELD = ("torque", "speed")
"""Commands under which nothing keeps a joint where it may be."""
AT_STOP = 0.01
"""Share of a joint's range from its end at which it is at its stop."""
FARTHEST = 0.5
"""How far, as a share of its range, a value may move to make up for a difference: slopes hold no farther."""


@dataclass(frozen=True, eq=False)
class Contender:
    """An explanation: ``hypothesis`` is all that the model then has. ``nearby``: the same with one of its P free values moved
    by ``step`` each (P,) shares of its range; ``known`` (P, P): what measurements say of these values, as the Hessian of
    half their squared error."""

    hypothesis: Hypothesis
    nearby: tuple[Hypothesis, ...] = ()
    step: tuple[float, ...] = ()
    known: Array | None = None


@dataclass(frozen=True)
class PlannedTrial:
    """``separations``: predicted distance of each pair of explanations on this trial, in the order of ``combinations``, in
    standard deviations of what the model cannot know; ``separation``: that of the pair that decides (see ``ranked``), the
    two most similar. Below ENOUGH the trial would not tell them apart. ``harm``: what would happen to the robot on it, that
    nobody wants; such a trial tells nothing."""

    excitation: Excitation
    separation: float
    separations: tuple[float, ...] = ()
    harm: str = ""


def next_trials(
    robot: Robot,
    tied: Sequence[Hypothesis],
    evaluator: Evaluator,
    library: Sequence[Excitation] = LIBRARY,
    every_s: float = 0.0,
) -> list[PlannedTrial]:
    """Excitations that tell apart what any of them can, the best for their length first: twins that no motion separates decide
    nothing, and a short trial that does not separate the others is no better than a longer one that does."""
    if len(tied) < 2:
        return []
    # A network in the loop reads its sensors in every row, and cannot be followed from fewer readings.
    some = [e for e in library if not every_s or e.weights(robot) is None]
    found = predicted(robot, [Contender(h) for h in tied], some, evaluator, every_s=every_s)
    return sorted(
        ranked(len(tied), found).trials,
        key=lambda p: (p.separation < ENOUGH, -p.separation / np.sqrt(p.excitation.seconds)),
    )


def predicted(
    robot: Robot,
    contenders: Sequence[Contender],
    excitations: Sequence[Excitation],
    evaluator: Evaluator,
    left: float = 1.0,
    windows: int = 0,
    progress: Progress = quiet,
    every_s: float = 0.0,
) -> list[PlannedTrial]:
    """How far apart the contenders, the best first, are on each excitation, in the order given.

    ``left``: mean square of what the best leaves of the measurements, in units of noise, from 1: with it, differences count
    for less. ``windows``: how many windows were measured already, in which the contenders say the same.
    """
    out: list[PlannedTrial] = []
    models = 8 + sum(1 + len(c.nearby) for c in contenders)
    size = max(1, int(TOGETHER // (models * max((e.steps(robot) for e in excitations), default=1))))
    for k in range(0, len(excitations), size):
        some = excitations[k : k + size]
        out += _predicted(robot, contenders, some, evaluator, left, windows, every_s)
        progress("trying motions", min(1.0, (k + size) / len(excitations)))
    return out


def _predicted(
    robot: Robot,
    contenders: Sequence[Contender],
    excitations: Sequence[Excitation],
    evaluator: Evaluator,
    left: float,
    windows: int,
    every_s: float,
) -> list[PlannedTrial]:
    best = contenders[0].hypothesis
    ahead, logs = _ahead(robot, best, excitations, evaluator, every_s)
    none = tuple(0.0 for _ in combinations(contenders, 2))
    out = [PlannedTrial(e, 0.0, none, harm(robot, log)) for e, log in zip(excitations, logs, strict=True)]
    usable = [k for k, t in enumerate(ahead) if t.log.finite and len(t.log.readings) >= SHORTEST and not out[k].harm]
    if not usable:
        return out
    problem = OpenLoop([ahead[k] for k in usable], robot, evaluator, before=best)
    asked = [h for c in contenders for h in (c.hypothesis, *c.nearby)]
    with np.errstate(over="ignore", invalid="ignore"):
        rows = np.stack([problem.smooth(r) for r in problem.residuals(asked)])
    for place, k in enumerate(usable):
        part = problem.slices[place]
        segment = problem.segment_of[part] - int(problem.segment_of[part].min())
        gaps = [
            _apart(a, b, segment, left, windows) for a, b in combinations(_with_slopes(contenders, rows[:, part]), 2)
        ]
        out[k] = PlannedTrial(excitations[k], min(gaps, default=0.0), tuple(gaps))
    return out


def ahead_of(
    robot: Robot,
    best: Hypothesis,
    excitations: Sequence[Excitation],
    evaluator: Evaluator,
    every_s: float = 0.0,
) -> list[MeasuredTrial]:
    """Trials that were not made yet, as one explanation predicts them."""
    return _ahead(robot, best, excitations, evaluator, every_s)[0]


def _ahead(
    robot: Robot, best: Hypothesis, excitations: Sequence[Excitation], evaluator: Evaluator, every_s: float
) -> tuple[list[MeasuredTrial], list[SensorLog]]:
    """These, and what happens in every step of them."""
    model, unheld = apply(robot, best), any(d.command in UNHELD for d in robot.drives)
    jobs, drivers = [], []
    for e in excitations:
        held, driver = apply(model, setup_of(e)), driver_of(e, robot)
        drivers.append(driver)
        # Sensors act on a network in their loop, and on planned commands not at all.
        jobs.append(
            Job(
                Rollout(clean(held) if isinstance(driver, Commands) else held, driver, e.steps(robot), 0, pose=unheld),
                Whole(),
            )
        )
    logs = evaluator.evaluate(jobs)
    # Where joints are is for the robot's safety: of what was measured nobody knows it.
    trials = [
        MeasuredTrial(
            str(e), replace(read_every(log, every_s), joints=None, torques=None, base_pose=None), driver, setup_of(e)
        )
        for e, log, driver in zip(excitations, logs, drivers, strict=True)
    ]
    return trials, logs


def harm(robot: Robot, log: SensorLog) -> str:
    """Where a trial drives a joint into its stop, or faster than it may go; nothing where it does not. Torques and speeds that
    are commanded hold nothing: an arm falls, and nobody's controller is in between. Positions are kept by the robot's own."""
    if log.joints is None or not log.finite:
        return ""
    for k, d in enumerate(robot.drives):
        if d.command not in UNHELD:
            continue
        joint, at = robot.joint(d.joint), log.joints[:, k]
        room = AT_STOP * (joint.upper - joint.lower)
        # Where it begins at a stop nothing drives it there.
        above, below = joint.upper - room, joint.lower + room
        if np.isfinite(room) and (np.nanmax(at) > above >= at[0] or np.nanmin(at) < below <= at[0]):
            return f"{d.joint} meets its stop"
        if np.nanmax(np.abs(np.diff(at))) > joint.top_speed * robot.time_step_s:
            return f"{d.joint} goes faster than {joint.top_speed:.3g} {'m' if joint.kind == 'slide' else 'rad'}/s"
    return ""


Sloped = tuple[Array, Array, Array]
"""What an explanation predicts of a trial (n,), the slopes of that (n, P), and what is known of the values (P, P)."""


def _with_slopes(contenders: Sequence[Contender], rows: Array) -> list[Sloped]:
    out, at = [], 0
    for c in contenders:
        here, near = rows[at], rows[at + 1 : at + 1 + len(c.nearby)]
        at += 1 + len(c.nearby)
        columns = [
            (r - here) / h if np.isfinite(r).all() else np.zeros_like(here) for r, h in zip(near, c.step, strict=True)
        ]
        slopes = np.stack(columns, axis=1) if columns else np.zeros((len(here), 0))
        out.append((here, slopes, np.zeros((0, 0)) if c.known is None else c.known))
    return out


def _apart(one: Sloped, other: Sloped, segment: Array, left: float, windows: int) -> float:
    """Standard deviations between two explanations once the values of both have come as near as measurements let them."""
    gap = one[0] - other[0]
    if not np.isfinite(gap).all():
        return 0.0
    slopes = np.concatenate([one[1], -other[1]], axis=1)
    p, q = one[1].shape[1], other[1].shape[1]
    if p + q:
        held = np.zeros((p + q, p + q))
        held[:p, :p], held[p:, p:] = one[2], other[2]
        normal = slopes.T @ slopes + held
        normal += 1e-9 * max(float(np.trace(normal)), 1e-9) * np.eye(p + q)
        gap = gap + slopes @ np.clip(np.linalg.solve(normal, -slopes.T @ gap), -FARTHEST, FARTHEST)
    energies = np.bincount(segment, weights=soften(gap) ** 2)
    low, _ = bootstrap(np.concatenate([energies, np.zeros(windows)]), seed=1)
    return float(np.sqrt(max(low, 0.0) / max(left, 1.0)))


@dataclass(frozen=True)
class Plan:
    """``trials``: the best first. ``alike``: pairs of explanations (by number) that none of them tells apart. ``enough``: whether
    the first tells all others apart; ``closest``: the pair that is most similar on it, of those that decide."""

    trials: tuple[PlannedTrial, ...]
    alike: tuple[tuple[int, int], ...]
    enough: bool
    closest: tuple[int, int]

    @property
    def best(self) -> PlannedTrial:
        return self.trials[0]

    @property
    def all_told(self) -> bool:
        """Whether the first tells every pair apart, so that nothing is open once it was made."""
        return self.enough and not self.alike


def ranked(count: int, trials: Sequence[PlannedTrial]) -> Plan:
    """Trials of ``count`` explanations by the separation of the two most similar ones, among the pairs that any of the trials
    can tell apart: twins that no motion separates decide nothing. Where there are only twins, by theirs."""
    pairs = list(combinations(range(count), 2))
    reach = np.max([t.separations for t in trials], axis=0)
    told = np.flatnonzero(reach >= ENOUGH)
    deciding = told if len(told) else np.arange(len(pairs))
    scored = [replace(t, separation=float(np.min(np.array(t.separations)[deciding]))) for t in trials]
    # Of trials that separate as well the gentler one.
    ordered = sorted(scored, key=lambda t: (bool(t.harm), -round(t.separation, 6), t.excitation.amplitude))
    alike = tuple(p for k, p in enumerate(pairs) if reach[k] < ENOUGH)
    closest = pairs[min(deciding, key=lambda k: ordered[0].separations[k])]
    return Plan(tuple(ordered), alike, bool(len(told)) and ordered[0].separation >= ENOUGH, closest)


@dataclass(frozen=True, eq=False)
class Parting:
    """Where two explanations part most on a trial: ``channel`` (by number), ``from_s`` to ``to_s``, and what every
    explanation predicts there: ``curves`` (contenders, T) at ``times_s`` (T,)."""

    channel: int
    from_s: float
    to_s: float
    times_s: Array
    curves: Array


def parting(
    robot: Robot,
    explanations: Sequence[Hypothesis],
    pair: tuple[int, int],
    excitation: Excitation,
    evaluator: Evaluator,
    every_s: float = 0.0,
) -> Parting:
    """Where ``pair`` of the explanations part most on a trial."""
    ahead = ahead_of(robot, explanations[0], [excitation], evaluator, every_s)
    problem = OpenLoop(ahead, robot, evaluator, before=explanations[0])
    one, other = (problem.smooth(problem.residuals([explanations[k]])[0]) for k in pair)
    width, layout = len(problem.channels), problem.layout
    readings = np.where(layout.reading & (layout.channel_of < len(robot.sensors)), (one - other) ** 2, 0.0)
    cell = np.bincount(layout.segment_of * width + layout.channel_of, weights=readings)
    segment, channel = divmod(int(np.argmax(cell)), width)
    mine = (layout.segment_of == segment) & layout.reading
    series = [next(s for s in problem.series(h) if s.channel == channel) for h in explanations]
    half = problem.block * (every_s or robot.time_step_s) / 2
    return Parting(
        channel,
        float(layout.time_s[mine].min()) - half,
        float(layout.time_s[mine].max()) + half,
        series[0].times_s,
        np.stack([s.predicted for s in series]),
    )
