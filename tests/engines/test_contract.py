"""What every engine must do, against formulas from mechanics and against the contract. Runs on both engines."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from engine_robots import (
    BOX_HALF_M,
    MASS_KG,
    RADIUS_M,
    G,
    at,
    ball,
    calm_commands,
    loose_drive,
    mixed_models,
    network,
    one_joint,
    run,
    sled,
)

from ee_dist.engines.contract import Engine, Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.robots.model import Robot, Sensor, Shape, World
from ee_dist.robots.quadruped import FOOT_M, LOWER_M, quadruped
from ee_dist.trials.log import SensorLog

UPRIGHT = [0.0, 0.0, 0.0, 1.0]


def assert_same_bits(first: SensorLog, second: SensorLog) -> None:
    for name in ("times_s", "sensors", "commands", "base_pose", "joints", "torques"):
        a, b = getattr(first, name), getattr(second, name)
        assert (a is None) == (b is None)
        assert a is None or a.tobytes() == b.tobytes(), name
    assert first.travel_m == second.travel_m or not first.finite


# -- free motion -----------------------------------------------------------------------------------------------------


def test_free_fall_is_the_parabola(engine: Engine) -> None:
    height = run(engine, ball(height_m=50.0), 200).channel("height")
    n = np.arange(200)
    # Both step speed first, then position: z = z0 - g h^2 n (n + 1) / 2.
    assert height == pytest.approx(50.0 - G * 1e-4 * n * (n + 1) / 2, abs=1e-9)


def test_a_push_gives_force_over_mass_and_drag_its_exponential(engine: Engine) -> None:
    drifting = ball(gravity_m_s2=0.0, has_floor=False, push_x_n=3.0)
    pushed = run(engine, drifting, 101)
    assert pushed.travel_m == pytest.approx(0.5 * 3.0 / MASS_KG * 1.0**2, rel=0.011)
    dragged = ball(gravity_m_s2=0.0, has_floor=False, drag_n_s_m=4.0)
    start = at([], [], [0.0, 0.0, 1.0, *UPRIGHT], [1.0, 0.5, 0.0, 0.0, 0.0, 0.0])
    log = run(engine, dragged, 201, start)
    assert log.base_pose is not None
    # Speed falls by the factor 1 - h c / m a step, which tends to exp(-c t / m).
    factor = 1 - 0.01 * 4.0 / MASS_KG
    gone = 0.01 * (factor ** np.arange(1, 201)).sum()
    assert gone == pytest.approx((1 - np.exp(-4.0 / MASS_KG * 2.0)) * MASS_KG / 4.0, rel=0.02)
    assert log.base_pose[-1, :2] == pytest.approx([gone, 0.5 * gone], rel=1e-6)


def test_a_twist_is_that_of_the_centre_of_mass_in_the_frame_of_the_floor(engine: Engine) -> None:
    spin, quarter = 2.0, [np.sqrt(0.5), 0.0, 0.0, np.sqrt(0.5)]
    robot = ball(com_m=(0.2, 0.0, 0.0), gravity_m_s2=0.0, has_floor=False)
    sensors = (Sensor("speed", "speed_x", ""), Sensor("turn", "turn_rate", ""))
    robot = replace(robot, time_step_s=0.002, sensors=sensors)
    # A quarter turn about x: the robot's y axis, about which it spins, is the floor's z axis.
    start = at([], [], [0.0, 0.0, 1.0, *quarter], [0.5, 0.0, 0.1, 0.0, 0.0, spin])
    log = run(engine, robot, 501, start)
    assert log.base_pose is not None
    t = log.times_s
    arm = np.stack([0.2 * np.cos(spin * t), 0.2 * np.sin(spin * t), np.zeros_like(t)], axis=1)
    expected = np.array([0.2, 0.0, 1.0]) + t[:, None] * np.array([0.5, 0.0, 0.1]) - arm
    assert log.base_pose[:, :3] == pytest.approx(expected, abs=1e-3)
    assert log.channel("speed") == pytest.approx(0.5, abs=2e-3)
    assert log.channel("turn") == pytest.approx(spin, abs=2e-3)


# -- joints ----------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("rotor_inertia", [0.0, 0.05])
def test_pendulum_period(engine: Engine, rotor_inertia: float) -> None:
    robot = one_joint("hinge", (0.0, 1.0, 0.0), rotor_inertia)
    angle = run(engine, robot, 2500, at([0.1], [0.0])).channel("position")
    down = np.flatnonzero((angle[:-1] > 0) & (angle[1:] <= 0))
    crossing = down + angle[down] / (angle[down] - angle[down + 1])
    period = np.diff(crossing).mean() * robot.time_step_s
    inertia = 0.012 + MASS_KG * 0.3**2 + rotor_inertia
    expected = 2 * np.pi * np.sqrt(inertia / (MASS_KG * G * 0.3)) * (1 + 0.1**2 / 16)
    assert len(down) >= 3
    assert period == pytest.approx(expected, rel=1e-3)
    assert angle.max() < 0.101, "a pendulum without friction gains no energy"
    assert angle[-700:].max() > 0.098, "and loses none"


@pytest.mark.parametrize("rotor", [0.0, 0.5])
def test_torque_turns_and_force_slides_a_joint(engine: Engine, rotor: float) -> None:
    for kind, inertia in (("hinge", 0.008), ("slide", MASS_KG)):
        robot = one_joint(kind, (0.0, 0.0, 1.0), rotor).with_world(gravity_m_s2=0.0)
        robot = robot.map_drive("joint", lambda d: replace(d, offset_torque=0.04))
        position = run(engine, robot, 201).channel("position")
        assert position[-1] == pytest.approx(0.5 * 0.04 / (inertia + rotor) * 0.4**2, rel=0.006)


@pytest.mark.parametrize(
    ("axis", "tilt_rad", "pull"), [((0.0, 0.0, 1.0), 0.0, -G), ((1.0, 0.0, 0.0), 0.3, G * np.sin(0.3))]
)
def test_the_rotor_of_a_slide_is_inertia_and_no_weight(
    engine: Engine, axis: tuple[float, float, float], tilt_rad: float, pull: float
) -> None:
    robot = one_joint("slide", axis, rotor_inertia=3 * MASS_KG).with_world(tilt_y_rad=tilt_rad)
    speed = run(engine, robot, 101).channel("velocity")
    assert speed[-1] == pytest.approx(pull / 4 * 100 * robot.time_step_s, rel=1e-6)
    # Held by a spring it sags by the weight of the part alone.
    held = run(engine, robot.with_drive("joint", spring=1000.0, viscous=180.0), 3001).channel("position")
    assert held[-1] == pytest.approx(pull * MASS_KG / 1000.0, rel=1e-3)


def test_what_is_bolted_down_may_stand_on_the_floor(engine: Engine) -> None:
    """A post with shapes in the floor moves nothing and is moved by nothing: its joint swings as without a floor."""
    bare = one_joint("hinge", (0.0, 1.0, 0.0))
    post = replace(
        bare.parts[0], shapes=(Shape("box", (0.05, 0.05, 0.05)), Shape("sphere", (0.02,), (0.0, 0.0, -0.01)))
    )
    standing = replace(bare, parts=(post, bare.parts[1]), world=World(has_floor=True), start_position_m=(0.0, 0.0, 0.6))
    sunk = replace(standing, parts=(replace(post, shapes=(Shape("sphere", (0.7,)),)), bare.parts[1]))
    lifted = replace(bare, start_position_m=standing.start_position_m)
    free, *others = (run(engine, r, 200, at([0.5], [0.0])) for r in (lifted, standing, sunk))
    for log in others:
        assert log.sensors == pytest.approx(free.sensors, abs=1e-9)


def test_coulomb_friction_stops_a_slide_where_the_formula_says_and_never_reverses_it(engine: Engine) -> None:
    robot = one_joint("slide", (1.0, 0.0, 0.0)).map_drive("joint", lambda d: replace(d, coulomb=5.0))
    log = run(engine, robot, 400, at([0.0], [0.5]))
    speed = log.channel("velocity")
    step = robot.time_step_s
    assert log.channel("position")[-1] == pytest.approx(0.5**2 / (2 * 5.0 / MASS_KG) - 0.5 * step / 2, rel=1e-6)
    assert speed.min() > -1e-9
    assert np.abs(speed[-100:]).max() < 1e-9
    first = speed[:50]
    assert np.diff(first) == pytest.approx(-5.0 / MASS_KG * robot.time_step_s, rel=1e-6)


def test_coulomb_friction_holds_a_load_below_it_and_gives_way_above(engine: Engine) -> None:
    load = MASS_KG * G * 0.3  # N.m of the horizontal arm
    level = at([-np.pi / 2], [0.0])
    arm = one_joint("hinge", (0.0, 1.0, 0.0))
    held = arm.map_drive("joint", lambda d: replace(d, coulomb=1.1 * load))
    lost = arm.map_drive("joint", lambda d: replace(d, coulomb=0.9 * load))
    assert run(engine, held, 500, level).channel("position")[-1] == pytest.approx(-np.pi / 2, abs=0.01)
    assert abs(run(engine, lost, 500, level).channel("position")[-1] + np.pi / 2) > 0.1


def test_a_stop_is_not_passed(engine: Engine) -> None:
    robot = one_joint("hinge", (0.0, 1.0, 0.0)).with_joint("joint", lower=-0.2, upper=0.3)
    swung = run(engine, robot, 2000, at([0.0], [2.0])).channel("position")
    assert 0.25 < swung.max() < 0.31
    assert swung.min() > -0.21


# -- the floor -------------------------------------------------------------------------------------------------------


SLIDING = {"pybullet": 0.01, "mujoco": 0.1}
"""How exactly an engine slides. MuJoCo's friction is convex: a fast slide chatters, on and off the floor by a millimetre."""


