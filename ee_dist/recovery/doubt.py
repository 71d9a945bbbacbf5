"""Whether anything is wrong that the last hypothesis does not say: what it leaves against what a right one would leave.

A search always ends with a nearest hypothesis. Whether it is near enough it does not say, and some faults (a failing hidden
neuron, a lighter body) no genome can say. The yardstick does not see the truth. A right hypothesis leaves two things:

- noise. How much shows the intact trial, before the change, against the intact model, which is right; and, where the noise
  of the sensors is declared, the largest of ``DRAWS`` trials simulated with that noise. So luck alone makes a doubt of about
  one right hypothesis in a hundred.
- rounding. A genome has two decimals, so a right magnitude may be off by less than one of their steps. What one step changes
  is simulated, for each magnitude of the hypothesis to both sides; the larger counts, and the magnitudes add up.

What is left above both is doubt. All trials after the change count, also the last one, which no diagnosis has seen. They
are compared by the beginning of the sensors' courses (``RollingMean``) whatever metric the diagnosis used: a whole trial is
chaotic, and there one step of a magnitude may change the distance by as much as another fault does. Where nothing at all is left
of the beginning, though, and no noise is declared, a right hypothesis foretells whole trials to the last digit: a joint that jams
may be driven against its new limits late in a trial, and till then nothing is changed.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from ee_dist.effects.catalogue import Hypothesis, Term, apply
from ee_dist.engines.contract import Rollout
from ee_dist.evaluation.jobs import Evaluator, Job, Whole
from ee_dist.evolution.ga import SCALE
from ee_dist.recovery.diagnosis import Judge
from ee_dist.recovery.kinds import subject_of
from ee_dist.recovery.metrics import Metric
from ee_dist.recovery.subject import Subject
from ee_dist.robots.system import System
from ee_dist.trials.log import SensorLog
from ee_dist.trials.noise import with_noise

DRAWS = 99
"""Of the noise of a whole run: the chance that a right hypothesis leaves more than the largest of them is 1 %."""
EXACT = 1e-9
"""Differences of sensors that are none: sums of floating-point numbers."""

PARTED = 1e-6
"""Differences of sensors from which two courses have parted: those of contact grow from there."""

Trials = Sequence[tuple[Any, SensorLog]]
"""What drove the hardware and what came back, trial by trial."""


@dataclass(frozen=True)
class Doubt:
    """Errors of the metric that judged, means over trials. ``left`` by the hypothesis; ``noise`` and ``rounding``: what a right
    one would leave of each; ``unchanged``: what "nothing changed" leaves; ``later_s``: from when on, in s, a trial whose
    beginning it leaves nothing of goes another way than it says (None: none does, or something was left of the beginning)."""

    left: float
    noise: float
    rounding: float
    unchanged: float
    trials: int
    later_s: float | None = None

    @property
    def allowed(self) -> float:
        """What a right hypothesis would leave at most."""
        return self.noise + self.rounding

    @property
    def said(self) -> bool:
        return not self.left <= self.allowed + EXACT or self.later_s is not None

    def as_dict(self) -> dict[str, Any]:
        """The form of a summary; errors that are not finite, of models that fly apart, are None: JSON has no such numbers."""
        numbers = {k: getattr(self, k) for k in ("left", "allowed", "noise", "rounding", "unchanged")}
        finite = {k: v if math.isfinite(v) else None for k, v in numbers.items()}
        return {"said": self.said, **finite, "trials": self.trials, "later_s": self.later_s}

    @property
    def words(self) -> str:
        """For people: one or two sentences."""
        most = f"a right one would leave at most {self.allowed:.2g}"
        if not self.said:
            left = f"{self.left:.2g}" if self.left > EXACT else "nothing"
            return f"No doubt: the last hypothesis leaves {left} of the sensors' courses unexplained; {most}."
        if self.later_s is not None:
            return (
                "Doubt: the last hypothesis leaves nothing of how trials begin unexplained, and one of them goes another way "
                f"than it says from {self.later_s:.2g} s on. Something shows later that it does not say."
            )
        share = (
            f", {100 * self.left / self.unchanged:.0f} % of what 'nothing changed' leaves"
            if self.unchanged > EXACT
            else ""
        )
        return (
            f"Doubt: the nearest hypothesis leaves an error of {self.left:.2g}{share}; {most}. Something is wrong that it "
            "does not say: no hypothesis can say it, or the search missed the one that can."
        )


def doubt_from(told: Mapping[str, Any]) -> Doubt:
    """A doubt from its form in a summary. Raises KeyError, TypeError where it is another thing."""
    numbers = {
        k: float("inf") if told[k] is None else float(told[k]) for k in ("left", "noise", "rounding", "unchanged")
    }
    return Doubt(**numbers, trials=int(told["trials"]), later_s=told.get("later_s"))


def doubt(
    robot: System,
    hypothesis: Hypothesis,
    intact: Trials,
    changed: Trials,
    metric: Metric,
    evaluator: Evaluator,
    noise: float,
    seed: np.random.SeedSequence,
) -> Doubt:
    """Of ``hypothesis``, by the trials before and after the change. ``noise``: declared standard deviation of the sensors'
    noise, as a share of their ranges; 0 where none is declared."""
    left, unchanged = Judge(robot, changed, metric, evaluator).errors([hypothesis, ()])
    known = Judge(robot, intact, metric, evaluator).errors([()])[0] if intact else 0.0
    model = apply(robot, hypothesis)
    quiet = evaluator.evaluate([Job(Rollout(model, d, metric.steps(len(log))), Whole()) for d, log in changed])
    drivers = [d for d, _ in changed]
    beside = list(zip(drivers, quiet, strict=True))
    lucky = _noise(robot, hypothesis, beside, metric, evaluator, noise, seed) if noise > 0.0 else 0.0
    rounding = _rounding(robot, hypothesis, Judge(robot, beside, metric, evaluator))
    later_s = _parting(model, changed, evaluator) if left <= EXACT and noise == 0.0 else None
    return Doubt(float(left), max(float(known), lucky), rounding, float(unchanged), len(changed), later_s)


def _parting(model: System, changed: Trials, evaluator: Evaluator) -> float | None:
    """When the first trial goes another way than the model says, in s."""
    logs = evaluator.evaluate([Job(Rollout(model, driver, len(log)), Whole()) for driver, log in changed])
    parted = [
        log.times_s[int(np.argmax(differs))]
        for (_, log), foretold in zip(changed, logs, strict=True)
        if (differs := np.any(np.abs(foretold.sensors - log.sensors) > PARTED, axis=1)).any()
    ]
    return float(min(parted)) if parted else None


def _noise(
    robot: System, hypothesis: Hypothesis, quiet: Trials, metric: Metric, evaluator: Evaluator, noise: float,
    seed: np.random.SeedSequence,
) -> float:  # fmt: skip
    """The largest error among draws of the noise, were the hypothesis right. Noise reaches the motors through the controller."""
    noisy = apply(with_noise(robot, noise), hypothesis)
    numbers = iter(seed.generate_state(DRAWS * len(quiet), np.uint64))
    jobs = [
        Job(Rollout(noisy, driver, metric.steps(len(log)), seed=int(next(numbers))), metric.against(log))
        for _ in range(DRAWS)
        for driver, log in quiet
    ]
    errors = np.array(evaluator.evaluate(jobs), dtype=float).reshape(DRAWS, len(quiet)).mean(axis=1)
    return float(errors.max())


def _rounding(robot: System, hypothesis: Hypothesis, judge: Judge) -> float:
    """What a step of each magnitude changes, summed over the magnitudes."""
    subject, total = subject_of(robot), 0.0
    for k, term in enumerate(hypothesis):
        others = [(*hypothesis[:k], t, *hypothesis[k + 1 :]) for t in next_to(term, subject)]
        if others:
            total += float(judge.errors(others).max())
    return total


def next_to(term: Term, subject: Subject) -> list[Term]:
    """The terms that a genome says with the next magnitudes below and above; none of what has no magnitude."""
    for situation in subject.situations:
        if situation.effect != term.effect or not term.values:
            continue
        for much in range(-SCALE, SCALE + 1):
            if situation.term(term.target, much) == term:
                around = [situation.term(term.target, m) for m in (much - 1, much + 1) if abs(m) <= SCALE]
                return [t for t in around if t != term]
    return []


def sayable(hypothesis: Hypothesis, subject: Subject) -> bool:
    """Whether a genome can say it but for the rounding of magnitudes: its effects, each within the magnitudes it has."""
    return all(any(_says(term, s.term(term.target, -SCALE), s.term(term.target, SCALE)) for s in subject.situations)
               for term in hypothesis)  # fmt: skip


def _says(term: Term, least: Term, most: Term) -> bool:
    ends = list(zip(least.values, most.values, term.values, strict=False))
    return least.effect == term.effect and len(least.values) == len(term.values) and all(
        min(low, high) <= value <= max(low, high) for (_, low), (_, high), (_, value) in ends
    )  # fmt: skip
