"""The last word on a model: how far it is from trials that took no part in its search, beside the model that it came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ee_dist.basics.names import listed
from ee_dist.discrepancy.base_model import residual_as_it_is
from ee_dist.discrepancy.compare import trial_name
from ee_dist.discrepancy.evidence.left import Leftover, leftovers, settled
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.steps_apart import StepApart
from ee_dist.effects.catalogue import Hypothesis

HELD_APART = "Held out from all of it"
TRIALS_APART = "trials that were held out from all of it"
WORSE = 1.01
"""Times the error before from which a model is called worse."""


@dataclass(frozen=True, eq=False)
class LastWord:
    """Errors of the model ``before`` and the one ``after``, of all trials of ``problem`` together and of each by itself, by
    the measure of the search; ``changed``: whether they are two; ``left``: curves in which the second leaves more than noise;
    ``others``: the same errors as this way counts them elsewhere (of positions, say), in lines for people; ``farther``: in
    which plain numbers the second is the worse one although its error fell, if it is; ``steps``: of each step of the ladder
    between the two, from the first model on, where there is a ladder."""

    problem: Problem
    before: float
    after: float
    floor: float
    by_trial: tuple[tuple[float, float], ...]
    left: tuple[Leftover, ...]
    changed: bool
    others: tuple[str, ...] = ()
    farther: str = ""
    steps: tuple[StepApart, ...] = ()

    @property
    def more(self) -> bool:
        """Whether more than noise is left on these trials."""
        return not settled(self.left, self.after, self.floor)

    @property
    def names(self) -> list[str]:
        """The trials, as those that were fitted are called."""
        return [trial_name(self.problem, k) for k in range(len(self.problem.trials))]

    @property
    def lines(self) -> list[str]:
        """``others``, told as of these trials."""
        return [f"{HELD_APART}: {line[:1].lower()}{line[1:]}" for line in self.others]

    @property
    def text(self) -> str:
        """For people, in a sentence or two."""
        told, worse = self.problem.told, self.after > WORSE * self.before
        improved = f"improved model {told(self.after)}, " if self.changed else ""
        text = (
            f"{HELD_APART} ({listed(self.names)}): model {told(self.before)}, {improved}noise floor {told(self.floor)}."
        )
        if worse:
            return f"{text} There the improved model is the worse one: do not use it for such motions."
        return f"{text} {self.farther}." if self.farther and self.after < self.before else text


def last_word(problems: Sequence[Problem], models: Sequence[Hypothesis], fitted: Sequence[str]) -> LastWord:
    """Of trials that nothing was fitted to, as a problem of each of two ``models`` (they may be weighed by a calibration);
    ``fitted``: the channels of what was fitted, which are other ones where a joint moves in some trials alone. Raises
    RobotError where one cannot be simulated."""
    residuals = [residual_as_it_is(p, m) for p, m in zip(problems, models, strict=True)]
    first, last = problems
    trials = range(len(last.trials))
    by_trial = [(first.trial_error(residuals[0], k), last.trial_error(residuals[1], k)) for k in trials]
    before, after = map(error, residuals)
    left = tuple(leftovers(last, residuals[1]))
    changed = models[0] != models[1]
    others = (*last.other_errors(*models if changed else models[:1]), *_elsewhere(last.compared, fitted))
    farther = last.farther_off(models[0], models[1], after < before) if changed else ""
    return LastWord(last, before, after, last.noise_floor()[0], tuple(by_trial), left, changed, others, farther)


def _elsewhere(channels: Sequence[str], fitted: Sequence[str]) -> list[str]:
    """A line where these trials are judged by other channels than those that were fitted."""
    more, less = ([c for c in a if c not in b] for a, b in ((channels, fitted), (fitted, channels)))
    told = [f"at {listed(more)} too"] * bool(more) + [f"not at {listed(less)}"] * bool(less)
    if not told:
        return []
    return [f"It is judged {' and '.join(told)}, unlike what was fitted: the two errors are of other joints."]
