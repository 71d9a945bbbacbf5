"""What a robot-step costs: in our rollout, and in the bare engine that makes the same motion from recorded torques.

The bare step is the limit: the same robots, worlds and threads make the same motion, bit for bit, because they get the
torques that the rollout computed; nothing is read, nothing is controlled, nothing is recorded. Setting the torques is part
of it, since a torque-controlled robot cannot be stepped without. What an engine does before the first step is left out of
the bare step and counted in the rollout.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from benchmarks.timing import Measurement, Sample, interleaved, median_cpu, median_ratio, median_wall, timed
from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Network, weight_count
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped import quadruped
from ee_dist.tasks.wiring import EngineMaker
from ee_dist.trials.log import Array

CHILD_SHARE = 0.01
"""How many of a controller's weights differ in a sample of its offspring, as in the genetic algorithm."""


@dataclass(frozen=True)
class StepSetting:
    """What is measured: an engine with so many native threads, a batch of robots, steps, and the controllers.

    ``controllers`` (k, 68) are those of a finished run; none: random ones.
    """

    engine: str
    robots: int
    steps: int
    threads: int = 1
    repeat: int = 5
    controllers: tuple[tuple[float, ...], ...] = ()


def sample_rollouts(setting: StepSetting, robot: Robot | None = None, seed: int = 0) -> list[Rollout]:
    """Rollouts as evolution asks for them: offspring of the given controllers, or random controllers."""
    model = quadruped() if robot is None else robot
    rng = np.random.default_rng(seed)
    size = weight_count(len(model.sensors), len(model.drives))
    rollouts = []
    for k in range(setting.robots):
        weights = np.round(rng.uniform(-1, 1, size), 2)
        if setting.controllers:
            parent = np.array(setting.controllers[k % len(setting.controllers)])
            weights = np.where(rng.random(size) < CHILD_SHARE, weights, parent)
        rollouts.append(Rollout(model, Network(tuple(float(w) for w in weights)), setting.steps))
    return rollouts


def recorded_torques(engine: Engine, rollouts: Sequence[Rollout]) -> Array:
    """(steps, robots, motors): the torques of these rollouts, in the order of the batch."""
    logs = engine.rollout([replace(r, pose=True) for r in rollouts])
    return np.stack([np.asarray(log.torques) for log in logs], axis=1)


def bare_pybullet(engine: Any, rollouts: Sequence[Rollout], torques: Array) -> Sample:
    """PyBullet stepping the same worlds with the torques handed over as ready-made lists."""
    import pybullet as p

    bodies = engine._place(rollouts)
    try:
        order = [(row, client, body, links) for row, client, body, links, _ in bodies.robots]
        clients = [world.client for world in bodies.worlds]
        present = {row: [k for k, link in enumerate(w.links) if link >= 0] for w, row in _rows(bodies)}
        ready = [[at[row, present[row]].tolist() for row, *_ in order] for at in torques[:-1]]
        send, simulate, mode = p.setJointMotorControlArray, p.stepSimulation, p.TORQUE_CONTROL

        def run() -> None:
            for values in ready:
                for (_, client, body, links), forces in zip(order, values, strict=True):
                    send(body, links, mode, forces=forces, physicsClientId=client)
                for client in clients:
                    simulate(client)

        return timed(run)
    finally:
        bodies.close()


def _rows(bodies: Any) -> list[tuple[Any, int]]:
    world_of = {world.client: world for world in bodies.worlds}
    return [(world_of[client], row) for row, client, *_ in bodies.robots]


def bare_mujoco(engine: Any, rollouts: Sequence[Rollout], torques: Array) -> Sample:
    """MuJoCo stepping the same batch, one native call a step, the torques written as an array."""
    bodies = engine._place(rollouts)
    try:
        groups = [(rows, g, np.ascontiguousarray(torques[:, rows][:, :, g.motors])) for rows, g in bodies.groups]

        def run() -> None:
            for step in range(len(torques) - 1):
                for _, group, values in groups:
                    group.torques[:, group.dof] = values[step]
                    group.batch.step()

        return timed(run)
    finally:
        bodies.close()


def one_call_mujoco(engine: Any, rollouts: Sequence[Rollout], torques: Array) -> Sample:
    """MuJoCo making the same motion in one native call, no Python in between: nobody who reacts can be as fast."""
    import mujoco

    bodies = engine._place(rollouts)
    try:
        ready = []
        for rows, group in bodies.groups:
            values = np.zeros((len(group.pose), len(torques) - 1, group.model.compiled.nv))
            values[:, :, group.dof] = np.moveaxis(torques[:-1, rows][:, :, group.motors], 0, 1)
            ready.append((group.batch, values))
        spec = int(mujoco.mjtState.mjSTATE_QFRC_APPLIED)

        def run() -> None:
            for batch, values in ready:
                batch.rollout(values.shape[1], values, spec, [])

        return timed(run)
    finally:
        bodies.close()


def measure_steps(setting: StepSetting) -> dict[str, float]:
    """Microseconds a robot-step of the rollout and of the bare engine (processor and wall time), and their ratio."""
    engine = EngineMaker(setting.engine, setting.threads)()
    rollouts = sample_rollouts(setting)
    torques = recorded_torques(engine, rollouts)
    measurements: dict[str, Measurement] = {"rollout": lambda: timed(lambda: engine.rollout(rollouts))}
    if setting.engine == "pybullet":
        measurements["bare"] = lambda: bare_pybullet(engine, rollouts, torques)
    else:
        measurements["bare"] = lambda: bare_mujoco(engine, rollouts, torques)
        measurements["one_call"] = lambda: one_call_mujoco(engine, rollouts, torques)
    found = interleaved(measurements, setting.repeat)
    engine.close()
    per = 1e6 / (setting.robots * max(setting.steps - 1, 1))
    result = {f"{name}_cpu_us": median_cpu(s) * per for name, s in found.items()}
    result.update({f"{name}_wall_us": median_wall(s) * per for name, s in found.items()})
    result["ratio_cpu"] = median_ratio(found["rollout"], found["bare"])
    result["ratio_wall"] = median_ratio(found["rollout"], found["bare"], "wall_s")
    return result


def batch_cost(engine: str, sizes: Sequence[int], steps: int, repeat: int) -> Mapping[str, float]:
    """A step of a batch of n robots costs ``per_batch_step_s`` + n ``per_robot_step_s``: processor time, least squares."""
    made = EngineMaker(engine, 1)()
    lots = {n: sample_rollouts(StepSetting(engine, n, steps)) for n in sizes}
    for lot in lots.values():
        made.rollout(lot)
    found = interleaved({str(n): lambda lot=lots[n]: timed(lambda: made.rollout(lot)) for n in sizes}, repeat)  # type: ignore[misc]
    made.close()
    times = np.array([median_cpu(found[str(n)]) / steps for n in sizes])
    # Relative errors count alike: a batch of one says as much as a batch of a hundred.
    table = np.stack([np.ones(len(sizes)), np.array(sizes, dtype=float)], axis=1) / times[:, None]
    fixed, each = np.linalg.lstsq(table, np.ones(len(sizes)), rcond=None)[0]
    return {"per_batch_step_s": max(float(fixed), 0.0), "per_robot_step_s": float(each)}
