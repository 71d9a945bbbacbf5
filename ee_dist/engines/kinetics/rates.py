"""How fast levels change, and a step of the classical Runge-Kutta method, for many networks of one structure.

Compiled like every function over a batch (see compiled.py): each row is computed by itself, so that it does not depend on
the others. Steps of ten minutes follow half-lives of twenty to forty minutes to within 1e-4 of the full level; the tests
hold them against scipy's solvers.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ee_dist.engines.compiled import compiled
from ee_dist.engines.kinetics.tables import Index
from ee_dist.trials.log import Array

Bools = NDArray[np.bool_]


@compiled
def derivative(
    levels: Array,
    shift: Array,
    rates: Array,
    links: Array,
    states: Array,
    first_module: Index,
    first_link: Index,
    first_deactivator: Index,
    regulator: Index,
    complexes: Bools,
    first_state: Index,
    active: Array,
    out: Array,
) -> None:
    """Into ``out`` (2, G) the rates of change of ``levels`` (2, G), messengers then proteins, per minute.

    ``shift`` (G,) is added to the basal activations; ``active`` (Q,) is room for the modules' activities.
    """
    for q in range(len(complexes)):
        bound, all_bound, partition = 1.0, 1.0, 1.0
        for k in range(first_link[q], first_link[q + 1]):
            occupied = (max(levels[1, regulator[k]], 0.0) / links[k, 0]) ** links[k, 1]
            all_bound *= occupied
            partition *= 1.0 + occupied
            if k < first_deactivator[q]:
                bound *= occupied
        if complexes[q]:
            partition = 1.0 + bound
            if first_deactivator[q] < first_link[q + 1]:
                partition += all_bound
        active[q] = bound / partition
    for g in range(len(first_state) - 1):
        begin = first_state[g]
        # A shift that would take the basal activation out of [0, 1] is cut to it, and so is each state's activation.
        moved = min(max(states[begin] + shift[g], 0.0), 1.0) - states[begin]
        made = 0.0
        for s in range(first_state[g + 1] - begin):
            likely = 1.0
            for m in range(first_module[g + 1] - first_module[g]):
                share = active[first_module[g] + m]
                likely *= share if (s >> m) & 1 else 1.0 - share
            made += likely * min(max(states[begin + s] + moved, 0.0), 1.0)
        out[0, g] = rates[g, 0] * made - rates[g, 1] * levels[0, g]
        out[1, g] = rates[g, 2] * levels[0, g] - rates[g, 3] * levels[1, g]


@compiled
def advance(
    levels: Array,
    shift: Array,
    rates: Array,
    links: Array,
    states: Array,
    first_module: Index,
    first_link: Index,
    first_deactivator: Index,
    regulator: Index,
    complexes: Bools,
    first_state: Index,
    step_min: float,
    steps: int,
) -> None:
    """Advance ``levels`` (B, 2, G) in place by ``steps`` steps of ``step_min`` minutes under shifts (B, G) that stay."""
    count, kinds, genes = levels.shape
    active = np.empty(len(complexes))
    slope = np.empty((4, kinds, genes))
    trial = np.empty((kinds, genes))
    for r in range(count):
        for _ in range(steps):
            for stage in range(4):
                ahead = 0.0 if stage == 0 else step_min if stage == 3 else step_min / 2
                for i in range(kinds):
                    for g in range(genes):
                        trial[i, g] = levels[r, i, g]
                        if stage:
                            trial[i, g] += ahead * slope[stage - 1, i, g]
                derivative(
                    trial, shift[r], rates[r], links[r], states[r], first_module, first_link, first_deactivator,
                    regulator, complexes, first_state, active, slope[stage],
                )  # fmt: skip
            for i in range(kinds):
                for g in range(genes):
                    total = slope[0, i, g] + 2.0 * slope[1, i, g] + 2.0 * slope[2, i, g] + slope[3, i, g]
                    levels[r, i, g] += step_min / 6.0 * total
