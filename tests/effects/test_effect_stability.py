"""Friction and play stay calm at the engine's time step, also where many joints of a walking robot have them at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from effect_robots import MASS_KG, Bench, lever, slider
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.effects import Term, apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drive import DrivePath
from ee_dist.engines.drivers import Commands
from ee_dist.robots.inertia import felt_inertia, steady_inertia
from ee_dist.robots.mass_matrix import both_ways, mass_matrix, placed
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped import quadruped
from ee_dist.trials.log import Array

STEPS, STOP = 1000, 500
Named = dict[str, dict[str, float]]
HARSH: dict[str, Named] = {
    "dry": {"coulomb_friction": {"torque_nm": 1.5}},
    "locked": {"coulomb_friction": {"torque_nm": 6.0}},
    "viscous": {"viscous_friction": {"damping_nm_s_rad": 5.0}},
    "stribeck": {"stribeck_friction": {"torque_nm": 1.5, "speed_rad_s": 0.05}},
    "load": {"load_friction": {"share": 0.8}, "quadratic_friction": {"per_nm": 0.16}},
    "backdrive": {"backdrive_friction": {"share": 0.8}, "load_stribeck_friction": {"share": 0.8}},
    "asymmetry": {"friction_asymmetry": {"dry_nm": 1.5, "viscous_nm_s_rad": 0.6}},
    "slow": {"speed_limit": {"loss": 0.9}},
    "play": {"backlash": {"gap_rad": 0.15}},
    "soft": {"elastic_transmission": {"compliance_rad_nm": 0.1}},
    "play and twist": {"backlash": {"gap_rad": 0.1}, "elastic_transmission": {"compliance_rad_nm": 0.05}},
    "all": {
        "coulomb_friction": {"torque_nm": 0.3},
        "load_friction": {"share": 0.3},
        "viscous_friction": {"damping_nm_s_rad": 0.2},
        "backlash": {"gap_rad": 0.1},
        "elastic_transmission": {"compliance_rad_nm": 0.05},
    },
}


def everywhere(robot: Robot, named: Named) -> list[Term]:
    return [term(name, joint, **values) for joint in robot.motor_names for name, values in named.items()]


def test_eight_harsh_joints_on_the_ground_walk_and_then_rest(bench: Bench) -> None:
    robot = quadruped()
    times = np.minimum(np.arange(STEPS), STOP)[:, None] * robot.time_step_s
    gait = 0.6 * np.sin(2 * np.pi * np.linspace(0.4, 1.2, 8) * times + np.arange(8))
    models = [robot, *(apply(robot, everywhere(robot, named)) for named in HARSH.values())]
    logs = bench.engine.rollout([Rollout(m, Commands(gait), STEPS, pose=True) for m in models])
    for name, log in zip(("untouched", *HARSH), logs, strict=True):
        assert log.finite
        assert log.joints is not None
        assert log.base_pose is not None
        assert log.base_pose[:, 2].max() < 0.2, f"{name}: it jumps"
        speed = np.diff(log.joints, axis=0) / robot.time_step_s
        assert np.abs(speed).max() < 12.0, f"{name}: joints run away"
        # Friction that falls with speed lets a loaded joint creep by stick and slip: slow, and not growing.
        creep = 0.3 if name == "backdrive" else 0.1
        assert np.abs(speed[-100:]).max() < creep, f"{name}: joints tremble at rest"


def test_a_standing_robot_with_dry_joints_stands_still(bench: Bench) -> None:
    robot = quadruped()
    model = apply(robot, everywhere(robot, {"coulomb_friction": {"torque_nm": 1.0}}))
    (log,) = bench.engine.rollout([Rollout(model, Commands(np.zeros((1, 8))), 300, pose=True)])
    assert log.joints is not None
    assert np.abs(log.joints).max() < 1e-3
    assert np.abs(np.diff(log.joints[50:], axis=0)).max() < 1e-6


POSITIVE = st.floats(0.0, 20.0)


@settings(deadline=None, max_examples=60)
@given(
    coulomb=POSITIVE,
    viscous=st.floats(0.0, 1e4),
    stribeck=POSITIVE,
    share=st.floats(0.0, 2.0),
    speed=st.floats(-3.0, 3.0),
    step_s=st.sampled_from([0.001, 0.01, 0.05]),
)
def test_friction_alone_never_speeds_a_joint_up_nor_turns_it_round(
    coulomb: float, viscous: float, stribeck: float, share: float, speed: float, step_s: float
) -> None:
    robot = apply(
        slider(step_s),
        (
            term("coulomb_friction", "joint", torque_nm=coulomb),
            term("viscous_friction", "joint", damping_nm_s_rad=viscous),
            term("stribeck_friction", "joint", torque_nm=stribeck, speed_rad_s=0.2),
            term("load_friction", "joint", share=share),
        ),
    )
    drive = DrivePath([robot], step_s)
    q, qd = np.zeros((1, 1)), np.full((1, 1), speed)
    for _ in range(60):
        before = qd.item()
        qd = qd + step_s / MASS_KG * drive.step(0.0, np.zeros((1, 1)), q, qd)
        q = q + step_s * qd
        assert abs(qd.item()) <= abs(before) + 1e-12
        assert qd.item() * before >= -1e-12


@settings(deadline=None, max_examples=40)
@given(push=st.floats(-30.0, 30.0), coulomb=st.floats(0.1, 20.0), heavier=st.floats(1.0, 50.0))
def test_a_joint_that_is_heavier_than_it_seems_still_stops_and_holds(
    push: float, coulomb: float, heavier: float
) -> None:
    """As a leg is that stands on the ground."""
    robot = apply(slider(0.01), (term("coulomb_friction", "joint", torque_nm=coulomb),))
    drive, mass = DrivePath([robot], 0.01), heavier * MASS_KG
    q, qd, speeds = np.zeros((1, 1)), np.ones((1, 1)), []
    for _ in range(int(40 * heavier)):
        torque = drive.step(0.0, np.zeros((1, 1)), q, qd)
        assert abs(torque.item()) <= coulomb + 1e-12
        qd = qd + 0.01 / mass * (torque + push)
        speeds.append(qd.item())
    if abs(push) < 0.9 * coulomb and mass / (coulomb - abs(push)) < 0.2 * heavier:
        assert abs(speeds[-1]) < 1e-3
    if abs(push) > 1.1 * coulomb:
        expected = 0.01 / mass * (push - math.copysign(coulomb, push))
        late = speeds[-1] - speeds[-2]
        if speeds[-2] * push > 0:  # it slid that way before the last step, and not only after it
            assert late == pytest.approx(expected, rel=1e-6)


def test_the_inertia_of_one_joint_on_a_bolted_base_is_exact() -> None:
    assert steady_inertia(slider()) == pytest.approx([MASS_KG])
    assert steady_inertia(lever(rotor_inertia=0.1)) == pytest.approx([MASS_KG * 0.09 + 0.1])


def test_no_combination_of_joints_is_lighter_than_steady_inertia() -> None:
    robot, rng = quadruped(), np.random.default_rng(5)
    d: Array = steady_inertia(robot)
    assert (d <= felt_inertia(robot)).all()
    places = placed(robot.present_joints, robot.root.name, robot.free_base, rng.uniform(-0.8, 0.8, (10, 8)))
    for matrix in both_ways(robot, places).reshape(-1, 14, 14):
        inverse = np.linalg.inv(matrix)[6:, 6:]
        largest = np.linalg.eigvalsh(np.sqrt(d)[:, None] * inverse * np.sqrt(d)).max()
        assert largest < 4 / 3, "beyond this, friction on all joints at once would throw them about"


def test_a_part_that_hangs_on_a_joint_listed_later_counts_all_the_same() -> None:
    robot = quadruped()
    turned = Robot(**{**robot.__getstate__(), "joints": robot.joints[::-1]})
    inverse, other = (np.linalg.inv(mass_matrix(r)) for r in (robot, turned))
    assert np.diag(other)[6:][::-1] == pytest.approx(np.diag(inverse)[6:])


def test_what_a_rollout_is_known_by_tells_when_its_drives_were_released() -> None:
    robot, still = slider(), Commands(np.zeros((1, 1)))
    keys = {Rollout(robot, still, 4, enabled=e).key for e in (None, np.ones(4), np.array([1.0, 1.0, 0.0, 0.0]))}
    assert len(keys) == 3
