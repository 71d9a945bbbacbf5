"""What is shown is what was found: where it is, of what it is, and against what."""

from __future__ import annotations

import io
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_problem import Linear
from rich.console import Console
from way_samples import measured, samples

from ee_dist.discrepancy.accounts.of_compare import PARTS, compare_account
from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.accounts.ranges import ranges, rest_text
from ee_dist.discrepancy.compare import RegimeReport, compare, of_all_regimes, trial_name
from ee_dist.discrepancy.evidence.holdout import in_turn
from ee_dist.discrepancy.evidence.intervals import ALL_OF_IT, NEUTRAL, ParameterReport
from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.discrepancy.explain import explain
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.last_word import last_word
from ee_dist.discrepancy.problem import Series, error, joined
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.effects.catalogue import term
from ee_dist.tasks.results.sections import (
    channels_section,
    heat_section,
    ranking_section,
    regimes_section,
    trials_section,
)
from ee_dist.tasks.results.tables import WITHOUT, show_comparison
from ee_dist.viewing import channels

WEAK = term("motor_weak", "knee_front_left", loss=0.4)


@pytest.fixture(scope="module")
def found():  # type: ignore[no-untyped-def]
    problem = Linear((WEAK,), motions=4)
    return problem, improve(problem, [parse(problem.robot, "motor_weak@knee_front_left")])


@pytest.mark.parametrize("extra", [0.0, 3.0])
def test_what_is_left_of_trials_held_out_from_all_of_it_is_told_in_words(found, extra: float) -> None:  # type: ignore[no-untyped-def]
    problem, improvement = found
    apart = Linear((WEAK,), seed=7, extra=extra)
    word = last_word([apart, apart], [(), improvement.terms], apart.channels)
    lines = improve_account(problem, improvement, word=word).lines
    (line,) = (w for w in lines if w.startswith("On trials that were held out from all of it "))
    assert bool(word.left) is bool(extra)
    told = (
        ("more than noise is left in 2 curves", *map(str, word.left[:2]))
        if extra
        else ("nothing is left above the noise",)
    )
    assert all(t in line for t in told)


def test_an_error_beside_that_of_trials_apart_says_what_it_is_of(found) -> None:  # type: ignore[no-untyped-def]
    problem, improvement = found
    apart = Linear((WEAK,), seed=7)
    word = last_word([apart, apart], [(), improvement.terms], apart.channels)
    of = in_turn(improvement.ladder[-1].held_out)
    assert f"on {of}: model " in improve_account(problem, improvement, word=word).error


def test_values_that_a_line_does_not_tell_are_counted_or_named() -> None:
    robot = Linear(()).robot
    terms = (WEAK, *(term("viscous_friction", j, damping_nm_s_rad=0.1) for j in ("knee_front_left", "hip_front_left")))
    sure = ParameterReport(0, "loss", 0.4, 0.3, 0.5, "")
    vague = [ParameterReport(k, "damping_nm_s_rad", 0.1, 0.0, 0.2, NEUTRAL, ALL_OF_IT) for k in (1, 2)]
    told = ranges(terms, [sure, *vague], [WEAK], robot, True)
    assert told.endswith("30 to 50 %; and 2 more values, as the table of values has them")
    assert "more value" not in ranges((WEAK,), [sure], [WEAK], robot, False)
    (line,) = rest_text(terms, [replace(sure, doubt=ALL_OF_IT), *vague])
    assert line.endswith("It could be all of: motor weak at knee front left; and 2 values flagged above.")


def test_candidates_stand_beside_the_model_without_them() -> None:
    problem = Linear((WEAK,), motions=4)
    found = explain(problem, [parse(problem.robot, f"{e}@knee_front_left") for e in ("motor_weak", "viscous_friction")])
    section = ranking_section(problem, found.candidates)
    assert section is not None and section.table is not None
    assert section.table.rows[0][1:3] == [WITHOUT, problem.told(error(problem.data))]
    assert section.table.lead == [1] and section.table.rows[1][0] == "1"
    # A colour is named where it is drawn, and no other.
    assert [name for name, _ in section.legend] == ["best"]


