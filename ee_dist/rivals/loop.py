"""The project's own loop, as task=recover runs it."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.recovery.loop import recover
from ee_dist.recovery.observer import Observer
from ee_dist.rivals.setting import Setting


def loop(setting: Setting) -> Sequence[Hypothesis]:
    s = setting
    return recover(s.robot, s.intact, s.changed, s.metric, s.plan, s.evaluator, s.fresh_seed(), Observer()).hypotheses
