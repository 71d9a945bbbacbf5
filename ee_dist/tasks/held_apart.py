"""What the trials that ``held_out=[...]`` names say of models that were found without them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from ee_dist.discrepancy.ladder import Rung
from ee_dist.discrepancy.last_word import TRIALS_APART, LastWord, last_word
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.steps_apart import StepApart, step_apart
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.tasks.config import Config
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.ways import Way


class HeldApart:
    """Trials that nothing was ``fitted`` to, compared by the same measure, and their commands taken as those of what was. A
    search hears nothing of it: what is asked here is told to people alone."""

    def __init__(self, apart: Measurements, way: Way, config: Config, fitted: Problem) -> None:
        self._apart, self._way, self._config, self._fitted = apart, way, config, fitted
        self.problem = self._with(apart.model)
        self._steps: dict[Hypothesis, StepApart] = {}

    def _with(self, model: Hypothesis) -> Problem:
        own = replace(self._apart, model=model)
        return self._way.as_read(own, self._config, self._fitted).as_searched(self._fitted)

    def step(self, model: Hypothesis) -> StepApart:
        """How far a model is from these trials, weighed by the one as it was, as in the search; each is simulated once."""
        if model not in self._steps:
            self._steps[model] = step_apart(self.problem, model)
        return self._steps[model]

    def told(self, model: Hypothesis) -> str:
        """The same in a few words."""
        return f"{self.problem.told(self.step(model).error)} on {TRIALS_APART}"

    def word(self, terms: Hypothesis, ladder: Sequence[Rung] = ()) -> LastWord:
        """How far the model as it was, each step of the ``ladder``, and the model with ``terms`` are from these trials. Raises
        RobotError where the first or the last cannot be simulated."""
        models = (self._apart.model, terms)
        found = last_word([self.problem, self._with(terms)], models, self._fitted.compared)
        return replace(found, steps=tuple(self.step(r.model) for r in ladder))


def told_of(apart: Measurements, way: Way, config: Config, terms: Hypothesis, fitted: Problem) -> LastWord:
    """The same of a model that no ladder led to."""
    return HeldApart(apart, way, config, fitted).word(terms)
