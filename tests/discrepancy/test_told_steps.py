"""What is said of a step while a search goes on is what its model has, and what a stopped search keeps."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest
from linear_problem import ROBOT, Linear

import ee_dist.tasks.improve as task
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.effects.catalogue import Hypothesis, Term, term
from ee_dist.effects.model_file import read_model
from ee_dist.trials.log import Array

WEAK, JAM, GAIN = "motor_weak@knee_front_left", "joint_jam@hip_rear_left", "command_gain@hip_front_left"
POOL = [parse(ROBOT, name) for name in (WEAK, JAM, GAIN)]
HIDDEN = (term("motor_weak", "knee_front_left", loss=0.4), term("joint_jam", "hip_rear_left", loss=0.3))
MEASURED = SimpleNamespace(source="quadruped_lab", folder=Path())


class StandIn(Linear):
    """A gain stands in for a weak motor at a knee and for a jam at a hip, but for a little: it comes first, and goes."""

    def shift(self, hypothesis: Hypothesis) -> Array:
        total = super().shift(tuple(t for t in hypothesis if t.effect != "command_gain"))
        for t in hypothesis:
            if t.effect == "command_gain":
                own = super().shift((Term(t.effect, t.target, (("change", 0.3),)),))
                total = total + t.values[0][1] / 0.3 * (super().shift(HIDDEN) + own)
        return total


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
