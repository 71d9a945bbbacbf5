"""Every reader against cut, bit-flipped, spliced and foreign files: an answer or one line, never a crash.

The fast suite draws a few hundred; ``EE_DIST_FUZZ=100000 pytest tests/fuzz`` as many as one likes. Each failure found is
kept as an ``example``.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from ee_dist.effects.catalogue import EffectError
from ee_dist.effects.model_file import read_model
from ee_dist.engines.drivers import Network
from ee_dist.measurements.mapping import read_mapping
from ee_dist.measurements.readers import read as read_table
from ee_dist.recording.errors import RecordingError
from ee_dist.recording.reader import read_logs, read_run
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import RobotError
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.serial import robot_to_dict
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.seal import opened, sealed
from ee_dist.trials.log import LogError, SensorLog

OURS = (RobotError, EffectError, RecordingError, LogError, ConfigError)
EXAMPLES = Path(__file__).parents[2] / "docs" / "examples"
COUNT = int(os.environ.get("EE_DIST_FUZZ", "60"))


def recording() -> bytes:
    robot, rows = quadruped(), 20
    log = SensorLog(
        np.arange(rows) * 0.01, np.zeros((rows, 8)), np.zeros((rows, 8)), robot.sensor_names,
        tuple(s.unit for s in robot.sensors), robot.motor_names,
    )  # fmt: skip
    path = Path(os.environ.get("TMPDIR", "/tmp")) / f"fuzz_{os.getpid()}.mcap"
    with RunWriter(path, robot, {"task": "trial"}, {"config.yaml": b"seed: 0\n"}) as writer:
        writer.trial(TrialRecord(0, "t", HARDWARE, Network((0.5,) * 68), log))
    content = path.read_bytes()
    path.unlink()
    return content


def parquet(tmp: Path) -> bytes:
    pd.DataFrame({"t": [0.0, 0.1], "a": [1.0, 2.0]}).to_parquet(tmp)
    content = tmp.read_bytes()
    tmp.unlink()
    return content


CORPUS: dict[str, bytes] = {
    "run.mcap": recording(),
    "model.yaml": b"robot: quadruped\neffects:\n  - {effect: motor_weak, target: knee_front_left, loss: 0.5}\n",
    "robot.yaml": yaml.safe_dump(robot_to_dict(quadruped())).encode(),
    "arm.yaml": (EXAMPLES / "arm.yaml").read_bytes(),
    "arm.urdf": (EXAMPLES / "arm.urdf").read_bytes(),
    "map.yaml": (EXAMPLES / "arm_csv.yaml").read_bytes(),
    "t.csv": b"t,a\n0,1\n0.1,2\n",
    "t.json": json.dumps({"kp": 3, "entries": [{"t": 0, "a": 1}, {"t": 0.1, "a": 2}]}).encode(),
    "t.parquet": parquet(Path(os.environ.get("TMPDIR", "/tmp")) / f"fuzz_{os.getpid()}.parquet"),
    "sealed.json": sealed({"hidden": [], "seed": 0})[0].encode(),
}
READERS: dict[str, tuple[Callable[[Path], object], ...]] = {
    "run.mcap": (read_run, read_logs),
    "model.yaml": (read_model,),
    "robot.yaml": (lambda p: load_robot(str(p)), read_model),
    "arm.yaml": (lambda p: load_robot(str(p)),),
    "arm.urdf": (lambda p: load_robot(str(p)),),
    "map.yaml": (read_mapping,),
    "t.csv": (lambda p: read_numbers(p),),
    "t.json": (lambda p: read_numbers(p),),
    "t.parquet": (lambda p: read_numbers(p),),
    "sealed.json": (opened,),
}
TEXTS = (b"1e999", b"-1", b"nan", b"1" * 400, b"[", b"{", b": ", b"~", b"&a *a")
FOREIGN = (
    b"",
    b"\x00" * 64,
    b"\x89MCAP0\r\n",
    b"PAR1PAR1",
    b"[" * 3000,
    b"{" * 3000,
    b"<a>" * 3000,
    b"\xff\xfe\xfa",
    b"null",
)


@st.composite
def damaged(draw: st.DrawFn, name: str) -> bytes:
    """The file with a few cuts, flips, repeats and insertions."""
    content = bytearray(CORPUS[name])
    for _ in range(draw(st.integers(1, 4))):
        place = draw(st.integers(0, max(len(content) - 1, 0)))
        kind = draw(st.sampled_from(("flip", "cut", "insert", "repeat", "splice", "number")))
        if kind == "flip" and content:
            content[place] ^= 1 << draw(st.integers(0, 7))
        elif kind == "cut":
            del content[place : place + draw(st.integers(1, 64))]
        elif kind == "insert":
            content[place:place] = draw(st.binary(max_size=16))
        elif kind == "repeat":
            content[place:place] = content[place : place + 64]
        elif kind == "splice":
            content[place:] = CORPUS[draw(st.sampled_from(sorted(CORPUS)))][place:]
        else:
            content[place : place + 1] = draw(
                st.sampled_from((b"1e999", b"-1", b"nan", b"1" * 400, b"[", b"{", b": ", b"~", b"&a *a"))
            )
    return bytes(content)


def read_numbers(path: Path) -> None:
    """A table, and all numbers in it."""
    for recorded in read_table(path):
        for table in recorded.tables:
            for address in table.addresses():
                table.numbers(address, gaps=True)


def look(path: Path, name: str, content: bytes) -> None:
    if name == "arm.yaml":
        (path.parent / "arm.urdf").write_bytes(CORPUS["arm.urdf"])
    path.write_bytes(content)
    for read in READERS[name]:
        try:
            read(path)
        except OURS as error:
            text = str(error)
            assert "\n" not in text, text
            assert len(text) < 1000, text


@pytest.mark.parametrize("name", sorted(CORPUS))
def test_the_files_themselves_are_read(tmp_path, name):
    (tmp_path / "arm.urdf").write_bytes(CORPUS["arm.urdf"])
    (tmp_path / name).write_bytes(CORPUS[name])
    for read in READERS[name]:
        if (name, read) != ("robot.yaml", read_model):  # a robot, and no model
            read(tmp_path / name)


@pytest.mark.parametrize("name", sorted(CORPUS))
@pytest.mark.parametrize("content", FOREIGN)
def test_foreign_files(tmp_path, name, content):
    look(tmp_path / name, name, content)


@pytest.mark.parametrize("name", sorted(CORPUS))
def test_damaged_files(tmp_path, name):
    @settings(max_examples=COUNT, deadline=None, derandomize="EE_DIST_FUZZ" not in os.environ, database=None,
              suppress_health_check=list(HealthCheck))  # fmt: skip
    @given(damaged(name))
    @example(CORPUS[name])
    def damage(content: bytes) -> None:
        look(tmp_path / name, name, content)

    damage()
