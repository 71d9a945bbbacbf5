"""What of a recording depends on the kind of system: the file that describes it, the units of its commands, its picture.

Everything else of a run (trials, hypotheses, generations) is recorded alike, whatever it was that ran.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from ee_dist.networks.model import GeneNetwork
from ee_dist.networks.serial import network_from_json, network_to_json
from ee_dist.recording.records import TrialRecord
from ee_dist.recording.scene import scene_message
from ee_dist.recording.topics import ROBOT_FILE, scene_topic, transforms_topic
from ee_dist.recording.transforms import model_of, transform_messages
from ee_dist.robots.model import Robot
from ee_dist.robots.numbers import checked
from ee_dist.robots.serial import robot_from_json, robot_to_json
from ee_dist.robots.system import System

_JOINT_UNITS = {"hinge": "rad", "slide": "m"}
Picture = tuple[str, int, Any]
"""Topic, log time in ns, message."""


@dataclass(frozen=True)
class Form:
    """``file`` is the name of the attachment with the system; ``write`` and ``read`` (raises RobotError) are its text.
    ``command_units`` are by the names of the drives. ``pictures`` show a trial of so many ns from a time on."""

    file: str
    write: Callable[[Any], str]
    read: Callable[[bytes], System]
    command_units: Callable[[Any], Mapping[str, str]]
    pictures: Callable[[TrialRecord, Any, int, int], Iterator[Picture]]


def _read_robot(text: bytes) -> Robot:
    return checked(robot_from_json(text), "robot")


def _joint_units(robot: Robot) -> dict[str, str]:
    return {j.name: _JOINT_UNITS.get(j.kind, "") for j in robot.joints}


def _of_body(record: TrialRecord, robot: Robot, start_ns: int, length_ns: int) -> Iterator[Picture]:
    """Its solids once, and how they move."""
    if len(record.log):
        solids = scene_message(model_of(record, robot), record.source, start_ns, length_ns)
        yield scene_topic(record.source), start_ns, solids
    for log_time, message in transform_messages(record, robot, start_ns):
        yield transforms_topic(record.source), log_time, message


def _stimulus_units(network: GeneNetwork) -> dict[str, str]:
    return {d.name: "1" for d in network.drives}


def _none(record: TrialRecord, system: System, start_ns: int, length_ns: int) -> Iterator[Picture]:
    """Nothing of it has a place."""
    return iter(())


FORMS: dict[type, Form] = {
    Robot: Form(ROBOT_FILE, robot_to_json, _read_robot, _joint_units, _of_body),
    GeneNetwork: Form("gene_network.json", network_to_json, network_from_json, _stimulus_units, _none),
}
FILES = {form.file: form for form in FORMS.values()}
"""Each recording has one of these."""


def form_of(system: System) -> Form:
    return FORMS[type(system)]
