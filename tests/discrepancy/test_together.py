"""Values that only hold together with others: what slopes over finite steps tell, and what a profile shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from way_samples import Sample, measure, problem_by

from ee_dist.discrepancy.evidence.holdout import PRIOR
from ee_dist.discrepancy.evidence.intervals import TOGETHER, ParameterReport, half_widths, parameters
from ee_dist.discrepancy.evidence.together import flat_widths
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

PENDULUM = with_noise(servo_pendulum(), 1e-3)
SERVO, ARM = PENDULUM.motor_names[0], PENDULUM.parts[1].name
LED = PENDULUM.map_drive(SERVO, lambda d: replace(d, command="torque", kp=0.0, kd=0.0, speed_limit=np.inf))
"""It obeys torques, so that nothing but its masses says how large these are."""
TRUTH = (
    term("rotor_inertia", SERVO, added_kg_m2=0.0015),
    term("command_gain", SERVO, change=0.6),
    term("coulomb_friction", SERVO, torque_nm=0.019),
    term("viscous_friction", SERVO, damping_nm_s_rad=0.0074),
)
PLAN = tuple(
    Excitation(k, 3.0, a, n) for k, a, n in (("multisine", 0.2, 1), ("steps", 0.15, 2), ("slow_sines", 0.1, 3))
)


def told(terms: Hypothesis) -> tuple[dict[str, ParameterReport], np.ndarray, np.ndarray]:
    """Reports of the values of these terms, fitted from there; half intervals by slopes, and how far values go together."""
    search = Search(problem_by("open_loop", measure(Sample(LED, PLAN, TRUTH, ()), TRUTH), LED))
    model = Model(tuple(candidate(LED, t.effect, t.target) for t in terms))
    start = np.concatenate([c.shares(dict(t.values)) for c, t in zip(model.parts, terms, strict=True)])
    (fit,) = follow_valley(search, [(model, start)], search.everything, PRIOR)
    flat = flat_widths(search, fit)
    reports = parameters(search.problem, fit, flat=flat)
    return {t.effect: p for t, p in zip(terms, reports, strict=True)}, half_widths(search.problem, fit), flat


def test_values_that_all_grow_with_a_mass_hold_only_together() -> None:
    tenth_more = (
        term("part_mass", ARM, change=0.1),
        term("rotor_inertia", SERVO, added_kg_m2=1.1 * 0.0035 - 0.002),
        term("command_gain", SERVO, change=1.1 * 1.6 - 1.0),
        term("coulomb_friction", SERVO, torque_nm=1.1 * 0.019),
        term("viscous_friction", SERVO, damping_nm_s_rad=1.1 * 0.0074),
    )
    found, half, flat = told(tenth_more)
    assert half[2] < 0.05, "slopes tell the gain, though it may be anything"
    assert flat[2] > 0.3
    gain = found["command_gain"]
    assert gain.flag == TOGETHER and gain.low < 0.3 and gain.high > 1.5
    assert found["rotor_inertia"].flag == TOGETHER


def test_values_of_which_the_masses_tell_the_size_are_told_as_slopes_say() -> None:
    found, _, flat = told(TRUTH)
    assert not flat.any()
    for t in TRUTH:
        p = found[t.effect]
        assert p.low < t.values[0][1] < p.high and p.flag == "", p
    assert found["command_gain"].high - found["command_gain"].low < 0.2


@pytest.mark.parametrize("count", [1, 17])
def test_a_single_value_and_very_many_are_left_as_they_are(count: int) -> None:
    search = Search(problem_by("open_loop", measure(Sample(LED, PLAN[:1], (), ()), ()), LED))
    (one,) = follow_valley(
        search, [(Model((candidate(LED, "command_gain", SERVO),)), np.zeros(1))], search.everything, PRIOR, 1
    )
    many = replace(one, u=np.zeros(count), slopes=np.repeat(one.slopes, count, axis=1))
    assert not flat_widths(search, many).any()
