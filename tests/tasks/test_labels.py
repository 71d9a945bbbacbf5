"""A trial is named with its number wherever it is named: repeats of a motion have one name."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np

from ee_dist.tasks.results.labels import trial_name, worst_trials


def test_the_worst_trial_is_told_from_its_repeat() -> None:
    problem = SimpleNamespace(
        trials=("sway", "sway"), channels=("a", "b"), trial_of_segment=np.array([0, 0, 1]), robot=None
    )
    found = SimpleNamespace(heat=np.array([[1.0, 0.0], [3.0, 1.0], [2.0, 5.0]]))
    assert worst_trials(problem, found) == {"a": "1. sway", "b": "2. sway"}  # type: ignore[arg-type]
    assert trial_name(SimpleNamespace(trials=("sway",)), 0) == "sway"  # type: ignore[arg-type]
