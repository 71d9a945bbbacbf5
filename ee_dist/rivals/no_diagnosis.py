"""No diagnosis: evolve again on the model of the intact robot, with the loop's seeds and budget, and try."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.drivers import Network
from ee_dist.rivals.loop import loop
from ee_dist.rivals.setting import Setting
from ee_dist.trials.log import SensorLog


def _nothing(
    trials: Sequence[tuple[Network, SensorLog]], k: int, stream: np.random.SeedSequence
) -> tuple[Hypothesis, float]:
    return (), math.nan


def no_diagnosis(setting: Setting) -> Sequence[Hypothesis]:
    return loop(setting, _nothing)
