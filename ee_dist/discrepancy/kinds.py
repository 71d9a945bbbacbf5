"""A model with many small effects as steps of a ladder, one a kind of effect: how far each of them comes is only to be shown."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.evidence.holdout import AWAY, PRIOR, Cut, cross_fit, held_by_slopes
from ee_dist.discrepancy.evidence.rule import least_energy
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.ladder import Rung
from ee_dist.discrepancy.problem import Problem, error, per_segment
from ee_dist.discrepancy.pruning import AGAIN, without_these
from ee_dist.discrepancy.search.candidates import Candidate, Proposal
from ee_dist.discrepancy.search.fit import fit_all
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import NEAR
from ee_dist.discrepancy.search.slopes import WIDTHS as SLOPES
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.trials.log import Array

STEPS = 4
"""Steps by which they come into the ladder at most: kinds that matter less come with the last."""


@dataclass(frozen=True, eq=False)
class Everywhere:
    """The model with all that earned its place, the steps that lead there, one a kind of effect, and its energy on held-out
    data."""

    current: Current
    rungs: list[Rung]
    held: float


@dataclass(frozen=True, eq=False)
class Kept:
    """A model that is worth its terms. ``held``: its energy on held-out data, under the cut that is the hardest for it;
    ``ties``: by one of its effects the fits that end with another that is as good; ``fitted``: energy that was left of what is
    fitted before any term left."""

    model: Current
    held: float
    cut: Cut
    ties: Mapping[str, Sequence[Fit]]
    fitted: float = np.inf


@dataclass(frozen=True, eq=False)
class Steps:
    """On top of the ``current`` model, whose first ``own`` parts stay. ``cuts``: what is held out, each with the held-out
    residual (n,) of the current model; ``calm``: the search on predictable trials; ``tried``: how many effects were to choose
    from."""

    search: Search
    calm: Search
    own: int
    current: Current
    cuts: tuple[tuple[Cut, Array], ...]
    tried: int

    def of(self, found: Kept) -> Everywhere:
        """One step a kind of effect, those that matter most first; kinds that help only together, or are better than the model
        before only together, are one step."""
        search, problem, kept, own = self.search, self.search.problem, found.model, self.own
        places = Model(kept.parts).places
        names = {c.name for c in self.current.parts}
        stay = {p.name for p in kept.parts}
        gone = tuple(c.name for c in self.current.parts[own:] if c.name not in stay)
        # What the ladder has already is not shown as a step again.
        chosen = [k for k, c in enumerate(kept.parts) if k < own or c.name in names]
        shown, energy = set(chosen), next(float(r @ r) for cut, r in self.cuts if cut is found.cut)
        rungs: list[Rung] = []
        order, taken = self._order(kept), []
        for kind in order:
            chosen = sorted({*chosen, *(k for k, c in enumerate(kept.parts) if c.effect.name == kind)})
            taken.append(chosen)
        # Each is fitted anew in every turn, for nothing but to be shown.
        taken = [*taken[: STEPS - 1], *taken[-1:]] if len(taken) > STEPS else taken
        starts = [(Model(tuple(kept.parts[k] for k in some)), values_at(kept.u, places, some)) for some in taken]
        # Shown is how far each step comes, and most have many values. Where slopes that are known lead nowhere values that have
        # seen all data would be told as held out, so that far from the noise each turn is fitted anew.
        begun, left = self._better_starts(kept, starts, taken)
        if left > NEAR * float(problem.floor.sum()):
            fitted = cross_fit(search, begun, found.cut, short=AWAY)
        else:
            fitted = held_by_slopes(search, fit_all(search, begun, None, SLOPES[2:], PRIOR), found.cut)
        energies = [held.energy for held in fitted]
        last, model, held_energy = self._as_far(found, starts, energies)
        for k in range(last + 1):
            chosen, (part_of_it, start), held = taken[k], starts[k], fitted[k]
            if energies[k] >= energy and k != last:
                continue
            mine = [m for m in chosen if m not in shown]
            ties = [(kept.parts[m].name, f) for m in mine for f in found.ties.get(kept.parts[m].name, ())]
            news = [kept.parts[m] for m in mine]
            terms = part_of_it.hypothesis(start)
            rungs.append(
                Rung(
                    _label(news),
                    tuple(t for m, t in zip(chosen, terms, strict=True) if m in mine),
                    (*search.fixed, *terms),
                    float(np.sqrt(held.seen)),
                    error(held.residual),
                    per_segment(problem, held.residual),
                    found.cut.name,
                    tied_with=[f.model.parts[-1].name for _, f in ties],
                    dropped=() if rungs else gone,
                    # Of a step of one effect the search goes by them; these it has compared here already.
                    alternatives=[_instead(news, name, f) for name, f in ties] if len(mine) > 1 else [],
                )
            )
            shown, energy = set(chosen), energies[k]
        return Everywhere(model, rungs, held_energy)

    def _better_starts(
        self, kept: Current, starts: Sequence[tuple[Model, Array]], taken: Sequence[Sequence[int]]
    ) -> tuple[list[tuple[Model, Array]], float]:
        """Parts of a model (those ``taken``), each with the values that these have in all of it, or with what the others were
        making up for, as far as slopes tell, whichever leaves less; and what the last of them leaves."""
        search, count = self.search, len(kept.parts)
        both = [*starts]
        if len(starts) > 1:
            (whole,) = follow_valley(search, [(Model(kept.parts), kept.u)], search.everything, PRIOR, 1, (AGAIN,))
            foretold = [without_these(whole, [k for k in range(count) if k not in some]) for some in taken]
            both += [(f.model, f.u) for f in foretold]
        rows = search.residuals([model.hypothesis(u) for model, u in both])
        left = [float(r @ r) if np.isfinite(r).all() else np.inf for r in rows]
        best = [min(range(k, len(both), len(starts)), key=lambda i: left[i]) for k in range(len(starts))]
        return [both[i] for i in best], left[best[-1]]

    def _as_far(
        self, found: Kept, starts: Sequence[tuple[Model, Array]], energies: Sequence[float]
    ) -> tuple[int, Current, float]:
        """The last of the steps to take, the model there, and its held-out energy: all of them, unless those beyond another make
        what is held out worse by more than luck."""
        last, best = len(starts) - 1, int(np.argmin(energies))
        if energies[last] <= energies[best] + luck(self.search.problem, self.tried, energies[best]):
            return last, found.model, found.held
        (fit,) = follow_valley(self.calm, [starts[best]], self.calm.everything, PRIOR, widths=(AGAIN,))
        return best, Current(fit.model.parts, fit.u), energies[best]

    def _order(self, kept: Current) -> list[str]:
        """Kinds of effect that are new, by what the model would lose without them."""
        names, places = {c.name for c in self.current.parts}, Model(kept.parts).places
        new = [k for k, c in enumerate(kept.parts) if k >= self.own and c.name not in names]
        kinds = list(dict.fromkeys(kept.parts[k].effect.name for k in new))
        rests = [[k for k, c in enumerate(kept.parts) if k not in new or c.effect.name != kind] for kind in kinds]
        rows = self.search.residuals(
            [Model(tuple(kept.parts[k] for k in rest)).hypothesis(values_at(kept.u, places, rest)) for rest in rests]
        )
        costs = [float(r @ r) if np.isfinite(r).all() else np.inf for r in rows]
        return [kinds[i] for i in np.argsort(costs, kind="stable")[::-1]]


def luck(problem: Problem, tried: int, energy: float) -> float:
    """By how much held-out energy of about this size may differ for no reason, the best of so many that were ``tried``."""
    return least_energy(tried) * max(float(problem.floor.mean()), energy / len(problem.floor))


def _instead(news: Sequence[Candidate], gone: str, other: Fit) -> tuple[Proposal, Array]:
    """What comes with a step, with the last effect of the ``other`` fit in the place of the one that is ``gone``, called by that
    effect as ties are; and the values that suited."""
    parts, stay = other.model.parts, {c.name for c in news} - {gone}
    chosen = [k for k, c in enumerate(parts) if c.name in stay or k == len(parts) - 1]
    return Proposal(tuple(parts[k] for k in chosen), parts[-1].name), values_at(other.u, other.model.places, chosen)


def _label(parts: Sequence[Candidate]) -> str:
    """Names of effects, those at several places as ``effect@each of 3 joints``."""
    names = []
    for kind in dict.fromkeys(c.effect.name for c in parts):
        mine = [c for c in parts if c.effect.name == kind]
        where = "parts" if mine[0].effect.family == "body" else "joints"
        names.append(mine[0].name if len(mine) == 1 else f"{kind}@each of {len(mine)} {where}")
    return " + ".join(names)


def values_at(u: Array, places: Sequence[slice], chosen: Sequence[int]) -> Array:
    """Those of the values (P,) of a model that some of its parts have."""
    return np.concatenate([*(u[places[k]] for k in chosen), np.zeros(0)])
