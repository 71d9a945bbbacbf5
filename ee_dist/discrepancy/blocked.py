"""Joints that something in their way held: a gripper that closes on a cube, a door that is ajar.

Friction leaves a joint where it comes to rest, a soft controller lets it sag, and an encoder shows it a step beside where it is:
so nothing held a joint that only sways with the others, nor one that was led through no more than it stays behind.

No effect of the catalogue is of a thing that is there at one time and not at another. What is asked of such a joint and not
done goes into play, springs and zeros at it, which tell nothing of the joint.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from ee_dist.basics.names import counted, listed
from ee_dist.basics.runs import runs
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.measurements.signals import HARDLY, usual
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

STILL_S, LAGS = 0.5, 3.0
"""How long a joint stands, at least, to be held, and for how many lags: where a slow one turns back it is still for about two."""
STILL, FAR = 0.01, 0.1
"""Shares of what a joint moved in all: within which it stands, and from which it is far from what it is asked for."""
USUAL = 4.0
"""Times as far as it stands from its command at other times, in the middle."""
ONE_PLACE, BEYOND = 0.25, 0.5
"""Shares of how far it is from its command: within which it stands each time, and by which it stood further at another, as near
to its command as usual."""
TWICE = 2
"""Times from which that is no accident."""


@dataclass(frozen=True)
class Stand:
    """A time in which a joint stood ``at`` a place while it was asked ``further``, by so much."""

    trial: int
    at: float
    further: float


def blocked(trials: Sequence[MeasuredTrial], robot: Robot) -> list[str]:
    """A line for people for each joint that stood at one place while asked for more, and beyond it at other times."""
    lines = []
    led: dict[int, tuple[int, list[MeasuredTrial]]] = {}
    for k, drive in enumerate(robot.drives):
        columns = [i for i, s in enumerate(robot.sensors) if s.kind == "position" and s.target == drive.joint]
        own = [t for t in trials if t.real and t.recorded(robot)[columns[0]]] if columns else []
        if drive.command == "position" and own:
            led[k] = columns[0], own
    for k in _moved(robot, led):
        drive, (column, own) = robot.drives[k], led[k]
        least_s = max(STILL_S, LAGS * robot.joint(drive.joint).lag_s)
        stands = _held([t.log.sensors[:, column] for t in own], [t.log.commands[:, k] for t in own], own, least_s)
        if stands:
            unit = "rad" if robot.joint(drive.joint).kind == "hinge" else "m"
            names = listed(dict.fromkeys(own[s.trial].name for s in stands))
            at, further = (float(np.median([getattr(s, n) for s in stands])) for n in ("at", "further"))
            lines.append(
                f"{drive.joint} stood at {at:.3g} {unit} {counted(len(stands), 'time')} ({names}) while it was asked to go "
                f"{abs(further):.2g} {unit} further, and stood beyond that place at others: was something in its way? No effect "
                "says so: what is found at it may stand in for that."
            )
    return lines


def _moved(robot: Robot, led: Mapping[int, tuple[int, Sequence[MeasuredTrial]]]) -> list[int]:
    """The drives (of ``led``: the column of its position and the trials that have it) whose joints do more than sway with others
    of their kind."""
    spans = {k: float(np.ptp(np.concatenate([t.log.sensors[:, c] for t in own]))) for k, (c, own) in led.items()}
    kinds = {k: robot.joint(robot.drives[k].joint).kind for k in led}
    least = {
        kind: HARDLY * usual(np.array([s for k, s in spans.items() if kinds[k] == kind])) for kind in kinds.values()
    }
    return [k for k, span in spans.items() if span > 0 and span >= least[kinds[k]]]


def _held(read: Sequence[Array], told: Sequence[Array], trials: Sequence[MeasuredTrial], least_s: float) -> list[Stand]:
    """Times of ``least_s`` and more in which something held a joint, by what it read and was told (T,) in each trial; none where
    there were too few, they are at several places, or it never stood beyond."""
    moved, commands = float(np.ptp(np.concatenate(read))), np.concatenate(told)
    asked = float(np.ptp(commands[np.isfinite(commands)])) if np.isfinite(commands).any() else 0.0
    far: list[Stand] = []
    near: list[Stand] = []
    for number, (q, c, trial) in enumerate(zip(read, told, trials, strict=True)):
        width = max(2, round(least_s / float(np.median(np.diff(trial.log.times_s)))))
        for rows in _stands(q, width, STILL * moved):
            gap = float(np.median(c[rows] - q[rows]))
            (far if abs(gap) > FAR * moved else near).append(Stand(number, float(np.median(q[rows])), gap))
    elsewhere = float(np.median([abs(s.further) for s in near])) if near else 0.0
    found = []
    for side in (-1.0, 1.0):
        mine = [s for s in far if side * s.further > 0]
        if len(mine) < TWICE or not near:
            continue
        least = float(np.median([abs(s.further) for s in mine]))
        at = np.array([s.at for s in mine])
        reached = max(side * s.at for s in near)
        if USUAL * elsewhere < least < asked and np.ptp(at) < ONE_PLACE * least:
            found += mine if reached > float((side * at).max()) + BEYOND * least else []
    return found


def _stands(q: Array, width: int, within: float) -> list[slice]:
    """Rows of each time in which a joint stands, in the order of time: within so much for ``width`` rows."""
    if len(q) < width:
        return []
    # A window that is still makes all of its rows still.
    spread = maximum_filter1d(q, width) - minimum_filter1d(q, width)
    still = maximum_filter1d((spread <= within).astype(np.int8), width) > 0
    return [slice(first, last) for first, last in runs(still)]
