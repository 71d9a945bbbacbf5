"""One contract for every evaluator: same results, bit for bit, wherever and in whatever pieces the rollouts run."""

from __future__ import annotations

import os
import signal
import threading
import time
from collections.abc import Iterator

import numpy as np
import pytest

from ee_dist.discrepancy.ways.open_loop.prediction import ToSensors
from ee_dist.effects import apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network, weight_count
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.jobs import Job, Travel, Whole
from ee_dist.evaluation.ray_actors import RayEvaluator
from ee_dist.evaluation.ray_session import EvaluatorError, start_ray
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.quadruped import quadruped

ROBOT = quadruped()
STEPS = 40


def networks(count: int, seed: int = 0) -> list[Network]:
    rng = np.random.default_rng(seed)
    size = weight_count(8, 8)
    return [Network(tuple(float(v) for v in np.round(rng.uniform(-1, 1, size), 2))) for _ in range(count)]


def jobs(count: int = 12, steps: int = STEPS) -> list[Job]:
    models = [
        ROBOT,
        apply(ROBOT, [term("part_lost", "upper_rear_left")]),
        apply(ROBOT, [term("motor_weak", "knee_front_left", loss=0.5), term("floor_tilt", "floor", sideways_deg=12.0)]),
    ]
    return [Job(Rollout(models[k % 3], n, steps), Whole()) for k, n in enumerate(networks(count))]


def content(logs: list) -> bytes:
    return b"".join(log.sensors.tobytes() + log.commands.tobytes() + np.float64(log.travel_m).tobytes() for log in logs)


@pytest.fixture(scope="module")
def reference() -> bytes:
    evaluator = SerialEvaluator(PyBulletEngine())
    result = content(evaluator.evaluate(jobs()))
    evaluator.close()
    return result


@pytest.fixture(scope="module")
def ray_once() -> Iterator[None]:
    import ray

    start_ray(None, 3)
    yield
    ray.shutdown()


@pytest.mark.parametrize("chunk", [1, 5, 256])
def test_serial_in_any_chunks(reference, chunk):
    evaluator = SerialEvaluator(PyBulletEngine(), chunk)
    assert content(evaluator.evaluate(jobs())) == reference
    evaluator.close()


@pytest.mark.usefixtures("ray_once")
@pytest.mark.parametrize(("workers", "chunk"), [(1, 0), (2, 0), (3, 2)])
def test_ray_with_any_workers_and_chunks(reference, workers, chunk):
    evaluator = RayEvaluator(PyBulletEngine, workers, chunk)
    assert content(evaluator.evaluate(jobs())) == reference
    assert evaluator.worked_s > 0.01, "the processor time that it took there"
    evaluator.close()


@pytest.mark.usefixtures("ray_once")
def test_a_killed_worker_changes_nothing():
    work = jobs(48, 400)
    serial = SerialEvaluator(PyBulletEngine())
    expected = content(serial.evaluate(work))
    serial.close()
    evaluator = RayEvaluator(PyBulletEngine, 2, 4)
    victim = evaluator.process_ids()[0]
    assert os.getpriority(os.PRIO_PROCESS, victim) == os.getpriority(os.PRIO_PROCESS, 0), (
        "no worker gives way by itself"
    )
    died = threading.Event()

    def kill() -> None:
        time.sleep(0.3)
        os.kill(victim, signal.SIGKILL)
        died.set()

    killer = threading.Thread(target=kill)
    killer.start()
    found = content(evaluator.evaluate(work))
    killer.join()
    assert died.is_set()
    assert victim not in evaluator.process_ids(), "the actor did not die, so nothing was tested"
    assert found == expected
    evaluator.close()


@pytest.mark.slow
@pytest.mark.usefixtures("ray_once")
def test_a_hanging_worker_is_replaced_and_changes_nothing(reference):
    evaluator = RayEvaluator(PyBulletEngine, 2, 1)
    assert content(evaluator.evaluate(jobs())) == reference
    evaluator.patience_s = 40.0  # long enough for a worker to start again, on a busy machine too
    victim = evaluator.process_ids()[0]
    os.kill(victim, signal.SIGSTOP)
    assert content(evaluator.evaluate(jobs())) == reference
    assert victim not in evaluator.process_ids()
    evaluator.close()


