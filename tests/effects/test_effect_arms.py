"""Effects for arms and their drives: what hangs on a part, where its mass is, how the base stands, gains and gears."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from effect_robots import ARM_M, MASS_KG, POINT, Bench, G, lever, slider
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.effects import CATALOGUE, EffectError, apply, term
from ee_dist.effects.catalogue import applied
from ee_dist.robots.instruments import with_motor_torques
from ee_dist.robots.inverse_dynamics import joint_torques, parameters
from ee_dist.robots.mass_matrix import mass_matrix
from ee_dist.robots.model import Drive, Joint, Part, Robot, Sensor, Wiring, World
from ee_dist.robots.quadruped import quadruped

METRES = st.floats(-0.3, 0.3)


def arm(**drive: float) -> Robot:
    """Two links that swing under gravity, on a bolted base."""
    inertia = (0.01, 0.012, 0.008, 0.001, -0.0005, 0.0008)
    parts = (
        Part("base", 1.0, (0.0, 0.0, 0.0), (1e-3, 1e-3, 1e-3, 0.0, 0.0, 0.0)),
        Part("upper", 2.0, (0.02, 0.0, 0.15), inertia),
        Part("lower", 1.0, (0.0, 0.01, 0.12), inertia),
    )
    joints = (
        Joint("shoulder", "hinge", "base", "upper", (0.0, 0.0, 0.2), (0.0, 1.0, 0.0), -3.0, 3.0),
        Joint("elbow", "hinge", "upper", "lower", (0.0, 0.0, 0.3), (0.0, 1.0, 0.0), -3.0, 3.0),
    )
    numbers = {"kp": 80.0, "ki": 0.0, "kd": 6.0, "torque_limit": 100.0, "speed_limit": math.inf} | drive
    drives = tuple(Drive(joint=j.name, **numbers) for j in joints)
    sensors = tuple(
        Sensor(f"{kind}_{j.name}", kind, j.name, unit)
        for kind, unit in (("position", "rad"), ("torque", "N.m"))
        for j in joints
    )
    return Robot(
        "arm",
        parts,
        joints,
        drives,
        sensors,
        Wiring((0, 1)),
        World(has_floor=False),
        free_base=False,
        time_step_s=0.002,
    )


def held(bench: Bench, robot: Robot, *terms: object) -> float:
    """Torque that holds a lever, with the angle's share taken out."""
    log = bench.run(robot, *terms, steps=2000)  # type: ignore[arg-type]
    return abs(float(log.channel("torque")[-1] / math.cos(log.channel("position")[-1])))


def test_payload_adds_its_weight_at_its_place(bench: Bench) -> None:
    robot = lever(kp=100.0, kd=10.0)
    assert held(bench, robot, term("payload", "arm", mass_kg=1.5, x_m=0.1, y_m=0.2)) == pytest.approx(
        G * (MASS_KG * ARM_M + 1.5 * 0.1), rel=1e-3
    )


def test_payload_moves_as_a_point_of_its_own_would(bench: Bench) -> None:
    """The same as an extra part, bolted on."""
    robot, at = arm(), (0.05, -0.04, 0.3)
    load = Part("load", 1.2, (0.0, 0.0, 0.0), POINT)
    bolt = Joint("bolt", "fixed", "lower", "load", at, (1.0, 0.0, 0.0), 0.0, 0.0)
    extra = replace(robot, parts=(*robot.parts, load), joints=(*robot.joints, bolt))
    with_payload = apply(robot, [term("payload", "lower", mass_kg=1.2, x_m=at[0], y_m=at[1], z_m=at[2])])
    wave = 0.8 * np.sin(np.linspace(0.0, 6.0, 600))[:, None]
    one, other = (bench.run(r, steps=600, command=wave[:, 0]) for r in (with_payload, extra))
    assert np.abs(one.sensors - other.sensors).max() < 1e-3 * np.abs(other.sensors).max()


@settings(deadline=None, max_examples=30)
@given(mass=st.floats(0.0, 5.0), x=METRES, y=METRES, z=METRES, seed=st.integers(0, 1000))
def test_payload_is_linear_in_the_parameters_of_a_balance_of_forces(
    mass: float, x: float, y: float, z: float, seed: int
) -> None:
    robot = arm()
    loaded = apply(robot, [term("payload", "lower", mass_kg=mass, x_m=x, y_m=y, z_m=z)])
    added = parameters(loaded) - parameters(robot)
    point = mass * np.array([1, x, y, z, y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z])
    assert added == pytest.approx(np.concatenate([np.zeros(10), point]), abs=1e-12)
    q, v, a = np.random.default_rng(seed).normal(size=(3, 5, 2))
    extra = joint_torques(loaded, q, v, a) - joint_torques(robot, q, v, a)
    assert np.isfinite(extra).all()
    assert np.linalg.eigvalsh(mass_matrix(loaded) - mass_matrix(robot)).min() > -1e-9


