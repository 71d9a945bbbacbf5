"""What improve gives: the steps of the ladder, and the model in the end."""

from __future__ import annotations

from dataclasses import dataclass, field

from ee_dist.discrepancy.calibrated_away import OddOne
from ee_dist.discrepancy.evidence.intervals import ParameterReport
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.evidence.worth import Worth
from ee_dist.discrepancy.examine import Examined
from ee_dist.discrepancy.meters import AtLimit
from ee_dist.discrepancy.search.candidates import Proposal
from ee_dist.effects.catalogue import Hypothesis, Term
from ee_dist.trials.log import Array

UNFITTED = "nothing was fitted"
"""What is held out of a model that is taken as it is."""


@dataclass(eq=False)
class Rung:
    """A step of the ladder: the model with ``added`` (and without ``dropped``). ``held`` (segments,) is the held-out energy,
    ``held_out`` what was held out. ``terms``: the model in which ``added`` came, what is ``dropped`` for it still there;
    ``reached``: the one that the search goes on with, where it is another."""

    name: str
    added: Hypothesis
    terms: Hypothesis
    error_fit: float
    error_heldout: float
    held: Array
    held_out: str
    interval: tuple[float, float] = (0.0, 0.0)
    tied_with: list[str] = field(default_factory=list)
    dropped: tuple[str, ...] = ()
    alternatives: list[tuple[Proposal, Array]] = field(default_factory=list)
    """What was tied with it, and the values that suited then."""
    reached: Hypothesis | None = None

    @property
    def model(self) -> Hypothesis:
        """The model after this step: with what was ``added``, without what was ``dropped``. The errors are of it."""
        return self.terms if self.reached is None else self.reached


@dataclass(frozen=True)
class Twin:
    """What does as well as the effect ``name`` of the model: ``term`` in its place, and ``terms``, the model then."""

    name: str
    term: Term
    terms: Hypothesis


@dataclass(eq=False)
class Improvement:
    """``terms``: the final model, fitted on all data. ``verdict``: ``explained`` (nothing is left above the noise),
    ``better_not_explained``, ``unexplained`` (nothing could be added) or ``nothing_missing``; ``explained``: the share of the
    squared error above the noise that the model takes off what it is ``judged_on``; ``all_rows``: errors before and after on all
    rows of records of which the search took stretches; ``worth``: what goes with each effect. ``last``: what was tried on
    top of it. ``odd``: of a calibration, the joints whose values stand out from those of like joints (see calibrated_away.py).
    ``unsure``: channels in which what is left may be noise or not; ``twins``: what does as well as an effect
    of the model, if other values follow; ``at_limit``: joints that are often at their torque limits with the final model, where
    somebody looked; ``no_farther``: guesses at their bounds, beyond which more room was tried and took off too little."""

    verdict: str
    explained: float
    ladder: list[Rung]
    terms: Hypothesis
    parameters: list[ParameterReport]
    base: Array
    residual: Array
    noise_floor: float
    floor_source: str
    left: list[Leftover]
    stopped: str
    last: Examined | None = None
    odd: list[OddOne] = field(default_factory=list)
    worth: Worth | None = None
    unsure: list[str] = field(default_factory=list)
    twins: list[Twin] = field(default_factory=list)
    judged_on: str = ""
    all_rows: tuple[float, float] | None = None
    at_limit: list[AtLimit] = field(default_factory=list)
    no_farther: frozenset[str] = frozenset()

    @property
    def refused(self) -> list[Judged]:
        """What was tried and earned no place; not what was refused then, and came into the model another way later."""
        here = {t.name for t in self.terms}
        tried = [] if self.last is None else self.last.judged
        return [c for c in tried if not c.earned and not {t.name for t in c.terms} <= here]

    @property
    def cuts(self) -> list[str]:
        """What was held out at the steps that were fitted, each once, in their order."""
        return list(dict.fromkeys(r.held_out for r in self.ladder if r.held_out != UNFITTED))

    def ties(self, step: int) -> list[str]:
        """What the measurements do not tell from the effect that step ``step`` (from 1) of ``effect=auto`` added."""
        return self.ladder[step].tied_with if 1 <= step < len(self.ladder) else []