@pytest.mark.usefixtures("ray_once")
def test_a_worker_with_something_else_installed_is_refused_by_name(monkeypatch):
    evaluator = RayEvaluator(PyBulletEngine, 1, 1)
    monkeypatch.setattr("ee_dist.evaluation.ray_actors.installed", lambda: {"pybullet": "9.9.9"})
    with pytest.raises(EvaluatorError, match=r"the worker on .* has pybullet [\d.]+, this machine 9\.9\.9"):
        evaluator.evaluate(jobs(2))
    evaluator.close()


def broken_engine() -> PyBulletEngine:
    raise SystemExit(0)


@pytest.mark.usefixtures("ray_once")
def test_what_a_worker_raises_is_raised_here():
    evaluator = RayEvaluator(broken_engine, 1, 1)
    with pytest.raises(EvaluatorError, match=r"sys\.exit\(0\) was called"):
        evaluator.evaluate(jobs(2))
    evaluator.close()


@pytest.mark.parametrize("running", [False, True])
def test_more_workers_than_a_machine_can_have_are_refused(running: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    import ray

    monkeypatch.setattr(ray, "is_initialized", lambda: running)
    with pytest.raises(EvaluatorError, match=r"evaluator\.workers=100000: this machine has \d+ cores"):
        start_ray(None, 100_000)


def test_cache_simulates_each_key_once_and_gives_the_same():
    plain, cached = SerialEvaluator(PyBulletEngine()), CachedEvaluator(SerialEvaluator(PyBulletEngine()))
    work = jobs(6)
    doubled = [*work, *work[::-1]]
    expected = content(plain.evaluate(doubled))
    assert content(cached.evaluate(doubled)) == expected
    assert content(cached.evaluate(doubled)) == expected
    assert (cached.counts.asked, cached.counts.simulated) == (24, 6)
    assert cached.counts.steps == 6 * STEPS
    assert cached.counts.asked_steps == 24 * STEPS
    plain.close()
    cached.close()


def test_a_cache_keeps_as_many_bytes_as_it_may_and_gives_the_same():
    """What is kept of logs of minutes would fill any memory; what went is simulated again, to the same bits."""
    plain, work = SerialEvaluator(PyBulletEngine()), [Job(j.rollout, ToSensors()) for j in jobs(4)]
    expected = plain.evaluate(work)
    small = CachedEvaluator(SerialEvaluator(PyBulletEngine()), most=2 * expected[0].nbytes)
    for _ in range(2):
        assert all(np.array_equal(a, b) for a, b in zip(small.evaluate(work), expected, strict=True))
        assert small._held == 2 * expected[0].nbytes
    assert small.counts.simulated == 4 + 2, "the two that were kept are not simulated again"
    small.close()
    plain.close()


def test_cache_tells_apart_what_is_physically_different():
    n = networks(1)[0]
    rollouts = [
        Rollout(ROBOT, n, STEPS),
        Rollout(ROBOT, n, STEPS + 1),
        Rollout(apply(ROBOT, [term("motor_weak", "knee_front_left", loss=0.01)]), n, STEPS),
        Rollout(ROBOT, networks(2)[1], STEPS),
        Rollout(ROBOT, n, STEPS, pose=True),
    ]
    keys = {Job(r, Travel()).key for r in rollouts} | {Job(rollouts[0], Whole()).key}
    assert len(keys) == 6
    assert Job(Rollout(quadruped(), n, STEPS, seed=3), Travel()).key == Job(rollouts[0], Travel()).key, (
        "a robot without noise does not depend on the seed"
    )


@pytest.mark.parametrize("address", ["127.0.0.1:1", "nonsense", "ray://127.0.0.1:1"])
def test_an_address_where_no_cluster_is(address):
    import ray

    ray.shutdown()
    with pytest.raises(EvaluatorError, match=r"ray\.address="):
        start_ray(address, 1)