@pytest.mark.parametrize("friction", [0.2, 0.5])
@pytest.mark.parametrize("speed", [0.5, 1.0])
def test_a_sled_slides_as_far_as_friction_lets_it(engine: Engine, friction: float, speed: float) -> None:
    start = at([], [], [0.0, 0.0, BOX_HALF_M[2], *UPRIGHT], [speed, 0.0, 0.0, 0.0, 0.0, 0.0])
    log = run(engine, sled(friction=friction), 150, start)
    # Speed falls before position moves, which costs half a step's way.
    expected = speed**2 / (2 * friction * G) - speed * 0.01 / 2
    assert log.travel_m == pytest.approx(expected, rel=SLIDING[engine.name])
    assert abs(log.channel("speed")[-1]) < 1e-3
    assert np.abs(log.channel("height") - BOX_HALF_M[2]).max() < 2.5e-3, "it neither hops nor sinks"


def test_a_slope_holds_a_sled_below_the_angle_of_friction_only(engine: Engine) -> None:
    slope, friction = 0.3, 0.2
    held = run(engine, sled(friction=0.4, tilt_y_rad=slope), 300)
    assert abs(held.travel_m) < 2e-3
    slid = run(engine, sled(friction=friction, tilt_y_rad=slope), 101)
    down = G * (np.sin(slope) - friction * np.cos(slope))
    assert slid.travel_m == pytest.approx(0.505 * down * 1.0**2, rel=SLIDING[engine.name])


