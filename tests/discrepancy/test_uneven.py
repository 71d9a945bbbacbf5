"""An improvement that is one on all motions together and a change for the worse on one of them is told as such."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import Linear

from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.discrepancy.uneven import worse_trials
from ee_dist.effects.catalogue import term


@pytest.fixture(scope="module")
def found():  # type: ignore[no-untyped-def]
    problem = Linear((term("motor_weak", "knee_front_left", loss=0.4),), motions=4)
    return problem, improve(problem, [parse(problem.robot, "motor_weak@knee_front_left")])


def test_what_helps_everywhere_is_no_contradiction(found) -> None:  # type: ignore[no-untyped-def]
    problem, improvement = found
    assert worse_trials(problem, improvement) == []


def test_the_motion_that_is_worse_is_named(found) -> None:  # type: ignore[no-untyped-def]
    problem, improvement = found
    first = improvement.ladder[0]
    held = 0.5 * first.held
    held[problem.trial_of_segment == 2] = 1.3 * first.held[problem.trial_of_segment == 2]
    last = replace(first, name="step", held=held)
    uneven = replace(improvement, ladder=[first, last])
    (worse,) = worse_trials(problem, uneven)
    assert worse.trial == "trial 2" and worse.after == pytest.approx(np.sqrt(1.3) * worse.before)
    lines = improve_account(problem, uneven).lines
    assert any("Worse than before on motions that were held out: trial 2" in line for line in lines)
