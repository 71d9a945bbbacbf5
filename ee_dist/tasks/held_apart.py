"""What the trials that ``held_out=[...]`` names say of a model that was found without them."""

from __future__ import annotations

from dataclasses import replace

from ee_dist.discrepancy.last_word import LastWord, last_word
from ee_dist.discrepancy.problem import Problem
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.tasks.config import Config
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.ways import Way


def told_of(apart: Measurements, way: Way, config: Config, terms: Hypothesis, fitted: Problem) -> LastWord:
    """How far the model as it was and the one with ``terms`` are from trials that nothing was fitted to, compared
    by the same measure, and their commands taken as those of what was ``fitted``."""
    models = (apart.model, terms)
    problems = [way.as_read(replace(apart, model=m), config, fitted).as_searched(fitted) for m in models]
    return last_word(problems, models, fitted.compared)
