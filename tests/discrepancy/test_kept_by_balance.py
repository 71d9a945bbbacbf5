"""What a balance of forces keeps of models that were asked for is bounded, however many motions there are."""

from __future__ import annotations

import numpy as np
import pytest
from way_samples import measured, samples

from ee_dist.discrepancy.ways.force_balance import balance
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
