"""The ladder on residuals whose answer is known: what it adds, and what it calls tied."""

from __future__ import annotations

import numpy as np
import pytest
from linear_problem import ROBOT, Linear

from ee_dist.discrepancy.search.candidates import parse
from ee_dist.discrepancy.ladder import climb, parted_most
from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.trials.log import Array

WEAK, JAM, GAIN = "motor_weak@knee_front_left", "joint_jam@hip_rear_left", "command_gain@hip_front_left"
POOL = [(parse(ROBOT, name),) for name in (WEAK, JAM, GAIN)]
HIDDEN = (term("motor_weak", "knee_front_left", loss=0.4), term("joint_jam", "hip_rear_left", loss=0.3))


class Twins(Linear):
    """``command_gain`` does nearly what ``motor_weak`` does."""

    unlike = 0.01

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = super().shift(tuple(t for t in hypothesis if t.effect != "command_gain"))
        for t in hypothesis:
            if t.effect == "command_gain":
                size = t.values[0][1]
                own = super().shift((Term(t.effect, t.target, (("change", 1.0),)),))
                like = super().shift((term("motor_weak", "knee_front_left", loss=1.0),))
                total = total + size * (like + self.unlike * own)
        return total


def test_what_is_there_is_added_and_nothing_else() -> None:
    problem = Linear(HIDDEN)
    rungs = climb(problem, (), POOL)
    assert [r.added for r in rungs[1:-1]] == [WEAK, JAM]
    held = [r.error_heldout for r in rungs[:-1]]
    assert held[0] > held[1] > held[2]
    assert held[2] == pytest.approx(1.0, abs=0.1)
    assert not any(v.tied for r in rungs for v in r.tried)
    assert all(v.why_not for v in rungs[-1].tried)


def test_a_twin_is_called_tied_and_where_they_part_is_said() -> None:
    rungs = climb(Twins(HIDDEN[:1]), (), POOL)
    first = rungs[1].tried
    assert [v.name for v in first if v.tied] == [first[1].name]
    assert {first[0].name, first[1].name} == {WEAK, GAIN}
    assert parted_most(Twins(HIDDEN[:1]), first[:2]) == "trial"


def test_an_effect_that_is_worse_beyond_doubt_is_not_tied() -> None:
    problem = Twins(HIDDEN[:1])
    problem.unlike = 1.0
    problem.data = np.random.default_rng(0).standard_normal(len(problem.data)) + problem.shift(HIDDEN[:1])
    first = climb(problem, (), POOL)[1].tried
    assert first[0].name == WEAK
    assert not any(v.tied for v in first)
