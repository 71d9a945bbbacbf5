"""Of long records a search simulates some stretches, which say of a model what the whole says."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, replace
from functools import cache
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from way_samples import Sample, evaluator_for, measure, sines, two_joint_arm

from ee_dist.discrepancy.evidence.holdout import MOTIONS, held_out_by
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.ways.open_loop import stretches as module
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.discrepancy.ways.open_loop.stretches import Stretch, at_most, enough, forgets, unsettled
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.trials.noise import with_noise

ARM = with_noise(two_joint_arm(), 2e-4)
SECONDS = 40.0
HIDDEN: dict[str, Hypothesis] = {
    "friction": (term("coulomb_friction", "elbow", torque_nm=0.25),),
    "a controller that goes no faster": (term("command_speed", "shoulder", slowness_s_rad=0.7),),
    "late commands": (term("command_delay", "elbow", delay_s=0.03),),
    "a sensor that sticks late": (term("sensor_stuck", "position_elbow", share=1.0, from_s=13.1),),
}


@cache
def measured(name: str) -> tuple[MeasuredTrial, ...]:
    return measure(Sample(ARM, sines(ARM, 0.6, SECONDS), (), ()), HIDDEN[name])


def cut(name: str, most: int = 10_000) -> tuple[OpenLoop, OpenLoop]:
    """The whole, and what a search takes of it if it may take so many steps."""
    whole = OpenLoop(measured(name), ARM, evaluator_for(ARM))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MOST", most)
        return whole, whole.searched


@pytest.mark.parametrize("name", HIDDEN)
def test_stretches_say_of_a_model_what_the_whole_says(name: str) -> None:
    whole, some = cut(name)
    assert Counter(p.trial for p in some.parts) == {0: 7, 1: 7}
    right = [error(p.residuals([HIDDEN[name]])[0]) for p in (whole, some)]
    wrong = [error(p.residuals([()])[0]) for p in (whole, some)]
    assert right[1] < 1.1 * some.noise_floor()[0] and right[0] < 1.1 * whole.noise_floor()[0]
    assert wrong[1] == pytest.approx(wrong[0], rel=0.25) and wrong[1] > 3 * right[1]


def test_where_a_stretch_lies_is_told_in_the_time_of_its_record() -> None:
    _, some = cut("friction")
    starts = [float(name.split("@")[1].removesuffix("s")) for name in some.segments]
    spread = [t for t, k in zip(starts, some.trial_of_segment, strict=True) if k == 0]
    assert spread == sorted(spread) and spread[0] < SECONDS / 4 and spread[-1] > SECONDS / 2
    assert some.layout.time_s.max() <= SECONDS
    # What is compared of a stretch is what was read there.
    residuals = some.residuals([HIDDEN["friction"]])[0]
    assert np.isfinite(residuals).all()
    ends = [t for t, k in zip(some.layout.time_s, some.trial_of, strict=True) if k == 0]
    assert max(ends) > SECONDS - 0.5, "up to the end of a record whose length is no multiple of a stretch"


def test_motions_stay_the_evidence_and_people_are_told() -> None:
    whole, some = cut("friction")
    assert [c.name for c in held_out_by(some)] == [MOTIONS] == [c.name for c in held_out_by(whole)]
    (note,) = set(some.notes) - set(whole.notes)
    assert "of the 80 s, in 14 stretches" in note and "compare takes all of it" in note
    assert some.whole is whole is whole.whole, "what is drawn is all of it"
    assert some.as_searched(some) is some and whole.as_searched(some) is whole
    brief = some.beginning(8.0)
    assert isinstance(brief, OpenLoop) and len(brief.parts) == 4


def test_a_trial_that_is_shorter_than_a_stretch_is_one() -> None:
    long, other = measured("friction")
    short = replace(other, log=other.log.head(500), name="short")
    whole = OpenLoop([long, short], ARM, evaluator_for(ARM))
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MOST", 10_000)
        patch.setattr(module, "FEWEST", 5)
        some = whole.searched
    assert Counter(p.trial for p in some.parts) == {0: 4, 1: 1} and some.parts[-1].run is short
    assert np.isfinite(some.trust).all() and len(some.trust) == 2
    parts = [r[some.trial_of == 1] for r in some.residuals([(), HIDDEN["friction"]])]
    kept = [r[whole.trial_of == 1] for r in whole.residuals([(), HIDDEN["friction"]])]
    np.testing.assert_allclose([error(r) for r in parts], [error(r) for r in kept], rtol=0.05)


def test_short_records_are_simulated_as_they_are() -> None:
    whole, some = cut("friction", 10**9)
    assert some is whole


def real(trial: MeasuredTrial, first: int) -> MeasuredTrial:
    """The trial from a row on, as one of somebody's hardware."""
    return replace(trial, log=trial.log.part(first, first + 800), driver=None, commands_held=True, hardware=True)


