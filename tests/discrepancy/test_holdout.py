"""Windows that are held out, of logs that have few of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import Linear
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.evidence.holdout import bootstrap, windows
from ee_dist.effects.catalogue import Hypothesis


class OneEach(Linear):
    """Eight trials of a window each."""

    def __init__(self, hidden: Hypothesis) -> None:
        super().__init__(hidden, motions=8)
        values = len(self.data)
        self.layout = replace(
            self.layout,
            segments=tuple(f"trial {k}" for k in range(8)),
            trial_of_segment=np.arange(8),
            segment_of=np.arange(values) * 8 // values,
        )


def test_trials_of_a_single_window_vary_among_one_another() -> None:
    groups = windows(OneEach(())).groups
    assert len(set(groups.tolist())) == 1
    low, high = bootstrap(np.array([-30.0, -25, -40, 250, -10, -20, -15, -5]), groups=groups)
    assert low < 0 < high
    assert len(set(windows(Linear((), motions=2)).groups.tolist())) == 2


@pytest.mark.parametrize("rows", [60, 119, 200])
def test_however_short_a_log_is_there_is_something_to_hold_out(rows: int) -> None:
    sample = samples()["pendulum"]
    (trial, *_) = measure(sample, ())
    log = trial.log
    cut = replace(
        log,
        times_s=log.times_s[:rows],
        sensors=log.sensors[:rows],
        commands=log.commands[:rows],
        base_pose=None,
        joints=None,
        torques=None,
    )
    problem = problem_by("open_loop", (replace(trial, log=cut),), sample.robot)
    assert windows(problem).folds == 2
