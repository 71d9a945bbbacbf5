"""An effect that shows in one kind of motion only: where that is held out nothing tells its value, nor speaks against it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import Linear

from ee_dist.discrepancy.evidence.holdout import MOTIONS, SETTINGS, travelling
from ee_dist.discrepancy.evidence.judge import FEW_SHOW, Judged
from ee_dist.discrepancy.examine import Current, Effort, examine
from ee_dist.discrepancy.search.candidates import candidate, values_of
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.trials.log import Array

LIMIT, OTHER = term("motor_weak", "knee_front_left", loss=0.5), term("motor_weak", "knee_front_right", loss=0.3)


class OneMotion(Linear):
    """Six trials: three motions, each under ``settings`` settings. ``LIMIT`` shows in the second motion alone, twice as much as
    the other effect does everywhere, and in just its way: fitted without the limit, that one's value is wrong in all motions. Of
    the second motion much else is wrong."""

    def __init__(self, hidden: Hypothesis, settings: int = 2) -> None:
        super().__init__(hidden, extra=1.0, motions=6)
        self.data += np.where(np.isin(self.trial_of, [2, 3]), 6.0 * np.sin(np.arange(len(self.data)) / 25.0), 0.0)
        stiff = (term("gear_ratio", "hip_front_left", change=0.5),)
        self.measured = tuple(
            replace(t, log=self.measured[2 * (k // 2)].log, setup=stiff if settings > 1 and k % 2 else ())
            for k, t in enumerate(self.measured)
        )

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = np.zeros(len(self.trial_of))
        for t in hypothesis:
            like = super().shift((replace(t, target=OTHER.target),))
            total += like * 2.0 * np.isin(self.trial_of, [2, 3]) if t.target == LIMIT.target else like
        return total


def judged(problem: OneMotion) -> list[Judged]:
    parts = (candidate(problem.robot, OTHER.effect, OTHER.target),)
    pool = [candidate(problem.robot, LIMIT.effect, LIMIT.target)]
    found = examine(
        Search(problem), Current(parts, values_of(parts, (OTHER,))), pool, Effort(first=4, second=2, final=2)
    )
    return found.judged


def test_settings_speak_for_what_only_one_motion_tells() -> None:
    problem = OneMotion((OTHER, LIMIT))
    assert [(c.name, c.folds) for c in travelling(problem)] == [(MOTIONS, 3), (SETTINGS, 2)]
    (limit,) = judged(problem)
    assert limit.earned and limit.held_out == SETTINGS and not limit.partly
    assert limit.terms[0].values[0][1] == pytest.approx(0.4, abs=0.1)


def test_with_one_setting_it_is_said_what_to_record() -> None:
    (limit,) = judged(OneMotion((OTHER, LIMIT), settings=1))
    assert not limit.earned and limit.partly
    assert limit.why_not == FEW_SHOW.format(kinds="motions")


def test_what_is_not_there_is_not_told_by_a_turn_that_says_nothing() -> None:
    assert not any(j.earned for j in judged(OneMotion((OTHER,))))
