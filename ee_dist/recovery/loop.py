"""The estimation-exploration loop: repair, try, diagnose, repair on the corrected model, try again.

It sees hardware through ``trial`` alone. What is wrong with the hardware it must find out.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network
from ee_dist.evaluation.jobs import Counts, Evaluator, Job, Whole
from ee_dist.evolution.ga import Budget, Genomes
from ee_dist.recording.records import HARDWARE, HINDSIGHT, PREDICTION, TrialRecord
from ee_dist.recovery.diagnosis import Judge, believe
from ee_dist.recovery.kinds import subject_of
from ee_dist.recovery.metrics import Metric
from ee_dist.recovery.observer import Observer
from ee_dist.recovery.repair import repair
from ee_dist.recovery.repertoire import Repertoire
from ee_dist.robots.system import System
from ee_dist.trials.hardware import Hardware
from ee_dist.trials.log import SensorLog


@dataclass(frozen=True)
class Plan:
    """The budget of a run; the defaults are the paper's."""

    repair: Budget = Budget()
    diagnosis: Budget = Budget()
    compensating_trials: int = 4
    steps: int = 1000
    parsimony: float = 0.1
    """Share of the error that a term of a hypothesis must account for to be believed; the paper has no such rule (0)."""
    polish: int = 8
    """How many steps to a better neighbour the evolved hypothesis may take; the paper has no such step (0)."""
    restarts: int = 3
    """How many passes after the change start from the intact robot's controller instead of all controllers so far. A pass
    keeps the kind of gait that it started with: restarts try several. The last pass starts from all in any case."""
    related: float = 1.0
    """Share of a repair pass's first population that descends from the database; with 0 only the database itself does."""

    def __post_init__(self) -> None:
        if self.compensating_trials < 1:
            raise ValueError("plan: compensating_trials must be 1 or more")
        if self.steps < 2:
            raise ValueError("plan: steps must be 2 or more")
        if not 0.0 <= self.parsimony < 1.0:
            raise ValueError(f"plan: parsimony must be from 0 to below 1, not {self.parsimony}")
        if self.polish < 0:
            raise ValueError(f"plan: polish must be 0 or more, not {self.polish}")
        if self.restarts < 0:
            raise ValueError(f"plan: restarts must be 0 or more, not {self.restarts}")
        if not 0.0 <= self.related <= 1.0:
            raise ValueError(f"plan: related must be from 0 to 1, not {self.related}")


Diagnosis = Callable[[Sequence[tuple[Network, SensorLog]], int, np.random.SeedSequence], tuple[Hypothesis, float]]
"""From all trials since the change, the number of the pass and its seed: the hypothesis to act on, and its error."""


@dataclass
class Recovery:
    """What a run found. ``intact``, ``after`` and each of ``trials`` (the compensating ones) say how well the hardware did, as
    does ``expected`` of the model that each controller was chosen on: values of the function, for a robot its distance in m."""

    intact: float = float("nan")
    after: float = float("nan")
    trials: list[float] = field(default_factory=list)
    expected: list[float] = field(default_factory=list)
    hypotheses: list[Hypothesis] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    controllers: list[Network] = field(default_factory=list)
    before_change: Counts = field(default_factory=Counts)
    """What was simulated before the change."""


def recover(
    robot: System,
    intact: Hardware,
    changed: Hardware,
    metric: Metric,
    plan: Plan,
    evaluator: Evaluator,
    seed: np.random.SeedSequence,
    observer: Observer,
    repertoire: Repertoire | None = None,
    diagnosis: Diagnosis | None = None,
) -> Recovery:
    """Run the loop. ``intact`` is the hardware before the change, ``changed`` the same robot after it.

    ``repertoire`` takes the place of the paper's repair passes after the change, ``diagnosis`` that of the evolution of
    hypotheses. Seeds: one for each repair pass, then one for each diagnosis pass, spawned from ``seed``.
    """
    passes = plan.compensating_trials
    streams = seed.spawn(2 * passes + 1)
    repair_seeds, diagnosis_seeds = streams[: passes + 1], streams[passes + 1 :]
    result, subject = Recovery(), subject_of(robot)

    best, expected = repair(robot, [], evaluator, plan.repair, plan.steps, repair_seeds[0], observer, 0)
    controllers: list[Network] = [best]
    result.expected.append(expected)
    if repertoire is not None:
        repertoire.prepare(robot, best, evaluator, plan.repair, plan.steps, repair_seeds[0], observer)

    def say(index: int, name: str, source: str, driver: Network, hypothesis: Hypothesis) -> None:
        """Record what the model under this hypothesis does in the trial of that index."""
        rollout = Rollout(apply(robot, hypothesis), driver, plan.steps, pose=True)
        (said,) = evaluator.evaluate([Job(rollout, Whole())])
        observer.trial(TrialRecord(index, name, source, driver, said, hypothesis))

    say(0, "intact", PREDICTION, best, ())
    log = intact.trial(best, plan.steps)
    result.intact = subject.value(log)
    observer.trial(TrialRecord(0, "intact", HARDWARE, best, log))

    result.before_change = evaluator.counts.copy()
    say(1, "after the change", PREDICTION, best, ())
    log = changed.trial(best, plan.steps)
    result.after = subject.value(log)
    observer.trial(TrialRecord(1, "after the change", HARDWARE, best, log))
    trials: list[tuple[Network, SensorLog]] = [(best, log)]
    believed: list[Genomes] = []

    def evolved(
        trials: Sequence[tuple[Network, SensorLog]], k: int, stream: np.random.SeedSequence
    ) -> tuple[Hypothesis, float]:
        judge = Judge(robot, trials, metric, evaluator)
        belief = believe(judge, believed, plan.diagnosis, plan.polish, plan.parsimony, stream, observer, k)
        believed.append(belief.genome)
        return belief.hypothesis, belief.error

    for k in range(passes):
        hypothesis, error = (diagnosis or evolved)(trials, k, diagnosis_seeds[k])
        result.hypotheses.append(hypothesis)
        result.errors.append(error)
        name = "after the change" if k == 0 else f"trial {k}"
        say(k + 1, name, HINDSIGHT, trials[-1][0], hypothesis)

        model = apply(robot, hypothesis)
        known = controllers if k >= min(plan.restarts, passes - 1) else controllers[:1]
        way = (evaluator, plan.repair, plan.steps, repair_seeds[k + 1], observer, k + 1)
        if repertoire is None:
            best, expected = repair(model, known, *way, plan.related)
        else:
            best, expected = repertoire.repair(model, controllers, *way)
        controllers.append(best)
        result.expected.append(expected)
        say(k + 2, f"trial {k + 1}", PREDICTION, best, hypothesis)
        log = changed.trial(best, plan.steps)
        result.trials.append(subject.value(log))
        observer.trial(TrialRecord(k + 2, f"trial {k + 1}", HARDWARE, best, log))
        trials.append((best, log))
    result.controllers = controllers
    return result
