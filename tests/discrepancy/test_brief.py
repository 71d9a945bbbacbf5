"""What only looks where to go looks at the beginning of long trials, where that tells as much."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from assumed_samples import the_problem
from linear_problem import Linear

from ee_dist.discrepancy import examine as examining
from ee_dist.discrepancy.assumed import LABEL
from ee_dist.discrepancy.brief import briefly, in_brief
from ee_dist.discrepancy.examine import Current, examine
from ee_dist.discrepancy.search.candidates import candidates
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.ground import Ground
from ee_dist.discrepancy.search.refit import Refit
from ee_dist.discrepancy.search.screen import screen
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.trials.log import Array

JAM, GAIN = term("joint_jam", "hip_rear_left", loss=0.8), term("command_gain", "knee_front_left", change=0.5)
CALM, ACTIVE = 0.0, 1.0


class Cut(Linear):
    """Its first fifth is a problem of its own. What is wrong shows there by ``share`` in the second channel."""

    def __init__(self, hidden: Hypothesis, share: float) -> None:
        self.share = share
        super().__init__(hidden)
        self.asked: list[int] = []
        self.short: Cut | None = None

    def shift(self, hypothesis: Hypothesis) -> Array:
        whole = super().shift(hypothesis)
        n = len(whole)
        early = (np.arange(n) < n // 5) & (np.arange(n) % 2 == 1)
        return np.asarray(np.where(early, self.share * whole, whole))

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        rows = np.stack([self.data - self.shift(h)[: len(self.data)] for h in hypotheses])
        self.asked.append(len(hypotheses))
        return rows if trials is None else np.where(np.isin(self.trial_of, trials), rows, 0.0)

    def beginning(self, seconds: float) -> Cut:
        if self.short is None:
            self.short = Cut((), self.share)
            n = len(self.data) // 5
            self.short.data = self.data[:n]
            own = self.layout
            self.short.layout = replace(
                own,
                segments=own.segments[: len(own.segments) // 5],
                trial_of_segment=own.trial_of_segment[: len(own.segments) // 5],
                segment_of=own.segment_of[:n],
                channel_of=own.channel_of[:n],
                time_s=own.time_s[:n],
                reading=own.reading[:n],
                floor=own.floor[:n],
                known=own.known[:n],
            )
        return self.short


@pytest.mark.parametrize(("share", "brief"), [(ACTIVE, True), (CALM, False)])
def test_candidates_are_chosen_on_the_beginning_unless_a_channel_is_at_rest_there(share: float, brief: bool) -> None:
    """Half of what is to be explained is there all the same, which is enough for all values at once and not for a choice."""
    problem = Cut((JAM, GAIN), share)
    search, base = Search(problem), problem.data
    assert briefly(search, base, ()).problem is problem.short
    found = in_brief(search.among([0]), Model(()), np.zeros(0), base, Refit())
    assert (found.search.problem is problem.short) == brief
    assert len(found.ground.base) == len(problem.data) // (5 if brief else 1)


def test_screening_on_the_beginning_promises_what_the_whole_holds() -> None:
    problem, pool = Cut((JAM,), ACTIVE), candidates(Linear(()).robot, only=["joint_jam", "command_gain"])
    search = Search(problem)
    few = in_brief(search.among([0]), Model(()), np.zeros(0), problem.data, Refit()).ground
    problem.asked.clear()
    short, whole = ({s.candidate.name: s.promise for s in screen(search, pool, few=f)} for f in (few, None))
    best = max(whole, key=lambda name: whole[name])
    assert best == "joint_jam@hip_rear_left" == max(short, key=lambda name: short[name])
    assert short[best] == pytest.approx(whole[best], rel=0.3)


def test_slopes_of_the_model_so_far_are_those_of_the_beginning() -> None:
    problem = Cut((JAM, GAIN), ACTIVE)
    (part,) = candidates(problem.robot, only=["joint_jam"], sharing=False)[:1]
    model, u = Model((part,)), np.array([0.1])
    base = problem.residuals([model.hypothesis(u)])[0]
    found = in_brief(Search(problem).among([0]), model, u, base, Refit(np.ones((len(base), 1))))
    assert found.search.problem is problem.short
    assert found.slopes is not None and found.slopes.shape == (len(base) // 5, 1)
    assert isinstance(found.ground, Ground) and found.ground.refit.basis is not None


def test_where_putting_guesses_right_takes_most_of_it_nothing_else_is_looked_at(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    problem = the_problem()
    pool = candidates(problem.robot, only=["position_gain", "speed_gain", "coulomb_friction", "part_mass"])
    looked: list[int] = []
    monkeypatch.setattr(examining, "screen", lambda s, c, *a, **k: looked.append(len(c)) or screen(s, c, *a, **k))
    found = examine(Search(problem), Current(), pool, guesses_first=True)
    assert [j.name for j in found.judged] == [LABEL] and not looked
    assert found.best is not None and found.left is not None
    every = examine(Search(problem), Current(), pool)
    assert looked and every.best is not None and every.best.name == LABEL
    assert every.best.gain == pytest.approx(found.best.gain, rel=1e-6)
    # Little of it goes with them: whatever else there is may be what matters.
    monkeypatch.setattr(examining, "MOST_OF_IT", 0.0)
    looked.clear()
    assert len(examine(Search(problem), Current(), pool, guesses_first=True).judged) > 1 and looked
