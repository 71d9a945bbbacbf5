"""A robot in a process of its own behind a socket: the same result as the simulated one, whatever is unplugged."""

from __future__ import annotations

import contextlib
import json
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
import pytest

from ee_dist.engines.drivers import Commands, Network, weight_count
from ee_dist.evaluation.socket_body import SocketBody
from ee_dist.evaluation.stepped import SteppedRobot
from ee_dist.recording.reader import read_logs
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped import quadruped
from ee_dist.trials.hardware import HardwareError, Limiter, Limits, Reading

ROBOT = Path(__file__).parents[2] / "docs" / "examples" / "socket_robot.py"
FAST = (
    "evaluator=serial", "engine=mujoco", "budget.compensating_trials=1", "budget.polish=0", "budget.population=4",
    "budget.diagnosis_population=4", "budget.tournament=2", "budget.crossovers=1", "budget.generations=1",
    "budget.diagnosis_generations=1",
)  # fmt: skip


@dataclass
class Plugged:
    address: str
    done: list[int] = field(default_factory=list)
    """Numbers of the trials that it finished; known once its process has ended."""


@contextlib.contextmanager
def plugged_in(*arguments: str, again: Plugged | None = None) -> Iterator[Plugged]:
    """``again``: at the same address as that one."""
    port = again.address.rpartition(":")[2] if again else "0"
    command = [sys.executable, str(ROBOT), "--port", port, "--engine", "mujoco", *arguments]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        robot = Plugged(process.stdout.readline().split()[-1])
        try:
            yield robot
        finally:
            process.kill()
            robot.done += [int(line.split()[1]) for line in process.stdout if line.endswith("done\n")]


def result_digest(folder: Path) -> str:
    return str(json.loads((folder / "summary.json").read_text())["result_digest"])


def test_recovery_on_it_with_the_plug_pulled_and_a_resume_ends_as_the_undisturbed_one_does(cli, tiny, tmp_path):
    base = ("+scenario=8", *tiny, *FAST)
    simulated = cli(*base, f"hydra.run.dir={tmp_path}/simulated")
    assert simulated.status == 0, simulated.err
    out, whole = tmp_path / "own", tmp_path / "whole"
    with plugged_in() as undisturbed:
        ask = (*base, f"hardware.address={undisturbed.address}")
        assert cli(*ask, f"hydra.run.dir={whole}").status == 0
    assert undisturbed.done == [0, 1, 2]
    with plugged_in("--unplug", "1:30", again=undisturbed) as before:
        stopped = cli(*ask, f"hydra.run.dir={out}")
    assert stopped.status == 2
    (line,) = stopped.err.strip().splitlines()
    assert f"trial 2, step 30 of 80: hardware.address={before.address}: the robot does not answer any more" in line
    assert "go on with the same command and resume=" in line
    (aborted,) = read_logs(out / "aborted_changed_0000_1.mcap")
    assert len(aborted.log) == 30
    gone = cli(*ask, f"resume={out}")
    assert gone.status == 2
    assert "no robot answers there" in gone.err
    with plugged_in(again=undisturbed) as after:
        careless = cli(*ask, "hardware.speed=3", f"resume={out}")
        resumed = cli(*ask, f"resume={out}")
    assert careless.status == 2
    assert "the run there has other settings (hardware.speed=" in careless.err
    assert resumed.status == 0, resumed.err
    assert (before.done, after.done) == ([0], [1, 2]), "a finished trial was asked for again"
    assert len({result_digest(f) for f in (tmp_path / "simulated", whole, out)}) == 1
    assert (out / "recovery.mcap").read_bytes() == (whole / "recovery.mcap").read_bytes()
    assert aborted.log.sensors.tobytes() == read_logs(out / "recovery.mcap")[1].log.head(30).sensors.tobytes()
    assert (out / "aborted_changed_0000_1.mcap").exists()


