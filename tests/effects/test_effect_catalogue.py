"""What every effect promises, checked for all that are registered: a new one is in here without a line."""

from __future__ import annotations

import inspect
import math
import pickle
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from ee_dist.effects import CATALOGUE, Effect, Term, apply, term
from ee_dist.effects.catalogue import from_dict
from ee_dist.effects.effect import FAMILIES
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network, weight_count
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.inertia import felt_inertia, steady_inertia
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.model import CONTINUOUS_RAD, Robot
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.log import SensorLog

ROBOTS = {r.name: r for r in (quadruped(), servo_pendulum(), linear_stage())}
NAMES = tuple(CATALOGUE)
STEPS, LONG = 150, 300
WEIGHTS = tuple(np.random.default_rng(7).uniform(-1, 1, weight_count(8, 8)))
SILENT_ALONE = {"missed_touch"}
BEFOREHAND = {"commands_stamped_late"}
"""Effects on commands that are known before they are due, as those of a log are."""


def corners(effect: Effect, robot: Robot, target: str) -> list[Term]:
    """Both ends of every parameter with the others at their far end, so that none is silenced by a neutral partner."""
    bounds = effect.bounds(robot, target)
    far = {p.name: max(bounds[p.name], key=lambda v, p=p: abs(v - p.neutral)) for p in effect.parameters}
    ends = [far | {name: end} for name, pair in bounds.items() for end in pair] or [{}]
    found = dict.fromkeys(term(effect.name, target, **values) for values in ends)
    return [t for t in found if not effect.parameters or t != neutral(effect, target)]


def neutral(effect: Effect, target: str) -> Term:
    return term(effect.name, target, **effect.neutral_values())


def walked(engine: PyBulletEngine, steps: int) -> dict[Term, SensorLog]:
    """The quadruped walking on one network under every corner of every effect at every target, in one go."""
    robot = quadruped()
    terms = [t for e in CATALOGUE.values() for target in e.targets(robot) for t in corners(e, robot, target)]
    found = engine.rollout([Rollout(apply(robot, (t,)), Network(WEIGHTS), steps, 1, pose=True) for t in terms])
    return dict(zip(terms, found, strict=True))


@pytest.fixture(scope="module")
def logs(pybullet: PyBulletEngine) -> dict[Term, SensorLog]:
    return walked(pybullet, STEPS)


@pytest.fixture(scope="module")
def untouched(pybullet: PyBulletEngine) -> SensorLog:
    (log,) = pybullet.rollout([Rollout(quadruped(), Network(WEIGHTS), STEPS, 1, pose=True)])
    return log


def same(a: SensorLog, b: SensorLog) -> bool:
    """Bit for bit."""
    arrays = ((a.sensors, b.sensors), (a.commands, b.commands), (a.joints, b.joints), (a.base_pose, b.base_pose))
    return all(x is not None and y is not None and x.tobytes() == y.tobytes() for x, y in arrays)


@pytest.mark.parametrize("name", NAMES)
def test_every_effect_states_its_facts(name: str) -> None:
    effect = CATALOGUE[name]
    assert re.fullmatch(r"[a-z]+(_[a-z]+)*", name)
    assert effect.family in FAMILIES
    for text in (effect.physics, effect.signature):
        assert len(text) > 40
        assert text.endswith(".")
    for p in effect.parameters:
        assert p.unit
        assert p.meaning
        assert p.resolution > 0
        assert p.lower < p.upper
    assert any(effect.targets(robot) for robot in ROBOTS.values())


@pytest.mark.parametrize("name", NAMES)
def test_every_effect_has_a_useful_finite_range_around_neutral_on_every_robot(name: str) -> None:
    effect = CATALOGUE[name]
    for robot in ROBOTS.values():
        for target in effect.targets(robot):
            bounds = effect.bounds(robot, target)
            assert list(bounds) == [p.name for p in effect.parameters]
            for p in effect.parameters:
                low, high = bounds[p.name]
                assert p.lower <= low <= p.neutral <= high <= p.upper
                assert math.isfinite(low)
                assert math.isfinite(high)
                assert low < high
                assert effect.unit(p.name, robot, target)


@pytest.mark.parametrize("name", [n for n in NAMES if CATALOGUE[n].parameters])
def test_every_effect_does_nothing_at_its_neutral_values(name: str, pybullet: PyBulletEngine) -> None:
    effect, robot = CATALOGUE[name], quadruped()
    models = [apply(robot, (neutral(effect, target),)) for target in effect.targets(robot)]
    found = pybullet.rollout([Rollout(m, Network(WEIGHTS), 40, 1, pose=True) for m in [robot, *models]])
    for target, log in zip(effect.targets(robot), found[1:], strict=True):
        assert same(log, found[0]), target


def check_finite(t: Term, log: SensorLog) -> None:
    assert log.finite, t
    assert log.base_pose is not None
    assert np.isfinite(log.base_pose).all(), t
    # A robot that a step has blown up is finite too, but not where robots walk.
    assert np.abs(log.base_pose[:, 2]).max() < 0.5, t


