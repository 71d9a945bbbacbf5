"""How effects, values, intervals and shares are told: with their digits and units."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.words import percent, percents, phrase, plain, span, told, told_all
from ee_dist.effects.catalogue import term
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.improve import effects_of
from ee_dist.tasks.results.tables import typed


def test_one_effect_at_several_joints_is_told_with_each_of_its_values() -> None:
    dry = [term("coulomb_friction", j, torque_nm=v) for j, v in (("a", 0.1), ("b", 0.25))]
    assert told_all(tuple(dry)) == "coulomb friction, each joint by itself (a 0.1 N.m; b 0.25 N.m)"
    both = [term("stribeck_friction", j, torque_nm=v, speed_rad_s=0.5) for j, v in (("a", 0.1), ("b", 0.2))]
    said = "stribeck friction, each joint by itself (torque, speed: a 0.1 N.m, 0.5 rad/s; b 0.2 N.m, 0.5 rad/s)"
    assert told_all(tuple(both)) == said


def test_many_values_are_told_by_kind_and_what_stands_alone_comes_first() -> None:
    robot = quadruped()
    (a, b, c), parts = robot.motor_names[:3], [p.name for p in robot.parts[:3]]
    dry = [term("coulomb_friction", j, torque_nm=v) for j, v in zip((a, b, c), (0.1, 0.25, 0.2), strict=True)]
    mass = [term("part_mass", j, change=v) for j, v in zip(parts, (-0.1, 0.05, 0.0), strict=True)]
    alone = [term("load_friction", b, share=0.3), *(term("zero_offset", j, offset_rad=0.01) for j in (a, c))]
    assert phrase((*mass, *dry, *alone), robot) == (
        f"load friction at {plain(b)} (share 30 %); zero offset at {plain(a)} (offset 0.01 rad); zero offset at {plain(c)} "
        "(offset 0.01 rad); part mass at 3 parts (change -10 to 5 %); coulomb friction at 3 joints (torque 0.1 to 0.25 N.m)"
    )


def test_a_value_that_is_called_by_its_unit_has_no_other_name() -> None:
    on_a_slide = term("quadratic_friction", "carriage", per_nm=1.06e-4)
    assert told(on_a_slide, linear_stage()) == "quadratic friction at carriage (0.000106 1/N)"


def test_what_a_candidate_has_is_what_the_next_command_asks_for() -> None:
    terms = (term("load_friction", "servo", share=0.1), term("quadratic_friction", "servo", per_nm=0.2))
    assert [c.name for c in effects_of(typed(terms), servo_pendulum()) or ()] == [t.name for t in terms]


@pytest.mark.parametrize(("error_m", "said"), [(3.2e-8, "3.2e-05 mm"), (4.1e-5, "0.041 mm"), (0.0123456, "12.3 mm")])
def test_small_errors_keep_their_digits(error_m: float, said: str) -> None:
    problem = SimpleNamespace(natural=lambda e: e, units=("m",))
    assert FreeRun.told(problem, error_m) == said  # type: ignore[arg-type]


def test_units_are_told_once_and_as_they_are_on_a_slide() -> None:
    stage = linear_stage()
    assert told(term("zero_offset", "carriage", offset_rad=0.07), stage) == "zero offset at carriage (offset 0.07 m)"


def test_an_interval_below_what_there_is_is_told_as_it_is() -> None:
    stage = linear_stage()
    wide = term("coulomb_friction", "carriage", torque_nm=20.4)
    assert span(wide, "torque_nm", -26.7, 67.5, stage, interval=True) == "-26.7 to 67.5 N"
    aside = term("zero_offset", "carriage", offset_rad=-0.1)
    assert span(aside, "offset_rad", -0.2, 0.1, stage, interval=True) == "-0.2 to 0.1 m", "comes on top of nothing"


@pytest.mark.parametrize(
    ("said", "effect", "values"),
    [
        ("part mass at arm (change +266 %)", "part_mass", {"change": 2.66}),
        (
            "centre of mass shifted at arm (along x 0.02 m, along y 0.01 m, along z 0 m)",
            "com_shifted",
            {"along_x_m": 0.02, "along_y_m": 0.01},
        ),
        ("part mass at arm (change -40 %)", "part_mass", {"change": -0.4}),
        ("motor weak at arm (loss 29.9 %)", "motor_weak", {"loss": 0.2991}),
        ("rotor factor at arm (factor 2.5)", "rotor_factor", {"factor": 2.5}),
    ],
)
def test_shares_are_told_in_percent_and_factors_are_not(said: str, effect: str, values: dict[str, float]) -> None:
    one = term(effect, "arm", **values)
    assert told(one) == said
    key, value = one.values[0]
    assert span(one, key, value - 0.01, value + 0.01, None).endswith(" %") is said.endswith("%)")


def test_much_more_than_described_is_told_in_times_and_without_exponents() -> None:
    strong = term("torque_limit", "servo", loss=-99.0)
    assert told(strong) == "torque limit at servo (100 times as much)"
    assert span(strong, "loss", -99.0, -0.5, None) == "-9900 to -50 %"
    assert told(term("torque_limit", "servo", loss=-0.5)) == "torque limit at servo (loss -50 %)"


def test_units_are_told_behind_values_and_not_in_names():
    stage, servo = linear_stage(), servo_pendulum()
    assert (
        told(term("coulomb_friction", "carriage", torque_nm=20.4), stage)
        == "coulomb friction at carriage (force 20.4 N)"
    )
    assert told(term("coulomb_friction", "servo", torque_nm=0.1), servo) == "coulomb friction at servo (torque 0.1 N.m)"
    soft = told(term("elastic_transmission", "carriage", compliance_rad_nm=1e-4), stage)
    assert soft == "elastic transmission at carriage (compliance 0.0001 m/N)"


@pytest.mark.parametrize(
    ("low", "high", "said"),
    [
        (0.1, 0.2, "0.1 to 0.2"),
        (0.1118, 0.1124, "0.1118 to 0.1124"),
        (0.3, 0.3, "0.3 to 0.3"),
        (-0.000569, -0.000259, "0.000259 to 0.000569 less than described"),
        (-0.01, 0.02, "0.01 less to 0.02 more than described"),
    ],
)
def test_the_ends_of_an_interval_differ(low: float, high: float, said: str) -> None:
    unit = " kg.m^2"
    found = span(term("rotor_inertia", "servo", added_kg_m2=0.1), "added_kg_m2", low, high, None)
    assert found.replace(unit, "") == said


@pytest.mark.parametrize(
    ("share", "said"),
    [(0.9999999999999998, "100 %"), (0.9996, "99.9 %"), (0.995, "99.5 %"), (0.42, "42 %"), (1.0, "100 %")],
)
def test_a_share_is_never_all_of_it_where_something_is_left(share: float, said: str) -> None:
    assert percent(share) == said


@pytest.mark.parametrize(("low", "high", "said"), [
    (0.0001, -1e-9, "0.01 to 0 %"), (-1e-9, 1e-9, "0 %"),
    (0.761, 1.0, "76 to 100 %"), (0.5581, 0.5634, "55.8 to 56.3 %"), (0.56, 0.56, "56 %"), (0.0, 0.0, "0 %"), (1.0, 1.0, "100 %"),
])  # fmt: skip
def test_a_narrow_interval_does_not_end_where_it_begins(low: float, high: float, said: str) -> None:
    assert percents(low, high) == said
