"""One number for all joints where a number for each is no more than luck."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.discrepancy import everywhere as module
from ee_dist.discrepancy.everywhere import everywhere
from ee_dist.discrepancy.evidence.holdout import travelling
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.exchanges import at_one_place
from ee_dist.discrepancy.search.candidates import Candidate, candidates
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.sharing import shared, singles
from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.effects.groups import members_of
from tests.discrepancy.linear_problem import ROBOT, Linear

KINDS = ("coulomb_friction", "viscous_friction", "command_gain")
JOINTS = tuple(d.joint for d in ROBOT.drives)


class Legs(Linear):
    """What a shared effect does is the sum of what it does at its joints."""

    def shift(self, hypothesis: Hypothesis):
        apart = []
        for t in hypothesis:
            at = members_of(ROBOT, t.target, JOINTS) or (t.target,)
            apart += [term(t.effect, joint, **dict(t.values)) for joint in at]
        return super().shift(tuple(apart))


def pool_of() -> list[Candidate]:
    return candidates(ROBOT, only=KINDS)


def found_in(problem: Linear):
    return everywhere(Search(problem), Current(), 0, pool_of(), travelling(problem))


def test_what_all_joints_have_in_common_is_found_though_no_joint_tells_it():
    """What is left beside is so much that the friction of one joint could be luck."""
    hidden = tuple(term("viscous_friction", j, damping_nm_s_rad=0.25 + 0.02 * (k % 3)) for k, j in enumerate(JOINTS))
    found = found_in(Legs(hidden, extra=7.0, motions=4))
    assert found is not None
    (only,) = found.current.parts
    assert only.name == "viscous_friction@all_joints"
    assert only.values(found.current.u)["damping_nm_s_rad"] == pytest.approx(0.27, abs=0.05)


def test_joints_that_differ_keep_a_number_of_their_own():
    hidden = tuple(term("viscous_friction", j, damping_nm_s_rad=0.1 * (k % 3)) for k, j in enumerate(JOINTS))
    found = found_in(Legs(hidden, motions=4))
    assert found is not None
    assert {c.name for c in found.current.parts} == {f"viscous_friction@{t.target}" for t in hidden if t.values[0][1]}


def test_one_number_is_fitted_to_all_trials_only_if_it_does_better_on_one(monkeypatch: pytest.MonkeyPatch):
    """Joints differ so much that one number for all leaves more of one trial than one for each leaves of data held out."""
    fitted: list[tuple[int, int]] = []
    descend = module.follow_valley

    def counted(search: Search, starts: list, mask: np.ndarray, *args: object, **named: object):
        fitted.append((len(starts[0][1]), len(np.unique(search.problem.trial_of[mask]))))
        return descend(search, starts, mask, *args, **named)

    monkeypatch.setattr(module, "follow_valley", counted)
    hidden = tuple(term("viscous_friction", j, damping_nm_s_rad=0.9 * (k % 3)) for k, j in enumerate(JOINTS))
    found = found_in(Legs(hidden, extra=3.0, motions=4))
    assert found is not None and len(found.current.parts) >= 5
    assert fitted == [(len(KINDS) * len(JOINTS), 4), (len(KINDS), 1)]


def test_each_kind_is_shared_as_widely_as_it_may_be():
    wide = shared(ROBOT, pool_of())
    assert {c.name for c in wide} == {f"{kind}@all_joints" for kind in KINDS}
    alone = singles(ROBOT, pool_of())
    assert {c.target for c in alone} == set(JOINTS)
    assert shared(ROBOT, alone) == alone, "what nobody shares stays as it is"
    assert np.isin([c.effect.name for c in alone], KINDS).all()


def exchange_of(*hidden: Term):
    """A model with viscous friction of all joints, beside the command gain that is hidden as well."""
    problem = Legs(hidden, motions=4)
    have = {c.name: c for c in pool_of()}
    parts = (have["viscous_friction@all_joints"], have[f"command_gain@{JOINTS[0]}"])
    current = Current(parts, np.array([0.02, 0.5]))
    return at_one_place(Search(problem), current, 0), at_one_place(Search(problem), current, 1)


def test_what_one_joint_has_alone_is_no_longer_shared_once_the_rest_is_known():
    gain = term("command_gain", JOINTS[0], change=0.1)
    alone, kept = exchange_of(gain, term("viscous_friction", JOINTS[3], damping_nm_s_rad=0.3))
    assert alone is not None
    then, rung = alone
    assert [c.name for c in then.parts] == [f"viscous_friction@{JOINTS[3]}", f"command_gain@{JOINTS[0]}"]
    assert then.parts[0].values(then.u[:1])["damping_nm_s_rad"] == pytest.approx(0.3, abs=0.02)
    assert rung.dropped == ("viscous_friction@all_joints",) and rung.added[0].target == JOINTS[3]
    assert kept is None, "what was given stays"


def test_what_all_joints_have_stays_shared():
    gain = term("command_gain", JOINTS[0], change=0.1)
    assert exchange_of(gain, *(term("viscous_friction", j, damping_nm_s_rad=0.2) for j in JOINTS)) == (None, None)
