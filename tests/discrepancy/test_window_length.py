"""Windows of free runs are longer where what their starts are off by would drown what the model is off by."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from test_windows import quiet, trial_of
from way_samples import evaluator_for, samples

from ee_dist.discrepancy.evidence import judge as judging
from ee_dist.discrepancy.evidence.rule import OF_STARTS
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.ways.free_run.windows import RESTART_S, SECOND, longer, most_telling
from ee_dist.effects.catalogue import Term, apply, term

NOISE_RAD = 1e-3


def heavier(rotor: float) -> Term:
    return term("rotor_inertia", "servo", added_kg_m2=0.2 * rotor)


def servo(rotor: float) -> FreeRun:
    """A servo without a sensor of speed, whose rotor coasts on what its start is off by, and is a fifth heavier than described.
    The heavier it is, the farther it coasts."""
    robot = quiet(samples()["pendulum"].robot)
    robot = replace(robot, sensors=tuple(s for s in robot.sensors if s.kind == "position"))
    robot = robot.map_drive("servo", lambda d: replace(d, rotor_inertia=rotor, kp=2.0, kd=0.3))
    trial = trial_of(apply(robot, (heavier(rotor),)), 12.0)
    read = trial.log.sensors + NOISE_RAD * np.random.default_rng(0).standard_normal(trial.log.sensors.shape)
    noisy = replace(trial, log=replace(trial.log, sensors=read, joints=read))
    return FreeRun((noisy,), robot, evaluator_for(robot))


@pytest.mark.parametrize(("rotor", "longer_ones"), [(0.2, True), (0.01, False)])
def test_a_robot_that_is_held_is_started_anew_less_often_where_starts_say_little(
    rotor: float, longer_ones: bool
) -> None:
    problem = servo(rotor)
    found, usual = problem.searched, problem._by(RESTART_S)
    assert isinstance(found, FreeRun) and found.windows_s is not None
    assert (found.windows_s > RESTART_S) == longer_ones == usual.layout.by_segment
    if longer_ones:
        assert found.windows_s <= 6.6, "two of a record at least"
        assert f"windows of {found.windows_s:g} s" in found.error_definition
        as_described, right = ([float(r @ r) for r in p.residuals([(), (heavier(rotor),)])] for p in (usual, found))
        assert as_described[0] < 1.6 * as_described[1], "in short ones there is nothing to be seen"
        assert right[0] > 2.0 * right[1]
        assert right[1] < 1.3 * float(found.floor.sum()), "the truth is at the floor"


def test_what_took_no_part_is_judged_in_windows_as_long() -> None:
    fitted, apart = servo(0.2).searched, servo(0.01)
    assert isinstance(fitted, FreeRun) and fitted.windows_s != RESTART_S
    assert apart.as_searched(fitted).windows_s == fitted.windows_s
    assert fitted.as_searched(fitted) is fitted


@given(st.floats(0.1, 4.0), st.floats(0.1, 60.0))
def test_windows_double_as_long_as_each_record_has_two(first: float, shortest: float) -> None:
    found = list(longer(first, shortest))
    assert all(s <= SECOND * shortest for s in found)
    assert found == [first * 2.0 ** (k + 1) for k in range(len(found))]
    assert not found or 2.0 * found[-1] > SECOND * shortest


@pytest.mark.parametrize(
    ("above", "taken"), [((2.0, 1.0, 1.5), 0.5), ((2.0, 2.4, 2.4), 0.5), ((2.0, 3.0, 2.8), 1.0), ((0.0, 0.0, 0.0), 0.5)]
)
def test_much_more_has_to_be_seen_in_longer_windows(above: tuple[float, ...], taken: float) -> None:
    by_length = dict(zip((0.5, 1.0, 2.0), above, strict=True))
    assert most_telling(0.5, longer(0.5, 4.0), by_length.__getitem__) == taken
    assert most_telling(0.5, longer(0.5, 1.5), by_length.__getitem__) == 0.5, "there are none"


def test_what_coasts_as_far_on_a_wrong_start_is_told_by_what_it_takes_off(monkeypatch: pytest.MonkeyPatch) -> None:
    """So few windows are left that what starts do in them may be nearly all, by itself; but a heavier rotor does not tame it."""
    found = servo(0.2).searched
    rotor = candidate(found.robot, "rotor_inertia", "servo")
    (judged,) = explain(found, [rotor]).candidates
    assert judged.earned and judged.hypothesis[0].values[0][1] == pytest.approx(0.04, rel=0.2)
    monkeypatch.setattr(judging, "tamed", lambda *_: np.inf)
    assert explain(found, [rotor]).candidates[0].why_not == OF_STARTS