def test_tilts_turn_gravity_the_way_they_say(engine: Engine) -> None:
    nose_down = run(engine, sled(friction=0.0, tilt_y_rad=0.1), 101).base_pose
    sideways = run(engine, sled(friction=0.0, tilt_x_rad=0.1), 101).base_pose
    assert nose_down is not None
    assert sideways is not None
    far = 0.5 * G * np.sin(0.1)
    assert nose_down[-1, :2] == pytest.approx([far, 0.0], rel=0.011, abs=1e-6)
    assert sideways[-1, :2] == pytest.approx([0.0, -far], rel=0.011, abs=1e-6)


@pytest.mark.parametrize("compliance", [1e-4, 1e-3])
def test_a_floor_that_gives_sinks_by_weight_times_compliance(engine: Engine, compliance: float) -> None:
    height = run(engine, ball(compliance_m_n=compliance), 400).channel("height")
    assert RADIUS_M - height[-1] == pytest.approx(MASS_KG * G * compliance, rel=0.02, abs=0.0003)
    assert height.min() < height[-1] - (1e-4 if compliance == 1e-3 else 0.0), "a soft one overshoots"


def test_touch_is_open_in_the_air_and_closed_on_the_floor(engine: Engine) -> None:
    log = run(engine, ball(height_m=RADIUS_M + 0.05), 200)
    touch, height = log.channel("touch"), log.channel("height")
    assert set(np.unique(touch)) == {-1.0, 1.0}
    assert (touch[height > RADIUS_M + 0.005] == -1).all()
    assert (touch[120:] == 1).all()
    assert run(engine, ball(height_m=1.0, has_floor=False), 20).channel("touch").max() == -1