def test_payload_of_nothing_is_the_robot_itself() -> None:
    assert apply(arm(), [term("payload", "lower", mass_kg=0.0, x_m=0.2)]) == arm()


def test_com_shifted_knows_all_three_axes(bench: Bench) -> None:
    robot = replace(lever(kp=100.0, kd=10.0))
    turned = robot.with_joint("joint", axis=(1.0, 0.0, 0.0)).with_part("arm", com_m=(0.0, -ARM_M, 0.0))
    assert held(bench, robot, term("com_shifted", "arm", along_x_m=0.06)) == pytest.approx(MASS_KG * G * 0.36, rel=1e-3)
    assert held(bench, turned, term("com_shifted", "arm", along_y_m=-0.06)) == pytest.approx(
        MASS_KG * G * 0.36, rel=1e-3
    )
    model = apply(robot, [term("com_shifted", "arm", along_z_m=0.1)])
    assert model.part("arm").com_m == (ARM_M, 0.0, 0.1)


def test_part_inertia_slows_a_turn_about_the_axes_across(bench: Bench) -> None:
    spread = (0.02, 0.05, 0.05, 0.0, 0.0, 0.0)  # mean squares along x, y, z times mass: 0.04, 0.01, 0.01
    robot = lever().with_part("arm", com_m=(0.0, 0.0, 0.0), inertia_kg_m2=spread).with_drive("joint", command="torque")
    for terms, inertia in (((), 0.05), ((term("part_inertia", "arm", along_x=1.0),), 0.09),
                           ((term("part_inertia", "arm", along_y=1.0),), 0.05)):  # fmt: skip
        log = bench.run(robot, *terms, steps=101, command=0.5)
        assert log.channel("velocity")[-1] == pytest.approx(0.5 * 0.1 / inertia, rel=0.01)


