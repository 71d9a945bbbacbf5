"""Terms and hypotheses: what is refused, what it says then, and what survives."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import replace

import pytest
from effect_robots import slider
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.discrepancy.search.candidates import candidates
from ee_dist.discrepancy.sharing import shared as widest
from ee_dist.effects import CATALOGUE, EffectError, Parameter, Term, apply, effect, term
from ee_dist.effects.catalogue import applied, find, from_dict
from ee_dist.effects.described import as_far_as_there_is, check_written
from ee_dist.effects.groups import groups
from ee_dist.effects.targets import motors
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum

QUADRUPED = quadruped()


def _unchanged(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot


@st.composite
def terms(draw: st.DrawFn) -> Term:
    """Any effect at any target of the quadruped, anywhere within its useful range."""
    entry = CATALOGUE[draw(st.sampled_from(sorted(n for n, e in CATALOGUE.items() if e.targets(QUADRUPED))))]
    target = draw(st.sampled_from(entry.targets(QUADRUPED)))
    bounds = entry.bounds(QUADRUPED, target)
    return term(entry.name, target, **{name: draw(st.floats(*pair)) for name, pair in bounds.items()})


@settings(deadline=None, max_examples=60)
@given(terms())
def test_a_term_comes_back_from_its_dictionary(t: Term) -> None:
    assert from_dict(t.as_dict()) == t
    assert eval(repr(t)) == t


@settings(deadline=None, max_examples=60)
@given(st.lists(terms(), max_size=4))
def test_a_hypothesis_gives_the_same_model_each_time_and_leaves_the_robot_alone(hypothesis: list[Term]) -> None:
    before = QUADRUPED.digest
    try:
        model = apply(QUADRUPED, hypothesis)
    except EffectError:
        return  # two effects may contradict each other: what one takes away the other cannot take again
    assert model == apply(QUADRUPED, hypothesis)
    assert model.motor_names == QUADRUPED.motor_names
    assert model.sensor_names == QUADRUPED.sensor_names
    assert quadruped().digest == before


@given(st.lists(terms(), min_size=1, max_size=3), terms())
@settings(max_examples=25, deadline=None)
def test_models_of_many_hypotheses_are_those_of_each_alone(first: list[Term], other: Term) -> None:
    hypotheses = [tuple(first), (*first, other), (other, *first), (), (*first, other)]
    try:
        alone = [apply(QUADRUPED, h) for h in hypotheses]
    except EffectError as refused:
        with pytest.raises(EffectError, match=re.escape(str(refused))):
            applied(QUADRUPED, hypotheses)
        return
    together = applied(QUADRUPED, hypotheses)
    assert together == alone
    assert together[1] is together[4] and together[3] is QUADRUPED


@settings(deadline=None, max_examples=60)
@given(terms())
def test_parameters_left_out_are_neutral(t: Term) -> None:
    entry = CATALOGUE[t.effect]
    assert dict(term(t.effect, t.target).values) == entry.neutral_values()


@settings(deadline=None, max_examples=60)
@given(terms(), st.floats(allow_nan=True, allow_infinity=True))
def test_a_value_is_taken_or_refused_in_one_line(t: Term, value: float) -> None:
    for p in CATALOGUE[t.effect].parameters:
        if math.isfinite(value) and p.lower <= value <= p.upper:
            assert dict(term(t.effect, t.target, **{p.name: value}).values)[p.name] == value
        else:
            with pytest.raises(EffectError, match=rf"^[^\n]*{p.name}[^\n]*$"):
                term(t.effect, t.target, **{p.name: value})


def test_an_unknown_effect_names_the_nearest() -> None:
    with pytest.raises(EffectError, match=r"no effect named 'columb_friction'; did you mean coulomb_friction"):
        term("columb_friction", "hip_front_left")
    with pytest.raises(EffectError, match=r"there are: part_lost"):
        term("zzz")


def test_a_value_out_of_bounds_names_the_bounds() -> None:
    with pytest.raises(EffectError, match=r"motor_weak: loss = 1.2 lies outside \[0, 1\]"):
        term("motor_weak", "hip_front_left", loss=1.2)
    with pytest.raises(EffectError, match=r"stribeck_friction: torque_nm = -1 lies outside \[0, inf\] N.m"):
        term("stribeck_friction", "hip_front_left", torque_nm=-1.0, speed_rad_s=0.1)


@pytest.mark.parametrize(
    ("effect", "key", "law"),
    [("coulomb_friction", "torque_nm", "coulomb"), ("viscous_friction", "damping_nm_s_rad", "viscous")],
)
def test_friction_that_is_described_can_be_taken_off_and_no_more(effect: str, key: str, law: str) -> None:
    robot = servo_pendulum()
    assert find(effect).bounds(robot, "servo")[key][0] == 0.0
    rough = robot.map_drive("servo", lambda d: replace(d, **{law: 0.3}))
    assert find(effect).bounds(rough, "servo")[key][0] == -0.3
    assert getattr(apply(rough, (term(effect, "servo", **{key: -0.2}),)).drives[0], law) == pytest.approx(0.1)
    assert getattr(apply(rough, (term(effect, "servo", **{key: -0.3}),)).drives[0], law) == 0.0
    more = term(effect, "servo", **{key: -0.4})
    assert getattr(apply(rough, (more,)).drives[0], law) == 0.0, "two effects of a search may take off the same"
    with pytest.raises(EffectError, match=r"servo is described with 0.3 .* of it; 0.4 cannot be taken off"):
        check_written(rough, (more,))


def test_a_joint_may_have_less_of_what_all_of_them_share() -> None:
    less = term("coulomb_friction", "hip_front_left", torque_nm=-0.3)
    shared = term("coulomb_friction", "all_joints", torque_nm=0.2)
    check_written(QUADRUPED, (shared, less))
    drives = {d.joint: d.coulomb for d in apply(QUADRUPED, (shared, less)).drives}
    assert drives["hip_front_left"] == 0.0
    assert drives["hip_front_right"] == 0.2
    with pytest.raises(EffectError, match="cannot be taken off"):
        check_written(QUADRUPED, (less, shared))


def test_what_a_search_leaves_can_be_written_and_read_and_is_the_same_robot() -> None:
    """Where what joints shared went in the end, what one of them had less of it is less of nothing."""
    rough = QUADRUPED.map_drive("knee_front_left", lambda d: replace(d, coulomb=0.1))
    left = (
        term("coulomb_friction", "hip_front_left", torque_nm=-0.3),
        term("coulomb_friction", "knee_front_left", torque_nm=-0.3),
        term("coulomb_friction", "hip_front_right", torque_nm=0.4),
    )
    with pytest.raises(EffectError, match="cannot be taken off"):
        check_written(rough, left)
    told = as_far_as_there_is(rough, left)
    check_written(rough, told)
    assert [dict(t.values)["torque_nm"] for t in told] == [0.0, -0.1, 0.4]
    assert apply(rough, told) == apply(rough, left)
    shared = (term("coulomb_friction", "all_joints", torque_nm=0.2), *left)
    assert as_far_as_there_is(rough, shared) == shared, "of what all share a joint may have less"


def test_joints_share_what_is_of_motors_where_one_of_them_has_none() -> None:
    """What acts on motors had no group at all on a robot with a passive joint."""
    robot = QUADRUPED.with_drive("knee_rear_right", command="none", kp=0.0, kd=0.0)
    driven = tuple(j for j in QUADRUPED.motor_names if j != "knee_rear_right")
    weak = apply(robot, (term("motor_weak", "driven_joints", loss=0.5),))
    assert [d.joint for d in weak.drives if d.strength == 0.5] == list(driven)
    assert find("motor_weak").shared(robot) == find("command_delay").shared(robot) == ("driven_joints",)
    # A bearing has friction with and without a motor.
    assert find("coulomb_friction").shared(robot) == ("all_joints", "driven_joints")
    assert "coulomb_friction@driven_joints" in {c.name for c in candidates(robot)}
    with pytest.raises(
        EffectError, match="motor_weak cannot act on 'all_joints' of quadruped; it can act on: driven_joints"
    ):
        apply(robot, (term("motor_weak", "all_joints", loss=0.5),))
    for untouched in (QUADRUPED, robot.with_drive("hip_front_left", command="torque")):
        names = groups(untouched)
        assert len(set(names.values())) == len(names), "one group has two names"
    assert "driven_joints" not in groups(QUADRUPED)


def test_hinges_share_with_slides_no_number_that_has_another_unit_there() -> None:
    robot = QUADRUPED
    slides = ("knee_front_left", "knee_rear_right")
    for name in slides:
        robot = robot.with_joint(name, kind="slide")
    hinges = tuple(j for j in robot.motor_names if j not in slides)
    assert {k: groups(robot)[k] for k in ("all_hinges", "all_slides")} == {"all_hinges": hinges, "all_slides": slides}
    for name, shared in (
        ("coulomb_friction", False),
        ("zero_offset", False),
        ("command_delay", True),
        ("motor_weak", True),
    ):
        found = find(name).shared(robot)
        assert ("all_joints" in found) is shared and {"all_hinges", "all_slides"} <= set(found)
    assert not any("slides" in g or "hinges" in g for g in groups(QUADRUPED))
    rubbing = [c.target for c in candidates(robot) if c.effect.name == "coulomb_friction"]
    assert {c.target for c in widest(robot, [c for c in candidates(robot) if c.effect.name == "coulomb_friction"])} == {
        "all_hinges", *slides
    }  # fmt: skip
    assert "all_joints" not in rubbing


def test_what_begins_at_a_moment_of_a_trial_is_the_fault_of_one_sensor() -> None:
    """All position sensors of a real arm were told to stick a little from the eighth second of each motion on."""
    assert "all_touch_sensors" in find("sensor_dropout").shared(QUADRUPED)
    assert not find("sensor_stuck").shared(QUADRUPED)
    assert {c.target for c in candidates(QUADRUPED) if c.effect.name == "sensor_stuck"} == {*QUADRUPED.sensor_names}


@pytest.mark.parametrize("value", [math.nan, math.inf, True, "0.5", None])
def test_a_value_that_is_no_number_is_refused(value: object) -> None:
    with pytest.raises(EffectError, match="torque_nm must be a number"):
        term("coulomb_friction", "hip_front_left", torque_nm=value)  # type: ignore[arg-type]


def test_an_unknown_parameter_names_those_there_are() -> None:
    with pytest.raises(EffectError, match="coulomb_friction has no parameter 'torque'; it has: torque_nm"):
        from_dict({"effect": "coulomb_friction", "target": "hip_front_left", "torque": 1.0})


def test_a_wrong_target_names_the_nearest() -> None:
    with pytest.raises(EffectError, match=r"cannot act on 'hip_frnt_left' of quadruped; it can act on: hip_front_left"):
        apply(QUADRUPED, (term("motor_weak", "hip_frnt_left", loss=0.1),))
    with pytest.raises(EffectError, match="floor_tilt cannot act on 'floor' of one_joint"):
        apply(slider(), (term("floor_tilt", "floor", sideways_deg=5.0),))


@pytest.mark.parametrize("entry", [{}, {"target": "floor"}, "coulomb_friction", None, 3])
def test_an_entry_that_is_no_effect_is_refused(entry: object) -> None:
    with pytest.raises(EffectError):
        from_dict(entry)  # type: ignore[arg-type]


def test_taking_away_more_rotor_than_there_is_is_refused() -> None:
    with pytest.raises(
        EffectError, match=r"rotor_inertia at hip_front_left .*described with 0.012 .*1 cannot be taken off"
    ):
        check_written(QUADRUPED, (term("rotor_inertia", "hip_front_left", added_kg_m2=-1.0),))


@pytest.mark.parametrize(
    ("facts", "message"),
    [
        ({"family": "magic"}, "no family 'magic'"),
        ({"parameters": (Parameter("x", "1", 0.0, 1.0, 2.0),)}, "neutral value of x lies outside"),
        ({"parameters": (Parameter("target", "1", 0.0, 1.0, 0.0),)}, "'target' cannot be the name of a parameter"),
        ({"parameters": (Parameter("x", "1", 0.0, math.inf, 0.0),)}, "x has no finite bounds"),
    ],
)
def test_an_effect_that_contradicts_itself_is_refused(facts: dict[str, object], message: str) -> None:
    stated = {"family": "drive", "targets": motors, "physics": "...", "signature": "..."} | facts
    with pytest.raises(EffectError, match=message):
        effect("own_effect", **stated)(_unchanged)  # type: ignore[arg-type]
    assert "own_effect" not in CATALOGUE


def test_a_name_that_is_taken_is_refused() -> None:
    with pytest.raises(EffectError, match="'motor_weak' exists already"):
        effect("motor_weak", family="drive", targets=motors, physics="...", signature="...")(_unchanged)


def test_units_follow_the_kind_of_joint_and_the_channel() -> None:
    friction, bias = CATALOGUE["viscous_friction"], CATALOGUE["sensor_bias"]
    assert friction.unit("damping_nm_s_rad", slider(), "joint") == "N.s/m"
    assert friction.unit("damping_nm_s_rad", QUADRUPED, "hip_front_left") == "N.m.s/rad"
    assert bias.unit("bias", slider(), "velocity") == "m/s"


def test_a_factor_at_its_bound_leaves_others_something_to_act_on() -> None:
    robot = QUADRUPED
    low = {e.name: e.bounds(robot, "hip_front_left")["factor"][0] for e in (find("speed_gain"), find("position_gain"))}
    none_left = tuple(term(name, "all_joints", factor=factor) for name, factor in low.items())
    again = tuple(term(name, "hip_front_left", factor=0.5) for name in low)
    assert apply(robot, (*none_left, *again)).drives[0].kd > 0
