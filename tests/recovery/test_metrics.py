"""The two diagnosis metrics on logs whose distance is known."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.evaluation.jobs import Travel
from ee_dist.recovery.metrics import Distance, RollingMean, rolling_mean
from ee_dist.trials.log import SensorLog


def log(sensors: np.ndarray, travel_m: float = 0.0) -> SensorLog:
    steps, channels = sensors.shape
    names = tuple(f"s{k}" for k in range(channels))
    return SensorLog(
        np.arange(steps) * 0.01, sensors, np.zeros((steps, 1)), names, ("1",) * channels, ("m",), travel_m=travel_m
    )


def test_rolling_mean_is_the_mean_of_every_window():
    x = np.random.default_rng(0).normal(size=(50, 3))
    expected = np.array([x[k : k + 7].mean(axis=0) for k in range(44)])
    assert np.allclose(rolling_mean(x, 7), expected, atol=1e-12)


def test_equal_logs_have_no_error():
    x = np.random.default_rng(0).normal(size=(80, 3))
    assert RollingMean(60, 10).against(log(x))(log(x[:60].copy())) == 0.0
    assert Distance().against(log(x, 1.5))(log(x, 1.5)) == 0.0


def test_a_constant_shift_of_one_channel_counts_as_its_share():
    x = np.zeros((80, 4))
    y = x.copy()
    y[:, 2] += 0.2
    assert RollingMean(60, 10).against(log(x))(log(y[:60].copy())) == pytest.approx(0.2 / 4)


def test_what_happens_after_the_header_does_not_count():
    x = np.zeros((80, 2))
    y = x.copy()
    y[60:] = 9.0
    metric = RollingMean(60, 10)
    assert metric.steps(80) == 60
    assert metric.against(log(x))(log(y[:60].copy())) == 0.0


def test_distance_reads_the_whole_trial():
    assert Distance().steps(1000) == 1000
    assert Distance().against(log(np.zeros((5, 1)), 2.0))(log(np.zeros((5, 1)), 0.5)) == 1.5


@pytest.mark.parametrize("metric", [RollingMean(20, 5), Distance()])
def test_a_model_that_left_the_finite_numbers_is_the_worst(metric):
    measured = log(np.zeros((20, 2)), 1.0)
    broken = log(np.full((20, 2), np.nan), float("nan"))
    assert metric.against(measured)(broken) == float("inf")
    assert Travel()(broken) == float("-inf"), "and the worst of distances"


@pytest.mark.parametrize(("header", "window"), [(5, 10), (10, 0)])
def test_impossible_header_or_window(header, window):
    with pytest.raises(ValueError, match="window"):
        RollingMean(header, window)


def test_reductions_of_different_logs_have_different_keys():
    a, b = log(np.zeros((80, 2))), log(np.ones((80, 2)))
    assert RollingMean().against(a).key != RollingMean().against(b).key
    assert RollingMean().against(a).key == RollingMean().against(log(np.zeros((80, 2)))).key
