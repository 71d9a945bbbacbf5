"""Which kinds of systems the loop knows. Another kind is one more line here, an engine, and effects of its own."""

from __future__ import annotations

from functools import singledispatch

from ee_dist.networks.model import GeneNetwork
from ee_dist.recovery.expression import expressing
from ee_dist.recovery.subject import Subject
from ee_dist.recovery.walking import WALKING
from ee_dist.robots.model import Robot
from ee_dist.robots.system import System


@singledispatch
def subject_of(system: System) -> Subject:
    """What the loop must be told of this kind of system. Raises TypeError for an unknown kind."""
    raise TypeError(f"no subject for a {type(system).__name__}")


@subject_of.register
def _(system: Robot) -> Subject:
    return WALKING


@subject_of.register
def _(system: GeneNetwork) -> Subject:
    return expressing(system)
