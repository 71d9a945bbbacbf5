"""Where only the size of a value acts, its sign is not told, and it is said."""

from __future__ import annotations

import numpy as np
import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.evidence.intervals import EITHER
from ee_dist.discrepancy.evidence.signs import either_sign
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import find, term


@pytest.fixture(scope="module", params=("open_loop", "free_run"))
def tilted(request):
    """A pendulum whose mounting is turned about an axis across its own: gravity loses by the cosine, whichever way."""
    sample = samples()["pendulum"]
    (base,) = find("mounting_tilt").targets(sample.robot)
    hidden = (term("mounting_tilt", base, sideways_deg=25.0), term("zero_offset", "servo", offset_rad=0.02))
    return problem_by(request.param, measure(sample, hidden), sample.robot), base


def test_a_tilt_that_only_weakens_gravity_may_be_to_either_side(tilted) -> None:
    problem, base = tilted
    search, robot = Search(problem), problem.robot
    parts = (candidate(robot, "mounting_tilt", base), candidate(robot, "zero_offset", "servo"))
    fit = fit_one(search, Model(parts), [np.array([0.1, 0.0, 0.1])])
    values = dict(fit.hypothesis[0].values)
    assert abs(values["sideways_deg"]) == pytest.approx(25.0, abs=2.0)
    assert either_sign(search, fit).tolist() == [True, False, False]


def test_it_is_said_wherever_the_value_is(tilted) -> None:
    problem, base = tilted
    wanted = [candidate(problem.robot, "mounting_tilt", base), candidate(problem.robot, "zero_offset", "servo")]
    found = improve(problem, (), wanted=wanted)
    flags = {p.name: p.flag for p in found.parameters}
    assert flags["sideways_deg"] == EITHER and flags["offset_rad"] == ""
    account = improve_account(problem, found)
    assert any(line.startswith("mounting tilt at") and line.endswith(f"sideways: {EITHER}.") for line in account.lines)
    assert f", of which {EITHER}" in account.sure
