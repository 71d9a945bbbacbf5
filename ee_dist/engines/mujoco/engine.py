"""MuJoCo behind the engine contract: robots of one structure as one batch, stepped on native threads."""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Hashable, Sequence

from ee_dist.basics.cores import usable
from ee_dist.engines.contract import Rollout
from ee_dist.engines.loop import in_batches, up_to
from ee_dist.engines.mujoco.bodies import Group, MuJoCoBodies
from ee_dist.engines.mujoco.model import Model, structure_key
from ee_dist.engines.mujoco.warned import no_file_of_warnings
from ee_dist.engines.per_robot import per_robot
from ee_dist.trials.log import SensorLog

MODELS = 256
"""Compiled structures kept for reuse (some 0.7 MB each, and 15 MB of a robot on a floor, most of which is never touched), beyond
which the longest unused are dropped."""


WORTH_A_THREAD = 32
"""Robots of a batch for each of its threads: these wait for one another in every step, as long as some thirty robots take where
something else is at work on their processors, and a few of them where nothing is."""


class MuJoCoEngine:
    """Implements ``ee_dist.engines.contract.Engine``.

    ``threads`` (at most; default: all cores) changes the speed and no bit of the result; a process a core wants 1. ``least``:
    robots of a batch below which no further thread helps.
    """

    name = "mujoco"

    def __init__(self, threads: int | None = None, largest_batch: int = 256, least: int = WORTH_A_THREAD) -> None:
        self.threads, self.least = threads or usable(), least
        self.largest_batch = largest_batch
        self._models: OrderedDict[Hashable, Model] = OrderedDict()
        no_file_of_warnings()

    def rollout(self, rollouts: Sequence[Rollout]) -> list[SensorLog]:
        return in_batches(rollouts, self._place, up_to(self.largest_batch))

    def close(self) -> None:
        self._models.clear()

    def _place(self, batch: Sequence[Rollout]) -> MuJoCoBodies:
        groups: dict[Hashable, list[int]] = {}
        for i, structure in enumerate(per_robot([r.model for r in batch], structure_key)):
            groups.setdefault(structure, []).append(i)
        placed = []
        for key, rows in groups.items():
            model = self._model(key, batch[rows[0]])
            placed.append((rows, Group(model, [batch[i] for i in rows], self.threads_for(len(rows)))))
        return MuJoCoBodies(placed, batch)

    def threads_for(self, robots: int) -> int:
        """Threads that a batch is worth."""
        return max(1, min(self.threads, robots // self.least))

    def _model(self, key: Hashable, rollout: Rollout) -> Model:
        if key not in self._models:
            self._models[key] = Model(rollout.model)
            while len(self._models) > MODELS:
                self._models.popitem(last=False)
        self._models.move_to_end(key)
        return self._models[key]
