"""What a fit found is read by kind of effect, each value with as many digits as its interval leaves."""

from __future__ import annotations

import math

import pytest

from ee_dist.discrepancy.accounts.ranges import flag_texts
from ee_dist.discrepancy.evidence.intervals import BOUND, HARDLY, NEUTRAL, NOT_DETERMINED, ParameterReport
from ee_dist.effects.catalogue import term
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.results.sections import values_section
from ee_dist.tasks.results.values import kinds_of, within


@pytest.mark.parametrize(
    ("value", "half", "flag", "said"),
    [
        (0.20316, 0.0027, "", "0.2032 ± 0.0027"),
        (203.47, 3.44, "", "203.5 ± 3.4"),
        (12345.6, 321.0, "", "12346 ± 321"),
        (-0.245, 47.0, "", "0 ± 47"),
        (0.0071, 0.106, NEUTRAL, f"0.01 ± 0.11 ({NEUTRAL})"),
        (0.5, math.inf, NOT_DETERMINED, f"0.5 ({NOT_DETERMINED})"),
        (0.25, 0.0, "", "0.25"),
        (0.1234567, 1.234e-7, "", "0.1235 ± 1e-07"),
    ],
)
def test_digits_are_those_that_the_interval_leaves(value, half, flag, said):
    assert within(ParameterReport(0, "x", value, value - half, value + half, flag)) == said


def test_values_stand_beside_those_of_their_kind():
    terms = (
        term("coulomb_friction", "servo", torque_nm=0.1),
        term("zero_offset", "servo", offset_rad=0.01),
        term("coulomb_friction", "other", torque_nm=0.2),
    )
    reports = [ParameterReport(k, n, v, v - 0.01, v + 0.01, "") for k, n, v in (
        (0, "torque_nm", 0.1), (1, "offset_rad", 0.01), (2, "torque_nm", 0.2))]  # fmt: skip
    dry, zero = kinds_of(terms, reports, servo_pendulum())
    assert (dry.name, [place for place, _ in dry.at]) == ("coulomb friction, torque (N.m)", ["servo", "other"])
    assert (zero.name, len(zero.at)) == ("zero offset, offset (rad)", 1)
    section = values_section([dry, zero])
    assert section.figures[0].data[0].y == ("servo", "other") and len(section.figures) == 1, (
        "what stands alone is no figure"
    )
    assert [row[2:5] for row in section.table.rows] == [
        ["servo", "0.1", "0.09 to 0.11"], ["other", "0.2", "0.19 to 0.21"], ["servo", "0.01", "0 to 0.02"],
    ]  # fmt: skip


def test_all_values_are_in_sight_and_each_has_a_quantity():
    """Of a number that is called by its unit alone too."""
    kinds = kinds_of(
        (term("quadratic_friction", "servo", per_nm=0.1),),
        [ParameterReport(0, "per_nm", 0.1, 0.0, 0.2, "")],
        servo_pendulum(),
    )
    table = values_section(kinds).table
    assert table.whole and [row[1] for row in table.rows] == ["coefficient"]
    assert kinds[0].name == "quadratic friction (1/(N.m))"


def test_an_interval_that_a_bound_cuts_is_drawn_from_end_to_end():
    """Not as far below the value as above it; what is said of a joint beside its name has a line of its own."""
    robot = quadruped()
    terms = tuple(
        term("coulomb_friction", t, torque_nm=v) for t, v in (("all_joints", 1.48), ("knee_front_left", 10.2))
    )
    reports = [
        ParameterReport(0, "torque_nm", 1.48, 0.0, 4.0, ""), ParameterReport(1, "torque_nm", 10.2, 9.2, math.inf, "")
    ]  # fmt: skip
    (kind,) = kinds_of(terms, reports, robot)
    (figure,) = values_section([kind]).figures
    bars = figure.data[0].error_x
    assert not bars.symmetric
    assert list(bars.array) == pytest.approx([2.52, 0.0]) and list(bars.arrayminus) == pytest.approx([1.48, 1.0])
    assert figure.data[0].text[0] == "0 to 4"
    assert figure.data[0].y[1].startswith("knee front left<br>"), figure.data[0].y
    assert all("," not in name.split("<br>")[0] for name in figure.data[0].y)


