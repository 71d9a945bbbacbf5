"""What the terminal says while a run goes on."""

from __future__ import annotations

import io

from rich.console import Console

from ee_dist.effects.catalogue import Term
from ee_dist.recording.records import DIAGNOSIS, POLISHED, PRUNED, REPAIR, GenerationRecord, HypothesisRecord
from ee_dist.tasks import progress_line
from ee_dist.tasks.progress import PassProgress, starting
from ee_dist.tasks.progress_line import SearchProgress


def test_a_finished_run_has_nothing_left_to_wait_for() -> None:
    """Five shares of a pass sum to a little more than the pass: no less than no time is left all the same."""
    out = io.StringIO()
    passes, generations = 3, 4
    with PassProgress(Console(file=out, width=200), {REPAIR: passes}, {REPAIR: 1.0}) as progress:
        for index in range(passes):
            progress.pass_started(REPAIR, index, generations)
            for k in range(generations + 1):
                progress.generation(GenerationRecord(REPAIR, index, k, 1.0, 0.5, 1, 10, 5))
    lines = [line for line in out.getvalue().splitlines() if "left" in line]
    assert len(lines) == passes
    assert lines[-1].rstrip().endswith("about 0 s left")


def test_what_is_done_before_the_first_bar_is_said() -> None:
    out = io.StringIO()
    console = Console(file=out, width=80)
    with starting(console, "starting Ray and its workers"):
        assert "starting Ray and its workers" in out.getvalue()
    with PassProgress(console, {REPAIR: 2}, {REPAIR: 1.0}) as progress:
        progress.pass_started(REPAIR, 0, 40)
        assert "repair 1 of 2, 40 generations" in out.getvalue()


def test_a_diagnosis_is_over_when_it_is_polished_and_told() -> None:
    """The belief is told, not the best that evolved, and the time for polish is counted."""
    out = io.StringIO()
    with PassProgress(Console(file=out, width=80), {DIAGNOSIS: 1}, {DIAGNOSIS: 1.0, POLISHED: 3.0}) as progress:
        progress.pass_started(DIAGNOSIS, 0, 1)
        for k in range(2):
            progress.generation(GenerationRecord(DIAGNOSIS, 0, k, 0.5, 0.6, 1, 10, 5))
        assert "error" not in out.getvalue()
        assert progress.done == progress.total / 4
        lost = (Term("part_lost", "upper_rear_left"),)
        progress.hypotheses([HypothesisRecord(0, 1, 0, lost, 0.25, final=True, stage=PRUNED)])
        assert progress.done == progress.total
    assert "diagnosis pass 1: error 0.25000 (evolved: 0.50000)" in out.getvalue()
    assert "believes: part lost at upper rear left" in out.getvalue()


def lines_of(monkeypatch, told, width: int = 200) -> list[str]:
    """What is printed where there is no terminal, in lines without spaces beside one another; ``told``: (s, what, share, perhaps
    an error), one after the other."""
    now = 0.0
    monkeypatch.setattr(progress_line.time, "monotonic", lambda: now)
    out = io.StringIO()
    with SearchProgress(Console(file=out, width=width)) as progress:
        for at, *said in told:
            now = at
            progress(*said)
    return [" ".join(line.split()) for line in out.getvalue().splitlines()]


def test_steps_of_one_stage_are_told_now_and_then_with_the_error_so_far(monkeypatch) -> None:
    told = ((1.0, "one more: screening", 0.5, None), (2.0, "one more: fitting", 0.5, 3.0),
            (3.0, "at once: fitting", 1.0, 2.5), (4.0, "at once: fitting 48 values", 1.0, 2.0),
            (14.0, "at once: fitting", 1.0, 1.5), (15.0, "at once: fitting", 1.0, 1.25))  # fmt: skip
    assert lines_of(monkeypatch, told, 40) == [
        "1 s one more: screening",
        "3 s at once: fitting, error 2.5",
        "14 s at once: fitting, error 1.5",
    ]


def test_a_long_stage_says_from_its_first_word_how_long_it_will_take(monkeypatch) -> None:
    """Where there is no terminal too, and not more often than one reads; a short one says its name alone."""
    told = ((1.0, "weighing", 0.0), (6.0, "screening", 0.05), (8.0, "screening", 0.07),
            (56.0, "screening", 0.5), (106.0, "screening", 1.0), (107.0, "scanning", 0.5),
            (127.0, "fitting", 0.2), (207.0, "fitting", 1.0), (217.0, "fitting", 0.1),
            (219.0, "fitting", 1.0), (220.0, "fitting", 0.03), (221.0, "fitting", 1.0),
            (223.0, "fitting", 0.03))  # fmt: skip
    assert lines_of(monkeypatch, told, 100) == [
        "1 s weighing",
        "6 s screening 5 %, about 95 s left of this step",
        "56 s screening 50 %, about 55 s left of this step",
        "107 s scanning",
        "127 s fitting 20 %, up to 80 s left of this fit",
        "217 s fitting 10 %, up to 90 s left of this fit",
    ]


def test_what_is_left_is_that_of_a_fit_and_a_fit_that_makes_no_headway_does_not_begin_anew(monkeypatch) -> None:
    """How many fits a stage has nobody knows: what is known is how long it has gone on."""
    told = ((10.0, "one more: screening", 1.0), (50.0, "at once: fitting 46 values", 0.25),
            (80.0, "at once: fitting 46 values", 0.25), (90.0, "at once: fitting 46 values", 1.0),
            (130.0, "at once: fitting 46 values", 0.25))  # fmt: skip
    assert lines_of(monkeypatch, told) == [
        "10 s one more: screening",
        "50 s at once: fitting 46 values 25 %, up to 120 s left of this fit",
        "80 s at once: fitting 46 values 25 %, up to 210 s left of this fit",
        "130 s at once: fitting 46 values 25 %, up to 120 s left of this fit (this stage: 120 s so far)",
    ]


def test_the_live_line_says_the_same(monkeypatch) -> None:
    now = 0.0
    monkeypatch.setattr(progress_line.time, "monotonic", lambda: now)
    out = io.StringIO()
    console = Console(file=out, width=200, force_terminal=True, color_system=None)
    with SearchProgress(console) as progress:
        for at, share in ((20.0, 1.0), (40.0, 0.5)):
            now = at
            progress("at once: fitting 46 values", share, 0.5)
    said = (
        "fitting 46 values 50 %, error 0.5, up to 20 s left of this fit (this stage: 40 s so far), 40 s so far in all"
    )
    assert said in out.getvalue()
