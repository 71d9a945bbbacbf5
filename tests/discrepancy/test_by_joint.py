"""Effects at many joints, each with a value of its own, where held-out data want them at some of these alone."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import PER, ROBOT, SEGMENTS, Linear

from ee_dist.discrepancy.everywhere import everywhere
from ee_dist.discrepancy.evidence.by_joint import gains_of
from ee_dist.discrepancy.evidence.holdout import travelling
from ee_dist.discrepancy.examine import Current, under
from ee_dist.discrepancy.search.candidates import Proposal, candidate, not_said
from ee_dist.discrepancy.search.search import Search
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.effects.groups import ALL_JOINTS
from ee_dist.trials.log import Array

JOINTS = ROBOT.motor_names[:4]
FRICTION = tuple(candidate(ROBOT, "coulomb_friction", j) for j in JOINTS)
HIDDEN = tuple(term("coulomb_friction", j, torque_nm=0.3) for j in JOINTS)


class JointByJoint(Linear):
    """Friction at a joint shows in that joint's channel alone. The last one turned round after the first of three motions, which
    no friction does: what is fitted to some motions is wrong in the others."""

    def __init__(self, hidden: Hypothesis) -> None:
        super().__init__((), motions=3)
        n = SEGMENTS * PER
        self.layout = replace(
            self.layout,
            channel_of=np.arange(n) % 4,
            channels=JOINTS,
            units=("N.m",) * 4,
            joint_of_channel=(0, 1, 2, 3),
        )
        turned = np.where((self.channel_of == 3) & (self.trial_of == 0), -1.0, 1.0)
        self.data = np.random.default_rng(5).standard_normal(n) + turned * self.shift(hidden)

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = np.zeros(SEGMENTS * PER)
        for t in hypothesis:
            own = np.arange(len(total)) % 4 == JOINTS.index(t.target)
            pattern = np.random.default_rng(JOINTS.index(t.target)).standard_normal(len(total))
            total += 40.0 * dict(t.values)["torque_nm"] * pattern * own
        return total


def test_a_joint_that_loses_what_the_others_gain_does_not_speak_against_them() -> None:
    problem = JointByJoint(HIDDEN)
    (cut,) = travelling(problem)
    base = problem.residuals([()])[0]
    starts = [(Proposal(FRICTION, "coulomb_friction@each of 4 joints"), np.full(4, 0.1))]
    best = under(Search(problem), Current(), starts, cut, base, 50)[0]
    assert best.earned and best.name == "coulomb_friction@each of 3 joints"
    assert [c.target for c in best.proposal.parts] == list(JOINTS[:3])
    gains = gains_of(problem, FRICTION, base, best.residual)
    assert (gains[:3] > 0).all() and gains[3] == pytest.approx(0.0, abs=1e-9)


def test_of_all_that_is_a_little_wrong_it_stays_out_too() -> None:
    problem = JointByJoint(HIDDEN)
    found = everywhere(Search(problem), Current(), 0, FRICTION, travelling(problem))
    assert found is not None
    assert [c.target for c in found.current.parts] == list(JOINTS[:3])


def test_an_effect_is_of_the_joint_that_it_acts_on_or_whose_sensor_it_changes() -> None:
    problem = JointByJoint(())
    own = np.bincount(problem.channel_of).astype(float)
    before, after = np.sqrt(1.0 + problem.channel_of), np.zeros(len(problem.channel_of))
    sensor = next(s for s in ROBOT.sensors if s.target in JOINTS)
    parts = [
        FRICTION[2],
        candidate(ROBOT, "sensor_delay", sensor.name),
        candidate(ROBOT, "coulomb_friction", ALL_JOINTS),
    ]
    joint = JOINTS.index(sensor.target)
    assert gains_of(problem, parts, before, after) == pytest.approx([3 * own[2], (1 + joint) * own[joint], 0.0])


def test_what_all_joints_share_says_nothing_new_where_each_has_a_value_of_its_own() -> None:
    shared = candidate(ROBOT, "coulomb_friction", ALL_JOINTS)
    singles = [candidate(ROBOT, "coulomb_friction", j) for j in ROBOT.motor_names]
    other = candidate(ROBOT, "viscous_friction", ALL_JOINTS)
    assert not_said(ROBOT, singles, [shared, other, *singles]) == [other]
    assert not_said(ROBOT, singles[1:], [shared, other, *singles]) == [shared, other, singles[0]]
