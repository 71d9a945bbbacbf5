"""What ended at neutral is no finding: it is left out of the model, of ties and of intervals as they are shown."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import ROBOT, Linear
from way_samples import two_joint_arm

from ee_dist.discrepancy.accounts.of_improve import has
from ee_dist.discrepancy.evidence.intervals import BOUND, HARDLY, NEUTRAL, NOT_DETERMINED, half_widths, parameters
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.pruning import without_neutral
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Fit, Model


def test_terms_at_neutral_leave_the_model_and_the_others_stay() -> None:
    parts = tuple(
        candidate(ROBOT, "motor_weak", joint) for joint in ("knee_front_left", "hip_rear_left", "hip_rear_right")
    )
    before = Current(parts, np.array([0.0, 0.3, 0.0]))
    after, gone = without_neutral(before, 0)
    assert [p.name for p in after.parts] == ["motor_weak@hip_rear_left"] and after.u.tolist() == [0.3]
    assert gone == ("motor_weak@knee_front_left", "motor_weak@hip_rear_right")
    kept, gone = without_neutral(before, 1)
    assert kept.parts[0] is parts[0] and gone == ("motor_weak@hip_rear_right",), "what the model began with stays"
    same, gone = without_neutral(after, 0)
    assert (same.parts, gone) == (after.parts, ())


def test_a_rival_that_came_into_the_model_later_is_no_rival() -> None:
    arm, names = two_joint_arm(), {"coulomb_friction@base", "coulomb_friction@elbow", "load_friction@elbow"}
    assert has(names, "coulomb_friction@base", arm)
    assert has(names, "coulomb_friction@each of 3 joints", arm)
    assert has(names, "coulomb_friction@elbow + load_friction@elbow", arm)
    assert not has(names, "viscous_friction@base", arm)
    assert not has(names, "viscous_friction@each of 3 joints", arm)
    assert not has(names, "load_friction@elbow + quadratic_friction@elbow", arm)
    joints = arm.motor_names
    assert not has(names, "coulomb_friction@all_joints", arm), "some of them, not all"
    assert has({f"coulomb_friction@{j}" for j in joints}, "coulomb_friction@all_joints", arm)


@pytest.mark.parametrize(
    ("u", "slope", "flag"),
    [
        (1.0, 0.0, f"{BOUND}; {NOT_DETERMINED}"),
        (1.0, 30.0, BOUND),
        (0.5, 0.0, NOT_DETERMINED),
        (0.5, 30.0, ""),
        (0.001, 30.0, NEUTRAL),
    ],
)
def test_a_value_at_its_bound_is_told_so_whatever_its_slope_there(u: float, slope: float, flag: str) -> None:
    """Past a bound the data may say much of what they do not say at it."""
    problem, fit = valued(u, slope)
    (told,) = parameters(problem, fit)
    assert told.flag == flag


def valued(u: float, slope: float) -> tuple[Linear, Fit]:
    """A fit of one value, of that slope in each datum."""
    problem = Linear((), motions=4)
    n = len(problem.data)
    model = Model((candidate(ROBOT, "viscous_friction", ROBOT.motor_names[0]),))
    slopes = slope * np.random.default_rng(0).standard_normal((n, 1))
    return problem, Fit(model, np.array([u]), float(n), problem.data, slopes, np.ones(n, dtype=bool))


@pytest.mark.parametrize(
    ("sigmas", "asked_for", "found_among_200"), [(1.0, NEUTRAL, NEUTRAL), (3.0, "", HARDLY), (6.0, "", "")]
)
def test_one_of_many_effects_is_told_from_neutral_by_luck(sigmas: float, asked_for: str, found_among_200: str) -> None:
    """Of two hundred that are nothing, ten are told by two standard deviations, and nearly always one by 2.6."""
    problem, fit = valued(1.0, 30.0)
    (half,) = half_widths(problem, fit)
    fit = replace(fit, u=np.array([sigmas * half / 1.96]))
    assert [p.flag for p in parameters(problem, fit)] == [asked_for]
    assert [p.flag for p in parameters(problem, fit, tried=200)] == [found_among_200]
