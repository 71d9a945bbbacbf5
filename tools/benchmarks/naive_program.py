"""The program a newcomer would write for the same job: one robot a PyBullet world, a Python loop, multiprocessing.Pool.

It knows nothing of ee_dist. The robot comes as a URDF, Bullet's own position motors drive it, every joint is read and
commanded by itself, touch is asked foot by foot, the network is a few NumPy lines, and every evaluation simulates its whole
trial: no cache, no early stop. What is sensible costs nothing extra and is there: DIRECT mode, a world kept from one
evaluation to the next, one process a core.

    python naive_program.py robot.urdf --evaluations 40 --steps 1000 --processes 2
"""

from __future__ import annotations

import argparse
import json
import multiprocessing
import os
import sys
import time

import numpy as np
import pybullet as p
from numpy.typing import NDArray

SENSORS, HIDDEN, MOTORS = 8, 3, 8
WEIGHTS = (SENSORS + 1) * HIDDEN + HIDDEN * HIDDEN + (HIDDEN + 1) * MOTORS
RANGE_RAD, TORQUE_NM, SPEED_RAD_S, STEP_S = np.pi / 4, 3.0, 5.0, 0.01
START_M = (0.0, 0.0, 0.148)

Weights = NDArray[np.float64]
_world: dict[str, int] = {}
_joints: list[int] = []
_feet: list[int] = []
_hips: list[int] = []


def load(urdf: str) -> None:
    """Open this process's world and put the robot in it."""
    client = p.connect(p.DIRECT)
    p.setTimeStep(STEP_S)
    p.setGravity(0, 0, -9.81)
    plane = p.createMultiBody(0, p.createCollisionShape(p.GEOM_PLANE))
    robot = p.loadURDF(urdf, START_M, flags=p.URDF_USE_INERTIA_FROM_FILE)
    _world.update(client=client, plane=plane, robot=robot)
    for k in range(p.getNumJoints(robot)):
        info = p.getJointInfo(robot, k)
        if info[2] == p.JOINT_REVOLUTE:
            _joints.append(k)
            name = info[1].decode()
            (_hips if name.startswith("hip") else _feet).append(k)
    _world["start"] = p.saveState()


def controller(weights: Weights, sensors: Weights, hidden: Weights) -> tuple[Weights, Weights]:
    """One step of the recurrent network: commanded joint angles (rad) and the new hidden state."""
    first, second = (SENSORS + 1) * HIDDEN, (SENSORS + 1) * HIDDEN + HIDDEN * HIDDEN
    from_input = weights[:first].reshape(HIDDEN, SENSORS + 1)
    from_hidden = weights[first:second].reshape(HIDDEN, HIDDEN)
    to_output = weights[second:].reshape(MOTORS, HIDDEN + 1)
    hidden = np.clip(from_input @ np.append(sensors, 1.0) + from_hidden @ hidden, -1, 1)
    return RANGE_RAD * np.clip(to_output @ np.append(hidden, 1.0), -1, 1), hidden


def evaluate(task: tuple[Weights, int]) -> float:
    """Forward distance (m) of one controller in one whole trial."""
    weights, steps = task
    robot, plane = _world["robot"], _world["plane"]
    p.restoreState(_world["start"])
    begin = p.getBasePositionAndOrientation(robot)[0][0]
    hidden = np.zeros(HIDDEN)
    for _ in range(steps):
        touch = [1.0 if p.getContactPoints(robot, plane, foot) else -1.0 for foot in _feet]
        angles = [p.getJointState(robot, hip)[0] / RANGE_RAD for hip in _hips]
        command, hidden = controller(weights, np.array(touch + angles), hidden)
        for joint, angle in zip(_joints, command, strict=True):
            p.setJointMotorControl2(
                robot, joint, p.POSITION_CONTROL, targetPosition=angle, force=TORQUE_NM, maxVelocity=SPEED_RAD_S
            )
        p.stepSimulation()
    return float(p.getBasePositionAndOrientation(robot)[0][0] - begin)


def busy_s(_: int) -> tuple[int, float]:
    """Which process this is, and its processor time so far (s)."""
    time.sleep(0.05)
    return os.getpid(), time.process_time()


def processor_s(pool: multiprocessing.pool.Pool, processes: int) -> float:
    """Processor time of the pool's processes so far, s."""
    seen: dict[int, float] = {}
    while len(seen) < processes:
        seen.update(pool.map(busy_s, range(4 * processes), chunksize=1))
    return sum(seen.values())


def main() -> int:
    parser = argparse.ArgumentParser(description="a newcomer's evaluation of random controllers")
    parser.add_argument("urdf")
    parser.add_argument("--evaluations", type=int, default=40)
    parser.add_argument("--steps", type=int, default=1000)
    parser.add_argument("--processes", type=int, default=os.cpu_count() or 1)
    options = parser.parse_args()
    rng = np.random.default_rng(0)
    tasks = [(rng.uniform(-1, 1, WEIGHTS), options.steps) for _ in range(options.evaluations)]
    with multiprocessing.Pool(options.processes, initializer=load, initargs=(options.urdf,)) as pool:
        before = processor_s(pool, options.processes)
        began = time.perf_counter()
        distances = pool.map(evaluate, tasks)
        wall = time.perf_counter() - began
        cpu = processor_s(pool, options.processes) - before
    finite = bool(np.isfinite(distances).all())
    json.dump(
        {
            "evaluations": len(tasks),
            "steps": len(tasks) * options.steps,
            "wall_s": wall,
            "cpu_s": cpu,
            "finite": finite,
        },
        sys.stdout,
    )
    return 0


if __name__ == "__main__":
    sys.exit(main())
