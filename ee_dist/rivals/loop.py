"""The project's own loop, as task=recover runs it; other rivals are this with another diagnosis."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.recovery.loop import Diagnosis, recover
from ee_dist.recovery.observer import Observer
from ee_dist.rivals.setting import Setting


def loop(setting: Setting, diagnosis: Diagnosis | None = None) -> Sequence[Hypothesis]:
    """``diagnosis`` takes the place of the evolution of hypotheses."""
    s = setting
    seed, observer = s.fresh_seed(), Observer()
    found = recover(s.robot, s.intact, s.changed, s.metric, s.plan, s.evaluator, seed, observer, diagnosis=diagnosis)
    return found.hypotheses