@settings(deadline=None, max_examples=40)
@given(*[st.floats(-0.8, 3.0)] * 3)
def test_part_inertia_stays_that_of_a_rigid_body(a: float, b: float, c: float) -> None:
    model = apply(arm(), [term("part_inertia", "lower", along_x=a, along_y=b, along_z=c)])
    xx, yy, zz, xy, xz, yz = model.part("lower").inertia_kg_m2
    low, middle, high = np.linalg.eigvalsh([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    assert low > 0
    assert high <= (low + middle) * (1 + 1e-9)


def test_mounting_tilt_turns_the_weight_at_all_joints(bench: Bench) -> None:
    # A level slide of 2 kg, tilted nose down by 10 degrees: gravity pulls it along.
    log = bench.run(slider(), term("mounting_tilt", "frame", forward_deg=10.0), steps=501)
    assert log.channel("velocity")[-1] == pytest.approx(G * math.sin(math.radians(10.0)) * 0.5, rel=0.01)
    still = np.zeros((1, 2))
    tilted = apply(arm(), [term("mounting_tilt", "base", sideways_deg=20.0, forward_deg=5.0)])
    assert (joint_torques(tilted, still, still, still) != joint_torques(arm(), still, still, still)).all()
    assert not CATALOGUE["mounting_tilt"].targets(quadruped())


def test_weight_carried_is_missing_at_all_joints_and_inertia_stays() -> None:
    pose, still, moving = np.array([[0.3, 0.9]]), np.zeros((1, 2)), np.array([[0.7, -0.4]])
    half, none = (apply(arm(), [term("weight_carried", "base", share=s)]) for s in (0.5, 1.0))
    weight = joint_torques(arm(), pose, still, still)
    assert np.abs(weight).min() > 0
    assert joint_torques(half, pose, still, still) == pytest.approx(0.5 * weight)
    assert joint_torques(none, pose, still, moving) == pytest.approx(joint_torques(arm(), pose, still, moving) - weight)
    assert not CATALOGUE["weight_carried"].targets(quadruped())


def test_speed_gain_is_a_factor_on_the_damping_of_the_drive(bench: Bench) -> None:
    robot = slider(kp=0.0, kd=3.0)
    for factor in (0.0, 2.0):
        log = bench.run(robot, term("speed_gain", "joint", factor=factor), steps=501, speed=1.0)
        assert log.channel("velocity")[-1] == pytest.approx(math.exp(-3.0 * factor * 0.5 / MASS_KG), rel=0.01)


def test_a_place_where_another_effect_left_nothing_is_still_one_of_a_group() -> None:
    """A search may take all of a rotor off one joint, and try a factor on those of all joints beside that."""
    robot = arm().with_drive("shoulder", rotor_inertia=0.02).with_drive("elbow", rotor_inertia=0.006)
    none = term("rotor_inertia", "elbow", added_kg_m2=-robot.drives[1].rotor_inertia)
    both = apply(robot, [none, term("rotor_factor", "all_joints", factor=2.0)])
    assert [d.rotor_inertia for d in both.drives] == [2 * robot.drives[0].rotor_inertia, 0.0]
    assert applied(robot, [[none, term("rotor_factor", "elbow", factor=2.0)]]) == [apply(robot, [none])]
    with pytest.raises(EffectError, match="cannot act on 'knee'"):
        apply(robot, [none, term("rotor_factor", "knee", factor=2.0)])


def test_rotor_factor_is_a_factor_on_what_is_described_at_each_joint() -> None:
    robot = arm().with_drive("shoulder", rotor_inertia=0.02).with_drive("elbow", rotor_inertia=0.006)
    twice = apply(robot, [term("rotor_factor", "all_joints", factor=2.0)])
    assert [d.rotor_inertia for d in twice.drives] == pytest.approx([0.04, 0.012])
    assert apply(robot, [term("rotor_factor", "all_joints", factor=1.0)]) == robot
    assert CATALOGUE["rotor_factor"].targets(robot.with_drive("elbow", rotor_inertia=0.0)) == ("shoulder",)
    low, high = CATALOGUE["rotor_factor"].bounds(robot, "elbow")["factor"]
    less, more = CATALOGUE["rotor_inertia"].bounds(robot, "elbow")["added_kg_m2"]
    assert 0.006 * low == pytest.approx(0.006 + less)
    # A guess may be an order of magnitude short.
    assert 0.006 * high > 2 * (0.006 + more) and high == pytest.approx(20.0)
    assert "rotor_factor" not in {name for name, effect in CATALOGUE.items() if effect.proposed(robot)}


def test_gear_ratio_moves_less_and_pulls_more(bench: Bench) -> None:
    robot = slider(kp=400.0, kd=60.0, torque_limit=10.0)
    geared = term("gear_ratio", "joint", change=0.25)
    log = bench.run(robot, geared, steps=3000, command=0.5)
    assert log.channel("position")[-1] == pytest.approx(0.4, rel=1e-3)
    assert log.channel("torque").max() == pytest.approx(12.5)
    torque = bench.run(slider(command="torque"), geared, steps=2, command=4.0)
    assert torque.channel("torque")[-1] == pytest.approx(5.0)


def test_gear_ratio_leaves_the_motor_as_it_is(bench: Bench) -> None:
    geared = term("gear_ratio", "joint", change=0.25)
    held = with_motor_torques(slider(kp=1e4, torque_limit=10.0))
    log = bench.run(held, geared, steps=3, command=9.0)
    assert log.channel("torque")[-1] == pytest.approx(12.5)
    assert log.channel("motor_torque_joint")[-1] == pytest.approx(10.0), "the same current as before"
    led = bench.run(slider(command="speed", kp=400.0, command_speed=0.5), geared, steps=500, command=2.0)
    assert led.channel("velocity")[-1] == pytest.approx(0.4, rel=1e-3)
    # Its speed without load is less by the ratio, whether by its data sheet or by more than that.
    for own in ({"speed_limit": 1.0}, {"back_emf": 10.0}):
        free = bench.run(slider(kp=1e4, torque_limit=10.0, **own), geared, steps=4000, command=9.0)
        assert free.channel("velocity")[-1] == pytest.approx(1.0 / 1.25, rel=0.01)


def test_sensor_group_delay_is_one_age_for_all_of_a_kind(bench: Bench) -> None:
    wave = 0.5 * np.sin(np.linspace(0.0, 8.0, 500))
    plain = bench.run(arm(), steps=500, command=wave)
    late = bench.run(arm(), term("sensor_group_delay", "position", delay_s=0.02), steps=500, command=wave)
    for joint in ("shoulder", "elbow"):
        assert np.array_equal(late.channel(f"position_{joint}")[10:], plain.channel(f"position_{joint}")[:-10])
        assert np.array_equal(late.channel(f"torque_{joint}"), plain.channel(f"torque_{joint}"))


def test_what_suits_arms_is_proposed_for_arms_alone() -> None:
    for robot, wanted in ((arm(), True), (quadruped(), False), (lever(), False)):
        names = {name for name, effect in CATALOGUE.items() if effect.proposed(robot)}
        assert ({"payload", "mounting_tilt", "weight_carried"} <= names) == wanted
        assert not {"part_inertia", "gear_ratio", "sensor_group_delay"} & names


def test_effects_act_where_the_kind_of_command_has_them() -> None:
    robot = arm().with_drive("elbow", command="torque").with_drive("shoulder", command="none")
    for name, targets in (
        ("zero_offset", ()),
        ("deadband", ()),
        ("command_speed", ("elbow",)),
        ("command_acceleration", ()),
        ("command_duration", ()),
        ("speed_gain", ()),
        ("motor_weak", ("elbow",)),
        ("command_gain", ("elbow",)),
        ("coulomb_friction", ("shoulder", "elbow")),
        ("parallel_spring", ("shoulder", "elbow")),
        ("motors_swapped", ()),
    ):
        assert CATALOGUE[name].targets(robot) == targets, name
    fast = robot.with_drive("elbow", speed_limit=5.0)
    assert CATALOGUE["speed_limit"].targets(fast) == ()
