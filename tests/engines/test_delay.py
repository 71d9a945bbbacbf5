"""A delay gives each value as it was, on straight lines between the steps: the bits of what one writes down first."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.engines.delay import Delay


@settings(max_examples=40, deadline=None)
@given(robots=st.integers(1, 4), places=st.integers(1, 5), longest=st.floats(0.0, 0.08), seed=st.integers(0, 2**32 - 1))
def test_each_value_as_it_was(robots: int, places: int, longest: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    delay_s = longest * rng.choice([0.0, 0.25, 1.0, rng.random()], (robots, places))
    steps = delay_s / 0.01
    whole = np.floor(steps + 1e-9).astype(int)
    part = np.clip(steps - whole, 0.0, 1.0)
    values = rng.normal(size=(25, robots, places))
    delay = Delay(delay_s, 0.01)
    for now, value in enumerate(values):
        near, far = (
            np.take_along_axis(values, np.maximum(now - whole - k, 0)[None], axis=0)[0] for k in (0, 1)
        )  # fmt: skip
        known = np.where(part > 0, near * (1 - part) + far * part, near)
        assert delay(value).tobytes() == known.tobytes()
