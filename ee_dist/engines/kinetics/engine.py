"""Gene networks behind the engine contract: ordinary differential equations of a batch of networks, one step after another.

Controllers and sensors are the code that robots have; only what lies between a command and a level is written here.
"""

from __future__ import annotations

import math
from collections import OrderedDict
from collections.abc import Hashable, Sequence

import numpy as np

from ee_dist.engines.contract import EngineError, Rollout
from ee_dist.engines.drivers import Controllers
from ee_dist.engines.kinetics.rates import advance
from ee_dist.engines.kinetics.tables import numbers_of, structure_key, structure_of
from ee_dist.engines.loop import by_shape, log_of, up_to
from ee_dist.engines.sensing import SensingPath
from ee_dist.networks.model import GeneNetwork
from ee_dist.trials.log import Array, SensorLog

LONGEST_STEP_S = 600.0
"""Of the integration; a step from one reading to the next is divided into equal ones."""
SETTLED_S = 200_000.0
"""Two days and more without stimulus, some sixty half-lives: how a network stands before a trial."""
RESTS = 4096
"""Networks whose rest is kept, beyond which the longest unused are dropped."""


class KineticsEngine:
    """Implements ``ee_dist.engines.contract.Engine`` for ``GeneNetwork``.

    A trial begins where the network, as it is, comes to rest without stimulus, from all genes at full level.
    """

    name = "kinetics"

    def __init__(self, largest_batch: int = 256) -> None:
        self.largest_batch = largest_batch
        self._rests: OrderedDict[str, Array] = OrderedDict()

    def rollout(self, rollouts: Sequence[Rollout]) -> list[SensorLog]:
        """Logs in the order asked. Raises EngineError for what is no gene network, and for what drives only bodies."""
        return by_shape(rollouts, _shape_of, up_to(self.largest_batch), self._run)

    def close(self) -> None:
        self._rests.clear()

    def _run(self, rollouts: Sequence[Rollout]) -> list[SensorLog]:
        networks: list[GeneNetwork] = [r.model for r in rollouts]
        first, steps = networks[0], rollouts[0].steps
        batch = _Batch(networks, self._rest(networks))
        scale = np.zeros(len(first.drives)), np.array([d.strongest for d in first.drives])
        control = Controllers(networks, [r.driver for r in rollouts], [scale] * len(networks), steps)
        sensing = SensingPath(networks, first.time_step_s, steps, [r.seed for r in rollouts])
        seen = [first.gene_names.index(s.target) for s in first.sensors]
        sensors = np.empty((steps, len(networks), len(first.sensors)))
        commands = np.empty((steps, len(networks), len(first.drives)))
        for step in range(steps):
            reported = sensing.step(step, batch.levels[:, 0, seen])
            command = control.step(step, step * first.time_step_s, reported)
            sensors[step], commands[step] = reported, command
            if step < steps - 1:
                batch.step(command, first.time_step_s)
        return [log_of(first, sensors[:, i], commands[:, i]) for i in range(len(networks))]

    def _rest(self, networks: Sequence[GeneNetwork]) -> Array:
        """Levels (B, 2, G) at which the networks stand without stimulus."""
        fresh = {n.digest: n for n in networks if n.digest not in self._rests}
        if fresh:
            some = list(fresh.values())
            batch = _Batch(some, np.ones((len(some), 2, len(some[0].genes))))
            batch.step(np.zeros((len(some), len(some[0].drives))), SETTLED_S)
            self._rests.update(zip(fresh, batch.levels, strict=True))
        found = np.empty((len(networks), 2, len(networks[0].genes)))
        for i, n in enumerate(networks):
            found[i] = self._rests[n.digest]
            self._rests.move_to_end(n.digest)
        while len(self._rests) > RESTS:
            self._rests.popitem(last=False)
        return found


class _Batch:
    """Networks of one structure and their levels (B, 2, G)."""

    def __init__(self, networks: Sequence[GeneNetwork], levels: Array) -> None:
        self.structure = structure_of(networks[0])
        known = {id(n): numbers_of(n) for n in networks}
        self.rates, self.links, self.states = (
            np.ascontiguousarray(np.stack([known[id(n)][k] for n in networks])) for k in range(3)
        )
        self.levels = levels
        self.shift = np.zeros((len(networks), len(networks[0].genes)))

    def step(self, command: Array, seconds: float) -> None:
        """Advance by a time under commands (B, M) that stay."""
        s, count = self.structure, math.ceil(seconds / LONGEST_STEP_S)
        self.shift[:] = 0.0
        for m, gene in enumerate(s.stimulated):
            self.shift[:, gene] += command[:, m]
        advance(
            self.levels, self.shift, self.rates, self.links, self.states, s.first_module, s.first_link,
            s.first_deactivator, s.regulator, s.complex, s.first_state, seconds / 60.0 / count, count,
        )  # fmt: skip


def _shape_of(rollout: Rollout) -> Hashable:
    """Rollouts of one shape can share a batch."""
    model = rollout.model
    if not isinstance(model, GeneNetwork):
        raise EngineError(
            f"kinetics simulates gene networks; {model.name} is a robot: engine=pybullet or engine=mujoco"
        )
    if any(
        a is not None
        for a in (rollout.start, rollout.supply_v, rollout.enabled, rollout.external, rollout.again or None)
    ):
        raise EngineError(f"kinetics: {model.name} is driven by its stimuli alone, from its own rest")
    sensors = tuple((s.kind, s.target) for s in model.sensors)
    return structure_key(model), tuple(d.strongest for d in model.drives), sensors, model.time_step_s, rollout.steps
