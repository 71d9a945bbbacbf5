"""What many robots of a batch share is found once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TypeVar

from ee_dist.robots.system import System

Fact = TypeVar("Fact")
Model = TypeVar("Model", bound=System)


def per_robot(robots: Sequence[Model], fact: Callable[[Model], Fact]) -> list[Fact]:
    """``fact`` of every robot, asked once of each: most batches are many controllers of one robot."""
    known: dict[int, Fact] = {}
    for robot in robots:
        if id(robot) not in known:
            known[id(robot)] = fact(robot)
    return [known[id(robot)] for robot in robots]
