"""Trials that a robot may make within limits: every kind of planned excitation, at several sizes, each from several seeds."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import command_span
from ee_dist.trials.excitation import FIXTURES, KINDS, Excitation
from ee_dist.trials.log import Array

PLANNED = tuple(k for k in KINDS if k != "gait")
"""Kinds whose commands are known beforehand: those of a gait come out of a network's loop."""
SIZES = (1.0, 0.5, 0.25)
"""Shares of the largest amplitude that is allowed."""
LEAST = 0.001
"""Share of half a range below which nothing moves to speak of."""


@dataclass(frozen=True)
class Limits:
    """What no trial may go beyond. ``amplitude``: share of half of each joint's range; ``excursion``: how far a command goes
    from the middle, and ``speed``: how fast it changes, in its own unit (rad, m, N.m) and that in a second. Positions are
    commanded no faster than a joint's data sheet says either (``Joint.top_speed``)."""

    seconds: float = 6.0
    amplitude: float = 0.5
    excursion: float = math.inf
    speed: float = math.inf


def driven(robot: Robot) -> bool:
    """Whether there is anything that commands can move."""
    return any(command_span(robot, d) != (0.0, 0.0) for d in robot.drives)


def family(
    robot: Robot,
    limits: Limits,
    kinds: Sequence[str] = PLANNED,
    fixtures: Sequence[str] = FIXTURES,
    seed: int = 0,
    draws: int = 2,
) -> list[Excitation]:
    """Excitations of some kinds within the limits, ``draws`` of each size; the same for the same ``seed``. On fixed bases there
    is one fixture. Raises ExcitationError for limits that no trial may have."""
    found: list[Excitation] = []
    for fixture in fixtures if robot.free_base else FIXTURES[:1]:
        for kind in kinds:
            if kind == "rest":
                still = Excitation(kind, limits.seconds, limits.amplitude, 0, fixture)
                # To come to rest in the middle may be too fast a way for a robot that stands elsewhere.
                if _keeps(robot, still, limits):
                    found.append(still)
                continue
            for k in range(draws):
                wanted = Excitation(kind, limits.seconds, limits.amplitude, seed * draws + k, fixture)
                most = largest(robot, wanted, limits)
                sizes = [_short(share * most) for share in SIZES]
                found += [replace(wanted, amplitude=a) for a in sizes if a >= LEAST]
    return list(dict.fromkeys(found))


def largest(robot: Robot, wanted: Excitation, limits: Limits) -> float:
    """The largest amplitude, up to that of ``wanted``, at which an excitation keeps to the limits."""
    half = max((high - low) / 2 for low, high in (command_span(robot, d) for d in robot.drives))
    most = min(wanted.amplitude, limits.excursion / half if half else math.inf)
    paces = allowed(robot, limits)
    if most < LEAST or not np.isfinite(paces).any():
        return most
    beyond = float(np.max(fastest(robot, replace(wanted, amplitude=most)) / paces))
    most = _short(most / max(beyond, 1.0))
    # The way from where it stands to the middle may be too fast by itself.
    kept = most >= LEAST and _keeps(robot, replace(wanted, amplitude=most), limits)
    return most if kept else 0.0


def _keeps(robot: Robot, excitation: Excitation, limits: Limits) -> bool:
    return bool((fastest(robot, excitation) <= allowed(robot, limits) * (1 + 1e-9)).all())


def allowed(robot: Robot, limits: Limits) -> Array:
    """(M,) how fast the command of each drive may change, in its unit per second."""
    own = [robot.joint(d.joint).top_speed if d.command == "position" else math.inf for d in robot.drives]
    return np.minimum(np.array(own), limits.speed)


def fastest(robot: Robot, excitation: Excitation) -> Array:
    """(M,) the fastest change of each drive's command from row to row, in its unit per second."""
    return np.asarray(np.abs(np.diff(excitation.commands(robot), axis=0)).max(axis=0) / robot.time_step_s)


def _short(amplitude: float) -> float:
    """With the digits that a command line shows, never more than it was."""
    return math.floor(amplitude * 1e4 + 1e-9) / 1e4
