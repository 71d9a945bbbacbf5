"""Steps of a ladder that made the trials held out from all of it worse, though the search took them for better.

An effect may suit the fitted motions alone, and one joint be fitted to what is no property of the robot.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from ee_dist.discrepancy.ladder import Rung
from ee_dist.discrepancy.last_word import TRIALS_APART, WORSE, LastWord
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.steps_apart import StepApart
from ee_dist.discrepancy.uneven import SURE
from ee_dist.discrepancy.words import placed, plain
from ee_dist.trials.log import Array

MUCH, MOST_OF_IT = 1.5, 0.5
"""Times its error by which a channel got much worse, and its share of all that channels got worse by, to be named."""


FARTHER = 1.1
"""Times the least error of a step from which it is told that the model ends farther off."""


@dataclass(frozen=True)
class WorseStep:
    """The step ``number`` of the ladder, which took the error on these trials from ``before`` to ``after`` (not ``overall``: made
    one channel alone worse); ``channel``: the one that most of it is at and that got much worse, if one is, with its errors
    ``at`` then, in its ``unit``."""

    number: int
    before: float
    after: float
    overall: bool
    channel: str = ""
    at: tuple[float, float] = (0.0, 0.0)
    unit: str = ""


def worse_steps(problem: Problem, steps: Sequence[StepApart]) -> list[WorseStep]:
    """Steps that made the trials of ``problem`` worse by more than chance, and what no later step brought back; or one channel
    of them much worse, by as much as alone would make all of them worse."""
    out: list[WorseStep] = []
    for k, (a, b) in enumerate(pairwise(steps), start=1):
        if not np.isfinite(a.error):
            continue
        worst = _much_worse(a, b, steps[-1])
        overall = b.error > WORSE * a.error and steps[-1].error > a.error and _surely((b.energy - a.energy).sum(axis=1))
        if overall and worst is None:
            out.append(WorseStep(k, a.error, b.error, True))
        elif worst is not None:
            at, unit = (float(a.off[worst]), float(b.off[worst])), problem.layout.units[worst]
            out.append(WorseStep(k, a.error, b.error, overall, problem.channels[worst], at, unit))
    return out


def nearest_step(steps: Sequence[StepApart]) -> int | None:
    """The number of the step after which least was left of these trials, where clearly more is left in the end: several steps,
    none of which made them worse by more than chance, may do so together. None where the first or the last is the nearest."""
    k = int(np.argmin([s.error for s in steps]))
    return k if 0 < k < len(steps) - 1 and steps[-1].error > FARTHER * steps[k].error else None


def _much_worse(a: StepApart, b: StepApart, last: StepApart) -> int | None:
    """The channel at which most of what got worse is, and that got much worse for good; None where no single one did."""
    if not np.isfinite(b.error):
        return None
    more = (b.energy - a.energy).sum(axis=0)
    worst = int(np.argmax(more))
    enough = more[worst] > max(MOST_OF_IT * np.maximum(more, 0.0).sum(), (WORSE**2 - 1.0) * a.energy.sum())
    stays = b.off[worst] > MUCH * a.off[worst] and last.off[worst] > MUCH * a.off[worst]
    return worst if enough and stays and _surely((b.energy - a.energy)[:, worst]) else None


def _surely(more: Array) -> bool:
    """Whether energies (segments,) got larger by more than they scatter from one segment to the next."""
    if not np.isfinite(more).all():
        return True
    return bool(more.sum() > SURE * np.std(more) * np.sqrt(len(more)))


def worse_step_lines(word: LastWord | None, ladder: Sequence[Rung]) -> list[str]:
    """The same of the steps of a ``ladder``, for people; none where no trials were held out from all of it."""
    if word is None:
        return []
    found = worse_steps(word.problem, word.steps)
    lines = [_text(word.problem, step, ladder[step.number]) for step in found]
    nearest = nearest_step(word.steps) if word.steps else None
    if nearest is not None and not any(s.overall and s.number > nearest for s in found):
        least, last = (word.problem.told(word.steps[k].error) for k in (nearest, -1))
        lines.append(
            f"On {TRIALS_APART} least was left after step {nearest} of the ladder, {least}, and {last} after its last: what "
            "came in between may suit the fitted motions alone."
        )
    return lines


def _text(problem: Problem, step: WorseStep, rung: Rung) -> str:
    first, *others = rung.name.split(" + ")
    name = f"{placed(first)} and {len(others)} more" if len(others) > 1 else placed(rung.name)
    before, after = map(problem.told, (step.before, step.after))
    head = f"Step {step.number} of the ladder ({name}) took the error"
    unit = "" if step.unit == "1" else f" {step.unit}"
    at, of = plain(step.channel), f"{step.at[0]:.3g} to {step.at[1]:.3g}{unit}"
    if not step.overall:
        said = f"of {at} on {TRIALS_APART} from {of}, while that of all together went from {before} to {after}"
    else:
        said = f"on {TRIALS_APART} from {before} to {after}" + (f", most of it at {at} ({of})" if step.channel else "")
    return f"{head} {said}: it may suit the fitted motions alone."
