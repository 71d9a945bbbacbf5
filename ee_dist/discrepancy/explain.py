"""explain: which missing effect accounts for the residual, judged on data that was not fitted."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from ee_dist.discrepancy.base_model import residual_as_it_is
from ee_dist.discrepancy.evidence.intervals import ParameterReport, parameters
from ee_dist.discrepancy.evidence.judge import Judged, ranked
from ee_dist.discrepancy.evidence.left import Leftover, leftovers, may_be_noise
from ee_dist.discrepancy.evidence.signs import either_sign
from ee_dist.discrepancy.examine import STANDARD_EFFORT, Current, Effort, Examined, examine
from ee_dist.discrepancy.left_as_guessed import beside_guesses
from ee_dist.discrepancy.meters import AtLimit
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.search.candidates import Candidate, known, on_top_of, values_of
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Progress, Search, quiet
from ee_dist.discrepancy.search.slopes import slopes_at
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

EFFECT, NOTHING_MISSING, UNEXPLAINED = "effect", "nothing_missing", "unexplained"

MADE_UP, BETTER_AS_IT_WAS = 1.3, 0.8
"""Energy of a model as it is over that with its own values fitted anew, from which these may stand in for what is missing; and
the share of held-out energy at which the model as it was, with one effect on top, explains more than with values fitted anew."""


@dataclass(eq=False)
class Explanation:
    """The outcome. ``baseline_error`` is that of the model as it is; ``refitted_error`` with its own values fitted anew
    (the same, where it has none, they are known, or they stayed ``as_it_was``); ``base`` (n,) the residual of the model
    ``before``, refitted or as it was; ``unsure``: channels in which what is left may be noise or not."""

    verdict: str
    baseline_error: float
    refitted_error: float
    noise_floor: float
    floor_source: str
    before: Hypothesis
    fixed: Hypothesis
    examined: Examined
    as_it_was: bool = False
    unsure: list[str] = field(default_factory=list)
    parameters: list[ParameterReport] = field(default_factory=list)
    """How sure each value of ``after`` is that was fitted, where an effect was found."""
    given: Hypothesis = ()
    """The model as it was given, whose terms ``before`` has with their values fitted anew."""
    offered: int = 0
    """Candidates that were there to be tried."""
    at_limit: list[AtLimit] = field(default_factory=list)
    """Joints that are often at their torque limits with the model ``before``, where somebody looked."""

    @property
    def candidates(self) -> list[Judged]:
        return self.examined.judged

    @property
    def base(self) -> Array:
        return self.examined.base

    @property
    def left(self) -> list[Leftover]:
        return self.examined.left

    @property
    def tried(self) -> int:
        return self.examined.tried

    @property
    def best(self) -> Judged | None:
        return self.examined.best

    @property
    def tied(self) -> list[Judged]:
        return self.examined.tied

    @property
    def after(self) -> Hypothesis:
        """The model with the best effect; as it was, where none earned its place."""
        return self.before if self.best is None else (*self.fixed, *self.best.hypothesis)


def begin(problem: Problem, before: Hypothesis, progress: Progress = quiet) -> tuple[Search, Current]:
    """The search, and the model that it starts from: the terms of ``before`` with their values fitted anew, or, where they
    come from a calibration, fixed."""
    if problem.calibrated or not before:
        return Search(problem, before, progress=progress), Current()
    parts = tuple(known(problem.robot, t) for t in before)
    search = Search(problem, progress=progress)
    fit = fit_one(search, Model(parts), [values_of(parts, before)])
    return search, Current(parts, fit.u)


def as_it_was(
    search: Search,
    found: Examined,
    before: Hypothesis,
    as_it_is: Array,
    pool: Sequence[Candidate],
    effort: Effort,
) -> Examined | None:
    """What explains most on top of ``before`` with its values as they were, if that is more than was ``found`` with them
    fitted anew. A model made on other records may be right, and all that is new one effect, such as a load, for which its
    values would stand in when fitted to these records, whose residual was ``as_it_is`` (n,)."""
    if search.fixed or not before or _energy(as_it_is) <= MADE_UP * _energy(found.base):
        return None
    kept = examine(search.on(before), Current(), pool, effort)
    against = _energy(found.base) if found.best is None else float(found.best.held.sum())
    better = kept.best is not None and float(kept.best.held.sum()) < BETTER_AS_IT_WAS * against
    return kept if better else None


def _that_say_something(problem: Problem, found: Examined, fixed: Hypothesis) -> Examined:
    """Without what explains no more than a model that says nothing: where most is rest, friction that stops all motion."""
    nothing = [(j, why) for j in found.judged if j.stands and (why := problem.says_nothing((*fixed, *j.hypothesis)))]
    if not nothing:
        return found
    for j, why in nothing:
        j.why_not = why
    again = replace(found, judged=ranked(found.judged))
    again.left = leftovers(problem, found.base if again.best is None else again.best.residual)
    return again


def _energy(residual: Array) -> float:
    return float(residual @ residual)


def explain(
    problem: Problem,
    pool: Sequence[Candidate],
    before: Hypothesis = (),
    effort: Effort = STANDARD_EFFORT,
    progress: Progress = quiet,
) -> Explanation:
    """Search ``pool`` for what explains the residual that the model with ``before`` leaves."""
    as_it_is = residual_as_it_is(problem, before)
    search, current = begin(problem, before, progress)
    names = {c.name for c in current.parts}
    fixed, model = search.fixed, (*search.fixed, *current.hypothesis)
    others = on_top_of(problem.robot, model, [c for c in pool if c.name not in names])
    found = examine(search, current, others, effort)
    kept = as_it_was(search, found, before, as_it_is, others, effort)
    if kept is not None:
        found, fixed, model = kept, before, before
    found = _that_say_something(problem, found, fixed)
    verdict = EFFECT if found.best is not None else (UNEXPLAINED if found.left else NOTHING_MISSING)
    floor, source = problem.noise_floor()
    unsure = may_be_noise(problem, found.base if found.best is None else found.best.residual)
    told = [] if found.best is None else _how_sure(replace(search, fixed=fixed), found.best, found)
    return Explanation(
        verdict, error(as_it_is), error(found.base), floor, source, model, fixed, found, kept is not None, unsure, told,
        tuple(before), len(pool),
    )  # fmt: skip


def _how_sure(search: Search, best: Judged, found: Examined) -> list[ParameterReport]:
    """Of each value of the best, as it is told, by all data: nothing is fitted anew for it."""
    problem, model, u = search.problem, best.model, best.u
    residual = search.residuals([model.hypothesis(u)])[0]
    fit = Fit(model, u, float(residual @ residual), residual, slopes_at(search, model, u), search.everything)
    beside = beside_guesses(search, fit)
    reports = parameters(problem, fit, found.left, found.tried, either_sign(search, fit), guesses=beside)
    return [replace(p, term=p.term + len(search.fixed)) for p in reports]


def gained_untouched(found: Explanation) -> float:
    """Energy that the most promising effect takes off held-out data of an untouched robot: none of it is its own."""
    energies = [c.gain * float(np.sum(found.base**2)) for c in found.candidates]
    return max([0.0, *(e for e in energies if np.isfinite(e))])
