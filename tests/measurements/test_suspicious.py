"""What a report says about channels that look wrong, and that it keeps quiet about good ones."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.measurements.suspicious import (
    command_suspicion,
    speed_suspicion,
    suspicions,
    time_suspicion,
    unit_suspicion,
)

T = np.arange(2000) * 0.01
WAVE = np.sin(2 * T)


def test_good_signals_raise_no_suspicion() -> None:
    rng = np.random.default_rng(0)
    for good in (WAVE, WAVE + 0.01 * rng.standard_normal(len(T)), np.round(WAVE, 2), np.repeat([0.0, 1.0], 1000)):
        assert suspicions("x", good) == []
    assert time_suspicion(0.01, 20, "s") is None
    assert unit_suspicion("x", WAVE, -1.5, 1.5, "rad") is None
    assert speed_suspicion("w", 2 * np.cos(2 * T), WAVE, 0.01) is None
    assert command_suspicion("j", WAVE, np.sin(2 * T - 0.3)) is None


@pytest.mark.parametrize(
    ("values", "word"),
    [
        (np.full(100, 3.0), "stuck at 3"),
        (np.r_[WAVE[:500], np.full(1500, WAVE[499])], "does not change for 1501 rows"),
        (np.clip(WAVE, -0.8, 0.8), "clipped"),
        (np.round(300 * WAVE) % 65536, "signed_bits: 16"),
        (np.round(100 * WAVE) % 256, "signed_bits: 8"),
        ((3 * WAVE + np.pi + T) % (2 * np.pi), "unwrap: true"),
    ],
)
def test_bad_signals_are_named(values: np.ndarray, word: str) -> None:
    assert any(word in s for s in suspicions("x", values))


def test_units_and_signs() -> None:
    assert "ms" in str(time_suspicion(5.0, 30000, "s"))
    assert "deg" in str(unit_suspicion("x", 57 * WAVE, -1.5, 1.5, "rad"))
    assert "swapped sign" in str(speed_suspicion("w", -2 * np.cos(2 * T), WAVE, 0.01))
    assert "another unit" in str(speed_suspicion("w", 114 * np.cos(2 * T), WAVE, 0.01))
    assert "swapped sign" in str(command_suspicion("j", -WAVE, WAVE))
