"""The same words for the same things in terminal, page and scene."""

from __future__ import annotations

from typing import TypeVar

from ee_dist.discrepancy.accounts.of_compare import CLOSE
from ee_dist.discrepancy.compare import Comparison, RegimeReport
from ee_dist.discrepancy.ladder import UNFITTED, Improvement, Rung
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.words import percent, phrase, placed
from ee_dist.trials.log import Array

MODEL = "model"
"""The model as it was given."""
IMPROVED = "improved model"
"""The model with what was found."""

_FACTORS = {"1": (100.0, "%"), "rad": (1e3, "mrad"), "m": (1e3, "mm")}
Value = TypeVar("Value", float, Array)


def unit_of(problem: Problem) -> str:
    """The unit in which errors of this way are drawn, which is that in which they are told."""
    return _FACTORS.get(problem.natural_unit, (1.0, problem.natural_unit))[1]


def drawn(problem: Problem, error: Value) -> Value:
    """An error, or many, in ``unit_of``."""
    factor = _FACTORS.get(problem.natural_unit, (1.0, ""))[0]
    return factor * problem.natural(error)  # type: ignore[return-value, arg-type]


def axis_of(problem: Problem) -> str:
    """What stands at an axis of errors."""
    return f"{problem.natural_name} ({unit_of(problem)})"


def step_name(r: Rung) -> str:
    """A step of the ladder: what was added, or, of the first, the model itself."""
    return placed(r.name) if r.added or r.held_out != UNFITTED else f"the {MODEL}"


def step_tick(r: Rung) -> str:
    """The same at an axis, where a dozen effects at once would lie over the names beside them."""
    first, *more = r.name.split(" + ")
    return step_name(r) if len(more) < 2 else f"{placed(first)} and {len(more)} more"


def refused_heading(problem: Problem, found: Improvement) -> str:
    """What was refused was tried on the model of then, which other steps may have followed."""
    last = problem.told(found.ladder[-1].error_heldout)
    on_top = all(problem.told(c.error_without) == last for c in found.refused[:1])
    return f"Tried {'on top of' if on_top else 'on the way to'} it, and refused"


def step_phrase(r: Rung, problem: Problem) -> str:
    """The same with the values of what was added, and with what went for it."""
    gone = f"; without {', '.join(map(placed, r.dropped))}" if r.added and r.dropped else ""
    return (phrase(r.added, problem.robot) or step_name(r)) + gone


def excess_share(found: Comparison, r: RegimeReport) -> str:
    """The share of what is above the noise that falls in a regime; a dash where next to nothing is above it."""
    return percent(r.share) if found.error > CLOSE * found.noise_floor else "-"