def test_trials_of_it_with_the_plug_pulled_and_a_resume_are_recorded_as_the_undisturbed_ones_are(cli, tmp_path):
    asked = ("task=trial", "engine=mujoco", "task.excitations=['sway:seconds=0.5,amplitude=0.1']", "task.repeats=2")
    robot, out, whole = ("--robot", "quadruped_lab", "--scenario", "none"), tmp_path / "own", tmp_path / "whole"
    with plugged_in(*robot) as undisturbed:
        ask = (*asked, f"hardware.address={undisturbed.address}")
        outcome = cli(*ask, f"hydra.run.dir={whole}")
        refused = cli("task=trial", "+hidden=drag", f"hardware.address={undisturbed.address}")
    assert outcome.status == 0, outcome.err
    assert [len(r.log) for r in read_logs(whole / "trial.mcap")] == [50, 50]
    assert not (whole / "sealed.json").exists(), "nobody knows what it hides"
    assert refused.status == 2
    assert "leave out hidden" in refused.err
    with plugged_in(*robot, "--unplug", "1:20", again=undisturbed) as before:
        stopped = cli(*ask, f"hydra.run.dir={out}")
    assert stopped.status == 2
    (line,) = stopped.err.strip().splitlines()
    assert "trial 2, step 20 of 50" in line
    assert "go on with the same command and resume=" in line
    (aborted,) = read_logs(next(out.glob("aborted_*.mcap")))
    with plugged_in(*robot, again=undisturbed) as after:
        resumed = cli(*ask, f"resume={out}")
    assert resumed.status == 0, resumed.err
    assert (undisturbed.done, before.done, after.done) == ([0, 1], [0], [1])
    assert result_digest(out) == result_digest(whole)
    assert (out / "trial.mcap").read_bytes() == (whole / "trial.mcap").read_bytes()
    assert aborted.log.sensors.tobytes() == read_logs(out / "trial.mcap")[1].log.head(20).sensors.tobytes()


class Dummy:
    """A body that answers what it is told to."""

    def __init__(self, torque: float = 0.0, sensors: int = 8, fail_at: int = 10**9, **rest: object) -> None:
        self.torque, self.sensors, self.fail_at = torque, sensors, fail_at
        self.rest = {"travel_m": 1.0, **rest}
        self.sent: list[np.ndarray] = []
        self.stopped, self.steps = 0, 0

    def begin(self, trial: int, steps: int, step_s: float) -> Reading:
        self.steps = steps
        return Reading(np.zeros(self.sensors))

    def step(self, commands: np.ndarray) -> Reading:
        self.sent.append(commands)
        if len(self.sent) == self.fail_at:
            raise KeyboardInterrupt
        over = len(self.sent) == self.steps
        return Reading(np.zeros(self.sensors), np.full(8, self.torque * len(self.sent)), self.rest if over else None)

    def abort(self) -> None:
        self.stopped += 1


def test_no_command_leaves_that_is_outside_of_the_limits():
    robot, rng = quadruped(), np.random.default_rng(0)
    wild = rng.normal(scale=5.0, size=(60, 8))
    body = Dummy()
    limits = Limits(range_share=0.5, speed=2.0, acceleration=50.0)
    log = SteppedRobot(body, robot, limits).trial(Commands(wild), 60)
    sent = np.array(body.sent)
    assert np.array_equal(log.commands, sent)
    joints = [robot.joint(d.joint) for d in robot.drives]
    half = np.array([(j.upper - j.lower) / 2 for j in joints])
    middle = np.array([(j.upper + j.lower) / 2 for j in joints])
    assert (np.abs(sent - middle) <= half * 0.5 + 1e-12).all()
    moved = np.diff(np.concatenate([np.zeros((1, 8)), sent]), axis=0)
    assert np.abs(moved).max() <= 2.0 * robot.time_step_s + 1e-12
    assert np.abs(moved).max() > 1.9 * robot.time_step_s, "the limits were never reached"
    within = np.clip(wild, [j.lower for j in joints], [j.upper for j in joints])
    free = Dummy()
    SteppedRobot(free, robot, Limits()).trial(Commands(within), 60)
    assert np.array(free.sent).tobytes() == within.tobytes(), "what is allowed is sent as it is"


