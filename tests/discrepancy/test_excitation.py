"""Excitations: within limits, from rest, the same every time, and errors in one line."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.engines.drivers import weight_count
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.trials.excitation import KINDS, Excitation, ExcitationError, parse
from ee_dist.trials.noise import channel_range, with_noise

LAB = quadruped_lab()


@settings(max_examples=40, deadline=None)
@given(
    st.sampled_from([k for k in KINDS if k != "gait"]), st.floats(0.01, 1.0), st.integers(0, 99), st.floats(0.2, 8.0)
)
def test_commands_stay_within_the_limits_and_begin_at_rest(
    kind: str, amplitude: float, seed: int, seconds: float
) -> None:
    e = Excitation(kind, seconds, amplitude, seed)
    values = e.commands(LAB)
    assert values.shape == (e.steps(LAB), 8)
    for k, drive in enumerate(LAB.drives):
        joint = LAB.joint(drive.joint)
        assert joint.lower - 1e-12 <= values[:, k].min() and values[:, k].max() <= joint.upper + 1e-12
    assert np.abs(values[0]).max() == 0.0
    assert np.array_equal(values, Excitation(kind, seconds, amplitude, seed).commands(LAB))


def test_gait_weights_fit_either_robot() -> None:
    for robot in (LAB, quadruped()):
        weights = Excitation("gait").weights(robot)
        assert weights is not None and len(weights) == weight_count(len(robot.sensors), 8)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("multisin", "multisine"),
        ("steps:amplitude=2", "share of half the range"),
        ("steps:speed=2", "no setting 'speed'"),
        ("steps:seconds=x", "must be a number"),
        ("steps:fixture=ceiling", "no fixture"),
        ("rest:seconds=0", "between 0.1 and 600"),
    ],
)
def test_mistakes_are_told_in_one_line(text: str, said: str) -> None:
    with pytest.raises(ExcitationError, match=said) as caught:
        parse(text)
    assert "\n" not in str(caught.value)


def test_typed_form() -> None:
    assert parse("sway:seconds=3,amplitude=0.2,seed=4,fixture=stand") == Excitation("sway", 3.0, 0.2, 4, "stand")


def test_noise_is_a_share_of_the_range() -> None:
    noisy = with_noise(LAB, 0.02)
    for s in noisy.sensors:
        assert s.noise == pytest.approx(0.02 * channel_range(LAB, s))
    assert with_noise(LAB, 0.0) is LAB
