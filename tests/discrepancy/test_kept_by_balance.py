"""What a balance of forces keeps of models that were asked for is bounded, however many motions there are."""

from __future__ import annotations

import numpy as np
import pytest
from way_samples import measured, samples

from ee_dist.discrepancy.ways.force_balance import balance, motion
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.effects.catalogue import term


@pytest.mark.parametrize("copies", [1, 4])
def test_values_that_are_kept_stay_within_what_is_said_of_them(monkeypatch: pytest.MonkeyPatch, copies: int) -> None:
    monkeypatch.setattr(balance, "MOST_VALUES", 200_000)
    problem = ForceBalance(measured("arm") * copies, samples()["arm"].robot)
    torques = np.linspace(0.0, 1.0, 400)
    problem.residuals([(term("coulomb_friction", "all_joints", torque_nm=float(c)),) for c in torques])
    kept = {id(a): a for b in problem.balances for pair in b._kept.values() if pair is not None for a in pair}
    # A view of every tenth row of one joint keeps all rows of all.
    held = sum(a.nbytes if a.base is None else a.base.nbytes for a in kept.values())
    assert 100_000 < held <= 2 * 8 * 200_000


def test_a_geometry_that_is_asked_for_once_is_worth_no_regressor(monkeypatch: pytest.MonkeyPatch) -> None:
    """Most hypotheses of where a joint is are asked for with one set of masses, and all of masses with one geometry."""
    made: list[int] = []
    whole = motion.regressor

    def counted(*args: object) -> np.ndarray:
        made.append(1)
        return whole(*args)  # type: ignore[arg-type]

    monkeypatch.setattr(motion, "regressor", counted)
    problem = ForceBalance(measured("arm"), samples()["arm"].robot)
    before = len(made)
    turned = [(term("zero_offset", "elbow", offset_rad=float(x)),) for x in np.linspace(0.01, 0.3, 10)]
    moved = problem.residuals(turned)
    assert len(made) == before
    heavy = [(*turned[0], term("part_mass", "lower", change=float(x))) for x in (0.1, 0.2, 0.3)]
    problem.residuals(heavy)
    assert len(made) == before + len(problem.balances), "two sets of masses are worth one of each motion"
    np.testing.assert_allclose(problem.residuals(turned), moved, rtol=1e-9, atol=1e-9)
