"""Effects in motor, controller and transmission do what their numbers say."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from effect_robots import ARM_M, MASS_KG, Bench, G, block, lever, slider

from ee_dist.effects import CATALOGUE, apply, term
from ee_dist.effects.catalogue import Term, find
from ee_dist.engines.delay import Delay
from ee_dist.engines.drive import DrivePath
from ee_dist.engines.drivers import advanced
from ee_dist.export.plan import parameters
from ee_dist.export.shim import Shim
from ee_dist.robots.model import CONTINUOUS_M, Robot
from ee_dist.robots.quadruped import quadruped

HOLD_NM = MASS_KG * G * ARM_M
PULL_N = 10.0
SERVO = {"kp": 400.0, "kd": 60.0}


def settled(bench: Bench, robot: Robot, *terms: Term, command: float = 0.0) -> float:
    """Where a joint comes to rest."""
    found = bench.run(robot, *terms, steps=3000, command=command).channel("position")
    assert np.ptp(found[-100:]) < 1e-4
    return float(found[-1])


def test_motor_weak_sags_more_under_the_same_load(bench: Bench) -> None:
    robot = lever(kp=100.0, kd=10.0)
    for loss in (0.0, 0.5):
        angle = settled(bench, robot, term("motor_weak", "joint", loss=loss))
        assert (1 - loss) * 100.0 * angle == pytest.approx(HOLD_NM * math.cos(angle), rel=1e-4)


def test_torque_limit_caps_the_acceleration_and_the_speed(bench: Bench) -> None:
    robot = slider(kp=1e4, torque_limit=PULL_N)
    log = bench.run(robot, term("torque_limit", "joint", loss=0.4), steps=100, command=9.0)
    assert log.channel("velocity")[50] / 0.05 == pytest.approx(0.6 * PULL_N / MASS_KG, rel=0.01)
    quick = slider(kp=1e4, torque_limit=100.0, speed_limit=1.0)
    log = bench.run(quick, term("torque_limit", "joint", loss=0.4), command=9.0)
    assert log.channel("velocity")[-1] == pytest.approx(0.6, rel=0.01)


def test_speed_limit_is_the_speed_without_load(bench: Bench) -> None:
    robot = slider(kp=1e4, torque_limit=100.0, speed_limit=1.0)
    for loss in (0.0, 0.4, 0.9):
        log = bench.run(robot, term("speed_limit", "joint", loss=loss), command=9.0)
        assert log.channel("velocity")[-1] == pytest.approx(1.0 - loss, rel=0.01)


def test_supply_sag_takes_its_share_at_full_torque_and_half_at_half(bench: Bench) -> None:
    sag = term("supply_sag", "supply", share=0.4)
    full = bench.run(slider(kp=1e4, torque_limit=PULL_N), sag, steps=100, command=9.0)
    assert full.torques is not None
    assert full.torques[5:, 0] == pytest.approx(0.6 * PULL_N)
    # The error hardly changes in a tenth of a second: half of the limit is asked all the time.
    half = bench.run(slider(kp=0.5, torque_limit=PULL_N), sag, steps=100, command=10.0)
    assert half.torques is not None
    assert half.torques[5:50, 0] == pytest.approx(0.8 * 0.5 * PULL_N, rel=0.01)


@pytest.mark.parametrize(
    ("fault", "draws"),
    [
        (term("part_lost", "lower_front_left"), False),
        (term("motor_weak", "knee_front_left", loss=1.0), False),
        (term("motor_weak", "knee_front_left", loss=0.5), True),
    ],
)
def test_only_motors_that_are_there_and_alive_load_the_supply(fault: Term, draws: bool) -> None:
    robot = quadruped()
    knee, still, late = robot.motor_names.index("knee_front_left"), np.zeros((1, 8)), np.full((1, 8), 9.0)
    alone = still.copy()
    alone[0, knee] = 9.0
    found = {}
    for share in (0.0, 0.8):
        model = apply(robot, (fault, term("supply_sag", "supply", share=share)))
        path, shim = DrivePath([model], model.time_step_s), Shim(parameters(model))
        path.step(0.0, alone, still, still)
        shim.torque(0.0, alone[0], still[0], still[0])
        dt = model.time_step_s
        found[share] = path.step(dt, late, still, still)[0], shim.torque(dt, late[0], still[0], still[0])
    others = np.arange(8) != knee
    for sagging, full in zip(found[0.8], found[0.0], strict=True):
        # One of eight gave its most the step before.
        assert sagging[others] == pytest.approx((0.9 if draws else 1.0) * full[others])


def test_command_gain_scales_where_the_joint_goes(bench: Bench) -> None:
    assert settled(bench, slider(**SERVO), term("command_gain", "joint", change=0.25), command=0.2) == pytest.approx(
        0.25
    )


def test_command_reversed_pushes_the_other_way(bench: Bench) -> None:
    robot = slider(**(SERVO | {"command": "torque"}))
    pushed, back = (
        bench.run(robot, *terms, steps=100, command=0.3) for terms in ((), (term("command_reversed", "joint"),))
    )
    assert pushed.channel("position")[-1] > 0.0
    np.testing.assert_allclose(back.channel("position"), -pushed.channel("position"), atol=1e-12)


@pytest.mark.parametrize("steps", [7, 50])
def test_command_delay_shifts_the_motion_by_its_time(bench: Bench, steps: int) -> None:
    command = np.concatenate([np.zeros(5), np.full(395, 0.2)])
    base, late = (
        bench.run(slider(**SERVO), term("command_delay", "joint", delay_s=d * 0.001), steps=400, command=command)
        for d in (0, steps)
    )
    np.testing.assert_array_equal(late.channel("position")[steps:], base.channel("position")[:-steps])
    assert np.ptp(base.channel("position")) > 0.1


def test_command_delay_of_half_a_step_is_half_way(bench: Bench) -> None:
    ramp = np.linspace(0.0, 1.0, 1001)
    late = bench.run(slider(**SERVO), term("command_delay", "joint", delay_s=0.0205), steps=1001, command=ramp)
    base = bench.run(slider(**SERVO), steps=1001, command=ramp)
    behind = (base.channel("position") - late.channel("position"))[-1]
    assert behind == pytest.approx(0.0205, rel=0.01), "a ramp of 1 m/s is as far behind as it is late"


def test_command_speed_makes_a_ramp_of_a_step(bench: Bench) -> None:
    capped = bench.run(slider(**SERVO), term("command_speed", "joint", slowness_s_rad=4.0), steps=2000, command=0.4)
    ramp = bench.run(slider(**SERVO), steps=2000, command=np.minimum(0.25 * 0.001 * np.arange(1, 2001), 0.4))
    np.testing.assert_allclose(capped.channel("position"), ramp.channel("position"), atol=1e-9)


def test_command_speed_takes_what_pushes_on_from_a_torque_and_not_what_brakes(bench: Bench) -> None:
    robot, top, pull = slider(command="torque"), 0.5, PULL_N / MASS_KG
    limit = term("command_speed", "joint", slowness_s_rad=1.0 / top)
    speed = bench.run(robot, limit, steps=600, command=PULL_N).channel("velocity")
    # As fast as without it up to nine tenths of the speed, then ever less.
    reached = round(0.9 * top / pull / 0.001)
    np.testing.assert_allclose(speed[: reached - 2], pull * 0.001 * np.arange(1, reached - 1), atol=6e-3)
    after = 0.001 * np.arange(len(speed) - reached)
    np.testing.assert_allclose(speed[reached:], top - 0.1 * top * np.exp(-after * pull / (0.1 * top)), atol=0.01)
    there_and_back = np.where(np.arange(600) < 300, PULL_N, -PULL_N)
    free = bench.run(robot, steps=600, command=there_and_back).channel("velocity")
    held = bench.run(robot, limit, steps=600, command=there_and_back).channel("velocity")
    np.testing.assert_allclose(np.diff(held)[310:390], np.diff(free)[310:390], atol=1e-9)
    again = bench.run(slider(command="torque", command_speed=top), steps=600, command=PULL_N).channel("velocity")
    np.testing.assert_array_equal(again, speed)


@pytest.mark.parametrize("speed", [0.0, 0.46, 0.49, 0.6, -0.49, -2.0])
def test_the_shim_lets_as_little_push_on_near_a_top_speed(speed: float) -> None:
    model = apply(slider(command="torque"), [term("command_speed", "joint", slowness_s_rad=2.0)])
    at, moving = np.zeros((1, 1)), np.full((1, 1), speed)
    path, shim = DrivePath([model], model.time_step_s), Shim(parameters(model))
    for t, told in enumerate((5.0, -5.0, 5.0)):
        asked = np.full((1, 1), told)
        wanted = told * float(np.clip((0.5 - np.sign(told) * speed) / 0.05, 0.0, 1.0))
        assert path.step(0.001 * t, asked, at, moving)[0] == pytest.approx([wanted])
        assert shim.torque(0.001 * t, asked[0], at[0], moving[0]) == pytest.approx([wanted])


def test_command_acceleration_makes_a_trapezoid_of_a_step(bench: Bench) -> None:
    times, far = 0.001 * np.arange(1, 2501), 0.4
    for slowest, most in ((np.inf, 0.5), (0.25, 0.5)):
        terms = [term("command_acceleration", "joint", reluctance_s2_rad=1.0 / most)]
        if np.isfinite(slowest):
            terms.append(term("command_speed", "joint", slowness_s_rad=1.0 / slowest))
        eased = bench.run(slider(**SERVO), *terms, steps=2500, command=far)
        # As long at rest, gathering speed, at full speed and losing it as the area under a trapezoid says.
        top = min(slowest, np.sqrt(far * most))
        rises, lasts = top / most, far / top + top / most
        before, after = np.minimum(times, rises), np.clip(times - (lasts - rises), 0.0, rises)
        goal = 0.5 * most * before**2 + top * np.clip(times - rises, 0.0, lasts - 2 * rises) + top * after
        goal = np.minimum(goal - 0.5 * most * after**2, far)
        profile = bench.run(slider(**SERVO), steps=2500, command=goal)
        np.testing.assert_allclose(eased.channel("position"), profile.channel("position"), atol=1.5e-3)
        assert eased.channel("position").max() < far + 1e-3, "it stops where it is wanted"


def test_command_acceleration_adds_to_a_limit_that_is_described() -> None:
    robot = slider(**SERVO, command_acceleration=0.5)
    gentler = apply(robot, [term("command_acceleration", "joint", reluctance_s2_rad=2.0)])
    assert gentler.drives[0].command_acceleration == pytest.approx(0.25)
    assert apply(robot, [term("command_acceleration", "joint", reluctance_s2_rad=0.0)]) == robot


def test_command_speed_adds_to_a_limit_that_is_described() -> None:
    robot = slider(**SERVO, command_speed=0.5)
    slower = apply(robot, [term("command_speed", "joint", slowness_s_rad=2.0)])
    assert slower.drives[0].command_speed == pytest.approx(0.25)
    assert apply(robot, [term("command_speed", "joint", slowness_s_rad=0.0)]) == robot


def test_zero_offset_shifts_the_joint(bench: Bench) -> None:
    assert settled(bench, slider(**SERVO), term("zero_offset", "joint", offset_rad=0.05), command=0.2) == pytest.approx(
        0.15
    )


@pytest.mark.parametrize("command", [0.3, -0.3])
def test_deadband_stops_short_by_its_half_width(bench: Bench, command: float) -> None:
    found = settled(bench, slider(kp=400.0, kd=120.0), term("deadband", "joint", half_width_rad=0.02), command=command)
    assert abs(command - found) == pytest.approx(0.02, abs=1e-4)
    assert abs(found) < abs(command)


def test_rotor_inertia_divides_the_acceleration(bench: Bench) -> None:
    inertia = MASS_KG * ARM_M**2
    terms = (term("rotor_inertia", "joint", added_kg_m2=inertia), term("offset_torque", "joint", torque_nm=1.0))
    # Hanging straight down, gravity pulls nowhere.
    log = bench.run(lever(), *terms, steps=21, position=math.pi / 2)
    assert log.channel("velocity")[-1] / 0.02 == pytest.approx(0.5 / inertia, rel=0.01)


def test_joint_jam_stops_the_joint_within_its_range(bench: Bench) -> None:
    found = settled(bench, slider(kp=400.0, kd=120.0), term("joint_jam", "joint", loss=0.95), command=2.0)
    assert found == pytest.approx(0.5, abs=0.002)


def test_joint_jam_leaves_a_joint_whose_range_is_without_zero_about_where_it_starts(bench: Bench) -> None:
    knee = slider(kp=400.0, kd=120.0).with_joint("joint", lower=-2.0, upper=-1.0, start=-1.2)
    jam = term("joint_jam", "joint", loss=0.5)
    for command, expected in ((0.0, -1.1), (-3.0, -1.6)):
        log = bench.run(knee, jam, command=command, position=-1.2, steps=3000)
        assert log.channel("position")[-1] == pytest.approx(expected, abs=0.002)
    assert knee.with_joint("joint", freedom=0.0, start=-5.0).joint("joint").stops == (-2.0, -2.0)


def test_joint_jam_is_for_joints_that_have_stops() -> None:
    robot = slider()
    assert CATALOGUE["joint_jam"].targets(robot) == ("joint",)
    assert CATALOGUE["joint_jam"].targets(robot.with_joint("joint", lower=-CONTINUOUS_M, upper=CONTINUOUS_M)) == ()


def test_backlash_is_how_far_the_joint_can_be_moved_with_the_motor_held(bench: Bench) -> None:
    ends = [
        settled(
            bench,
            slider(rotor_inertia=0.5, **SERVO),
            term("backlash", "joint", gap_rad=0.04),
            term("viscous_friction", "joint", damping_nm_s_rad=20.0),
            term("offset_torque", "joint", torque_nm=pull),
        )
        for pull in (PULL_N, -PULL_N)
    ]
    assert ends[0] - ends[1] == pytest.approx(0.04 + 2 * PULL_N / SERVO["kp"], rel=1e-3)


def test_backlash_of_nearly_nothing_is_nearly_the_rigid_drive(bench: Bench) -> None:
    command = 0.3 * np.sin(np.arange(2000) * 0.001 * 6.0)
    rigid = bench.run(slider(rotor_inertia=0.5, **SERVO), steps=2000, command=command).channel("position")
    loose = [
        bench.run(
            slider(rotor_inertia=0.5, **SERVO), term("backlash", "joint", gap_rad=gap), steps=2000, command=command
        ).channel("position")
        for gap in (1e-6, 0.04)
    ]
    small, large = (float(np.abs(found - rigid).max()) for found in loose)
    assert small < 1e-3
    assert 0.015 < large < 0.05


def test_backlash_lets_the_joint_wait_after_a_reversal(bench: Bench) -> None:
    command = 0.3 * np.sin(np.arange(4000) * 0.001 * 2.0)
    dry = term("coulomb_friction", "joint", torque_nm=20.0)  # or the joint would coast on through the gap
    robot = slider(rotor_inertia=0.1, kp=4000.0, kd=300.0)
    tight, loose = (
        bench.run(robot, dry, term("backlash", "joint", gap_rad=gap), steps=4000, command=command).channel("position")
        for gap in (0.0, 0.05)
    )
    assert np.ptp(tight) - np.ptp(loose) == pytest.approx(0.05, abs=0.01), "each side is reached half a gap short"


def test_elastic_transmission_twists_by_compliance_times_torque(bench: Bench) -> None:
    soft = term("elastic_transmission", "joint", compliance_rad_nm=0.004)
    grease = term("viscous_friction", "joint", damping_nm_s_rad=20.0)
    found = settled(bench, slider(**SERVO), soft, grease, term("offset_torque", "joint", torque_nm=PULL_N))
    assert found == pytest.approx(PULL_N / SERVO["kp"] + 0.004 * PULL_N, rel=1e-3)


@pytest.mark.parametrize(("command", "acts"), [("position", True), ("speed", True), ("torque", False), ("none", False)])
def test_elastic_transmission_is_for_drives_whose_controller_reads_the_motor(command: str, acts: bool) -> None:
    # Where the torque is commanded, the joint gets it through a spring as well as without.
    assert bool(CATALOGUE["elastic_transmission"].targets(slider(command=command))) is acts


def test_elastic_transmission_swings_with_the_stiffness_of_motor_and_shaft_in_series(bench: Bench) -> None:
    soft = term("elastic_transmission", "joint", compliance_rad_nm=0.01)
    log = bench.run(slider(kp=400.0), soft, steps=3000, position=0.1)
    ups = np.flatnonzero(np.diff(np.sign(log.channel("position"))) > 0)
    period = float(np.diff(ups).mean()) * 0.001
    assert period == pytest.approx(2 * math.pi * math.sqrt(MASS_KG * (1 / 400.0 + 0.01)), rel=0.01)


def test_upper_stop_ends_a_joint_before_the_end_that_is_described(bench: Bench) -> None:
    robot, stop = slider(kp=400.0, kd=60.0, torque_limit=100.0), term("upper_stop", "joint", nearer_rad=0.7)
    end = robot.joint("joint").upper - 0.7
    assert settled(bench, robot, stop, command=end + 0.2) == pytest.approx(end, abs=1e-3)
    for free in (end - 0.2, robot.joint("joint").lower + 0.1):
        assert settled(bench, robot, stop, command=free) == pytest.approx(free, abs=1e-3)


def test_lower_stop_ends_a_joint_before_the_end_that_is_described(bench: Bench) -> None:
    robot, stop = slider(kp=400.0, kd=60.0, torque_limit=100.0), term("lower_stop", "joint", nearer_rad=0.7)
    end = robot.joint("joint").lower + 0.7
    assert settled(bench, robot, stop, command=end - 0.2) == pytest.approx(end, abs=1e-3)
    assert settled(bench, robot, stop, command=end + 0.3) == pytest.approx(end + 0.3, abs=1e-3)


def test_parallel_spring_swings_about_its_rest_with_its_own_period(bench: Bench) -> None:
    spring = term("parallel_spring", "joint", stiffness_nm_rad=50.0, rest_rad=0.2)
    position = bench.run(slider(), spring, steps=4000, position=0.3).channel("position")
    ups = np.flatnonzero(np.diff(np.sign(position - 0.2)) > 0)
    assert float(np.diff(ups).mean()) * 0.001 == pytest.approx(2 * math.pi * math.sqrt(MASS_KG / 50.0), rel=0.01)
    assert position.max() == pytest.approx(0.3, rel=0.01)


def test_parallel_spring_beside_another_is_one_stiffer_spring_between_their_rests(bench: Bench) -> None:
    two = (
        term("parallel_spring", "joint", stiffness_nm_rad=30.0, rest_rad=0.4),
        term("parallel_spring", "joint", stiffness_nm_rad=10.0, rest_rad=-0.4),
        term("viscous_friction", "joint", damping_nm_s_rad=15.0),
    )
    assert settled(bench, slider(), *two) == pytest.approx(0.2, abs=1e-4)


def test_parallel_spring_takes_off_what_is_described_down_to_none(bench: Bench) -> None:
    described = slider().with_drive("joint", spring=50.0, spring_rest=0.2)
    half, none = (term("parallel_spring", "joint", stiffness_nm_rad=-k, rest_rad=0.2) for k in (25.0, 50.0))
    position = bench.run(described, half, steps=4000, position=0.3).channel("position")
    ups = np.flatnonzero(np.diff(np.sign(position - 0.2)) > 0)
    assert float(np.diff(ups).mean()) * 0.001 == pytest.approx(2 * math.pi * math.sqrt(MASS_KG / 25.0), rel=0.01)
    np.testing.assert_allclose(bench.run(described, none, steps=200, position=0.3).channel("position"), 0.3, atol=1e-12)
    # Of one with another rest a pull is left: what it was off by.
    pulled = apply(described, (term("parallel_spring", "joint", stiffness_nm_rad=-50.0, rest_rad=0.1),)).drives[0]
    assert (pulled.spring, pulled.offset_torque) == (0.0, pytest.approx(50.0 * 0.1))


@pytest.mark.parametrize("spring", [0.0, 40.0])
def test_parallel_spring_is_looked_for_down_to_what_is_described(spring: float) -> None:
    low, high = CATALOGUE["parallel_spring"].room(slider().with_drive("joint", spring=spring), "joint")[
        "stiffness_nm_rad"
    ]
    assert low == -spring and high > 0


def test_offset_torque_accelerates_by_torque_over_mass(bench: Bench) -> None:
    log = bench.run(slider(), term("offset_torque", "joint", torque_nm=PULL_N), steps=101)
    assert log.channel("velocity")[-1] / 0.1 == pytest.approx(PULL_N / MASS_KG, rel=1e-6)


def test_a_released_drive_neither_pushes_nor_brakes(bench: Bench) -> None:
    robot = slider(kp=400.0, kd=60.0, torque_limit=100.0, speed_limit=1.0)
    braked, free = (bench.run(robot, speed=0.5, steps=200, command=9.0, enabled=np.full(200, on)) for on in (1.0, 0.0))
    np.testing.assert_array_equal(free.channel("velocity"), np.full(200, 0.5))
    assert abs(braked.channel("velocity")[-1] - 0.5) > 0.1
    untouched = bench.run(robot, speed=0.5, steps=200, command=9.0)
    np.testing.assert_array_equal(braked.sensors, untouched.sensors)


def test_a_released_drive_falls_and_is_caught_when_it_is_enabled_again(bench: Bench) -> None:
    on = np.concatenate([np.zeros(100), np.ones(2900)])
    position = bench.run(lever(kp=100.0, kd=10.0), steps=3000, enabled=on).channel("position")
    assert position[100] == pytest.approx(0.5 * G / ARM_M * 0.1**2, rel=0.02)
    assert position[-1] == pytest.approx(HOLD_NM * math.cos(position[-1]) / 100.0, rel=1e-3)


def test_a_released_drive_keeps_its_friction(bench: Bench) -> None:
    terms = (term("coulomb_friction", "joint", torque_nm=4.0), term("speed_limit", "joint", loss=0.5))
    robot = slider(torque_limit=100.0, speed_limit=1.0)
    log = bench.run(robot, *terms, speed=1.0, steps=101, enabled=np.zeros(1))
    assert log.channel("velocity")[-1] == pytest.approx(1.0 - 0.1 * 4.0 / MASS_KG, rel=1e-3)


def test_a_drive_without_a_floor_or_load_does_nothing_at_rest(bench: Bench) -> None:
    assert bench.run(block(), steps=20).joints == pytest.approx(0.0)


def test_delays_worth_trying_do_not_shrink_with_the_step_of_a_simulation() -> None:
    """A bus is as late however finely somebody simulates."""
    robot = quadruped()
    fine = replace(robot, time_step_s=0.0005)
    for effect, target in (
        ("command_delay", robot.motor_names[0]),
        ("sensor_delay", next(x.name for x in robot.sensors if x.kind == "angle")),
    ):
        assert dict(find(effect).bounds(fine, target))["delay_s"][1] == 0.1
        assert dict(find(effect).bounds(robot, target))["delay_s"][1] == 20.0 * robot.time_step_s > 0.1


def test_speed_feed_forward_takes_off_what_a_joint_lags_by_its_damping(bench: Bench) -> None:
    """A ramp of speed v is followed kd*v/kp late; with a share of the speed known, late by what that leaves."""
    speed, late = 0.05, SERVO["kd"] / SERVO["kp"]
    times = 0.001 * np.arange(4001)
    lags = []
    for share in (0.0, 0.6, 1.0):
        log = bench.run(
            slider(**SERVO), term("speed_feed_forward", "joint", share=share), steps=4001, command=speed * times
        )
        lags.append(float((speed * times - log.channel("position"))[-1]) / speed)
        assert lags[-1] == pytest.approx((1.0 - share) * late, abs=0.0015)
    assert lags[0] > 0.004, "there is a lag to be less"


def test_speed_feed_forward_adds_to_what_is_described_and_does_nothing_at_rest(bench: Bench) -> None:
    half = apply(slider(**SERVO, feed_forward=0.5), [term("speed_feed_forward", "joint", share=0.25)])
    assert half.drives[0].feed_forward == pytest.approx(0.75)
    less = apply(slider(**SERVO, feed_forward=0.5), [term("speed_feed_forward", "joint", share=-0.7)])
    assert less.drives[0].feed_forward == 0.0
    plain, told = (bench.run(slider(**SERVO, feed_forward=f), steps=400, command=0.1) for f in (0.0, 1.0))
    assert plain.channel("position").tobytes() == told.channel("position").tobytes(), (
        "a step at the beginning has no speed"
    )
    assert CATALOGUE["speed_feed_forward"].targets(slider(**{**SERVO, "kd": 0.0})) == ()


def test_commands_stamped_late_act_before_their_time(bench: Bench) -> None:
    """A ramp is followed sooner by as long, until its last value, which stays."""
    ramp = 0.05 * 0.001 * np.arange(2001)
    robot, early = slider(**SERVO), term("commands_stamped_late", "log", late_s=0.0125)
    plain = bench.run(robot, steps=2001, command=ramp).channel("position")
    sooner = bench.run(robot, early, steps=2001, command=ramp).channel("position")
    assert (sooner - plain)[1000] == pytest.approx(0.05 * 0.0125, rel=1e-3)
    assert sooner[-1] < ramp[-1] + 1e-6


def test_what_is_early_by_as_much_as_it_is_late_is_neither() -> None:
    """Commands early by 12.5 ms behind a delay of 12.5 ms, but for the first and last rows, where nobody knows them."""
    values = np.cumsum(np.random.default_rng(0).standard_normal((60, 2)), axis=0)
    again = advanced(values, 0.010, 0.005)
    late = np.stack([Delay(np.full((1, 2), 0.010), 0.005).over(again[:, None])[:, 0]])[0]
    np.testing.assert_allclose(late[2:-2], values[2:-2])
    assert advanced(values, 0.0, 0.005) is values


def test_integral_gain_lets_a_load_creep_away(bench: Bench) -> None:
    """Under a steady load a joint hangs back by load/kp; with ki that shrinks as exp(-t ki/kp), damping left out."""
    robot = slider(kp=400.0, kd=60.0, torque_limit=1000.0)
    load = term("offset_torque", "joint", torque_nm=20.0)
    hangs = bench.run(robot, load, steps=3000).channel("position")
    assert hangs[-1] == pytest.approx(20.0 / 400.0, rel=1e-3)
    led = bench.run(robot, load, term("integral_gain", "joint", added=200.0), steps=3000).channel("position")
    assert led[2999] / led[1999] == pytest.approx(math.exp(-200.0 / 400.0), rel=0.1)
    none = bench.run(replace(robot, drives=(replace(robot.drives[0], ki=200.0),)), load, steps=3000)
    assert none.channel("position").tobytes() == led.tobytes(), "as it is described"


def test_integral_gain_is_held_within_a_quarter_of_the_torque_limit(bench: Bench) -> None:
    robot = slider(kp=400.0, kd=60.0, torque_limit=40.0)
    load, led = term("offset_torque", "joint", torque_nm=20.0), term("integral_gain", "joint", added=2000.0)
    assert settled(bench, robot, load, led) == pytest.approx((20.0 - 40.0 / 4) / 400.0, rel=1e-3)