def test_rows_that_were_lost_are_told_and_not_drawn(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = Linear((), motions=2)
    log, filled = problem.measured[0].log, np.zeros(len(problem.measured[0].log), dtype=bool)
    filled[200:260] = True
    log = replace(log, filled=filled)
    problem.measured = (replace(problem.measured[0], log=log), problem.measured[1])
    (note,) = problem.notes
    assert note.startswith(
        "60 of 1600 rows lie in gaps between readings (1 trial: trial 0): they are bridged by lines, and not"
    )

    read = log.readings
    (whole,) = joined([Series(0, 0, "rad", log.times_s[read], *2 * (log.commands[read, 0],))])
    assert (
        np.isnan(whole.measured).sum() == 1 and np.isnan(whole.predicted[200]) and len(whole.times_s) == len(read) + 1
    )

    sent: list[np.ndarray] = []
    monkeypatch.setattr(channels.rr.Scalars, "columns", lambda scalars: sent.append(scalars))
    channels.send_scalars(SimpleNamespace(send_columns=lambda *_: None), "place", [(0.0, log, log.commands[:, 0])])  # type: ignore[arg-type]
    np.testing.assert_array_equal(np.isnan(sent[0]), [*filled, True])


def test_trials_have_the_numbers_of_their_log() -> None:
    problem = Linear((WEAK,), motions=2)
    problem.measured = tuple(replace(t, name="again", number=n) for t, n in zip(problem.measured, (3, 7), strict=True))
    residual = np.full(len(problem.data), 4.0)
    found, left = compare(problem, residual), leftovers(problem, residual)
    assert [trial_name(problem, k) for k in range(2)] == ["3. again", "7. again"]
    assert [*found.parted_s] == ["again (3)", "again (7)"]
    account = compare_account(problem, found, left)
    (line,) = (x for x in account.lines if x.startswith(PARTS))
    assert all(f"{n}. again at " in line for n in (3, 7)) and {str(g).split(" during ")[1][:8] for g in left} == {
        "3. again",
        "7. again",
    }


def test_where_they_part_is_by_the_weight_of_a_trial_as_the_worst_window_is() -> None:
    class Weighed(Linear):
        def weight_of(self, trial: int) -> float:
            return 100.0 if trial else 1.0

    problem = Weighed((), motions=2)
    assert [*compare(problem, np.full(len(problem.data), 4.0)).parted_s.values()] == [0.0, None]


def test_regimes_and_root_mean_squares_say_what_they_are_of() -> None:
    problem = Linear((WEAK,), motions=2)
    problem.averaged = "means over 0.02 s"
    found = compare(problem, problem.data)
    found.regimes[:] = [
        RegimeReport("moving", 3.0, 0.9, 0.6),
        RegimeReport("at rest", 1.0, 0.1, 0.2),
        RegimeReport("high load", 9.0, 0, 0.1),
    ]
    assert of_all_regimes(found.regimes) == pytest.approx(np.sqrt(5.6 / 0.8))
    assert "joints' readings, error 2.65 in all" in regimes_section(problem, found).caption
    assert "also counts" not in regimes_section(problem, found).caption, "these are all that is compared"
    problem.layout = replace(problem.layout, reading=np.arange(len(problem.data)) > 0)
    why = f"The error of the model, {problem.told(found.error)}, also counts how much readings scatter and how often they repeat."
    assert regimes_section(problem, found).caption.endswith(why)
    assert "rmse: root mean square of means over 0.02 s" in channels_section(problem, found).caption
    rmse = channels_section(problem, found).table.rows[0][1]
    assert rmse.startswith(f"{found.channels[0].rmse:.3g}"), "as many digits as in the terminal"
    for section in (regimes_section, trials_section, channels_section):
        assert [name for name, _ in section(problem, found).legend] == ["model"]
    assert "one scale for all channels" in heat_section(problem, problem.data).caption
    console = Console(width=100, record=True, file=io.StringIO())
    show_comparison(console, problem, found)
    said = " ".join(console.export_text().split())
    assert "channels (rmse: of means over 0.02 s)" in said
    assert "regimes, by what a joint was doing at the time (joints' readings, error 2.65 in all)" in said


def test_forces_over_rows_that_were_lost_are_said_to_be_compared() -> None:
    trials = measured("arm")
    filled = np.zeros(len(trials[0].log), dtype=bool)
    filled[100:140] = True
    lost = (replace(trials[0], log=replace(trials[0].log, filled=filled)), *trials[1:])
    said = [line for line in ForceBalance(lost, samples()["arm"].robot).notes if "gaps between readings" in line]
    assert len(said) == 1 and "compared as if they had been read" in said[0]
    assert not any("gaps" in line for line in ForceBalance(trials, samples()["arm"].robot).notes)
