"""A user's own terms of the drive path: functions by name, so that a robot that carries one stays plain data."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from ee_dist.basics.quoted import quoted

Array = NDArray[np.float64]


class LawContext:
    """What a drive law sees at a step: arrays (R,) over the joints that carry it, whatever robots they belong to.

    ``position`` rad, ``speed`` rad/s, ``torque`` N.m so far at the joint (m, m/s, N for a slide), ``inertia`` that the
    joint has at least, ``values`` of the law by name, ``t_s``, ``time_step_s``; ``memory`` lasts for the rollout.
    """

    def __init__(self, values: dict[str, Array], time_step_s: float, inertia: Array | None = None) -> None:
        self.values = values
        self.time_step_s = time_step_s
        self.inertia: Array = np.ones(0) if inertia is None else inertia
        self.memory: dict[str, Array] = {}
        self.t_s = 0.0
        self.position: Array = np.zeros(0)
        self.speed: Array = np.zeros(0)
        self.torque: Array = np.zeros(0)


LawFunction = Callable[[LawContext], Array]

LAWS: dict[str, LawFunction] = {}
"""Drive laws by name: each returns the torque (R,) to add at its joints, or,"""
SPEED_LAWS: set[str] = set()
"""those of these names, the speed (R,) that the controller of its joints goes by, in place of the true one. Where the force of
a drive was measured, they have had their say."""


TEXTS: dict[str, str] = {}
"""Digest of a user's file by the name of the module that it became: its laws are what that text says."""


class LawError(KeyError):
    """A drive law that is not registered, or a name that is taken."""

    def __str__(self) -> str:
        return str(self.args[0])


def drive_law(name: str) -> Callable[[LawFunction], LawFunction]:
    """Register a drive law. Each entry of what it returns may depend on its own joint only. Raises LawError."""

    def register(function: LawFunction) -> LawFunction:
        if name in LAWS and LAWS[name].__module__ != function.__module__:
            raise LawError(f"a drive law named {quoted(name)} exists already")
        LAWS[name] = function
        return function

    return register


def speed_law(name: str) -> Callable[[LawFunction], LawFunction]:
    """Register a law of the speed that a controller knows. Raises LawError."""

    def register(function: LawFunction) -> LawFunction:
        found = drive_law(name)(function)
        # Only now: a name that is taken by a law of torques stays one.
        SPEED_LAWS.add(name)
        return found

    return register


def text_of_law(name: str) -> str:
    """Digest of the user's file that a drive law is from; empty for one of ours, which the version of the package tells."""
    return TEXTS.get(LAWS[name].__module__, "") if name in LAWS else ""


def find_law(name: str) -> LawFunction:
    """The drive law of that name. Raises LawError."""
    if name not in LAWS:
        raise LawError(f"no drive law named {quoted(name)}; there are: {', '.join(sorted(LAWS)) or 'none'}")
    return LAWS[name]
