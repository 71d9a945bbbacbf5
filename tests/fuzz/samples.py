"""A small whole file (or folder of files) of every kind that is read, and what reads it: what the fuzzing begins with."""

from __future__ import annotations

import functools
import json
import socket
import sys
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import yaml

# Under every import mode of pytest.
sys.path.insert(0, str(Path(__file__).parents[1] / "measurements"))
sys.path.insert(0, str(Path(__file__).parents[1] / "tasks"))
sys.path.insert(0, str(Path(__file__).parent))

import measurement_files as written
import one_job
import wrong_files
from kinds import COMMAND_LINE, OURS, Files, Sample, made
from proposed_samples import PROPOSED

from ee_dist.effects.catalogue import from_dict
from ee_dist.effects.model_file import read_model
from ee_dist.engines.drivers import Commands
from ee_dist.evaluation.journal import Journal
from ee_dist.evaluation.socket_body import SocketBody
from ee_dist.evaluation.stepped import SteppedRobot
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.readers import read as read_table
from ee_dist.recording.reader import read_logs, read_run
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.repair import repair
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.describe import load_robot
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.serial import robot_to_dict
from ee_dist.tasks import compose, explained, measurements, reveal
from ee_dist.tasks.config import Config
from ee_dist.tasks.results import study_runs
from ee_dist.tasks.results.story import _asked
from ee_dist.tasks.seal import opened, sealed
from ee_dist.tasks.unfinished import FOLDER, Unfinished, finished
from ee_dist.trials.hardware import Limits

EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
ROWS = 20


# -- what reads them ---------------------------------------------------------------------------------------------------


def numbers(path: Path) -> None:
    """A table, and all numbers in it."""
    for recorded in read_table(path):
        for table in recorded.tables:
            for address in table.addresses():
                table.numbers(address, gaps=True)


def robot(path: Path) -> None:
    load_robot(str(path))


def model_or_robot(path: Path) -> None:
    with_error: list[Exception] = []
    for read in (robot, read_model):
        try:
            read(path)
        except OURS as error:
            with_error.append(error)
    if len(with_error) == 2:
        raise with_error[0]


def measured(path: Path) -> None:
    measurements.load(_config(measured=str(path)))


def calibrated(path: Path) -> None:
    measurements._calibration(path.with_name("model.yaml"), quadruped())


def summary(path: Path) -> None:
    """As task=study, task=reveal and a resume look at it."""
    finished(path.parent, _config(), None)
    hidden = (from_dict({"effect": "motor_weak", "target": "knee_front_left", "loss": 0.5}),)
    reveal.score(explained.summary_of(path), hidden, quadruped())


def studied(path: Path) -> None:
    study_runs.runs_of(study_runs.summaries(path.parent), ())


def studied_before(path: Path) -> None:
    study_runs.runs_of({}, (path,))


def repaired(path: Path) -> None:
    target = path.with_name("again.mcap")
    try:
        repair(path, target)
    finally:
        target.unlink(missing_ok=True)


def begun(path: Path) -> None:
    Unfinished(path.parent.parent, _config(), None).check()


def journal(path: Path) -> None:
    with Journal(path) as found:
        assert all(isinstance(v, tuple) or np.size(v) for v in found.values())


def beside(path: Path) -> None:
    _asked(path.parent.parent)


def answered(path: Path) -> None:
    """The lines as answers of a robot behind a socket, in a trial of so many steps."""
    content = path.read_bytes()[:60_000]
    ours, theirs = socket.socketpair()
    with ours, theirs:
        theirs.sendall(content)
        theirs.shutdown(socket.SHUT_WR)
        ours.settimeout(5)
        body = _Plugged("127.0.0.1:1", 5.0)
        body.plug = ours
        SteppedRobot(body, quadruped(), Limits()).trial(Commands(np.zeros((3, 8))), 3)


class _Plugged(SocketBody):
    plug: socket.socket

    def begin(self, trial: int, steps: int, step_s: float) -> Any:
        self._socket = self.plug
        return self._ask({"do": "begin", "trial": trial, "steps": steps, "step_s": step_s})


def command_line(path: Path) -> None:
    """Words of a command line, one a line, up to where the verb would begin."""
    words = path.read_bytes().decode("utf-8", "replace").replace("\0", "").splitlines()
    with one_job.listening():
        try:
            composed = one_job.prepared(compose.quoted(words))
            compose.settings(one_job.without_hydra(composed))
        except (RecursionError, SystemExit):
            pass  # the program has a line for each
        finally:
            one_job.forget()


@functools.cache
def _settings() -> Config:
    composed = one_job.without_hydra(one_job.prepared(["task=compare"]))
    one_job.forget()
    return compose.settings(composed)[0]


def _config(**changes: Any) -> Config:
    return replace(_settings(), **changes)


