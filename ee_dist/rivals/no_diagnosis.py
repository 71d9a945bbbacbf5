"""No diagnosis: evolve again on the model of the intact robot, with the loop's seeds and budget, and try."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.drivers import Network
from ee_dist.recovery.loop import recover
from ee_dist.recovery.observer import Observer
from ee_dist.rivals.setting import Setting
from ee_dist.trials.log import SensorLog


def _nothing(
    trials: Sequence[tuple[Network, SensorLog]], k: int, stream: np.random.SeedSequence
) -> tuple[Hypothesis, float]:
    return (), math.nan


def no_diagnosis(setting: Setting) -> Sequence[Hypothesis]:
    s = setting
    return recover(
        s.robot, s.intact, s.changed, s.metric, s.plan, s.evaluator, s.fresh_seed(), Observer(), diagnosis=_nothing
    ).hypotheses
