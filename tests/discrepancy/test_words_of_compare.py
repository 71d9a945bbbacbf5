"""What compare says: agreement only where nothing stands out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace

from rich.console import Console
from way_samples import measured, problem_by, samples

from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.compare import compare
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.last_word import last_word
from ee_dist.discrepancy.meters import AtLimit
from ee_dist.discrepancy.ways.force_balance.problem import OF_ALL_TRIALS as FORCE_OF_ALL
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.open_loop.problem import OF_ALL_TRIALS as CHANNELS_OF_ALL
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.results.sections import last_word_section, trials_section
from ee_dist.tasks.results.tables import show_last_word


def compared(
    error: float,
    left: list[Leftover],
    there: float | None = None,
    parted: dict[str, float | None] | None = None,
    at_limit: Sequence[AtLimit] = (),
) -> Account:
    """``there``: the error of the worst channel, where it is another than that of the model."""
    found = SimpleNamespace(
        error=error, noise_floor=1.0, floor_source="told", definition="e", parted_s=parted or {},
        channels=[SimpleNamespace(name="a_b", normalised=there or error), SimpleNamespace(name="command_b", normalised=0.0)],

        unsure=[], at_limit=list(at_limit),
    )  # fmt: skip
    problem = SimpleNamespace(
        shared_by_trials="",
        robot=servo_pendulum(),
        told=str,
        natural=lambda e: e**2,
        natural_name="error",
        natural_unit="mm",
        notes=[],
        doubts="",
        channels=("a_b", "command_b"),
        curves=((0, "a_b"), (0, "command_b")),
        trials=tuple(parted or ("sway",)),
        numbers=tuple(range(1, 1 + len(parted or ("sway",)))),
    )
    return compare_account(problem, found, left)  # type: ignore[arg-type]


def test_an_error_below_its_floor_gets_a_word() -> None:
    assert not [line for line in compared(1.05, []).lines if "below" in line or "within chance" in line]
    assert "The error is at the floor, within chance." in compared(0.98, []).lines
    assert any(line.startswith("The error is below the floor: there is less noise") for line in compared(0.9, []).lines)


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


def test_the_worst_channel_is_told_with_its_own_error() -> None:
    """The error of the model is over all channels."""
    assert compared(12.9, [], 25.0).headline.startswith(
        "The model is off, most of all at a b (25.0 there): error 12.9 in all, "
    )
    assert compared(12.9, []).headline.startswith("The model is off, most of all at a b: error 12.9, ")


def test_of_many_trials_those_that_part_soonest_are_told() -> None:
    def said(count: int) -> str:
        (line,) = (
            n for n in compared(5.0, [], parted={f"t{k}": 9.0 - k for k in range(count)}).lines if "differ clearly" in n
        )
        return line

    assert "noise: 1. t0 at 9.00 s; 2. t1 at 8.00 s; 3. t2 at 7.00 s." in said(3)
    assert "in 8 trials, soonest in 8. t7 at 2.00 s; 7. t6 at 3.00 s; 6. t5 at 4.00 s (all in summary.json" in said(8)


def test_a_trial_that_has_another_error_by_itself_says_why() -> None:
    """Of a share of the force of all trials a gentle one has little."""
    slow, robot = measured("arm")[0], samples()["arm"].robot
    assert slow.log.torques is not None
    lively = replace(slow, name="lively", log=replace(slow.log, torques=5.0 * slow.log.torques))
    both, alone = ForceBalance((slow, lively), robot), ForceBalance((slow,), robot)
    first = [p.natural(compare(p, p.residuals([()])[0]).trial_errors[0]) for p in (both, alone)]
    assert first[0] < 0.5 * first[1]
    for problem, told in ((both, True), (alone, False)):
        found = compare(problem, problem.residuals([()])[0])
        assert (FORCE_OF_ALL in compare_account(problem, found, []).lines) is told
        assert trials_section(problem, found).caption == (FORCE_OF_ALL if told else "")
        word = last_word([problem, problem], [(), ()], problem.compared)
        assert (FORCE_OF_ALL in last_word_section(word).caption) is told
        console = Console(width=500, record=True)
        show_last_word(console, word)
        assert (FORCE_OF_ALL in console.export_text()) is told


def test_trials_by_commands_are_weighed_by_the_channels_of_all_of_them() -> None:
    trials, robot = measured("arm"), samples()["arm"].robot
    assert problem_by("open_loop", trials, robot).shared_by_trials == CHANNELS_OF_ALL
    assert problem_by("open_loop", trials[:1], robot).shared_by_trials == ""