# -- the files ---------------------------------------------------------------------------------------------------------


def _recording(folder: Path) -> None:
    robot = load_robot("servo_pendulum")[0]
    log = wrong_files.servo_log()
    about = {
        "task": "trial", "trials": json.dumps([{"kind": "sway", "seconds": 1.0, "amplitude": 0.1}]),
        "robot_sources": "{}", "truth": json.dumps([{"effect": "viscous_friction", "target": "servo", "damping_nm_s_rad": 0.1}]),
    }  # fmt: skip
    with RunWriter(folder / "run.mcap", robot, about, {"config.yaml": b"seed: 0\n"}) as writer:
        writer.trial(TrialRecord(0, "t", HARDWARE, Commands(log.commands), log))


@dataclass(frozen=True, eq=False)
class _Record:
    """Of the kind that a reduction makes of a log."""

    means: np.ndarray
    nothing: np.ndarray
    finite: bool


def _journal(folder: Path) -> None:
    with Journal(folder / "simulated.bin") as found:
        record = _Record(np.ones((3, 2), np.float32), np.empty((0, 2)), True)
        found.note([(f"{k:064x}", v) for k, v in enumerate((1.0, np.arange(3.0), np.ones((2, 2)), record))])


def _measured(name: str) -> Files:
    before, written.ROWS = written.ROWS, ROWS
    try:
        return made(getattr(written, name))
    finally:
        written.ROWS = before


def _compressed(folder: Path) -> None:
    from scipy import io

    io.savemat(folder / "run.mat", written.motion(), do_compression=True)


MJCF = """<mujoco model="arm"><compiler angle="radian" autolimits="true"/><option timestep="0.002" integrator="implicitfast"/>
<default><joint damping="0.1" frictionloss="0.05" armature="0.01"/><default class="big"><joint damping="0.4"/></default></default>
<asset><material name="m" rgba="1 0 0 1"/></asset>
<worldbody><geom type="plane" size="1 1 0.1"/><body name="upper" pos="0 0 1">
<joint name="a" axis="0 1 0" range="-1 1" class="big"/>
<geom type="capsule" size="0.02 0.1" mass="0.3" material="m"/><site name="s"/>
<body name="lower" pos="0 0 -0.2" quat="1 0 0 0"><inertial pos="0 0 -0.1" mass="0.2" diaginertia="0.001 0.001 0.0001"/>
<joint name="b" axis="0 1 0" range="-2 2"/></body></body></worldbody>
<actuator><position joint="a" kp="20" ctrlrange="-1 1" forcerange="-5 5"/><motor joint="b" gear="2"/></actuator>
<sensor><jointpos joint="a"/><jointvel joint="b"/></sensor></mujoco>
"""
SUMMARY = {
    "task": "explain", "verdict": "effect", "config_digest": "0",
    "candidates": [{"name": "a", "tied_with": [], "terms": [{"effect": "motor_weak", "target": "knee_front_left"}]}],
    "model_terms": [{"effect": "motor_weak", "target": "knee_front_left"}],
    "ladder": [{"added": [{"effect": "motor_weak", "target": "knee_front_left"}], "dropped": [], "tied_with": []}],
}  # fmt: skip
STUDIED = {
    "task": "recover", "distance_m": {"trials": [1.0, 2.0], "intact": 3.0, "after": 1.0},
    "evaluations": {"asked": 1, "simulated": 1, "steps": 1}, "diagnosis": None, "recovered_fraction": 0.5, "scenario": 8,
    "metric": "rolling_mean", "seed": 0, "engine": "mujoco", "budget": "quick", "restored": True, "wall_s": 1.0,
    "result_digest": "0" * 16,
}  # fmt: skip
ANSWERS = [{"sensors": [0.0] * 8}, *2 * [{"sensors": [0.1] * 8, "torques": [0.1] * 8}], {"done": True, "travel_m": 1.0}]
WORDS = (
    "+scenario=8", "seed=3", "engine=mujoco", "budget.population=200", "evaluator=serial", "ray.address=a:1",
    "hardware.address=a:2", "hardware.speed=3",
    "scenario.changes=[{effect: motor_weak, target: knee_front_left, loss: 0.5}]", "hydra.run.dir=out", "budget.steps=200",
)  # fmt: skip
MORE_WORDS = (
    "task=trial", "robot=servo_pendulum", "+hidden=[{effect: coulomb_friction, target: servo, torque_nm: 0.1}]", "task.repeats=2",
    "task.excitations=['sway:seconds=0.5,amplitude=0.1']", "task.noise=0.02", "overwrite=true",
)  # fmt: skip


def _lines(words: tuple[str, ...]) -> bytes:
    return "\n".join(words).encode()


