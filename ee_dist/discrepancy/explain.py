"""explain: which missing effect accounts for the residual. Screen all, fit the promising, judge on held-out data."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ee_dist.discrepancy.candidates import Candidate
from ee_dist.discrepancy.fit import WIDTHS, Fit, Model, fit_all
from ee_dist.discrepancy.folds import halves
from ee_dist.discrepancy.judge import Judged, judge, least_energy, ranked
from ee_dist.discrepancy.misfit import Leftover, leftovers
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.scan import Scanned, scan
from ee_dist.discrepancy.screen import Progress, Screened, quiet, screen
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.trials.log import Array

CALM = 0.8
"""Share of the most predictable trial's trust from which a trial counts as calm."""
EFFECT, NOTHING_MISSING, UNEXPLAINED = "effect", "nothing_missing", "unexplained"


@dataclass(frozen=True)
class Effort:
    """How much is tried. ``shares``: sizes of the probes; ``first``: candidates that are scanned over their range;
    ``second``: those of them that get a quick fit, from ``starts`` points each; ``final``: those fitted out and judged."""

    shares: tuple[float, ...] = (0.1, 0.6)
    first: int = 20
    second: int = 9
    starts: int = 2
    final: int = 6


STANDARD_EFFORT = Effort()


@dataclass(eq=False)
class Explanation:
    """The outcome. ``candidates`` are ranked; ``left`` is what the best (or the model as it is) leaves unexplained."""

    verdict: str
    baseline_error: float
    noise_floor: float
    floor_source: str
    candidates: list[Judged]
    screened: list[Screened]
    left: list[Leftover]
    base: Array
    before: Hypothesis = ()
    tried: int = 0
    notes: list[str] = field(default_factory=list)

    @property
    def best(self) -> Judged | None:
        return self.candidates[0] if self.candidates and self.candidates[0].earned else None

    @property
    def tied(self) -> list[Judged]:
        """The best and all that are tied with it."""
        best = self.best
        return [] if best is None else [best, *(c for c in self.candidates if c.name in best.tied_with)]


def explain(
    problem: Problem,
    pool: Sequence[Candidate],
    before: Hypothesis = (),
    effort: Effort = STANDARD_EFFORT,
    progress: Progress = quiet,
) -> Explanation:
    """Search ``pool`` for what explains the residual that the model with ``before`` leaves."""
    base = problem.residuals([before])[0]
    if not np.isfinite(base).all():
        raise ValueError("the model cannot be simulated on these commands: its motion leaves the finite numbers")
    floor, source = problem.noise_floor()
    calm = calm_trials(problem, base)
    screened = screen(problem, pool, before, effort.shares, busiest(problem, base, calm), progress=progress)
    least = least_energy(len(pool))
    promising = sorted((s for s in screened if s.promise > 0.5 * least), key=lambda s: -s.promise)[: effort.first]
    half = halves(problem)
    scanned = sorted(scan(problem, promising, before, calm, progress=progress), key=lambda s: s.energy)[: effort.second]
    quick = _fit(problem, scanned, before, effort.starts, calm, progress)
    order = sorted(range(len(quick)), key=lambda i: quick[i].energy)[: effort.final]
    judged = fit_out(problem, [(quick[i].model, quick[i].u) for i in order], base, before, half, len(pool), progress)
    found = ranked(judged)
    best = found[0] if found and found[0].earned else None
    left = leftovers(problem, base if best is None else best.residual)
    verdict = EFFECT if best is not None else (UNEXPLAINED if left else NOTHING_MISSING)
    return Explanation(verdict, error(base), floor, source, found, screened, left, base, before, len(pool))


def gained_untouched(found: Explanation) -> float:
    """Energy that the most promising effect takes off held-out data of an untouched robot: none of it is its own."""
    energies = [c.gain * float(np.sum(found.base**2)) for c in found.candidates]
    return max([0.0, *(e for e in energies if np.isfinite(e))])


def calm_trials(problem: Problem, base: Array) -> list[int]:
    """Trials to search on: those that can be predicted, where the residual follows a parameter smoothly. One trial in
    which a controller was in the loop is always among them: only there does wiring show. All, where the calm ones have
    nothing to explain, or the problem does not say which are calm."""
    count = len(problem.trials)
    trust = getattr(problem, "trust", None)
    if trust is None:
        return list(range(count))
    chosen = [k for k in range(count) if trust[k] >= CALM * max(trust)]
    looped = getattr(problem, "looped", ())
    if looped and not set(looped) & set(chosen):
        chosen.append(looped[0])
    own = np.isin(problem.trial_of_segment[problem.segment_of], chosen)
    excess = float((base[own] ** 2 - problem.floor[own]).sum())
    if excess < 6.0 * float(np.sqrt(2.0 * problem.floor[own].sum())):
        return list(range(count))
    return sorted(chosen)


def busiest(problem: Problem, base: Array, among: Sequence[int], share: float = 0.5) -> list[int]:
    """Of some trials those with most to explain for their length, up to a share of all their values; a trial with a
    controller in the loop is always among them."""
    own = [problem.trial_of_segment[problem.segment_of] == k for k in range(len(problem.trials))]
    size = np.array([float(m.sum()) for m in own])
    excess = np.array([float((base[m] ** 2 - problem.floor[m]).sum()) for m in own])
    chosen: list[int] = []
    for k in sorted(among, key=lambda k: -excess[k] / max(size[k], 1.0)):
        if not chosen or size[chosen].sum() < share * size[list(among)].sum():
            chosen.append(k)
    looped = [k for k in getattr(problem, "looped", ()) if k in among]
    if looped and not set(looped) & set(chosen):
        chosen.append(looped[0])
    return sorted(chosen)


def _fit(
    problem: Problem,
    scanned: Sequence[Scanned],
    before: Hypothesis,
    starts: int,
    trials: Sequence[int],
    progress: Progress,
) -> list[Fit]:
    """The better of a few quick fits of each candidate, on all data: it only chooses who is judged."""
    tasks = [(i, Model((s.candidate,)), u) for i, s in enumerate(scanned) for u in s.starts[:starts]]
    everything = np.ones(len(problem.segment_of), dtype=bool)
    fits = fit_all(problem, [(m, u) for _, m, u in tasks], before, everything, trials, WIDTHS[1:3], progress)
    best: dict[int, Fit] = {}
    for (i, _, _), fit in zip(tasks, fits, strict=True):
        if i not in best or fit.energy < best[i].energy:
            best[i] = fit
    return [best[i] for i in sorted(best)]


def fit_out(
    problem: Problem,
    starts: Sequence[tuple[Model, Array]],
    base: Array,
    before: Hypothesis,
    half: Array,
    tried: int,
    progress: Progress = quiet,
) -> list[Judged]:
    """Each model fitted on either half of the segments from the same start, and judged on the other."""
    masks = [half[problem.segment_of] == k for k in range(2)]
    by_half = [fit_all(problem, list(starts), before, masks[k], widths=WIDTHS[2:], progress=progress) for k in range(2)]
    return [judge(problem, base, (by_half[0][i], by_half[1][i]), half, tried) for i in range(len(starts))]
