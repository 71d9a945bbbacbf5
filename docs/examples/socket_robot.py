"""A robot as a process of its own, behind a local socket: what to write around a robot of yours, with a simulated one.

    python docs/examples/socket_robot.py --port 5555 --scenario 8
    python -m ee_dist budget=quick hardware.address=127.0.0.1:5555

It is intact in its first trial; then what the scenario says happens to it. ``--unplug TRIAL:STEP`` ends the process in the
middle of a trial, as a pulled plug does.
"""

from __future__ import annotations

import argparse
import json
import os
import socket
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from ee_dist.effects.catalogue import apply, from_dict
from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import ClosedLoop
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.describe import robot_of
from ee_dist.robots.model import Robot

SCENARIOS = Path(__file__).resolve().parents[2] / "conf" / "scenario"


class AbortedError(Exception):
    """The other end stopped the trial, or is gone."""


class Line:
    """One connection: a line of JSON in, a line out."""

    def __init__(self, connection: socket.socket) -> None:
        self.file = connection.makefile("rwb")

    def hear(self) -> dict[str, Any]:
        text = self.file.readline()
        if not text:
            raise AbortedError
        heard: dict[str, Any] = json.loads(text)
        if heard.get("do") == "abort":
            raise AbortedError
        return heard

    def say(self, **answer: Any) -> None:
        self.file.write(json.dumps(answer).encode() + b"\n")
        self.file.flush()


def controller(line: Line, unplug_at: int | None) -> Callable[[], Callable[[float, np.ndarray], np.ndarray]]:
    """Asks the other end for the commands of every step: it has the controller, we have the body."""

    def make() -> Callable[[float, np.ndarray], np.ndarray]:
        step = 0

        def commands(t_s: float, sensors: np.ndarray) -> np.ndarray:
            nonlocal step
            if step == unplug_at:
                os._exit(1)
            step += 1
            line.say(sensors=sensors.tolist())
            return np.array(line.hear()["commands"], dtype=float)

        return commands

    return make


def trial(line: Line, engine: Engine, robot: Robot, changed: Robot, unplug: tuple[int, int] | None) -> None:
    asked = line.hear()
    index = int(asked["trial"])
    unplug_at = unplug[1] if unplug and unplug[0] == index else None
    driver = ClosedLoop(f"trial {index}", controller(line, unplug_at))
    (log,) = engine.rollout([Rollout(changed if index else robot, driver, int(asked["steps"]), pose=True)])
    rows = {name: getattr(log, name) for name in ("base_pose", "joints", "torques", "supply_v")}
    line.say(done=True, travel_m=log.travel_m, **{k: v.tolist() for k, v in rows.items() if v is not None})
    print(f"trial {index} done", flush=True)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--port", type=int, default=5555, help="0 chooses one and prints it")
    parser.add_argument("--robot", default="quadruped")
    parser.add_argument("--scenario", default="8", help="what happens to it after its first trial, or none")
    parser.add_argument("--engine", choices=("pybullet", "mujoco"), default="pybullet")
    parser.add_argument("--unplug", default="")
    given = parser.parse_args()
    robot = robot_of(given.robot, None, None)[0]
    changed = robot
    if given.scenario != "none":
        scenario = yaml.safe_load((SCENARIOS / f"{given.scenario}.yaml").read_text(encoding="utf-8"))
        changed = apply(robot, [from_dict(entry) for entry in scenario["changes"]])
    engine: Engine = PyBulletEngine() if given.engine == "pybullet" else MuJoCoEngine(threads=1)
    first, _, second = given.unplug.partition(":")
    unplug = (int(first), int(second)) if second else None
    with socket.create_server(("127.0.0.1", given.port)) as server:
        print(f"listening on 127.0.0.1:{server.getsockname()[1]}", flush=True)
        while True:
            connection, _ = server.accept()
            with connection:
                connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
                try:
                    trial(Line(connection), engine, robot, changed, unplug)
                except (AbortedError, OSError, ValueError, KeyError) as error:
                    print(f"trial ended early: {type(error).__name__} {error}", flush=True)


if __name__ == "__main__":
    sys.exit(main())