def _one(name: str, content: bytes | str, *readers: Callable[[Path], Any], **more: Any) -> Sample:
    data = content if isinstance(content, bytes) else content.encode()
    return Sample({name: data}, name, readers, **more)


def _table(maker: str) -> Sample:
    files = _measured(maker)
    if len(files) == 1:
        return Sample(files, next(iter(files)), (numbers,))
    return Sample(files, next(iter(files)).split("/")[0], (numbers,), tuple(files))


def _begun(folder: Path) -> None:
    found = Unfinished(folder, _config(), None)
    found.begin()


def place(sample: Sample, folder: Path) -> Path:
    """Write the files; what to read."""
    for name, content in sample.files.items():
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(content)
    return folder / sample.main


def _recorded() -> Sample:
    return _one("run.mcap", made(_recording)["run.mcap"], read_run, read_logs, repaired, measured)


def _yaml_robot() -> Sample:
    return _one("robot.yaml", yaml.safe_dump(robot_to_dict(quadruped())), model_or_robot)


def _described() -> Sample:
    return Sample({n: (EXAMPLES / n).read_bytes() for n in ("arm.yaml", "arm.urdf")}, "arm.yaml", (robot,))


def _sealed() -> Sample:
    truth = {"hidden": [{"effect": "motor_weak", "target": "a", "loss": 0.5}]}
    return _one("sealed.json", sealed(truth)[0], opened)


def _calibration() -> Sample:
    content = {"unmodelled": [{"trial": "t", "channels": {"a": {"rms": 0.1}}}], "gained": 0.1, "way": "open_loop"}
    return _one("model.calibration.yaml", yaml.safe_dump(content), calibrated)


def _beside() -> Sample:
    files = {
        "config/config.yaml": b"task: {name: compare}\nmeasured: [a.mcap, b.mcap]\n",
        "config/hydra.yaml": b"hydra: {runtime: {cwd: /tmp}}\n",
    }
    return Sample(files, "config/config.yaml", (beside,), tuple(files))


MODEL = "robot: quadruped\neffects:\n  - {effect: motor_weak, target: knee_front_left, loss: 0.5}\n"
TALK = "\n".join(map(json.dumps, ANSWERS)) + "\n"
SAMPLES: dict[str, Callable[[], Sample]] = {
    "recording": _recorded,
    "model": lambda: _one("model.yaml", MODEL, read_model),
    "robot, ours": _yaml_robot,
    "robot, described": _described,
    "URDF": lambda: _one("arm.urdf", (EXAMPLES / "arm.urdf").read_bytes(), robot),
    "MJCF": lambda: _one("arm.xml", MJCF, robot),
    "mapping": lambda: _one("map.yaml", (EXAMPLES / "arm_csv.yaml").read_bytes(), read_mapping),
    "CSV": lambda: _table("csv"),
    "CSV with lists": lambda: _table("csv_lists"),
    "JSON": lambda: _table("json_rows"),
    "JSON, columns": lambda: _table("json_columns"),
    "JSON, lines": lambda: _table("json_lines"),
    "Parquet": lambda: _table("parquet"),
    "NumPy": lambda: _table("npz"),
    "MATLAB": lambda: _table("mat"),
    "MATLAB, compressed": lambda: Sample(made(_compressed), "run.mat", (numbers,)),
    "MATLAB 7.3": lambda: _table("mat73"),
    "HDF5": lambda: _table("hdf5"),
    "LeRobot": lambda: _table("lerobot"),
    "ROS 1 bag": lambda: _table("rosbag1"),
    "ROS 2 bag, db3": lambda: _table("rosbag2_db3"),
    "ROS 2 bag, MCAP": lambda: _table("rosbag2_mcap"),
    "MCAP with JSON": lambda: _table("mcap_json"),
    "MCAP with protobuf": lambda: _table("mcap_protobuf"),
    "sealed truth": _sealed,
    "summary": lambda: _one("summary.json", json.dumps(SUMMARY), summary),
    "summaries of a study": lambda: _one("summary.json", json.dumps(STUDIED), studied),
    "runs of an earlier study": lambda: _one("runs.json", study_runs.kept([STUDIED, STUDIED]), studied_before),
    "calibration": _calibration,
    "begun run": lambda: Sample(made(_begun), f"{FOLDER}/run.json", (begun,)),
    "journal": lambda: Sample(made(_journal), "simulated.bin", (journal,)),
    "settings of a run beside": _beside,
    "robot behind a socket": lambda: _one("answers", TALK, answered),
    "command line": lambda: _one("words", _lines(WORDS), command_line, allowed=COMMAND_LINE),
    "command line of a trial": lambda: _one("words", _lines(MORE_WORDS), command_line, allowed=COMMAND_LINE),
    **PROPOSED,
}
"""By name of what is read."""


@functools.cache
def sample(name: str) -> Sample:
    return SAMPLES[name]()
