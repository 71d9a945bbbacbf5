"""A real cluster of two nodes on this machine: one is lost, all of it is lost, it comes back."""

from __future__ import annotations

import json
import os
import socket
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network, weight_count
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.jobs import Job, Whole
from ee_dist.evaluation.ray_actors import RayEvaluator
from ee_dist.evaluation.ray_session import EvaluatorError
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.quadruped import quadruped

pytestmark = pytest.mark.slow
RUN = (
    "+scenario=8", "engine=mujoco", "budget=quick", "budget.population=40", "budget.generations=5", "budget.polish=1",
    "budget.diagnosis_population=40", "budget.diagnosis_generations=4", "budget.steps=200", "budget.compensating_trials=2",
)  # fmt: skip


def cluster(port: int):
    from ray.cluster_utils import Cluster

    found = Cluster(
        initialize_head=True, head_node_args={"num_cpus": 1, "gcs_server_port": port, "include_dashboard": False}
    )
    return found, found.add_node(num_cpus=1)


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


def engine() -> MuJoCoEngine:
    return MuJoCoEngine(threads=1)


def jobs(count: int) -> list[Job]:
    robot, rng = quadruped(), np.random.default_rng(0)
    weights = np.round(rng.uniform(-1, 1, (count, weight_count(8, 8))), 2)
    return [Job(Rollout(robot, Network(tuple(map(float, w))), 300), Whole()) for w in weights]


def content(logs: list) -> bytes:
    return b"".join(log.sensors.tobytes() + np.float64(log.travel_m).tobytes() for log in logs)


def test_a_lost_node_changes_nothing():
    import ray

    ray.shutdown()
    nodes, second = cluster(free_port())
    try:
        work = jobs(200)
        serial = SerialEvaluator(engine())
        expected = content(serial.evaluate(work))
        for _ in ("joined for it", "joined already"):
            with pytest.raises(EvaluatorError, match=r"evaluator\.workers=17: the cluster has 2 cores"):
                RayEvaluator(engine, 17, 5, nodes.address)
        evaluator = RayEvaluator(engine, 2, 5, nodes.address)
        assert content(evaluator.evaluate(work[:20])) == expected[: len(content(serial.evaluate(work[:20])))]
        homes = {n["NodeID"] for n in ray.nodes() if n["Alive"]}
        assert len(homes) == 2
        before = evaluator.process_ids()
        killer = threading.Thread(target=lambda: (time.sleep(0.3), nodes.remove_node(second, allow_graceful=False)))
        killer.start()
        assert content(evaluator.evaluate(work)) == expected
        killer.join()
        assert len({n["NodeID"] for n in ray.nodes() if n["Alive"]}) == 1
        assert evaluator.process_ids() != before, "no worker was on the node that was lost, so nothing was tested"
        evaluator.close()
    finally:
        ray.shutdown()
        nodes.shutdown()


def run(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "ee_dist", *RUN, *arguments],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ},
    )  # fmt: skip


def test_a_cluster_that_is_gone_and_back(tmp_path):
    with run(tmp_path, "evaluator=serial", "hydra.run.dir=whole") as whole:
        assert whole.wait() == 0
    port = free_port()
    own = ("evaluator=ray", "evaluator.workers=2", f"ray.address=127.0.0.1:{port}")
    nodes, _ = cluster(port)
    with run(tmp_path, *own, "hydra.run.dir=out") as stopped:
        assert stopped.stdout is not None
        while "hardware, after the change" not in (line := stopped.stdout.readline()):
            assert line, "the run ended before it got there"
        nodes.shutdown()
        _, err = stopped.communicate(timeout=120)
    assert stopped.returncode == 2, err
    (said,) = err.strip().splitlines()
    assert said.startswith("ee_dist: Ray is lost: ")
    assert "resume=out" in said
    with run(tmp_path, *own, "resume=out") as early:
        _, err = early.communicate(timeout=120)
    assert early.returncode == 2
    assert f"ray.address=127.0.0.1:{port}: no Ray cluster answers there" in err
    nodes, _ = cluster(port)
    try:
        with run(tmp_path, *own, "resume=out") as resumed:
            _, err = resumed.communicate(timeout=300)
        assert resumed.returncode == 0, err
    finally:
        nodes.shutdown()
    digests = {json.loads((tmp_path / n / "summary.json").read_text())["result_digest"] for n in ("whole", "out")}
    assert len(digests) == 1