def test_a_command_brakes_before_the_end_of_the_range():
    robot, most = quadruped(), 50.0
    limiter = Limiter(robot, Limits(speed=5.0, acceleration=most))
    asked = np.concatenate([np.full((60, 8), 9.0), np.full((90, 8), -9.0)])
    sent = np.array([np.zeros(8), np.zeros(8), *[limiter(a) for a in asked]])
    speed = np.diff(sent, axis=0) / robot.time_step_s
    assert np.abs(np.diff(speed, axis=0)).max() <= most * robot.time_step_s * (1 + 1e-6)
    upper = robot.joint(robot.drives[0].joint).upper
    assert sent[:, 0].max() == pytest.approx(upper) and sent[:, 0].min() < 0, "it does not come to the end at all"


def standing(start: float, lower: float, upper: float, **drive: object) -> Robot:
    robot = quadruped()
    for name in robot.motor_names:
        robot = robot.with_joint(name, start=start, lower=lower, upper=upper).with_drive(name, **drive)
    return robot


def test_the_first_command_begins_where_the_robot_stands():
    limiter = Limiter(standing(1.5, -2.0, 2.0), Limits(speed=1.0))
    assert limiter(np.full(8, 1.5)).tolist() == [1.5] * 8
    outside = standing(0.0, 0.0, 2.0)
    with pytest.raises(HardwareError, match=r"range_share=0\.5: .* starts at 0, outside of 0\.5 to 1\.5") as caught:
        SteppedRobot(Dummy(), outside, Limits(range_share=0.5))
    assert "\n" not in str(caught.value)


def test_drives_that_obey_torques_or_speeds_are_limited_in_their_own_units():
    torque = standing(0.0, -0.5, 0.5, command="torque", torque_limit=8.0)
    assert Limiter(torque, Limits())(np.full(8, 6.0)).tolist() == [6.0] * 8
    assert Limiter(torque, Limits(torque=3.0))(np.full(8, -6.0)).tolist() == [-3.0] * 8
    with pytest.raises(HardwareError, match=r"hardware\.speed=1: .* obeys torques"):
        Limiter(torque, Limits(speed=1.0))
    speed = standing(0.0, -0.5, 0.5, command="speed", speed_limit=8.0)
    limiter = Limiter(speed, Limits(speed=2.0, acceleration=100.0))
    assert limiter(np.full(8, 6.0)) == pytest.approx(np.full(8, 100.0 * speed.time_step_s))
    assert np.max([limiter(np.full(8, 6.0)) for _ in range(9)]) == 2.0
    body = Dummy()
    count = weight_count(len(torque.sensors), 8)
    SteppedRobot(body, torque, Limits()).trial(Network((0.0,) * (count - 1) + (1.0,)), 3)
    assert body.sent[-1][-1] == 8.0, "a network's 1 is the largest torque, as in the engines"


def test_what_limits_make_no_number_is_never_sent():
    limiter = Limiter(quadruped(), Limits())
    limiter.low = np.full(8, np.nan)
    with pytest.raises(HardwareError, match="not 8 numbers"):
        limiter(np.zeros(8))


def test_what_ends_a_trial_stops_the_body_and_keeps_what_was_measured():
    robot, drive = quadruped(), Commands(np.zeros((40, 8)))
    hot = SteppedRobot(Dummy(torque=0.1), robot, Limits(torque=1.05))
    with pytest.raises(
        HardwareError, match=r"trial 1, step 11 of 40: 1\.1 N\.m at .*, beyond the limit of 1\.05"
    ) as caught:
        hot.trial(drive, 40)
    assert caught.value.log is not None and len(caught.value.log) == 11
    assert (hot.body.stopped, hot.trials) == (1, 0)
    interrupted = SteppedRobot(Dummy(fail_at=7), robot, Limits())
    with pytest.raises(KeyboardInterrupt):
        interrupted.trial(drive, 40)
    assert interrupted.body.stopped == 1
    assert interrupted.aborted is not None and len(interrupted.aborted) == 7
    with pytest.raises(HardwareError, match="expected 8 numbers"):
        SteppedRobot(Dummy(sensors=3), robot, Limits()).trial(drive, 40)
    with pytest.raises(HardwareError, match="not 8 numbers"):
        Limiter(robot, Limits())(np.full(8, np.nan))


