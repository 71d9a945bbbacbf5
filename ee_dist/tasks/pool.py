"""What a search is to try, as it was asked for on the command line."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, candidates
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import ConfigError


def check(robot: Robot, without: Sequence[str], only: Sequence[str]) -> None:
    """To be asked before workers are started. Raises EffectError for names that do not exist, and ConfigError where nothing
    is left to try."""
    for key, names in (("without", without), ("only", only)):
        for name in names:
            if name.endswith("@"):
                raise ConfigError(f"task.{key}=[{name}]: where? {name[:-1]} is everywhere it can act")
    if (without or only) and not candidates(robot, without, only or None):
        raise _nothing(robot, without, only)


def chosen(problem: Problem, without: Sequence[str], only: Sequence[str]) -> list[Candidate]:
    """Candidates at all places and groups, less those left out. Raises ConfigError where this way of comparing has none."""
    found = pool_of(problem, without, only)
    if (without or only) and not found:
        raise _unseen(problem, without, only)
    return found


def _asked(without: Sequence[str], only: Sequence[str]) -> str:
    return " and ".join(f"task.{k}=[{','.join(v)}]" for k, v in (("only", only), ("without", without)) if v)


def _nothing(robot: Robot, without: Sequence[str], only: Sequence[str]) -> ConfigError:
    return ConfigError(
        f"{_asked(without, only)}: nothing is left to try on {robot.name}; name an effect that can act on it"
    )


def _unseen(problem: Problem, without: Sequence[str], only: Sequence[str]) -> ConfigError:
    """What is left could act on the robot, and leaves no mark in what is compared."""
    families = {c.effect.family for c in candidates(problem.robot, without, only or None)}
    blind = families.isdisjoint(problem.families)
    why = "knows no faults of sensors or controllers" if blind else "sees nothing of it in these data"
    other = "; task.by=open_loop compares what sensors read on recorded commands" if blind else ""
    return ConfigError(f"{_asked(without, only)}: task.by={problem.way} {why}, so that nothing is left to try{other}")
