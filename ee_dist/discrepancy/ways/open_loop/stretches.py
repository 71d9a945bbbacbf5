"""Stretches of long records, which a search simulates in place of the whole.

A search simulates a robot ten thousand times. Of minutes of a motion that is led by positions some stretches tell as much as all
of it: a joint that a controller leads forgets within moments where it was. So a stretch begins with its joints where they were
measured, and is compared once they have come to where the model takes them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from ee_dist.discrepancy.measured_trial import Begun, MeasuredTrial, reading_s, released
from ee_dist.discrepancy.past import Past
from ee_dist.discrepancy.starting import starting_speeds
from ee_dist.discrepancy.thinning import one_of_each, place
from ee_dist.effects.scales import longest_delay
from ee_dist.engines.drivers import Commands, Network
from ee_dist.robots.model import Robot
from ee_dist.trials.log import State

STRETCH_S, SETTLED_S = 4.0, 0.5
"""How much of a record is compared in one go, and how much before is simulated alone, for joints to come to where they go."""
MOVING, SPARED = 0.1, 0.3
"""Share of the highest speed in a trial from which it begins in motion, and what of it may be left out for that at most."""
STOOD, STOOD_S = 3, 0.05
"""Readings, and the time, that a robot which begins at rest stands for at least."""
MOST, FEWEST = 36_000, 15
"""Steps of a simulation, times joints, that a search takes for each model at most: three trials of 20 s of six joints in steps of
10 ms; but so many stretches, and one of each trial."""


@dataclass(frozen=True, eq=False)
class Stretch:
    """A part of the trial of that number."""

    trial: int
    run: MeasuredTrial


def in_one_go(robot: Robot, trials: Sequence[MeasuredTrial]) -> tuple[Stretch, ...]:
    """Each trial in one go, compared from where it has settled on."""
    if not forgets(robot, trials):
        return tuple(Stretch(k, t) for k, t in enumerate(trials))
    return tuple(Stretch(k, _from(t, unsettled(t, robot))) for k, t in enumerate(trials))


def unsettled(trial: MeasuredTrial, robot: Robot) -> int:
    """How many first rows of a real trial say more of what came before it than of the robot: where it begins in motion, nobody
    knows what its controllers were told until then. None where it stood, nor where they would be much of it."""
    log = trial.log
    if not trial.real or len(log) < 2:
        return 0
    speeds = np.abs(starting_speeds(trial, robot))
    if _stood(trial) or not speeds[0].max() > MOVING * speeds.max():
        return 0
    rows = int(np.searchsorted(log.times_s, log.times_s[0] + SETTLED_S))
    return rows if rows < SPARED * len(log) else 0


def _from(trial: MeasuredTrial, rows: int) -> MeasuredTrial:
    """The trial, of which so many first rows are simulated and not compared."""
    if not rows:
        return trial
    filled = np.zeros(len(trial.log), dtype=bool) if trial.log.filled is None else trial.log.filled.copy()
    filled[:rows] = True
    return replace(trial, log=replace(trial.log, filled=filled))


def forgets(robot: Robot, trials: Sequence[MeasuredTrial]) -> bool:
    """Whether it hardly matters to the robot in these trials where its joints were a moment ago: controllers without an integral
    lead all of them by positions that were recorded, and its base stays."""
    led = bool(robot.drives) and all(d.command == "position" and d.kp > 0 and not d.ki for d in robot.drives)
    known = all(t.log.joints is not None and not isinstance(t.driver, Network) and t.begun is None for t in trials)
    return led and known and not robot.free_base


def _stood(trial: MeasuredTrial) -> bool:
    """Whether the first readings are one number at each joint: an encoder with coarse steps makes a speed of what comes next."""
    log = trial.log
    assert log.joints is not None
    count = max(STOOD, int(np.searchsorted(log.times_s[log.readings], log.times_s[0] + STOOD_S)))
    first = log.joints[log.readings[:count]]
    return len(first) == count and not np.ptp(first, axis=0).any()


def stretches(
    robot: Robot, trials: Sequence[MeasuredTrial], window: int, seconds: float = STRETCH_S
) -> tuple[Stretch, ...]:
    """Of trials of a robot that ``forgets``, one after another, of about so many seconds: whole windows of so many readings."""
    spacing = reading_s(trials) or robot.time_step_s
    count = window * max(1, round(seconds / (window * spacing)))
    return tuple(s for k, t in enumerate(trials) for s in _of_trial(k, t, robot, count))


def _of_trial(number: int, trial: MeasuredTrial, robot: Robot, count: int) -> list[Stretch]:
    trial = _from(trial, unsettled(trial, robot))
    log, step = trial.log, robot.time_step_s
    if len(log.readings) < count:
        return [Stretch(number, trial)]
    assert log.joints is not None
    speeds, read = starting_speeds(trial, robot), log.readings
    commands, enabled = released(trial.obeyed(log.commands, robot))
    run_up = math.ceil((SETTLED_S + longest_delay(robot)) / step)
    found = []
    for first in _firsts(number, len(read), count):
        begin, last = int(max(0, read[first] - run_up)), int(read[first + count - 1]) + 1
        part = log.part(begin, last)
        filled = np.zeros(len(part), dtype=bool) if part.filled is None else part.filled.copy()
        filled[: read[first] - begin] = True
        begun = None
        if begin:
            past = Past(commands, enabled, log.joints, step, begin)
            begun = Begun(State(log.joints[begin].copy(), speeds[begin].copy()), past)
        driver = Commands(trial.driver.values[begin:last]) if isinstance(trial.driver, Commands) else trial.driver
        run = replace(trial, log=replace(part, filled=filled), driver=driver, begun=begun)
        found.append(Stretch(number, run))
    return found


def _firsts(number: int, rows: int, count: int) -> list[int]:
    """The first rows of as many stretches of ``count`` rows as a trial of so many has. What is left over lies between them, and
    before or behind one that is alone: the end of a motion is as good as its beginning."""
    some, over = rows // count, rows % count
    before = np.linspace(0, over, some) if some > 1 else np.array([place(number) * over])
    return [k * count + int(b) for k, b in enumerate(before)]


def too_long(robot: Robot, trials: Sequence[MeasuredTrial]) -> bool:
    """Whether a search would take too long on all of them."""
    return len(robot.drives) * sum(len(t.log) for t in trials) > MOST


def enough(robot: Robot, of: Sequence[Stretch]) -> int:
    """How many stretches of a trial a search takes: of short trials all."""
    counts = np.bincount([s.trial for s in of])
    steps = max(len(s.run.log) for s in of)
    total = max(MOST // (steps * len(robot.drives)), FEWEST)
    return next((n for n in range(int(counts.max()), 1, -1) if int(np.minimum(counts, n).sum()) <= total), 1)


def at_most(of: Sequence[Stretch], count: int) -> tuple[Stretch, ...]:
    """So many of each trial, spread over all of it."""
    found: list[Stretch] = []
    for number in dict.fromkeys(s.trial for s in of):
        own = [s for s in of if s.trial == number]
        edges = np.round(np.linspace(0, len(own), min(count, len(own)) + 1)).astype(int)
        found += one_of_each((own[a:b] for a, b in pairwise(edges.tolist())), len(found))
    return tuple(found)
