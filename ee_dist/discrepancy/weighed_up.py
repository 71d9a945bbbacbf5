"""How much a model explains, judged by what knows it least.

A search holds back some of what it looks at. Of long records it looks at stretches alone, and trials may be held out from all of
it: where the model explains less of these, that is what it explains.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ee_dist.discrepancy.evidence.left import leftovers, settled
from ee_dist.discrepancy.finished import BETTER, EXPLAINED, taken_off
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.last_word import TRIALS_APART, LastWord
from ee_dist.discrepancy.problem import Problem, error

ALL_ROWS = "all rows of the records, of which the search took stretches"
TELLING = 1.1
"""Times the noise floor that the model as it was must leave, for a share of what is above it to say something."""


def weighed_up(found: Improvement, problem: Problem, word: LastWord | None) -> Improvement:
    """The result of a search on ``problem`` with the least share that it explains: of what it held out, of all rows of its
    records where it took stretches of them, and of the trials of the last ``word``; and what that is judged on."""
    judged = [(found.explained, found.judged_on)]
    if problem.whole is not problem and len(found.ladder) > 1:
        found = _on_all_rows(found, problem.whole)
    if found.all_rows is not None:
        judged.append((share(*found.all_rows, problem.whole.noise_floor()[0]), ALL_ROWS))
    if word is not None and word.changed:
        judged.append((share(word.before, word.after, word.floor), TRIALS_APART))
    least, on = min((j for j in judged if np.isfinite(j[0])), key=lambda j: j[0], default=judged[0])
    return replace(found, explained=least, judged_on=on)


def _on_all_rows(found: Improvement, whole: Problem) -> Improvement:
    """The result with its errors on all rows; what leaves more than noise there explains them not, whatever the stretches say."""
    first, last = whole.residuals([found.ladder[0].terms, found.terms])
    if not np.isfinite([first, last]).all():
        return found
    before, after = error(first), error(last)
    noise = settled(leftovers(whole, last), after, whole.noise_floor()[0])
    verdict = BETTER if found.verdict == EXPLAINED and not noise else found.verdict
    return replace(found, all_rows=(before, after), verdict=verdict)


def share(before: float, after: float, floor: float) -> float:
    """Of the squared error above the noise that went; NaN where hardly any was."""
    return taken_off(before, after, floor) if before > TELLING * floor else float("nan")
