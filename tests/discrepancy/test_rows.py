"""A command that is late by less than a row of the log, and a descent that was caught with it late by more."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from linear_problem import PER, ROBOT, SEGMENTS, Linear

from ee_dist.discrepancy.search.candidates import candidate, values_of
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.ridges import over_ridges
from ee_dist.discrepancy.search.rows import over_rows
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import NARROWEST, follow_valley
from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.trials.log import Array

ROW = 0.01
JOINT = ROBOT.motor_names[0]
PARTS = tuple(candidate(ROBOT, name, JOINT) for name in ("command_delay", "viscous_friction"))


class Late(Linear):
    """Past a row the delay moves other readings, and partly back what it moved before: each side has a valley of its own."""

    def __init__(self, late: float, joint: str = JOINT) -> None:
        rng = np.random.default_rng(5)
        self.before, rest, self.friction = rng.standard_normal((3, SEGMENTS * PER))
        self.after = -0.6 * self.before + rest
        self.shape = np.random.default_rng(7).standard_normal(SEGMENTS * PER)
        self.late = joint
        super().__init__(
            (term("command_delay", joint, delay_s=late), term("viscous_friction", joint, damping_nm_s_rad=0.2))
        )

    def shift(self, hypothesis: Hypothesis) -> Array:
        at_joint = [t for t in hypothesis if t.target == self.late]
        values = {t.effect: t.values[0][1] for t in at_joint}
        rows = values.get("command_delay", 0.0) / ROW
        return np.asarray(
            20.0 * (min(rows, 1.0) * self.before + max(rows - 1.0, 0.0) * self.after)
            + 10.0 * values.get("viscous_friction", 0.0) * self.friction
        )


def caught(problem: Late, late: float) -> Fit:
    parts = tuple(candidate(ROBOT, c.effect, problem.late) for c in PARTS)
    search, start = Search(problem), values_of(parts, tuple(_at(c.effect.name, late, problem.late) for c in parts))
    (fit,) = follow_valley(search, [(Model(parts), start)], search.everything, widths=(NARROWEST,))
    return fit


def _at(effect: str, late: float, joint: str) -> Term:
    values = {"delay_s": late} if effect == "command_delay" else {"damping_nm_s_rad": 0.0}
    return term(effect, joint, **values)


def delay_of(fit: Fit) -> float:
    return dict(fit.hypothesis[0].values)["delay_s"]


@pytest.mark.parametrize(("truth", "start"), [(0.006, 0.014), (0.0135, 0.006)])
def test_the_other_side_of_a_row_is_tried(truth: float, start: float) -> None:
    problem = Late(truth)
    fit = caught(problem, start)
    assert fit.energy > 3.0 * len(problem.data), "slopes alone do not see it"
    found = over_rows(Search(problem), fit, fit.energy)
    assert delay_of(found) == pytest.approx(truth, abs=0.0003)
    assert found.energy < 1.1 * len(problem.data)
    assert over_ridges(Search(problem), fit).energy == pytest.approx(found.energy, rel=0.01)


def test_what_is_no_better_stays() -> None:
    problem = Late(0.006)
    fit = caught(problem, 0.005)
    assert over_rows(Search(problem), fit, fit.energy) is fit, "its joint has nothing left to explain"
    worse = caught(problem, 0.014)
    assert over_rows(Search(problem), worse, 0.0) is worse, "not by as much as was wanted"


class Elsewhere(Late):
    """The same, and it shows in the other joint's channels alone."""

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        rows = super().residuals(hypotheses, trials)
        return np.where(self.layout.channel_of == 1, rows, 0.0)


def test_a_joint_that_is_at_the_noise_is_not_tried() -> None:
    problem = Elsewhere(0.006)
    fit = caught(problem, 0.014)
    assert fit.energy > 1.5 * len(problem.data)
    assert over_rows(Search(problem), fit, fit.energy) is fit
