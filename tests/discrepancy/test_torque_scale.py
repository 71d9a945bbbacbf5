"""The strength of all motors in the place of a mass, from wherever the values of a model are."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from way_samples import problem

from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.torque_scale import STRENGTH, other_scale
from ee_dist.effects.catalogue import find

EFFECTS = ("part_mass", "coulomb_friction", "viscous_friction", "rotor_inertia", "torque_limit", "command_delay")


def model_of_arm() -> Model:
    robot = problem("arm", "open_loop").robot
    return Model(tuple(candidate(robot, e, t) for e in EFFECTS for t in find(e).targets(robot)))


@settings(max_examples=25, deadline=None)
@given(st.lists(st.sampled_from([-1.0, -0.4, 0.0, 0.3, 1.0]), min_size=40, max_size=40))
def test_it_begins_within_the_ranges_of_all_effects(shares: list[float]) -> None:
    """A mass of a tenth of what it is makes all others ten times as heavy, which none may be."""
    of_arm = problem("arm", "open_loop")
    model = model_of_arm()
    u = np.clip(np.array(shares)[: len(model.lower)], model.lower, model.upper)
    for other, start in other_scale(of_arm, Current(model.parts, u), 0, pool_of(of_arm)):
        assert other.parts[-1].effect.name == STRENGTH, "of several motors"
        assert np.all((start >= other.lower) & (start <= other.upper))


def test_masses_far_off_are_there_to_be_scaled() -> None:
    """What the property above is about happens."""
    of_arm, model = problem("arm", "open_loop"), model_of_arm()
    u = np.where(model.lower < 0, -1.0, 0.5)
    found = list(other_scale(of_arm, Current(model.parts, u), 0, pool_of(of_arm)))
    assert len(found) == len(find("part_mass").targets(of_arm.robot)) > 1
