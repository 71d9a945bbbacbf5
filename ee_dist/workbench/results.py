"""What the long verbs found, small enough to travel between processes and to keep: the typed results of the tasks in brief."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ee_dist.discrepancy.evidence.intervals import ParameterReport
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.workbench.bench import Step

REFUSED = "not"


@dataclass(frozen=True)
class Ranked:
    """One proposal as it was judged. ``fixed`` and ``terms``: the model with it; ``explained`` and ``interval`` are shares of
    what is above the noise, on held-out data."""

    name: str
    words: str
    terms: Hypothesis
    model: Hypothesis
    error_heldout: float
    explained: float
    interval: tuple[float, float]
    kind: str
    why_not: str
    sure: str
    physics: str
    signature: str


@dataclass(frozen=True)
class Explained:
    """What task=explain found. ``before``: the model that it refers to, its own values fitted anew."""

    headline: str
    lines: tuple[str, ...]
    verdict: str
    candidates: tuple[Ranked, ...]
    before: Hypothesis
    tried: int
    folder: Path


@dataclass(frozen=True)
class Improved:
    """What task=improve found: the model, the interval of each value, and the steps of the ladder after the first."""

    headline: str
    lines: tuple[str, ...]
    terms: Hypothesis
    parameters: tuple[ParameterReport, ...]
    steps: tuple[Step, ...]
    folder: Path


@dataclass(frozen=True)
class Compared:
    """What task=compare says of a saved model. ``starts_s``: of each trial, on the ``timeline`` of its recording in 3-D."""

    error: float
    noise_floor: float
    told: str
    headline: str
    folder: Path
    starts_s: tuple[float, ...]
    timeline: str
