"""What findings say: ties by name, errors with their digits and units, agreement only where nothing stands out."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.accounts.ranges import as_loads, beyond_a_guess, load_text, weight_text
from ee_dist.discrepancy.assumed import LABEL
from ee_dist.discrepancy.evidence.intervals import BOUND, HARDLY, NEUTRAL, ParameterReport
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.explain import EFFECT
from ee_dist.discrepancy.finished import BETTER, EXPLAINED
from ee_dist.discrepancy.ladder import Twin
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.discrepancy.words import percent, percents, phrase, plain, span, told, told_all
from ee_dist.effects.catalogue import Term, apply, term
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.improve import effects_of
from ee_dist.tasks.results.tables import typed

DRY = term("coulomb_friction", "servo", torque_nm=0.3)


def made_up() -> SimpleNamespace:
    """What an account asks of a problem, of one trial."""
    return SimpleNamespace(
        robot=servo_pendulum(),
        told=str,
        natural_name="error",
        natural_unit="",
        way="open_loop",
        notes=[],
        doubts="",
        trials=("a",),
        measured=(),
        says_nothing=lambda _: "",
        layout=SimpleNamespace(units=("rad",)),
    )


def account(
    tied: list[str], explained: float = 1.0, ahead: object = None, planner: str = "", unsure: tuple[str, ...] = (),
    what: Term = DRY, left: tuple[Leftover, ...] = (), parameters: tuple[ParameterReport, ...] = (), label: str = "",
    problem: SimpleNamespace | None = None,
) -> Account:  # fmt: skip
    best = SimpleNamespace(
        terms=(what,), tied_with=tied, interval=(0.4, 0.6), gain=0.5,
        explained=explained, held_out="windows", error_heldout=1.1, own=np.zeros(len(what.values)),
        proposal=SimpleNamespace(label=label, guess=False, parts=(candidate(servo_pendulum(), what.effect, what.target),)),
    )  # fmt: skip
    found = SimpleNamespace(
        candidates=[],
        best=best,
        verdict=EFFECT,
        left=list(left),
        baseline_error=2.0,
        refitted_error=2.0,
        noise_floor=1.0,
        floor_source="told",
        tried=9,
        offered=9,
        before=(),
        as_it_was=False,
        unsure=unsure,
        after=(what,),
        parameters=list(parameters),
    )
    return explain_account(problem or made_up(), found, ahead, planner)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("tied", "said"),
    [
        ([], "Missing: coulomb friction at servo (torque 0.3 N.m). Nothing"),
        (["part_lost@servo"], "(torque 0.3 N.m), or part lost at servo, which looks the same here. Nothing"),
        (["part_lost@servo", "b@c"], ", or part lost at servo or b at c, which look the same here. Nothing"),
        (["a@c", "b@c", "d@c"], ", or one of 3 others that look the same here. Nothing"),
    ],
)
def test_what_looks_the_same_is_named(tied: list[str], said: str) -> None:
    assert said in account(tied).headline


def test_a_rest_above_the_noise_is_no_contradiction_where_nothing_is_left() -> None:
    assert "; what it leaves of that stands out nowhere. Of 9" in account([], 0.66).sure
    assert "leaves" not in account([], 0.99).sure


def test_that_no_motion_tried_helps_is_not_that_none_does() -> None:
    ahead = SimpleNamespace(separation=0.1)
    told_of = account(["a@c"], ahead=ahead, planner="plan it")
    assert told_of.advice == "None of the motions tried is expected to tell them apart."
    assert told_of.planner == "plan it" and told_of.first[-1].endswith(" plan it")
    assert told_of.first[-1].startswith("To look for other motions: ") and told_of.lead == "Next"
    assert not account([], ahead=None, planner="plan it").planner, "nothing is tied"


def test_a_noisy_sensor_explains_the_noise_that_it_leaves() -> None:
    noise = term("sensor_noise", "speed", deviation=0.4)
    quick, slow, other = (
        Leftover("a", c, 9.0, 3.0, t) for c, t in (("speed", False), ("speed", True), ("position", False))
    )
    its_own = account([], 0.23, what=noise, left=(quick,))
    assert its_own.good and its_own.headline.endswith("rad/s). What is left there is this noise itself.")
    assert "several" not in its_own.headline and not any("more than noise" in line for line in its_own.lines)
    for more in (slow, other):
        open_ = account([], 0.23, what=noise, left=(quick, more))
        assert (
            not open_.good and "among other things" in open_.headline and "in 1 curve; worst" in " ".join(open_.lines)
        )


def test_what_is_tied_is_open_and_told_apart_before_it_is_added() -> None:
    tied, alone = account(["a@c"], planner="plan it"), account([], planner="plan it")
    assert tied.first[-1] == "Next, to tell them apart: plan it" and tied.lead == "Or go on without" and not tied.good
    assert alone.lead == "Next" and alone.good


def test_where_more_is_missing_it_is_added_before_what_is_tied_is_told_apart() -> None:
    """Half an explanation each, as dry and viscous friction are: a trial between them tells which half is larger."""
    halves = account(["a@c"], planner="plan it", left=(Leftover("a", "position", 9.0, 3.0, True),))
    assert halves.more and halves.lead == "Next"
    assert halves.first[-1] == "To tell apart what may stay tied then: plan it"


def test_more_twins_than_a_headline_holds_are_named_below_it() -> None:
    assert "Of 9 explanations no other does as well." in account([]).sure
    assert "2 others do as well. " in account(["a@c", "b@c"]).sure, "the headline names them"
    assert "3 others do as well (a at c; b at c; d at c). " in account(["a@c", "b@c", "d@c"]).sure
    assert "(a at c; b at c; d at c; e at c and 2 more). " in account([f"{x}@c" for x in "abdefg"]).sure


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


def compared(error: float, left: list[Leftover]) -> Account:
    found = SimpleNamespace(
        error=error, noise_floor=1.0, floor_source="told", definition="e", parted_s={},
        channels=[SimpleNamespace(name="a_b", normalised=error), SimpleNamespace(name="command_b", normalised=0.0)],

        unsure=[],
    )  # fmt: skip
    problem = SimpleNamespace(
        robot=servo_pendulum(),
        told=str,
        natural=lambda e: e**2,
        natural_name="error",
        natural_unit="mm",
        notes=[],
        doubts="",
        channels=("a_b", "command_b"),
        curves=((0, "a_b"), (0, "command_b")),
        trials=("sway",),
        numbers=(1,),
    )
    return compare_account(problem, found, left)  # type: ignore[arg-type]


def test_an_error_below_its_floor_gets_a_word() -> None:
    assert not [line for line in compared(1.05, []).lines if "below" in line or "within chance" in line]
    assert "The error is at the floor, within chance." in compared(0.98, []).lines
    assert any(line.startswith("The error is below the floor: the noise was") for line in compared(0.9, []).lines)


def test_a_small_error_is_no_agreement_where_a_channel_stands_out() -> None:
    calm, loud = compared(1.02, []), compared(1.02, [Leftover("sway", "a_b", 7.0, 3.0, True)])
    assert calm.good and calm.headline.startswith("The model agrees") and calm.advice.startswith("Next: nothing")
    assert not loud.good and "nearly right" in loud.headline and "most of all at a b" in loud.headline
    assert "1 of 1 curve (1 channel in 1 trial) differs by more than noise" in loud.sure and not loud.advice


def test_what_is_next_is_said_once_and_among_the_words() -> None:
    calm, loud = compared(1.02, []), compared(1.02, [Leftover("sway", "a_b", 7.0, 3.0, True)])
    assert loud.followed("type this").words.count("Next: type this") == 1
    assert [w for w in calm.followed("type this").words if w.startswith("Next")] == [calm.advice]


def test_times_the_floor_are_those_of_the_errors_that_are_told() -> None:
    assert "9 times what noise alone would leave" in compared(3.0, []).headline, "the way tells squares"


@pytest.mark.parametrize(("error_m", "said"), [(3.2e-8, "3.2e-05 mm"), (4.1e-5, "0.041 mm"), (0.0123456, "12.3 mm")])
def test_small_errors_keep_their_digits(error_m: float, said: str) -> None:
    problem = SimpleNamespace(natural=lambda e: e, units=("m",))
    assert FreeRun.told(problem, error_m) == said  # type: ignore[arg-type]


def test_what_may_be_noise_is_no_proof_that_nothing_is_left() -> None:
    told_of = account([], unsure=("knee_left", "hip"))
    assert told_of.headline.endswith("Nothing else is left beyond what may be noise.") and not told_of.good
    assert "; the noise floor is only an upper bound at knee left, hip. " in told_of.sure
    assert told_of.advice.startswith("To tell, repeat the motion at a third of its pace")
    assert account([]).good and "beyond" not in " ".join(account([]).words)


def test_units_are_told_once_and_as_they_are_on_a_slide() -> None:
    stage = linear_stage()
    assert told(term("zero_offset", "carriage", offset_rad=0.07), stage) == "zero offset at carriage (offset 0.07 m)"


def test_a_headline_says_no_more_than_the_verdict() -> None:
    rung = SimpleNamespace(
        added=(term("coulomb_friction", "servo", torque_nm=0.3),), dropped=(), tied_with=[], name="x@y", error_heldout=1.5,
        held_out="motions that were not fitted", alternatives=[],
    )  # fmt: skip
    start = SimpleNamespace(added=(), dropped=(), tied_with=[], error_heldout=5.0, held_out="", name="")
    problem = made_up()
    for verdict, share, said in (
        (EXPLAINED, 1.0, "Nothing else is left above the noise."),
        (BETTER, 0.9979, "More than noise is left on motions that were not fitted: 99.7 % of"),
    ):
        found = SimpleNamespace(
            ladder=[start, rung], left=[], verdict=verdict, explained=share, parameters=[], terms=rung.added, stopped="so",
            noise_floor=1.0, floor_source="told", last=None, odd=[], worth=None, unsure=[], twins=[],
            judged_on=rung.held_out, all_rows=None,
        )  # fmt: skip
        account = improve_account(problem, found)  # type: ignore[arg-type]
        assert account.headline.endswith(said) or said in account.headline
        assert not account.planner, "nothing is tied"
        assert account.good is (verdict == EXPLAINED) and ("Nothing" in account.headline) is account.good
    rung.alternatives = [(SimpleNamespace(name="speed_limit@each of 3 joints"), ())]
    found.ladder = [start, rung]
    assert improve_account(problem, found, "plan it").first[-1].endswith(" plan it")  # type: ignore[arg-type]
    rung.dropped = ("offset_torque@servo",)
    end = SimpleNamespace(**{**vars(start), "dropped": ("rotor_inertia@servo",)})
    found.ladder = [start, rung, end]
    lines = improve_account(problem, found).lines  # type: ignore[arg-type]
    assert account.sure.count("not told from") == 0
    rung.tied_with = ["coulomb_friction@servo", "motor_weak@servo"]
    swapped = improve_account(problem, found)  # type: ignore[arg-type]
    told_apart = "These measurements cannot tell x at y from: motor weak at servo."
    assert told_apart in swapped.lines and "not told from motor weak at servo" in swapped.sure
    heavy, weak = (term("part_mass", "arm", change=c) for c in (1.2, 0.05)), term("motor_weak", "servo", loss=0.5)
    more, less = heavy
    rung.tied_with, rung.added = [], (weak,)
    inertia = term("rotor_inertia", "servo", added_kg_m2=0.002)
    twin = Twin(weak.name, inertia, (more, inertia))
    own = ParameterReport(1, "change", 0.05, 0.04, 0.06, "")
    found.terms, found.parameters, found.twins = (weak, less), [own], [twin]
    rung.dropped = (inertia.name,)
    either = improve_account(problem, found, "plan it")  # type: ignore[arg-type]
    assert (
        "These measurements cannot tell motor weak at servo from: rotor inertia at servo. With that in its place: rotor inertia "
        "at servo (added 0.002 kg.m^2); part mass at arm (change +120 %)." in either.lines
    )
    assert not either.good and "not told from rotor inertia at servo" in either.sure and either.planner == "plan it"
    assert not any("Dropped again" in line for line in either.lines)
    found.ladder, found.twins = [start, SimpleNamespace(**{**vars(rung), "added": (less, weak)})], []
    assert improve_account(problem, found).headline.startswith("Added: motor weak at servo")  # type: ignore[arg-type]
    found.parameters = [own, ParameterReport(0, "loss", 0.5, -0.1, 0.9, NEUTRAL)]
    assert improve_account(problem, found).headline.startswith("Added: part mass at arm")  # type: ignore[arg-type]
    found.ladder = [start, rung, end]
    found.terms, found.parameters, found.twins = (term("coulomb_friction", "servo", torque_nm=0.3),), [], []
    rung.dropped = ("offset_torque@servo",)
    rung.added = (term("viscous_friction", "servo", damping_nm_s_rad=0.1),)
    gone = improve_account(problem, found)  # type: ignore[arg-type]
    assert not any("cannot tell" in line for line in gone.lines) and "not told from" not in gone.sure
    assert "Dropped again: offset torque at servo, which a later effect made useless." in lines
    assert "Left out in the end, since these data do not tell them from neutral: rotor inertia at servo." in lines
    rung.dropped = ("coulomb_friction@all_joints", "coulomb_friction@elbow", "backlash@servo")
    apart = improve_account(problem, found).lines  # type: ignore[arg-type]
    assert "Shared at first, and of other joints or of each by itself since: coulomb friction." in apart
    assert [line for line in apart if line.startswith("Dropped")] == [
        "Dropped again: backlash at servo, which a later effect made useless."
    ]
    rung.dropped = (*(f"part_mass@link_{k}" for k in range(5)), "backlash@servo")
    assert (
        "Dropped again: part mass at 5 places; backlash at servo, which later effects made useless."
        in improve_account(problem, found).lines  # type: ignore[arg-type]
    )


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


def test_explain_says_how_sure_a_value_is_and_which_ended_at_its_bound() -> None:
    exact = ParameterReport(0, "torque_nm", 0.3, 0.28, 0.32, "")
    said = account([], parameters=(exact,)).sure
    assert "no other does as well; 95 % intervals: torque 0.28 to 0.32 N.m." in said
    at_end = account([], parameters=(replace(exact, flag=BOUND),)).sure
    assert f"; 95 % intervals: torque {BOUND}." in at_end and "0.28" not in at_end
    assert "interval" not in account([]).sure.partition("judged on")[2]


@pytest.mark.parametrize(("low", "high", "said"), [
    (0.0001, -1e-9, "0.01 to 0 %"), (-1e-9, 1e-9, "0 %"),
    (0.761, 1.0, "76 to 100 %"), (0.5581, 0.5634, "55.8 to 56.3 %"), (0.56, 0.56, "56 %"), (0.0, 0.0, "0 %"), (1.0, 1.0, "100 %"),
])  # fmt: skip
def test_a_narrow_interval_does_not_end_where_it_begins(low: float, high: float, said: str) -> None:
    assert percents(low, high) == said


@pytest.mark.parametrize(("flag", "said"), [(NEUTRAL, "tell none by itself"), ("", "(torque 0.3 N.m)")])
def test_of_drives_that_were_assumed_only_what_the_data_tell_is_named(flag: str, said: str) -> None:
    """Six numbers go together, and each of them may stand in for the others."""
    robot = servo_pendulum()
    guessed = replace(robot, assumed=tuple((j, "kp") for j in robot.motor_names))
    still, moving = (np.full((4, 1), 0.3), np.linspace(0, 1, 4)[:, None])
    told_of = (ParameterReport(0, "torque_nm", 0.3, 0.0, 1.0, flag),)

    def of(commands: np.ndarray) -> Account:
        problem = made_up()
        problem.robot, problem.measured = guessed, (SimpleNamespace(log=SimpleNamespace(commands=commands)),)
        return account([], parameters=told_of, label=LABEL, problem=problem)

    head = of(moving).headline
    assert head.startswith("Not what was assumed: coulomb friction") and said in head
    assert not any("commanded to move" in line for line in of(moving).lines)
    assert any("Only 0 joints of 1 are commanded to move here" in line for line in of(still).lines)


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


@pytest.mark.parametrize(("flag", "said"), [(NEUTRAL, True), (HARDLY, True), ("", False)])
def test_an_effect_of_which_no_value_is_told_is_named_with_that(flag: str, said: bool) -> None:
    told_of = (ParameterReport(0, "torque_nm", 0.3, 0.0, 1.0, flag),)
    head = account([], parameters=told_of).headline
    assert ("(of which these data tell no value)" in head) == said and "coulomb friction" in head


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
    assert not beyond_a_guess(guessed, stiffer, [within])
    assert not beyond_a_guess(robot, stiffer, [at_end]), "nobody guessed"
