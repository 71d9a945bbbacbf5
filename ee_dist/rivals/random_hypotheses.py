"""Random hypotheses: each pass the best of a few drawn genomes, without any evolution of the diagnosis.

They are drawn as the first population of a diagnosis pass is. The rest is the loop's.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.effects.catalogue import Hypothesis
from ee_dist.engines.drivers import Network
from ee_dist.recovery.diagnosis import Judge
from ee_dist.recovery.genome import first_hypotheses
from ee_dist.rivals.loop import loop
from ee_dist.rivals.setting import Setting
from ee_dist.trials.log import SensorLog

DRAWN = 1
"""As few as one: a guess."""


def random_hypotheses(setting: Setting, drawn: int = DRAWN) -> Sequence[Hypothesis]:
    s = setting

    def guess(
        trials: Sequence[tuple[Network, SensorLog]], k: int, stream: np.random.SeedSequence
    ) -> tuple[Hypothesis, float]:
        judge = Judge(s.robot, trials, s.metric, s.evaluator)
        said = [judge.hypothesis(g) for g in first_hypotheses(drawn, np.random.default_rng(stream))]
        errors = judge.errors(said)
        best = int(np.argmin(errors))
        return said[best], float(errors[best])

    return loop(s, guess)
