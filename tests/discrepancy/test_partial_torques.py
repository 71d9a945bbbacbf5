"""A balance of forces is judged at the joints whose torques are known; that the others move counts all the same."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from way_samples import measure, measured, samples

from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.last_word import last_word
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.sharing import apart
from ee_dist.discrepancy.ways.force_balance.motion import motor_torques
from ee_dist.discrepancy.ways.force_balance.noise import RESOLVED
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.effects.catalogue import term
from ee_dist.engines.drivers import Commands
from ee_dist.measurements.errors import MeasurementError
from ee_dist.recording.reader import read_logs
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.instruments import MOTOR_TORQUE
from ee_dist.robots.model import Robot, Sensor

FRICTION = (term("coulomb_friction", "shoulder", torque_nm=0.3),)


def without(trials: tuple[MeasuredTrial, ...], *gone: int) -> tuple[MeasuredTrial, ...]:
    """The same trials, as if nobody had measured the torques of some joints."""
    out = []
    for t in trials:
        assert t.log.torques is not None
        torques = t.log.torques.copy()
        torques[:, gone] = math.nan
        out.append(replace(t, log=replace(t.log, torques=torques)))
    return tuple(out)


def arm() -> Robot:
    return samples()["arm"].robot


@cache
def known_at(joint: int) -> ForceBalance:
    return ForceBalance(without(measured("arm"), 1 - joint), arm())


@pytest.mark.parametrize("joint", [0, 1])
def test_what_is_left_at_a_joint_is_the_same_whatever_is_known_of_another(joint: int) -> None:
    whole, part = ForceBalance(measured("arm"), arm()), known_at(joint)
    assert part.channels == (arm().motor_names[joint],) and part.layout.joint_of_channel == (joint,)
    for model in ((), FRICTION):
        both, own = (p.raw(p.residuals([model])[0]) for p in (whole, part))
        at_joint = both[whole.channel_of == joint]
        assert own == pytest.approx(at_joint, abs=0.02 * float(np.abs(at_joint).max()))
    of_joint = [s for s in whole.series(()) if s.channel == joint]
    for one, other in zip(part.series(()), of_joint, strict=True):
        assert np.array_equal(one.measured, other.measured)
    assert part.remains(()).motor == arm().motor_names[joint]


def test_it_is_said_where_torques_are_compared_and_where_they_are_not_known() -> None:
    (said,) = [n for n in known_at(0).notes if "Torques" in n]
    assert "compared at 1 of 2 joints: shoulder." in said and "At elbow they are not known: how it moves counts" in said
    assert not [n for n in ForceBalance(measured("arm"), arm()).notes if "Torques" in n]


def test_wrong_torques_of_one_joint_left_out_do_not_drown_those_of_another() -> None:
    trials = measure(samples()["arm"], FRICTION)
    wrong = tuple(replace(t, log=replace(t.log, torques=t.log.torques * [1.0, -0.2])) for t in trials)  # type: ignore[operator]
    drowned, left = (ForceBalance(t, arm()) for t in (wrong, without(wrong, 1)))
    errors = [[p.natural(float(np.sqrt(np.mean(r**2)))) for r in p.residuals([(), FRICTION])] for p in (drowned, left)]
    assert errors[0][1] > 3 and errors[1][1] < 0.1 * errors[1][0] < 0.1


def test_nothing_is_proposed_where_it_cannot_show() -> None:
    at = {k: {c.name for c in pool_of(known_at(k))} for k in (0, 1)}
    assert "coulomb_friction@shoulder" in at[0] and "coulomb_friction@elbow" not in at[0]
    # What the elbow carries weighs on the shoulder; what the shoulder carries does not on the elbow.
    assert {"part_mass@upper", "part_mass@lower"} <= at[0]
    assert "part_mass@lower" in at[1] and "part_mass@upper" not in at[1]
    assert "coulomb_friction@all_joints" not in at[0] | at[1]
    assert "coulomb_friction@all_joints" in {c.name for c in pool_of(ForceBalance(measured("arm"), arm()))}


def test_what_joints_share_is_looked_for_at_those_that_are_measured(monkeypatch: pytest.MonkeyPatch) -> None:
    whole = ForceBalance(measured("arm"), arm())
    every = pool_of(whole)
    monkeypatch.setattr(whole, "unjudged", ("a joint of another arm",))
    assert pool_of(whole) == every
    shared = candidate(arm(), "viscous_friction", "all_joints")
    for problem, members in ((whole, ["shoulder", "elbow"]), (known_at(0), ["shoulder"])):
        found = apart(problem, Current((shared,), np.array([0.2])), 0)
        assert [c.target for c in found.parts] == members and len(found.u) == len(members)


def test_trials_are_compared_where_all_know_the_torques() -> None:
    one, two, *_ = measured("arm")
    (part,) = without((two,), 1)
    assert ForceBalance((one, part), arm()).channels == ("shoulder",)
    (other,) = without((one,), 0)
    with pytest.raises(MeasurementError, match="no joint of small_arm has its torque known in every trial"):
        ForceBalance((other, part), arm())
    with pytest.raises(MeasurementError, match="has no torques of the drives"):
        ForceBalance(without((one,), 0, 1), arm())


def test_a_meter_at_one_motor_is_enough() -> None:
    t = measured("arm")[0]
    assert t.log.torques is not None
    meter = Sensor("current", MOTOR_TORQUE, "elbow", "N.m")
    robot = replace(arm(), sensors=(*arm().sensors, meter))
    log = replace(
        t.log, sensors=np.column_stack([t.log.sensors, t.log.torques[:, 1]]), torques=None,
        sensor_names=(*t.log.sensor_names, "current"), sensor_units=(*t.log.sensor_units, "N.m"),
    )  # fmt: skip
    found = motor_torques(log, robot)
    assert found is not None and np.isnan(found[:, 0]).all() and np.array_equal(found[:, 1], t.log.torques[:, 1])
    assert ForceBalance((replace(t, log=log),), robot).channels == ("elbow",)


def test_a_recording_keeps_which_torques_are_not_known(tmp_path: Path) -> None:
    (trial,) = without(measured("arm")[:1], 1)
    log = trial.log
    with RunWriter(tmp_path / "part.mcap", arm(), {"task": "import"}) as writer:
        writer.trial(TrialRecord(0, "part", HARDWARE, Commands(log.commands.copy()), log, ()))
    (record,) = read_logs(tmp_path / "part.mcap")
    assert log.torques is not None and record.log.torques is not None
    assert np.array_equal(record.log.torques, log.torques, equal_nan=True)


def test_a_torque_of_a_few_steps_of_its_readings_does_not_outweigh_the_others() -> None:
    """An idle wrist read in steps as large as its torque: what is off there is a hundred times as much, and means nothing."""
    rms = float(
        np.sqrt(np.mean([np.mean(t.log.torques[:, 1] ** 2) for t in measured("arm") if t.log.torques is not None]))
    )
    for steps, coarse in ((2.0, (1,)), (200.0, ())):
        size, read = rms / steps, []
        for t in measured("arm"):
            assert t.log.torques is not None
            torques = t.log.torques.copy()
            torques[:, 1] = size * np.round(torques[:, 1] / size)
            read.append(replace(t, log=replace(t.log, torques=torques)))
        problem = ForceBalance(read, arm())
        assert problem.coarse == coarse
        assert any("a few steps of the readings" in n for n in problem.notes) == bool(coarse)
        assert problem.size[1] == pytest.approx(RESOLVED * size if coarse else rms, rel=0.1)
        # In newton metres what is left is what it was.
        left = problem.raw(problem.residuals([FRICTION])[0])[problem.channel_of == 0]
        plain = ForceBalance(measured("arm"), arm())
        assert left == pytest.approx(plain.raw(plain.residuals([FRICTION])[0])[plain.channel_of == 0], abs=1e-7)


def test_a_last_word_on_other_joints_than_were_fitted_says_so() -> None:
    both, one = ForceBalance(measured("arm"), arm()), known_at(0)
    for last, fitted, told in ((both, one, "at elbow too"), (one, both, "not at elbow"), (one, one, None)):
        word = last_word([last, last], [(), FRICTION], fitted.channels)
        lines = [line for line in word.lines if "the two errors are of other joints" in line]
        assert len(lines) == (told is not None) and all(f"it is judged {told}" in line for line in lines)