@pytest.mark.parametrize(
    ("name", "value"),
    [("travel_m", "far"), ("travel_m", [1.0]), ("joints", [[0.0], [0.0, 1.0]]), ("supply_v", {"a": 1})],
)
def test_an_end_that_cannot_be_read_is_one_line_and_the_log_is_kept(name, value):
    robot, drive = quadruped(), Commands(np.zeros((20, 8)))
    with pytest.raises(HardwareError, match=f"trial 1, step 20 of 20: at the end it answered {name}") as caught:
        SteppedRobot(Dummy(**{name: value}), robot, Limits()).trial(drive, 20)
    assert "\n" not in str(caught.value)
    assert caught.value.log is not None and len(caught.value.log) == 20


def test_null_at_the_end_is_as_if_it_were_not_said():
    log = SteppedRobot(Dummy(travel_m=None, joints=None), quadruped(), Limits()).trial(Commands(np.zeros((20, 8))), 20)
    assert np.isnan(log.travel_m) and log.joints is None


ANSWERS = (b"", b"no json\n", b"[1]\n", b'{"error": "too hot"}\n', b"[" * 9000 + b"\n", b'{"a": 1}\n', None)


@pytest.mark.parametrize("answer", ANSWERS)
def test_whatever_it_answers_is_one_line_within_the_time(answer):
    import socket
    import threading

    with socket.create_server(("127.0.0.1", 0)) as server:
        hold = threading.Event()

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                connection.recv(1000)
                if answer is None:
                    hold.wait(5)
                else:
                    connection.sendall(answer)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        body = SocketBody(f"127.0.0.1:{server.getsockname()[1]}", 0.3, 0.3)
        with pytest.raises(HardwareError) as caught:
            body.begin(0, 10, 0.01)
        hold.set()
        thread.join(5)
    text = str(caught.value)
    assert text.startswith("hardware.address=127.0.0.1:") and "\n" not in text and len(text) < 400


@pytest.mark.parametrize(("setting", "said"), [
    ("hardware.address=nowhere", "expected host:port"), ("hardware.timeout_s=0", "hardware.timeout_s=0.0: must be above 0"),
    ("hardware.speed=-1", "hardware.speed=-1.0: must be above 0"), ("hardware.range_share=2", "must be above 0 and at most 1"),
])  # fmt: skip
def test_a_wrong_setting_is_one_line(cli, setting, said):
    outcome = cli("+scenario=8", setting)
    assert outcome.status == 2
    (line,) = outcome.err.strip().splitlines()
    assert said in line


@pytest.mark.parametrize("robot", ["servo_pendulum", "linear_stage"])
def test_a_robot_that_goes_nowhere_is_refused_before_its_first_trial(cli, robot):
    outcome = cli("task=recover", f"robot={robot}", "hardware.address=127.0.0.1:1")
    assert outcome.status == 2
    (line,) = outcome.err.strip().splitlines()
    assert "stands on no floor or on a fixed base" in line


@pytest.mark.parametrize("limits", [{"range_share": 0.9}, {"speed": 2.0}, {"acceleration": 50.0}])
def test_limits_that_no_model_knows_are_told_before_the_search(cli, tiny, tmp_path, limits):
    assert Limits(**limits).moves and not Limits(torque=2.0).moves
    (name, value), out = next(iter(limits.items())), tmp_path / "run"
    with plugged_in() as robot:
        said = cli(
            *tiny, *FAST, f"hardware.address={robot.address}", f"hardware.{name}={value}", f"hydra.run.dir={out}"
        )
    assert "The models know none of the limits" in " ".join(said.out.split())
