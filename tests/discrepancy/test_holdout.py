"""Windows that are held out, of logs that have few of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from linear_problem import Linear
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.accounts.account import held_out_notes
from ee_dist.discrepancy.evidence.holdout import MOTIONS, _turn, bootstrap, joint_by_joint, travelling, windows
from ee_dist.discrepancy.problem import Problem
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


def arm_moved(*shares: tuple[float, float]) -> Problem:
    """The arm of two joints, in each trial moved by shares of what it does in another."""
    sample = samples()["arm"]
    trials = [t for t in measure(sample, ()) if t.log.joints is not None][: len(shares)]
    moved = []
    for k, (trial, share) in enumerate(zip(trials, shares, strict=True)):
        wave = np.sin((1 + k) * np.linspace(0.0, 6.0, len(trial.log.times_s)))[:, None]
        log = replace(trial.log, joints=0.5 * wave * share, commands=0.5 * wave * share)
        moved.append(replace(trial, name=f"{trial.name} {k}", log=log))
    return problem_by("open_loop", tuple(moved), sample.robot)


def test_motions_of_one_joint_each_are_not_held_out() -> None:
    """With the only motion of a joint held out nothing that is fitted says what it is like."""
    each = arm_moved((1.0, 0.0), (0.02, 1.0))
    assert joint_by_joint(each)
    assert travelling(each) == []
    assert held_out_notes(each) and not held_out_notes(arm_moved((1.0, 1.0), (0.5, 1.0)))


@pytest.mark.parametrize(
    ("ways", "apart"), [((1, -1), True), ((1, 1), False), ((1, -1, 1, -1), False), ((1, 0), False)]
)
def test_motions_of_one_way_each_are_not_held_out(ways: tuple[int, ...], apart: bool) -> None:
    """A shaft that turns forwards in one and backwards in the other (0: to and fro)."""
    sample = samples()["pendulum"]
    trials, moved = [t for t in measure(sample, ()) if t.log.joints is not None], []
    for k, way in enumerate(ways):
        trial = trials[k % len(trials)]
        t = np.linspace(0.0, 1.0, len(trial.log.times_s))[:, None]
        course = (way * (1 + 0.3 * k) * t**2 if way else np.sin(7 * t)) + 1e-4 * np.sin(9e3 * t)
        log = replace(trial.log, joints=course, commands=course)
        moved.append(replace(trial, name=f"{trial.name} {k}", log=log))
    problem = problem_by("open_loop", tuple(moved), sample.robot)
    assert joint_by_joint(problem) == apart
    assert bool(travelling(problem)) == (not apart)


@pytest.mark.parametrize("shares", [((1.0, 1.0), (0.5, 1.0)), ((1.0, 0.3), (0.3, 1.0)), ((1.0, 0.0), (0.5, 0.001))])
def test_motions_in_which_joints_move_together_or_twice_are_held_out(shares: tuple[tuple[float, float], ...]) -> None:
    both = arm_moved(*shares)
    assert not joint_by_joint(both)
    assert [c.name for c in travelling(both)] == [MOTIONS]


def test_two_groups_of_motions_do_not_fall_together_with_how_recordings_alternate() -> None:
    """Of series in which slow and quick, or three amplitudes, take turns each group has all kinds, and half of the motions."""
    for of in (5, 6, 8, 12, 18, 30):
        turns = np.array([_turn(k, of) for k in range(of)])
        assert abs(turns.sum() - of / 2) <= 1
        for period in (2, 3):
            for kind in range(period):
                mine = turns[kind::period]
                assert len(mine) < 3 or set(mine) == {0, 1}, (of, period, kind)
    assert [_turn(k, 4) for k in range(4)] == [0, 1, 2, 3], "few are held out one by one"
