"""What a sensor's readings show of its steps."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from ee_dist.trials.grid import grid_of


@given(st.floats(1e-3, 10.0), st.floats(-5.0, 5.0), st.integers(0, 1000))
def test_steps_are_read_off_whatever_the_sensor_s_zero(step: float, zero: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    readings = np.round(rng.normal(size=200) * 4.0) * step + zero
    assert grid_of(readings) == pytest.approx(step, rel=1e-6)


@given(st.integers(0, 1000))
def test_readings_on_no_grid_show_none(seed: int) -> None:
    assert grid_of(np.random.default_rng(seed).normal(size=100)) == 0.0


@given(st.floats(0.05, 5.0), st.integers(0, 1000))
def test_a_file_that_was_written_with_few_digits_shows_the_coarser_steps(step: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    readings = np.round(np.round(rng.normal(size=200) * 4.0) * step, 4)
    assert grid_of(readings) == pytest.approx(step, rel=1e-2)


@pytest.mark.parametrize("readings", [[], [1.0], [np.nan] * 5, [2.0] * 50, [0.0, 1.0, 3.0]])
def test_too_few_different_readings_show_nothing(readings: list[float]) -> None:
    assert grid_of(np.array(readings)) == 0.0