def test_a_robot_stands_at_the_height_of_its_knees(engine: Engine) -> None:
    # A floor that gives lets four legs share the weight; on a hard one, which of them carry is left to the solver.
    compliance = 3e-4
    robot = quadruped().with_world(compliance_m_n=compliance)
    log = run(engine, robot, 400, commands=np.tile([0.0, 0.35], (400, 4)))
    assert log.joints is not None
    assert log.base_pose is not None
    knee = log.joints[-1, 1::2]
    assert knee == pytest.approx(0.35, abs=0.05)
    assert np.ptp(knee) < 1e-3
    sunk = sum(p.mass_kg for p in robot.parts) * G / 4 * compliance
    assert log.base_pose[-1, 2] == pytest.approx((LOWER_M * np.cos(knee)).mean() + FOOT_M - sunk, abs=3e-4)
    assert (log.sensors[-1, :4] == 1).all()


# -- starts, losses, logs --------------------------------------------------------------------------------------------


def test_a_rollout_starts_in_the_state_asked_for(engine: Engine) -> None:
    rng = np.random.default_rng(3)
    pose = [0.3, -0.2, 0.5, *(np.array([0.1, -0.2, 0.3, 0.9]) / np.linalg.norm([0.1, -0.2, 0.3, 0.9]))]
    joints, speeds = rng.uniform(-0.5, 0.5, 8), rng.uniform(-1, 1, 8)
    start = at(list(joints), list(speeds), pose, [0.4, 0.0, 0.0, 0.0, 0.0, 0.5])
    robot = quadruped().with_part("body", com_m=(0.01, 0.02, 0.0))
    robot = replace(robot, drives=tuple(loose_drive(d.joint, d.rotor_inertia) for d in robot.drives))
    log = run(engine, robot, 3, start)
    assert log.joints is not None
    assert log.base_pose is not None
    assert log.joints[0] == pytest.approx(joints, abs=1e-12)
    assert log.base_pose[0] == pytest.approx(pose, abs=1e-6)
    assert log.joints[1] - log.joints[0] == pytest.approx(speeds * 0.01, abs=3e-4)
    # The next rollout, without a state, starts at the robot's own pose.
    after = run(engine, robot, 2)
    assert after.joints is not None
    assert after.base_pose is not None
    assert after.joints[0] == pytest.approx(0.0, abs=0)
    assert after.base_pose[0] == pytest.approx([*robot.start_position_m, *robot.start_rotation], abs=1e-6)


def test_lost_legs_leave_their_channels_dead_and_the_robot_on_its_side(engine: Engine) -> None:
    whole = run(engine, quadruped(), 200)
    lame = run(engine, quadruped().without("upper_front_left").without("upper_rear_left"), 200)
    assert (whole.channel("touch_rear_left")[50:] == 1).any()
    for leg in ("front_left", "rear_left"):
        assert (lame.channel(f"touch_{leg}") == -1).all()
        assert (lame.channel(f"angle_{leg}") == 0).all()
    assert lame.joints is not None
    assert lame.torques is not None
    gone = [0, 1, 4, 5]
    assert (lame.joints[:, gone] == 0).all()
    assert (lame.torques[:, gone] == 0).all()
    assert np.abs(np.delete(lame.joints, gone, axis=1)).max() > 0.01
    assert whole.base_pose is not None
    assert lame.base_pose is not None
    # Without its left legs it falls to the left: a negative turn about the forward axis.
    assert 2 * lame.base_pose[-1, 3] < -0.3
    assert abs(2 * whole.base_pose[-1, 3]) < 0.02


@pytest.mark.parametrize("pose", [True, False])
def test_logs_have_their_shapes(engine: Engine, pose: bool) -> None:
    robot = quadruped()
    (log,) = engine.rollout([Rollout(robot, network(0), 37, pose=pose)])
    assert log.sensors.shape == (37, 8)
    assert log.commands.shape == (37, 8)
    assert log.times_s == pytest.approx(np.arange(37) * 0.01)
    assert log.sensor_names == robot.sensor_names
    assert log.motor_names == robot.motor_names
    if pose:
        assert log.base_pose is not None
        assert log.base_pose.shape == (37, 7)
        assert log.travel_m == pytest.approx(log.base_pose[-1, 0] - log.base_pose[0, 0], abs=1e-12)
    else:
        assert log.base_pose is None
        assert np.isfinite(log.travel_m)


def test_wild_controllers_stay_finite_for_a_thousand_steps(engine: Engine) -> None:
    logs = engine.rollout([Rollout(robot, network(i), 1000) for i, robot in enumerate(mixed_models())])
    assert all(log.finite for log in logs)
    assert max(abs(log.travel_m) for log in logs if log is not logs[9]) < 20, "nothing is shot away"


# -- independence ----------------------------------------------------------------------------------------------------


