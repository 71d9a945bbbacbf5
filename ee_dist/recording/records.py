"""What a run leaves behind, as objects: the writer stores them, the reader gives them back, viewers show them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.drivers import Commands, Network
from ee_dist.trials.log import SensorLog

HARDWARE, PREDICTION, HINDSIGHT = "hardware", "prediction", "hindsight"
"""Where a trial was: on hardware; on the model that its controller was chosen on, before it; on the model that was found
from it, afterwards."""
REPAIR, DIAGNOSIS, MAP = "repair", "diagnosis", "map"
"""Passes: repair, diagnosis, and, where a map of the intact system is made, that."""
EVOLVING, EVOLVED, POLISHED, PRUNED = "evolving", "evolved", "polished", "pruned"
"""How far a hypothesis has come: best of a generation, one of the last population, after its last step to a better
neighbour, after terms that explain nothing were dropped."""
STAGES = (EVOLVING, EVOLVED, POLISHED, PRUNED)


@dataclass(frozen=True, eq=False)
class TrialRecord:
    """One run of a controller: on hardware, or what a model said about the hardware trial of the same index.

    A PREDICTION was made before the trial, by the model that the controller was chosen on; HINDSIGHT is the trial on the
    model of the diagnosis that followed it. ``name`` is for people ("intact", "after the change", "trial 1").
    ``believed`` is the hypothesis behind a prediction or hindsight. ``not_recorded``: sensors that nobody recorded in it; the log
    holds where they are taken to have stood.
    """

    index: int
    name: str
    source: str
    driver: Network | Commands
    log: SensorLog
    believed: Hypothesis = ()
    not_recorded: tuple[str, ...] = ()


@dataclass(frozen=True)
class HypothesisRecord:
    """A hypothesis with its error (lower is better).

    ``rank`` 0 is the best of its generation. ``stage`` is one of STAGES. ``final`` marks the one of each pass that the
    loop believed and acted on; the others were on the way to it.
    """

    pass_index: int
    generation: int
    rank: int
    terms: Hypothesis
    error: float
    final: bool = False
    stage: str = EVOLVING


@dataclass(frozen=True)
class GenerationRecord:
    """One generation of a repair pass or of the map (best: fitness, m, higher is better) or a diagnosis pass (error, lower)."""

    phase: str
    pass_index: int
    generation: int
    best: float
    mean: float
    dominants: int
    asked: int
    simulated: int


@dataclass
class RunRecord:
    """A whole run. ``metadata`` holds short strings (task, version, seed, digests), ``attachments`` files by name.

    ``robot`` is a Robot, or another system of those in ``forms.py``.
    """

    robot: Any
    metadata: dict[str, str] = field(default_factory=dict)
    attachments: dict[str, bytes] = field(default_factory=dict)
    trials: list[TrialRecord] = field(default_factory=list)
    hypotheses: list[HypothesisRecord] = field(default_factory=list)
    generations: list[GenerationRecord] = field(default_factory=list)
    complete: bool = False
