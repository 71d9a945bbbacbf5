"""Friction does what its numbers say, in both engines: measured on one joint, where pencil and paper know the answer."""

from __future__ import annotations

import math

import numpy as np
import pytest
from effect_robots import ARM_M, MASS_KG, Bench, G, lever, slider

from ee_dist.effects import Term, apply, term
from ee_dist.effects.catalogue import find
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.log import Array

PULL_N = 10.0
HOLD_NM = MASS_KG * G * ARM_M


def acceleration(speed: Array, steps: int = 50, dt: float = 0.001) -> float:
    """Mean over the first steps of a series of speeds, 1/s^2."""
    return float((speed[steps] - speed[0]) / (steps * dt))


@pytest.mark.parametrize("step_s", [0.001, 0.01])
def test_coulomb_friction_slows_a_slide_by_torque_over_mass_and_then_holds_it(bench: Bench, step_s: float) -> None:
    log = bench.run(slider(step_s), term("coulomb_friction", "joint", torque_nm=4.0), steps=int(1 / step_s), speed=1.0)
    speed, stop = log.channel("velocity"), int(0.5 / step_s)
    assert acceleration(speed, stop // 2, step_s) == pytest.approx(-4.0 / MASS_KG, rel=0.01)
    assert (speed >= -1e-9).all(), "friction reversed the motion that it stopped"
    assert np.abs(speed[stop + 2 :]).max() < 1e-9
    assert log.channel("position")[-1] == pytest.approx(0.25, abs=step_s)


def test_coulomb_friction_holds_up_to_its_torque_and_gives_way_beyond(bench: Bench) -> None:
    friction = term("coulomb_friction", "joint", torque_nm=PULL_N)
    held = bench.run(slider(), friction, term("offset_torque", "joint", torque_nm=0.99 * PULL_N))
    moved = bench.run(slider(), friction, term("offset_torque", "joint", torque_nm=1.5 * PULL_N))
    assert np.abs(held.channel("position")).max() < 1e-9
    assert acceleration(moved.channel("velocity")) == pytest.approx(0.5 * PULL_N / MASS_KG, rel=0.01)


def test_coulomb_friction_holds_a_weight_that_no_one_announced(bench: Bench) -> None:
    log = bench.run(lever(), term("coulomb_friction", "joint", torque_nm=1.5 * HOLD_NM), steps=2000)
    position = log.channel("position")
    assert np.abs(position[10:] - position[10]).max() < 1e-6
    assert abs(position[-1]) < 1e-4, "the load is felt one step late"


@pytest.mark.parametrize("damping", [0.5, 20.0, 5000.0])
def test_viscous_friction_is_exact_in_the_steady_state_however_strong(bench: Bench, damping: float) -> None:
    terms = (
        term("viscous_friction", "joint", damping_nm_s_rad=damping),
        term("offset_torque", "joint", torque_nm=0.5 * damping),
    )
    log = bench.run(slider(0.01), *terms, steps=200, speed=0.5)
    assert log.channel("velocity")[-1] == pytest.approx(0.5, rel=1e-3)


def test_viscous_friction_lets_speed_decay_with_mass_over_damping(bench: Bench) -> None:
    log = bench.run(slider(), term("viscous_friction", "joint", damping_nm_s_rad=4.0), steps=501, speed=1.0)
    assert log.channel("velocity")[-1] == pytest.approx(math.exp(-0.5 * 4.0 / MASS_KG), rel=0.01)


def test_stribeck_friction_holds_more_than_it_slows(bench: Bench) -> None:
    sticky = term("stribeck_friction", "joint", torque_nm=8.0, speed_rad_s=0.1)
    rest = bench.run(slider(), sticky, term("offset_torque", "joint", torque_nm=7.9))
    assert np.abs(rest.channel("position")).max() < 1e-9
    for speed in (0.1, 0.3):
        moving = bench.run(slider(), sticky, steps=3, speed=speed)
        slowed = acceleration(moving.channel("velocity"), steps=1)
        assert slowed == pytest.approx(-8.0 / MASS_KG * math.exp(-speed / 0.1), rel=0.01)


def test_load_friction_takes_its_share_of_what_the_motor_gives(bench: Bench) -> None:
    # The drive saturates at its limit: a known torque through the gear, and no load but inertia.
    robot = slider(kp=1e4, torque_limit=PULL_N)
    log = bench.run(robot, term("load_friction", "joint", share=0.3), command=9.0)
    assert acceleration(log.channel("velocity")[5:]) == pytest.approx(0.7 * PULL_N / MASS_KG, rel=0.01)


def test_load_friction_takes_its_share_of_what_the_load_gives(bench: Bench) -> None:
    log = bench.run(lever(), term("load_friction", "joint", share=0.3))
    assert acceleration(log.channel("velocity")[5:], steps=20) == pytest.approx(0.7 * G / ARM_M, rel=0.01)


def test_load_friction_of_more_than_the_load_cannot_be_turned_backwards(bench: Bench) -> None:
    for share, falls in ((0.8, True), (1.2, False)):
        log = bench.run(lever(), term("load_friction", "joint", share=share), steps=500)
        assert bool(abs(log.channel("position")[-1]) > 0.1) is falls


def test_backdrive_friction_acts_on_the_load_and_not_on_the_motor(bench: Bench) -> None:
    more = term("backdrive_friction", "joint", share=0.4)
    driven = bench.run(slider(kp=1e4, torque_limit=PULL_N), more, command=9.0)
    assert acceleration(driven.channel("velocity")[5:]) == pytest.approx(PULL_N / MASS_KG, rel=0.01)
    falling = bench.run(lever(), more)
    assert acceleration(falling.channel("velocity")[5:], steps=20) == pytest.approx(0.6 * G / ARM_M, rel=0.01)


def test_quadratic_friction_grows_with_the_square_of_the_torque(bench: Bench) -> None:
    for pull in (PULL_N, 2 * PULL_N):
        robot = slider(kp=1e4, torque_limit=pull)
        log = bench.run(robot, term("quadratic_friction", "joint", per_nm=0.02), command=9.0)
        expected = (pull - 0.02 * pull**2) / MASS_KG
        assert acceleration(log.channel("velocity")[5:]) == pytest.approx(expected, rel=0.01)


def test_load_stribeck_friction_fades_with_speed(bench: Bench) -> None:
    robot = slider(kp=1e4, torque_limit=PULL_N)
    sticky = term("load_stribeck_friction", "joint", share=0.5, speed_rad_s=0.2)
    for speed in (0.0, 0.2):
        log = bench.run(robot, sticky, steps=12, speed=speed, command=9.0)
        now = float(log.channel("velocity")[10])
        expected = PULL_N * (1 - 0.5 * math.exp(-now / 0.2)) / MASS_KG
        assert acceleration(log.channel("velocity")[10:], steps=1) == pytest.approx(expected, rel=0.02)


def test_stribeck_friction_of_both_kinds_fades_each_at_its_own_speed(bench: Bench) -> None:
    robot = slider(kp=1e4, torque_limit=PULL_N)
    plain = term("stribeck_friction", "joint", torque_nm=0.2 * PULL_N, speed_rad_s=0.05)
    loaded = term("load_stribeck_friction", "joint", share=0.4, speed_rad_s=0.6)
    for terms in ((plain, loaded), (loaded, plain)):
        for speed in (0.05, 0.6):
            log = bench.run(robot, *terms, steps=12, speed=speed, command=9.0)
            now = float(log.channel("velocity")[10])
            rubs = 0.2 * math.exp(-now / 0.05) + 0.4 * math.exp(-now / 0.6)
            assert acceleration(log.channel("velocity")[10:], steps=1) == pytest.approx(
                PULL_N * (1 - rubs) / MASS_KG, rel=0.02
            )


@pytest.mark.parametrize(
    ("name", "much", "field"),
    [("stribeck_friction", "torque_nm", "stribeck"), ("load_stribeck_friction", "share", "stribeck_load")],
)
def test_two_of_a_kind_take_as_much_at_rest_and_over_all_speeds(name: str, much: str, field: str) -> None:
    """The second one's speed was that of both, however small it was: a jump at neutral, and another one in another order."""

    def drive(*terms: Term) -> tuple[float, float]:
        (d,) = apply(slider(), terms).drives
        return getattr(d, field), getattr(d, f"{field}_speed")

    wide, narrow = (term(name, "joint", **{much: v, "speed_rad_s": s}) for v, s in ((0.3, 0.4), (0.1, 0.02)))
    for both in (drive(wide, narrow), drive(narrow, wide)):
        assert both == pytest.approx((0.4, (0.3 * 0.4 + 0.1 * 0.02) / 0.4))
    hardly = term(name, "joint", **{much: 1e-9, "speed_rad_s": 0.02})
    assert drive(wide, hardly) == pytest.approx(drive(wide))
    assert drive(wide, wide) == (0.6, 0.4)


def test_a_description_with_one_speed_for_both_kinds_keeps_its_meaning() -> None:
    d = slider(stribeck_load=0.2, stribeck_speed=0.3).drives[0]
    assert d.stribeck_load_speed == 0.3
    assert (
        apply(
            slider(stribeck_load=0.2, stribeck_speed=0.3),
            [term("stribeck_friction", "joint", torque_nm=1.0, speed_rad_s=0.01)],
        )
        .drives[0]
        .stribeck_load_speed
        == 0.3
    )


@pytest.mark.parametrize(("dry", "up", "down"), [(2.0, 5.0, 1.0), (-2.0, 1.0, 5.0), (4.0, 7.0, 0.0)])
def test_friction_asymmetry_is_more_one_way_and_less_the_other(
    bench: Bench, dry: float, up: float, down: float
) -> None:
    terms = (term("coulomb_friction", "joint", torque_nm=3.0), term("friction_asymmetry", "joint", dry_nm=dry))
    for speed, friction in ((1.0, up), (-1.0, down)):
        log = bench.run(slider(), *terms, steps=100, speed=speed)
        slowed = -math.copysign(1.0, speed) * acceleration(log.channel("velocity"))
        assert slowed == pytest.approx(friction / MASS_KG, rel=0.01, abs=1e-9)


def test_friction_asymmetry_of_the_viscous_kind_changes_the_slope(bench: Bench) -> None:
    terms = (
        term("viscous_friction", "joint", damping_nm_s_rad=3.0),
        term("friction_asymmetry", "joint", viscous_nm_s_rad=-1.0),
    )
    for pull, slope in ((1.0, 2.0), (-1.0, 4.0)):
        push = term("offset_torque", "joint", torque_nm=pull)
        log = bench.run(slider(0.01), *terms, push, steps=200, speed=pull / slope)
        assert log.channel("velocity")[-1] == pytest.approx(pull / slope, rel=1e-3)


def test_frictions_add_up(bench: Bench) -> None:
    terms = (
        term("coulomb_friction", "joint", torque_nm=2.0),
        term("coulomb_friction", "joint", torque_nm=1.0),
        term("viscous_friction", "joint", damping_nm_s_rad=2.0),
    )
    log = bench.run(slider(), *terms, steps=3, speed=1.0)
    assert acceleration(log.channel("velocity"), steps=1) == pytest.approx(-5.0 / MASS_KG, rel=0.01)


def test_a_torque_drive_may_be_braked_far_below_the_speed_that_is_stated() -> None:
    """A motor led by its voltage and described by its data sheet: back-EMF is friction to one that is told torques."""
    robot = servo_pendulum()
    (drive,) = robot.drives
    most = {}
    for command, limit in (("position", 8.0), ("torque", 8.0), ("torque", math.inf)):
        altered = robot.with_drive(drive.joint, command=command, speed_limit=limit)
        most[command, limit] = find("viscous_friction").bounds(altered, drive.joint)["damping_nm_s_rad"][1]
    assert most["torque", 8.0] == pytest.approx(10 * most["position", 8.0])
    assert most["torque", math.inf] < most["torque", 8.0]


def test_as_much_again_as_is_described_is_worth_trying() -> None:
    """Many files state a speed that nobody measured: what is described would keep the drive from ever reaching it."""
    robot = servo_pendulum()
    (drive,) = robot.drives
    least = find("viscous_friction").bounds(robot, drive.joint)["damping_nm_s_rad"][1]
    for described in (0.5 * least, 3.0 * least):
        altered = robot.with_drive(drive.joint, viscous=described)
        bounds = find("viscous_friction").bounds(altered, drive.joint)["damping_nm_s_rad"]
        assert bounds == pytest.approx((-described, max(least, described)))