def _rollouts(models: list[Robot]) -> list[Rollout]:
    out = [Rollout(m, network(i), 120, pose=True) for i, m in enumerate(models)]
    out += [Rollout(m, Commands(calm_commands(i, 120)), 120, pose=True) for i, m in enumerate(models)]
    out[3] = replace(out[3], start=at([0.1] * 8, [0.0] * 8, [0.0, 0.0, 0.2, *UPRIGHT], [0.1, 0.0, 0.0, 0.0, 0.0, 0.3]))
    return out


def test_a_result_does_not_depend_on_its_batch_its_order_or_what_ran_before(engine: Engine) -> None:
    rollouts = _rollouts(mixed_models())
    together = engine.rollout(rollouts)
    again = engine.rollout(rollouts)
    backwards = engine.rollout(rollouts[::-1])[::-1]
    alone = [engine.rollout([r])[0] for r in rollouts]
    for one, *others in zip(together, again, backwards, alone, strict=True):
        for other in others:
            assert_same_bits(one, other)
    assert len({log.sensors.tobytes() for log in together}) == len(together), "the rollouts do differ"


def test_a_fresh_engine_gives_the_same_bits(engine: Engine) -> None:
    rollouts = _rollouts(mixed_models())
    used = engine.rollout(rollouts)
    for rollout, expected in zip(rollouts, used, strict=True):
        fresh = type(engine)()
        assert_same_bits(fresh.rollout([rollout])[0], expected)
        fresh.close()


def test_small_batches_give_the_same_bits(engine: Engine) -> None:
    rollouts = _rollouts(mixed_models())
    small = type(engine)(largest_batch=3)  # type: ignore[call-arg]
    for one, other in zip(engine.rollout(rollouts), small.rollout(rollouts), strict=True):
        assert_same_bits(one, other)
    small.close()


# -- agreement -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("compliance", "body_mm", "joints_mrad", "touch_share"), [(0.0, 8.0, 18.0, 0.15), (3e-4, 4.0, 8.0, 0.02)]
)
def test_the_engines_agree_over_the_first_second_of_a_calm_trial(
    engines: dict[str, Engine], compliance: float, body_mm: float, joints_mrad: float, touch_share: float
) -> None:
    """On a hard floor, which of four legs carry is left to the solver, and the engines part there first."""
    steps, count = 100, 12
    robot = quadruped().with_world(compliance_m_n=compliance)
    rollouts = [Rollout(robot, Commands(calm_commands(i, steps)), steps, pose=True) for i in range(count)]
    bullet, mujoco = (engines[name].rollout(rollouts) for name in ("pybullet", "mujoco"))
    gaps = np.array([_gap(a, b) for a, b in zip(bullet, mujoco, strict=True)])
    for name, values in zip(("body mm", "joints mrad", "touch share"), gaps.T, strict=True):
        print(f"compliance {compliance:g} m/N, {name}: median {np.median(values):.3g}, worst {values.max():.3g}")
    assert (np.median(gaps, axis=0) < [body_mm, joints_mrad, touch_share]).all()
    assert (gaps.max(axis=0) < 4 * np.array([body_mm, joints_mrad, touch_share])).all()
    assert gaps[:, 1].min() > 0.01, "two engines, not one"


def _gap(a: SensorLog, b: SensorLog) -> tuple[float, float, float]:
    """Greatest distance of the bodies (mm), RMS difference of the joints (mrad), share of unlike touch values."""
    assert a.base_pose is not None
    assert b.base_pose is not None
    assert a.joints is not None
    assert b.joints is not None
    body = np.linalg.norm(a.base_pose[:, :3] - b.base_pose[:, :3], axis=1).max()
    joints = np.sqrt(((a.joints - b.joints) ** 2).mean())
    return 1e3 * float(body), 1e3 * float(joints), float((a.sensors[:, :4] != b.sensors[:, :4]).mean())


def test_the_engines_stand_alike(engines: dict[str, Engine]) -> None:
    for robot in mixed_models():
        a, b = (run(engines[name], robot, 60) for name in ("pybullet", "mujoco"))
        assert a.base_pose is not None
        assert b.base_pose is not None
        # A robot of these that falls over a lost leg slides while it falls: there contact models differ most.
        assert a.base_pose[:, :3] == pytest.approx(b.base_pose[:, :3], abs=1e-2)
        assert a.base_pose[:, 3:] == pytest.approx(b.base_pose[:, 3:], abs=0.04)
