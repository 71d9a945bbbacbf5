"""What values together, or at the end of their range, are told to mean: a load, a weight, a guess that is farther off."""

from __future__ import annotations

from dataclasses import replace

import pytest

from ee_dist.discrepancy.accounts.ranges import as_loads, beyond_a_guess, load_text, weight_text
from ee_dist.discrepancy.evidence.intervals import BOUND, ParameterReport
from ee_dist.effects.catalogue import apply, term
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum


@pytest.mark.parametrize(("mass", "x"), [(0.1, 0.03), (0.2, -0.05)])
def test_a_mass_and_a_centre_that_are_a_load_in_other_words_are_told_to_be_one(mass: float, x: float) -> None:
    robot = servo_pendulum()
    arm = robot.parts[1]
    held = apply(robot, (term("payload", arm.name, mass_kg=mass, x_m=x, y_m=0.0, z_m=-0.1),)).part(arm.name)
    moved = [b - a for a, b in zip(arm.com_m, held.com_m, strict=True)]
    shifted = term("com_shifted", arm.name, **dict(zip(("along_x_m", "along_y_m", "along_z_m"), moved, strict=True)))
    heavier = term("part_mass", arm.name, change=mass / arm.mass_kg)
    (load,) = as_loads(robot, (heavier, shifted))
    assert load.name == f"payload@{arm.name}"
    assert list(dict(load.values).values()) == pytest.approx([mass, x, 0.0, -0.1])
    (line,) = load_text(robot, (heavier, shifted))
    assert f"{mass:.3g} kg" in line and "load" in line
    lighter = term("part_mass", arm.name, change=-0.3)
    far = term("com_shifted", arm.name, along_x_m=3.0, along_y_m=0.0, along_z_m=0.0)
    assert not load_text(robot, (heavier,)) and not load_text(robot, (shifted,)), "one of them says what it says"
    assert not load_text(robot, (lighter, shifted)) and not load_text(robot, (heavier, far))


def test_all_that_moves_being_much_heavier_than_described_is_told() -> None:
    robot = servo_pendulum()
    part = robot.parts[1]
    (line,) = weight_text(robot, (term("part_mass", part.name, change=1.0),))
    moving = sum(p.mass_kg for p in robot.parts[1:])
    assert f"weighs {moving + part.mass_kg:.3g} kg in this model, and {moving:.3g} kg" in line
    assert not weight_text(robot, (term("part_mass", part.name, change=0.1),))


def test_a_factor_on_a_guess_that_ended_at_its_bound_says_how_to_go_on() -> None:
    robot = quadruped()
    guessed = replace(robot, assumed=tuple((j, "kp") for j in robot.motor_names))
    stiffer = (term("position_gain", "all_joints", factor=5.0),)
    at_end, within = (ParameterReport(0, "factor", 5.0, 4.0, 6.0, flag) for flag in (BOUND, ""))
    (line,) = beyond_a_guess(guessed, stiffer, [at_end])
    assert (
        line.startswith("Position gain at all joints ended") and "multiply what the description assumes by 5," in line
    )
    (line,) = beyond_a_guess(guessed, stiffer, [at_end], alone=True)
    assert "improve puts it right together" in line and "multiply" not in line
    (line,) = beyond_a_guess(guessed, stiffer, [at_end], no_farther={"position_gain@all_joints"})
    assert "with more room it took less than a tenth off" in line and "multiply" not in line
    assert not beyond_a_guess(guessed, stiffer, [within])
    assert not beyond_a_guess(robot, stiffer, [at_end]), "nobody guessed"
