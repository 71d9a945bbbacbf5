"""A signal or a lost Ray while a trial is made: one that has reached its end is kept, whatever comes in between."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from ee_dist import leaving
from ee_dist.basics.uncut import keeping, trial_on_hardware
from ee_dist.engines.drivers import Commands
from ee_dist.evaluation.stepped import SteppedRobot
from ee_dist.recording.reader import read_logs
from ee_dist.robots.quadruped import quadruped
from ee_dist.tasks.config import Config
from ee_dist.tasks.recover import Options
from ee_dist.tasks.unfinished import Unfinished
from ee_dist.trials.hardware import Limits, Reading

STEPS = 12
DRIVE = Commands(np.zeros((STEPS, 8)))


class Body:
    """Answers zeros; ``at`` a step it does ``what`` before it answers."""

    def __init__(self, at: int, what: Any) -> None:
        self.at, self.what, self.trials, self.done = at, what, 0, 0

    def begin(self, trial: int, steps: int, step_s: float) -> Reading:
        self.step_now, self.trials = 0, self.trials + 1
        return Reading(np.zeros(8))

    def step(self, commands: np.ndarray) -> Reading:
        self.step_now += 1
        if self.step_now == self.at:
            self.what()
        over = self.step_now == STEPS
        self.done += over
        return Reading(np.full(8, 0.01 * self.step_now), None, {"travel_m": 1.0} if over else None)

    def abort(self) -> None:
        self.step_now = -1


@pytest.fixture
def armed(monkeypatch):
    for name in ("_leaving", "_left"):
        monkeypatch.setattr(leaving, name, getattr(leaving, name))
    before = signal.getsignal(signal.SIGTERM)
    leaving.arm()
    yield
    signal.signal(signal.SIGTERM, before)
    leaving.disarm()


def remembered(folder: Path, body: Body) -> tuple[Any, SteppedRobot]:
    robot = quadruped()
    inner = SteppedRobot(body, robot, Limits())
    return Unfinished(folder, Config(), Options()).hardware("changed", inner, robot), inner


def end_me() -> None:
    os.kill(os.getpid(), signal.SIGTERM)


def test_a_trial_whose_end_and_a_signal_come_together_is_kept_and_not_asked_for_again(tmp_path, armed):
    body = Body(STEPS, end_me)
    hardware, inner = remembered(tmp_path, body)
    with pytest.raises(leaving.Left):
        hardware.trial(DRIVE, STEPS)
    (record,) = read_logs(tmp_path / "unfinished" / "changed_0000.mcap")
    assert record.log.sensors.tobytes() == inner.made.sensors.tobytes()
    assert not list(tmp_path.glob("aborted*"))
    again, _ = remembered(tmp_path, body)
    assert len(again.trial(DRIVE, STEPS)) == STEPS
    assert (body.trials, body.done) == (1, 1)


def test_a_signal_while_it_is_written_waits(tmp_path, armed, monkeypatch):
    hardware, _ = remembered(tmp_path, Body(0, None))
    begin = hardware.run.begin
    monkeypatch.setattr(hardware.run, "begin", lambda: (end_me(), begin()))
    with pytest.raises(leaving.Left):
        hardware.trial(DRIVE, STEPS)
    assert len(read_logs(tmp_path / "unfinished" / "changed_0000.mcap")) == 1


def test_a_signal_in_the_middle_stops_the_body(tmp_path, armed):
    body = Body(STEPS // 2, end_me)
    hardware, _ = remembered(tmp_path, body)
    with pytest.raises(leaving.Left):
        hardware.trial(DRIVE, STEPS)
    assert body.step_now == -1
    (record,) = read_logs(tmp_path / "aborted_changed_0000_1.mcap")
    assert len(record.log) == STEPS // 2
    assert not (tmp_path / "unfinished" / "changed_0000.mcap").exists()


class LostError(Exception):
    pass


def test_what_is_lost_elsewhere_is_told_after_the_trial(tmp_path):
    body = Body(3, lambda: trial_on_hardware.interrupt(LostError()))
    hardware, _ = remembered(tmp_path, body)
    with pytest.raises(LostError):
        hardware.trial(DRIVE, STEPS)
    assert body.done == 1
    assert len(read_logs(tmp_path / "unfinished" / "changed_0000.mcap")) == 1
    with pytest.raises(LostError):
        trial_on_hardware.interrupt(LostError())


def test_a_stretch_within_a_stretch_ends_with_the_outer_one():
    ended = []

    def outer() -> None:
        with keeping:
            with keeping:
                keeping.interrupt(LostError())
            ended.append("inner")

    with pytest.raises(LostError):
        outer()
    assert ended == ["inner"] and not keeping.under_way