def test_a_real_trial_that_begins_in_motion_is_compared_once_it_has_settled() -> None:
    """Nobody knows what the controllers were told before: here a command that is far from where the arm is."""
    moving, standing = real(measured("friction")[0], 300), real(measured("friction")[0], 0)
    rows = round(module.SETTLED_S / ARM.time_step_s)
    assert unsettled(moving, ARM) == rows and unsettled(standing, ARM) == 0
    assert unsettled(replace(moving, log=moving.log.head(2 * rows)), ARM) == 0, "of a short one that would be much"
    assert unsettled(replace(moving, commands_held=False, hardware=False), ARM) == 0, "of a simulated one all is known"
    problem = OpenLoop([moving, standing], ARM, evaluator_for(ARM))
    first = [float(problem.layout.time_s[(problem.trial_of == k) & problem.layout.reading].min()) for k in (0, 1)]
    assert first[0] >= module.SETTLED_S - problem.block * ARM.time_step_s and first[1] < 0.1
    (note,) = [n for n in problem.notes if "begins in motion" in n]
    assert moving.name in note and "1 trial" in note
    thrown = moving.log.joints.copy()
    thrown[0] += 0.2
    off = replace(moving, log=replace(moving.log, joints=thrown))
    ends = [error(OpenLoop([t], ARM, evaluator_for(ARM)).residuals([HIDDEN["friction"]])[0]) for t in (moving, off)]
    assert ends[1] < 1.2 * ends[0], "it has forgotten where it began"


def test_a_robot_that_does_not_forget_is_simulated_from_where_it_began() -> None:
    trials = measured("friction")
    assert forgets(ARM, trials)
    drives = tuple(replace(d, ki=1.0) for d in ARM.drives)
    pushed = tuple(replace(d, command="torque") for d in ARM.drives)
    assert not forgets(replace(ARM, drives=drives), trials)
    assert not forgets(replace(ARM, drives=pushed), trials)
    assert not forgets(quadruped_lab(), trials)
    assert not forgets(ARM, [replace(t, log=replace(t.log, joints=None)) for t in trials])


@given(st.lists(st.integers(1, 40), min_size=1, max_size=6), st.integers(1, 12))
def test_each_trial_keeps_so_many_in_order(counts: list[int], most: int) -> None:
    trial = measured("friction")[0]
    of = [Stretch(k, replace(trial)) for k, n in enumerate(counts) for _ in range(n)]
    some = at_most(of, most)
    assert Counter(s.trial for s in some) == {k: min(n, most) for k, n in enumerate(counts)}
    places = [next(i for i, s in enumerate(of) if s is own) for own in some]
    assert places == sorted(places)
    taken = sum(min(n, enough(ARM, of)) for n in counts)
    assert taken <= max(module.FEWEST, len(counts), module.MOST // (len(ARM.drives) * len(trial.log)))


def test_of_many_trials_with_a_stretch_each_they_are_not_all_the_first() -> None:
    of = [Stretch(k, _Part(first)) for k in range(12) for first in range(8)]
    taken = [s.run.first for s in at_most(of, 1)]
    assert len(taken) == 12 and set(taken) >= {0, 1, 2, 3, 4, 5, 6, 7}


@dataclass(frozen=True)
class _Part:
    first: int


@given(st.integers(0, 40), st.integers(0, 900), st.integers(1, 300))
def test_stretches_of_a_trial_reach_over_all_of_it_and_do_not_overlap(number: int, more: int, count: int) -> None:
    rows = count + more
    firsts = module._firsts(number, rows, count)
    assert len(firsts) == rows // count
    assert all(b - a >= count for a, b in pairwise([*firsts, rows]))
    if len(firsts) > 1:
        assert firsts[0] == 0 and firsts[-1] == rows - count


def test_a_trial_whose_first_readings_are_one_number_began_at_rest() -> None:
    """Of an encoder with coarse steps the curve through what follows has a speed."""
    trial = real(measured("friction")[0], 300)
    assert unsettled(trial, ARM) > 0
    joints = trial.log.joints.copy()
    joints[:60] = joints[0]
    stood = replace(trial, log=replace(trial.log, joints=joints))
    assert unsettled(stood, ARM) == 0
