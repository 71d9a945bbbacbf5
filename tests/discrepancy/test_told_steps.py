"""What is said of a step while a search goes on is what its model has, and what a stopped search keeps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from linear_problem import GAIN, HIDDEN, JAM, ROBOT, WEAK, Linear, StandIn

import ee_dist.tasks.improve as task
from ee_dist.discrepancy.accounts.of_improve import improve_account
from ee_dist.discrepancy.evidence.holdout import IN_TURN, MOTIONS, WINDOWS
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.last_word import TRIALS_APART, last_word
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.discrepancy.steps_apart import step_apart
from ee_dist.discrepancy.worse_steps import nearest_step, worse_step_lines, worse_steps
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.effects.model_file import read_model
from ee_dist.trials.log import Array

POOL = [parse(ROBOT, name) for name in (WEAK, JAM, GAIN)]
MEASURED = SimpleNamespace(source="quadruped_lab", folder=Path())


class Noted:
    """Where progress is told, and the model so far is kept."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
        self.path, self.lines, self.kept = folder / "model.yaml", list[str](), list[tuple[str, Hypothesis]]()
        monkeypatch.setattr(task, "keep_so_far", self._keep)

    def note(self, text: str) -> None:
        self.lines.append(text)

    def _keep(self, write, *_) -> None:  # type: ignore[no-untyped-def]
        write(self.path)
        self.kept.append((self.path.read_text(), read_model(self.path).terms))


