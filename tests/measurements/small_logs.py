"""Small logs of a chain of joints, and what comes of them without a mapping."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import measurement_files as samples
import numpy as np
import pandas as pd
from mcap.writer import Writer

from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.measurements.proposal.write import as_yaml
from ee_dist.measurements.report import Report
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog


def frame_of(
    t: np.ndarray, positions: np.ndarray, goals: np.ndarray, names: str = "{joint}_{what}_rad",
    joints: tuple[str, ...] = samples.JOINTS, what: tuple[str, str] = ("pos", "goal"),
) -> pd.DataFrame:  # fmt: skip
    """A table with a time, and a column for each joint's position and command (T, J)."""
    found = {"time": t}
    for word, values in zip(what, (positions, goals), strict=True):
        found |= {names.format(joint=j, what=word): values[:, k] for k, j in enumerate(joints)}
    return pd.DataFrame(found)


def written(folder: Path, frame: pd.DataFrame) -> Path:
    frame.to_csv(folder / "log.csv", index=False)
    return folder / "log.csv"


def proposed(
    folder: Path, file: Path, joints: tuple[str, ...] = samples.JOINTS, change: Any = None, described: Any = None
) -> tuple[Robot, Proposal]:
    """A chain of joints (its URDF is put through ``change``, its description through ``described``), and what is proposed for a
    file beside it."""
    path = samples.robot_file(folder, joints)
    if described is not None:
        path.write_text(described(path.read_text()))
    if change is not None:
        (folder / "chain.urdf").write_text(change((folder / "chain.urdf").read_text()))
    robot, _ = load_robot(path)
    return robot, proposal_for([file], robot, Hints())


def imported(
    folder: Path, file: Path, joints: tuple[str, ...] = samples.JOINTS, change: Any = None
) -> tuple[SensorLog, Report]:
    """The log of a file by the mapping that is proposed for it, which must ask nothing."""
    robot, proposal = proposed(folder, file, joints, change)
    assert not proposal.questions, proposal.questions
    (folder / "mapping.yaml").write_text(as_yaml(proposal, str(folder / "chain.yaml"), file.name))
    ((record, report),) = import_files([file], read_mapping(folder / "mapping.yaml"), robot)
    return record.log, report


def stamp(ns: int) -> dict[str, Any]:
    """The header of a message."""
    return {"header": {"stamp": {"sec": ns // 10**9, "nanosec": ns % 10**9}}}


def states(
    t: np.ndarray, positions: np.ndarray, joints: tuple[str, ...] = samples.JOINTS, ahead_s: float | None = 0.0
) -> list[tuple[int, Any]]:
    """(log time in ns, message) of joint states; the stamps are ``ahead_s`` ahead of the time of logging, or there are none."""
    found = []
    for s, row in zip(t, positions, strict=True):
        ns = samples.START_NS + round(1e9 * s)
        head = {} if ahead_s is None else stamp(ns + round(1e9 * ahead_s))
        found.append((ns, head | {"name": list(joints), "position": row.tolist()}))
    return found


def bag(folder: Path, topics: dict[str, list[tuple[int, Any]]]) -> Path:
    """An MCAP file of messages as JSON."""
    with (folder / "log.mcap").open("wb") as file:
        writer = Writer(file)
        writer.start()
        schema = writer.register_schema("JointState", "jsonschema", b"{}")
        for topic, messages in topics.items():
            channel = writer.register_channel(topic, "json", schema)
            for ns, message in messages:
                writer.add_message(channel, ns, json.dumps(message).encode(), ns)
        writer.finish()
    return folder / "log.mcap"