@pytest.mark.parametrize("name", NAMES)
def test_every_effect_stays_finite_at_its_bounds(name: str, logs: dict[Term, SensorLog]) -> None:
    for t, log in logs.items():
        if t.effect == name:
            check_finite(t, log)


@pytest.mark.slow
def test_every_effect_stays_finite_at_its_bounds_for_twice_as_long(pybullet: PyBulletEngine) -> None:
    for t, log in walked(pybullet, LONG).items():
        check_finite(t, log)


@pytest.mark.parametrize("name", NAMES)
def test_every_effect_changes_something_at_every_target(
    name: str, logs: dict[Term, SensorLog], untouched: SensorLog
) -> None:
    changed = {t.target: False for t in logs if t.effect == name}
    for t, log in logs.items():
        if t.effect == name:
            changed[t.target] |= not same(log, untouched)
    if name in BEFOREHAND:
        assert not any(changed.values()), "what a network commands nobody knows before"
    elif name in SILENT_ALONE:
        assert any(changed.values())
    else:
        assert all(changed.values()), changed


@pytest.mark.parametrize("name", [n for n in NAMES if CATALOGUE[n].targets(ROBOTS["quadruped"])])
def test_a_row_does_not_depend_on_the_rest_of_its_batch(
    name: str, logs: dict[Term, SensorLog], pybullet: PyBulletEngine
) -> None:
    t = next(t for t in logs if t.effect == name)
    (alone,) = pybullet.rollout([Rollout(apply(quadruped(), (t,)), Network(WEIGHTS), 60, 1, pose=True)])
    head = logs[t].head(60)
    # Noise is drawn for a whole rollout: a shorter one has other draws.
    if not any(s.noise or s.dropout for s in apply(quadruped(), (t,)).sensors):
        assert same(alone, head)


@pytest.mark.parametrize("name", NAMES)
def test_every_effect_survives_pickle_dictionary_and_yaml(name: str) -> None:
    effect = CATALOGUE[name]
    assert pickle.loads(pickle.dumps(effect)) == effect
    for robot in ROBOTS.values():
        for target in effect.targets(robot)[:1]:
            for t in corners(effect, robot, target):
                assert pickle.loads(pickle.dumps(t)) == t
                assert from_dict(t.as_dict()) == t
                assert from_dict(yaml.safe_load(yaml.safe_dump(t.as_dict()))) == t
                model = apply(robot, (t,))
                assert pickle.loads(pickle.dumps(model)) == model
                assert name in str(t)


def test_every_effect_is_measured() -> None:
    """A test named after the effect shows that it does what it says."""
    here = Path(inspect.getfile(inspect.currentframe())).parent  # type: ignore[arg-type]
    text = "".join(f.read_text() for f in here.glob("test_effect_*.py"))
    missing = [n for n in NAMES if not re.search(rf"^def test_{n}_", text, re.MULTILINE)]
    assert not missing


def test_no_spring_pulls_back_what_turns_without_end_and_without_a_motor() -> None:
    """Fitted within a turn, it would throw a free pendulum that goes round."""
    robot, spring = quadruped(), CATALOGUE["parallel_spring"]
    first = robot.motor_names[0]
    assert spring.targets(robot) == robot.motor_names
    endless = robot.with_joint(first, lower=-CONTINUOUS_RAD, upper=CONTINUOUS_RAD)
    assert first in spring.targets(endless), "a motor's joint may have a cable"
    free = endless.with_drive(first, command="none")
    assert first not in spring.targets(free)
    assert first in spring.targets(robot.with_drive(first, command="none"))


@pytest.mark.parametrize(
    ("lower", "upper"), [(-2.818, -0.888), (0.4, 2.0), (3.465, 5.395), (-5.395, -3.465), (-1.0, 0.0)]
)
def test_every_effect_can_be_tried_on_joints_whose_range_leaves_out_zero(lower: float, upper: float) -> None:
    """As the knees of most quadrupeds do, and angles that are counted from another turn."""
    robot = quadruped()
    knees = {j.name for j in robot.joints if "knee" in j.name}
    robot = replace(
        robot, joints=tuple(replace(j, lower=lower, upper=upper) if j.name in knees else j for j in robot.joints)
    )
    for e in CATALOGUE.values():
        for target in e.targets(robot):
            for t in corners(e, robot, target):
                changed = apply(robot, (t,))
                assert all(j.lower <= j.upper for j in changed.joints), t
                assert (steady_inertia(changed) > 0).all() and np.isfinite(felt_inertia(changed)).all(), t
    stops = {s: set(CATALOGUE[s].targets(robot)) & knees for s in ("lower_stop", "upper_stop")}
    assert stops["lower_stop" if upper <= 0 else "upper_stop"] == knees, "away from the end at which it begins"