def test_units_are_those_of_a_slide():
    found = kinds_of(
        (term("coulomb_friction", "carriage", torque_nm=20.0),), [ParameterReport(0, "torque_nm", 20, 19, 21, "")],
        linear_stage(),
    )  # fmt: skip
    assert found[0].name == "coulomb friction, force (N)"


def test_an_interval_that_a_bound_cuts_is_told_by_its_ends():
    """218 with an interval of -90 to 300 is no 218 plus and minus 195, which is surely above zero."""
    assert within(ParameterReport(0, "x", 218.0, -90.0, 300.0, "")) == "218 (-90 to 300)"
    assert within(ParameterReport(0, "x", 218.0, -90.0, 300.0, "at its bound")) == "218 (-90 to 300; at its bound)"
    assert within(ParameterReport(0, "x", 218.0, 23.0, 413.0, "")) == "218 ± 195"
    # Rounded it would go below nothing, where there are no delays.
    assert within(ParameterReport(0, "x", 0.0172, 0.0, 0.0366, "")) == "0.0172 (0 to 0.0366)"


def test_a_joint_with_more_or_less_than_all_share_says_how_much_that_is():
    robot = quadruped()
    terms = (
        term("coulomb_friction", "all_joints", torque_nm=1.48),
        term("coulomb_friction", "knee_front_left", torque_nm=10.2),
        term("coulomb_friction", "hip_front_left", torque_nm=-0.48),
        term("zero_offset", "hip_front_left", offset_rad=0.01),
    )
    reports = [ParameterReport(k, t.values[0][0], t.values[0][1], 0.0, 1.0, "") for k, t in enumerate(terms)]
    dry, zero = kinds_of(terms, reports, robot)
    assert [place for place, _ in dry.at] == [
        "all joints", "knee front left, 11.7 in all, beside what is shared", "hip front left, 1 in all, beside what is shared",
    ]  # fmt: skip
    assert [place for place, _ in zero.at] == ["hip front left"]


def test_a_factor_beside_one_that_all_share_says_what_both_come_to():
    robot = quadruped()
    terms = (
        term("position_gain", "all_joints", factor=0.5),
        term("position_gain", "knee_front_left", factor=1.6),
    )
    reports = [ParameterReport(k, "factor", t.values[0][1], 0.1, 2.0, "") for k, t in enumerate(terms)]
    (gains,) = kinds_of(terms, reports, robot)
    assert [place for place, _ in gains.at] == ["all joints", "knee front left, 0.8 in all, beside what is shared"]


def test_a_doubt_stands_beside_a_value_in_a_word_and_below_in_full():
    told = [
        ParameterReport(0, "torque_nm", 0.1, -0.2, 0.4, HARDLY),
        ParameterReport(1, "torque_nm", 9.0, 8.0, 10.0, BOUND),
    ]
    assert [within(p) for p in told] == ["0.10 ± 0.30 (hardly told from neutral)", "9.0 ± 1.0 (at its bound)"]
    assert within(ParameterReport(0, "x", 1.0, 0.5, 1.5, f"{BOUND}; {NOT_DETERMINED}")).endswith(
        "(at its bound; not determined by these data)"
    )
    joints = ("hip_front_left", "hip_front_right", "hip_rear_left", "hip_rear_right")
    terms = (
        *(term("coulomb_friction", j, torque_nm=0.1) for j in joints),
        term("zero_offset", joints[0], offset_rad=0.01),
        term("zero_offset", joints[1], offset_rad=0.01),
        term("viscous_friction", joints[0], damping_nm_s_rad=3.0),
    )  # fmt: skip
    reports = [ParameterReport(k, t.values[0][0], 0.1, -1, 1, NEUTRAL if k < 6 else BOUND) for k, t in enumerate(terms)]
    assert flag_texts(terms, reports) == [
        "coulomb friction at 4 places, torque; zero offset at hip front left and hip front right, offset: not told from neutral.",
        "viscous friction at hip front left, damping: at its bound: the range is too small, or the effect is another.",
    ]
    assert flag_texts(terms, []) == []