def test_what_a_step_drops_is_in_no_model_that_is_kept_of_it(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    problem, noted = StandIn(HIDDEN), Noted(monkeypatch, tmp_path)
    found = improve(problem, POOL, climbed=task.telling(problem, noted, MEASURED))  # type: ignore[arg-type]
    (place,) = [k for k, r in enumerate(found.ladder[1:]) if r.dropped == (GAIN,)]
    header, model = noted.kept[place]
    assert "; without command gain at hip front left" in header
    assert GAIN not in {t.name for t in model} and set(found.ladder[1 + place].added) <= set(model)


@pytest.mark.parametrize(("extra", "cut"), [(0.0, WINDOWS), (2.0, MOTIONS)])
def test_a_line_of_a_step_tells_what_takes_turns_from_what_was_held_out_from_all_of_it(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, extra: float, cut: str
) -> None:
    problem, noted = Linear(HIDDEN, extra=extra, motions=4), Noted(monkeypatch, tmp_path)
    other = Linear(HIDDEN, seed=7)
    told = SimpleNamespace(told=lambda m: f"{other.told(step_apart(other, m).error)} on {TRIALS_APART}")
    found = improve(problem, POOL, climbed=task.telling(problem, noted, MEASURED, told))  # type: ignore[arg-type]
    assert cut in found.cuts and len(noted.lines) == len(found.ladder) - 1
    for rung, line, (header, _) in zip(found.ladder[1:], noted.lines, noted.kept, strict=True):
        own, there = problem.told(rung.error_heldout), other.told(step_apart(other, rung.model).error)
        assert line.endswith(f": {own} on {IN_TURN[rung.held_out]}; {there} on {TRIALS_APART}") and line in header
    plain = improve(problem, POOL, climbed=task.telling(problem, noted, MEASURED))  # type: ignore[arg-type]
    assert noted.lines[-1].endswith(" on data held out")
    assert [(r.terms, r.error_heldout) for r in plain.ladder] == [(r.terms, r.error_heldout) for r in found.ladder]


def stepped(problem: Linear, apart: Linear):  # type: ignore[no-untyped-def]
    """A search on one problem, and what the trials of another say of its steps."""
    found = improve(problem, POOL[:2])
    word = last_word([apart, apart], [(), found.terms], problem.compared)
    return found, replace(word, steps=tuple(step_apart(apart, r.model) for r in found.ladder))


@pytest.mark.parametrize(
    ("hidden", "warned"),
    [(HIDDEN, False), (HIDDEN[:1], True), (HIDDEN[1:], True)],
)
def test_a_step_that_suits_the_fitted_motions_alone_is_named(hidden: Hypothesis, warned: bool) -> None:
    problem, apart = Linear(HIDDEN, motions=4), Linear(hidden, seed=7)
    found, word = stepped(problem, apart)
    assert [r.name for r in found.ladder[1:]] == [WEAK, JAM]
    assert [s.error for s in word.steps][:: len(found.ladder) - 1] == pytest.approx([word.before, word.after], rel=0.02)
    lines = [line for line in improve_account(problem, found, word=word).first if line.startswith("Step ")]
    assert bool(lines) is warned
    if warned:
        (line,), (step,) = lines, worse_steps(apart, word.steps)
        name, number = (
            ("joint jam at hip rear left", 2) if hidden == HIDDEN[:1] else ("motor weak at knee front left", 1)
        )
        before, after = (apart.told(s.error) for s in word.steps[number - 1 : number + 1])
        assert (
            step.overall
            and f"Step {number} of the ladder ({name}) took the error on {TRIALS_APART} from {before} to {after}"
            in line
        )


class OneChannel(Linear):
    """The jam shows in the second channel alone, and there three times as much."""

    def shift(self, hypothesis: Hypothesis) -> Array:
        jam = [t for t in hypothesis if t.effect == "joint_jam"]
        rest = tuple(t for t in hypothesis if t.effect != "joint_jam")
        return super().shift(rest) + np.where(self.layout.channel_of == 1, 3.0 * super().shift(tuple(jam)), 0.0)


@pytest.mark.parametrize("hidden", [HIDDEN[:1], ()])
def test_a_joint_that_got_much_worse_is_named_too(hidden: Hypothesis) -> None:
    problem, apart = OneChannel(HIDDEN, motions=4), OneChannel(hidden, seed=7)
    found, word = stepped(problem, apart)
    jam = 1 + [r.name for r in found.ladder[1:]].index(JAM)
    (step,) = [s for s in worse_steps(apart, word.steps) if s.number == jam]
    assert step.channel == "b" and step.at[1] > 1.5 * step.at[0]
    (line,) = [x for x in improve_account(problem, found, word=word).first if x.startswith(f"Step {jam} ")]
    assert f"most of it at b ({step.at[0]:.3g} to {step.at[1]:.3g} rad)" in line


def test_what_a_later_step_brings_back_is_not_told_and_one_joint_is_although_all_together_got_better() -> None:
    apart = OneChannel((term("motor_weak", "knee_front_left", loss=0.9),), seed=7)
    weak = (term("motor_weak", "knee_front_left", loss=0.9),)
    jam = (term("joint_jam", "hip_rear_left", loss=0.5),)
    first, worse, last = (step_apart(apart, m) for m in ((), jam, weak))
    assert [s.number for s in worse_steps(apart, [first, worse])] == [1] and not worse_steps(
        apart, [first, worse, last]
    )
    # Both at once: far nearer in the first channel, and off in the second for good.
    quiet = replace(first, off=np.array([6.0, 1.0]), error=6.0, energy=np.tile([[720.0, 20.0]], (20, 1)))
    loud = replace(first, off=np.array([1.0, 3.0]), error=2.2, energy=np.tile([[20.0, 180.0]], (20, 1)))
    (step,) = worse_steps(apart, [quiet, loud])
    assert not step.overall and step.channel == "b" and step.at == (1.0, 3.0)


@pytest.mark.parametrize(
    ("errors", "nearest"), [((5, 2, 2.1, 2.3), 1), ((5, 2, 2.1, 2.15), None), ((5, 6, 7), None), ((5, 4, 3), None)]
)
def test_steps_that_make_it_worse_together_are_told_by_the_one_after_which_least_was_left(
    errors: tuple[float, ...], nearest: int | None
) -> None:
    """None of them by more than what one segment differs from the next by."""
    problem, apart = Linear(HIDDEN, motions=4), Linear(HIDDEN, seed=7)
    found, word = stepped(problem, apart)
    rng = np.random.default_rng(2)
    energies = [e**2 * rng.exponential(size=(20, 2)) for e in errors]
    steps = tuple(
        replace(word.steps[0], error=e, energy=en, off=np.ones(2)) for e, en in zip(errors, energies, strict=True)
    )
    assert nearest_step(steps) == nearest
    ladder = [*found.ladder, *found.ladder][: len(steps)]
    lines = worse_step_lines(replace(word, steps=steps), ladder)
    told = [line for line in lines if "least was left after step" in line]
    assert len(told) == (
        nearest is not None and not any(s.overall and s.number > nearest for s in worse_steps(apart, steps))
    )
    if told:
        assert f"{apart.told(2)}, and {apart.told(2.3)} after its last" in told[0]
