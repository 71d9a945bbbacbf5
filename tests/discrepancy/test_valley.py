"""Fitting many values at once, on a problem that is straight, and on one that is bent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from linear_problem import ROBOT, Linear

from ee_dist.discrepancy.search import valley
from ee_dist.discrepancy.search.candidates import candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.trials.log import Array

JOINTS = ROBOT.motor_names
POOL = candidates(ROBOT, only=["motor_weak", "load_friction"], sharing=False)
HIDDEN: Hypothesis = tuple(term("motor_weak", j, loss=0.2 + 0.05 * k) for k, j in enumerate(JOINTS))


class Bent(Linear):
    """Twice the value does not shift by twice as much; counts what it is asked."""

    asked = 0

    def shift(self, hypothesis: Hypothesis) -> Array:
        straight = super().shift(hypothesis)
        return np.asarray(np.sinh(straight))

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        self.asked += len(hypotheses)
        return super().residuals(hypotheses, trials)


def fitted(problem: Linear) -> dict[str, float]:
    model = Model(tuple(POOL))
    (fit,) = follow_valley(
        Search(problem), [(model, np.zeros(len(model.lower)))], np.ones(len(problem.segment_of), dtype=bool)
    )
    return {f"{t.effect}@{t.target}": t.values[0][1] for t in fit.hypothesis}


def test_steps_that_keep_their_word_spare_slopes(monkeypatch: pytest.MonkeyPatch) -> None:
    often, seldom = Bent(HIDDEN), Bent(HIDDEN)
    found = fitted(seldom)
    monkeypatch.setattr(valley, "SECANTS", 0)
    before = fitted(often)
    assert seldom.asked < 0.95 * often.asked
    for t in HIDDEN:
        name = f"{t.effect}@{t.target}"
        assert found[name] == pytest.approx(t.values[0][1], abs=0.03)
        assert found[name] == pytest.approx(before[name], abs=0.01)
    assert all(abs(v) < 0.03 for name, v in found.items() if name.startswith("load_friction"))
