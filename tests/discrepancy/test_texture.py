"""How often a real sensor repeats a reading tells of the sensor only where what it reads changes by more than its steps."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.discrepancy.ways.open_loop.prediction import repeats
from ee_dist.discrepancy.ways.open_loop.texture import by_steps, moving
from ee_dist.trials.log import Array

STEP, WINDOW = 0.012, 50


def encoder(speed: float, noise: float, lost: float = 0.0) -> Array:
    """(R, 1) readings in steps of what goes to and fro, of which a share is ``lost``: the last one comes again."""
    rng = np.random.default_rng(3)
    values = np.round((200 * speed * np.sin(np.arange(4000) / 200) + noise * rng.standard_normal(4000)) / STEP) * STEP
    for k in np.flatnonzero(rng.random(len(values)) < lost):
        values[k] = values[k - 1] if k else values[k]
    return values[:, None]


def excess(values: Array) -> float:
    """Share of readings that come again and tell of the sensor."""
    again = repeats(values).reshape(-1, WINDOW).mean(axis=1)
    told = np.maximum(again[:, None] - by_steps(values, WINDOW), 0.0) * moving(values, WINDOW)
    return float(told.mean())


@pytest.mark.parametrize(("speed", "noise"), [(0.0, 0.0), (0.0, 0.004), (0.0, 0.025), (0.003, 0.004), (0.5, 0.025)])
def test_an_encoder_in_order_repeats_what_its_steps_explain(speed: float, noise: float) -> None:
    assert excess(encoder(speed, noise)) < 0.03


@pytest.mark.parametrize("lost", [0.1, 0.3])
def test_one_that_loses_readings_while_it_moves_shows(lost: float) -> None:
    assert excess(encoder(0.5, 0.025, lost)) == pytest.approx(lost, abs=0.03)


def test_one_that_creeps_by_less_than_counts_tells_nothing_of_its_sensor() -> None:
    """Its last digit says finer steps than the encoder has."""
    creeping = np.round(np.arange(400) * 0.0004 / 0.003)[:, None] * 0.003 + 1e-7 * np.arange(400)[:, None] % 3e-7
    assert moving(creeping, WINDOW).all() and not moving(creeping, WINDOW, 0.05).any()
    assert moving(encoder(0.5, 0.025), WINDOW, 0.05).mean() > 0.9
