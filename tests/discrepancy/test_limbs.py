"""Limbs of a robot whose base stands fast are simulated each by itself, and only where something changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.ways.open_loop import prediction
from ee_dist.discrepancy.ways.open_loop.prediction import Digest, Predictor
from ee_dist.effects.catalogue import apply, term
from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.robots.limbs import limbs, whole
from ee_dist.robots.model import Joint, Robot, Sensor
from ee_dist.robots.quadruped import quadruped

ENGINES = {"mujoco": lambda: MuJoCoEngine(1), "pybullet": PyBulletEngine}


def hanging() -> Robot:
    """A quadruped bolted to a stand, legs in the air; channels and motors of its legs lie mixed."""
    robot = quadruped()
    joints = robot.motor_names
    sensors = tuple(Sensor(f"{kind}_{j}", kind, j) for kind in ("position", "velocity") for j in joints)
    order = np.random.default_rng(0).permutation(len(sensors))
    drives = tuple(robot.drives[k] for k in np.random.default_rng(1).permutation(len(joints)))
    return replace(
        robot,
        free_base=False,
        world=replace(robot.world, has_floor=False),
        sensors=tuple(sensors[k] for k in order),
        drives=drives,
    )


def recorded(robot: Robot, engine: Engine, released: bool = False, external: bool = False) -> MeasuredTrial:
    rng = np.random.default_rng(3)
    t = np.arange(300) * robot.time_step_s
    commands = 0.3 * np.sin(
        2 * np.pi * (0.5 + rng.random(len(robot.drives))) * t[:, None] + rng.random(len(robot.drives))
    )
    if released:
        commands[200:] = np.nan
    (log,) = engine.rollout([Rollout(robot, Commands(np.nan_to_num(commands)), len(t), pose=True)])
    pushed = 0.2 * np.sin(t[:, None] * np.arange(1, len(robot.drives) + 1)) if external else None
    assert log.joints is not None
    log = replace(log, commands=commands, joints=log.joints + 0.05 * np.arange(len(robot.drives)), external=pushed)
    return MeasuredTrial("t", log, Commands(commands), commands_held=True)


def predictor(robot: Robot, trial: MeasuredTrial, engine: Engine) -> Predictor:
    return Predictor([trial], robot, CachedEvaluator(SerialEvaluator(engine)), 5, 50)


def test_each_channel_and_each_motor_is_in_one_limb() -> None:
    robot = hanging()
    found = limbs(robot)
    assert len(found) == 4
    assert sorted(k for limb in found for k in limb.motors) == list(range(8))
    assert sorted(k for limb in found for k in limb.sensors) == list(range(16))
    for limb in found:
        assert [d.joint for d in limb.robot.drives] == [robot.drives[k].joint for k in limb.motors]
        assert {s.target for s in limb.robot.sensors} == {d.joint for d in limb.robot.drives}


@pytest.mark.parametrize(
    "change",
    [
        lambda r: replace(r, free_base=True),
        lambda r: replace(r, world=replace(r.world, has_floor=True)),
        lambda r: replace(r, world=replace(r.world, supply_sag=0.1)),
        lambda r: replace(r, sensors=tuple(s for s in r.sensors if s.target == "hip_front_left")),
    ],
    ids=["walks about", "floor", "one supply", "one limb is sensed"],
)
def test_what_limbs_share_keeps_them_together(change: Any) -> None:
    robot = change(hanging())
    (only,) = limbs(robot)
    assert only.robot is robot


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("kind", ["plain", "released", "external"])
def test_what_is_predicted_is_what_all_of_it_does(engine: str, kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    robot, runs = hanging(), ENGINES[engine]()
    trial = recorded(robot, runs, released=kind == "released", external=kind == "external")
    hypotheses = [
        (),
        (term("coulomb_friction", "knee_rear_right", torque_nm=0.2),),
        (term("mounting_tilt", "body", sideways_deg=9.0),),
        (term("motors_swapped", "hip_front_left+knee_rear_right"),),
        (term("sensor_delay", "position_hip_rear_left", delay_s=0.033),),
        (term("part_lost", "lower_front_right"),),
    ]
    models = [apply(robot, h) for h in hypotheses]
    found = predictor(robot, trial, runs).digests([(0, m) for m in models])
    monkeypatch.setattr(prediction, "limbs", lambda robot: (whole(robot),))
    right = predictor(robot, trial, runs).digests([(0, m) for m in models])
    runs.close()
    for a, b in zip(found, right, strict=True):
        np.testing.assert_allclose(a.means, b.means, rtol=1e-4, atol=1e-6)
        np.testing.assert_allclose(a.rough, b.rough, rtol=1e-4, atol=1e-6)
        # Of a limb that comes to rest by itself the last digit says whether a row is exactly the one before it.
        np.testing.assert_allclose(a.repeated, b.repeated, atol=0.2 if kind == "released" else 1e-6)
        assert a.finite and b.finite
    moved = [float(np.abs(f.means - found[0].means).max()) for f in found[1:]]
    assert min(moved) > 1e-3, "each of them shows"


def test_only_the_limb_that_changed_is_simulated() -> None:
    robot, runs = hanging(), MuJoCoEngine(1)
    predicts = predictor(robot, recorded(robot, runs), runs)
    counts = predicts.evaluator.counts
    joints = robot.motor_names
    one_each = [apply(robot, (term("coulomb_friction", j, torque_nm=0.1),)) for j in joints]
    predicts.digests([(0, m) for m in (robot, *one_each)])
    assert counts.simulated == 4 + len(joints)
    predicts.digests([(0, apply(robot, tuple(term("coulomb_friction", j, torque_nm=0.1) for j in joints)))])
    assert counts.simulated == 4 + len(joints) + 1, "with no other to share a limb with it is simulated at once"


def test_a_limb_has_only_what_leads_to_it() -> None:
    """Of links that are bolted to the base, frames of cameras and batteries, a limb needs those that carry it."""
    robot = hanging()
    own = robot.root
    plate, box = replace(own, name="plate", shapes=()), replace(own, name="box", shapes=())
    fixed = [Joint(n, "fixed", own.name, n, (0.0, 0.0, 0.1), (0.0, 0.0, 1.0), 0.0, 0.0) for n in ("plate", "box")]
    on_plate = {"hip_front_left", "hip_front_right"}
    joints = tuple(replace(j, parent="plate") if j.name in on_plate else j for j in robot.joints)
    robot = replace(robot, parts=(*robot.parts, plate, box), joints=(*joints, *fixed))
    for limb in limbs(robot):
        names = {p.name for p in limb.robot.parts}
        assert "box" not in names
        assert ("plate" in names) == bool(on_plate & {d.joint for d in limb.robot.drives})


def test_a_limb_that_flies_apart_is_told_of_all_of_it() -> None:
    def one(finite: bool, columns: Sequence[int]) -> Digest:
        values = np.array([columns], dtype=np.float32)
        return Digest(values, values, values, finite)

    parts: Any = [SimpleNamespace(sensors=(2, 0)), SimpleNamespace(sensors=(1,))]
    found = prediction.joined(parts, [one(True, (2, 0)), one(False, (1,))])
    assert found.means.tolist() == [[0.0, 1.0, 2.0]] and not found.finite
