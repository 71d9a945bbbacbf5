"""What is a little wrong everywhere: all such effects, at all places, fitted at once, and then left out one by one.

A real robot differs from its model in a hundred small ways. A search that adds one effect after another puts the first of
them where twenty small ones would be right, and is caught there. This goes the other way round.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.assumed import beside, puts_right
from ee_dist.discrepancy.brief import briefly, in_brief
from ee_dist.discrepancy.evidence.holdout import PRIOR, Cut, cross_fit, travelling
from ee_dist.discrepancy.evidence.judge import TIE_ENERGY, Judged, judge
from ee_dist.discrepancy.examine import FAR, Current
from ee_dist.discrepancy.kinds import Everywhere, Kept, Steps, luck, values_at
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.pruning import AGAIN, pruned
from ee_dist.discrepancy.search.candidates import Candidate, Proposal, not_said, possible
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.race import race
from ee_dist.discrepancy.search.refit import Refit
from ee_dist.discrepancy.search.ridges import over_ridges
from ee_dist.discrepancy.search.screen import screen
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import slopes_at
from ee_dist.discrepancy.search.trials import calm_trials, telling, telling_values
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.discrepancy.sharing import apart, distinct, shared, singles
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

FEWEST = 3
"""Effects that must be there to be fitted at once."""
WIDTHS, MORE_WIDTHS, MANY = (0.12, 0.3), (0.03, 0.12, 0.3), 20
"""Finite differences to begin with: each leads down another side of a ridge, and which is right shows at the end. More of them
where it costs little, for fewer than MANY values."""
AT_ONCE = "all small effects at once"
"""What the search is at, for who waits."""
TWINS = 2
"""Twins of effects that are tried in their place."""
TRIED = 20
"""Effects that are tried one by one beside all that may be a little wrong,"""
HEATS = ((1, 10), (1, 5), (3, 2))
"""in a race: how many of them go on after how many steps."""
OF_DRIVES = ("coulomb", "viscous", "rotor_inertia")
"""What every drive has, and a description of it."""
MOST_OF_IT = 0.5
"""Share of what is above the noise that must be left at one joint for an effect to stand out there."""


def looked_for_at_once(problem: Problem, pool: Sequence[Candidate]) -> list[Candidate]:
    """What of the pool may be fitted at once. Of a single motion windows are all the evidence, and they share what a model gets
    wrong in it: there it is what every driven joint has, friction and a rotor, as in anybody's least squares. One of them is
    worth little by itself where another is described wrongly: a joint that is said to be slowed by its speed alone, and has
    dry friction too."""
    if travelling(problem):
        return [*pool]
    idle = {d.joint for d in problem.robot.drives if d.command == "none"}
    return [c for c in pool if not c.effect.everywhere or (_of_drives(c) and c.target not in idle)]


def _of_drives(c: Candidate) -> bool:
    return any(p.on_top in OF_DRIVES for p in c.effect.parameters)


def everywhere(
    search: Search,
    current: Current,
    own: int,
    pool: Sequence[Candidate],
    cuts: Sequence[Cut],
    again: bool = False,
    twins: Sequence[tuple[int, Candidate, Array]] = (),
    seen: Sequence[tuple[Candidate, Array]] = (),
    single: Judged | None = None,
) -> Everywhere | None:
    """On top of the current model, whose first ``own`` parts stay. None where it does not earn its place on the data held out
    in each of ``cuts``. ``again``: after such effects were added, only from neutral: beside what was added since, and beside
    whatever else promises most, for its twin may have been added; and beside each of ``twins``, which were tied with the part
    whose number they have, with the values that suited. ``seen``: single effects that were worth their place before, and the
    values that they had: they are tried too, whatever they promise on top of values that stood in for them. ``single``: what
    was just judged by itself: where it does more than all of these, the two are fitted together."""
    as_it_is = search.on(current.hypothesis).base()
    without = [as_it_is for _ in cuts]
    if current.parts:
        model = Model(current.parts)
        without = [cross_fit(search, [(model, current.u)], cut)[0].residual for cut in cuts]
    calm = search.among(calm_trials(search.problem, as_it_is))
    brief = briefly(calm, as_it_is, current.hypothesis)
    look = _Look(search, calm, brief, own, tuple(pool), current, tuple(zip(cuts, without, strict=True)), tuple(seen))
    robot, places = search.problem.robot, Model(current.parts).places
    begun = list(instead(robot, current, own))
    # From neutral, which the model as it is may be, small values take in least of what is not theirs.
    fitted = as_it_is[calm.everything]
    than = float(fitted @ fitted)
    found = None if again else look.kept(current, than, beside_all=not begun)
    # Of what was added last the most is not yet decided.
    alike = [t for t in reversed(twins) if again and stands_out(robot, current.parts[t[0]])][:TWINS]
    for keep in begun:
        bare = not keep[own:]
        for base in _with_twins(current, places, keep, alike):
            if found is not None:
                than = min(than, found.fitted)
            other = look.kept(base, than, more=bare, beside_all=bare and not again)
            if other is not None and (
                found is None or other.held < found.held + (look.luck(other.held) if bare else 0.0)
            ):
                found = other
    if found is not None and single is not None and float(single.held.sum()) <= found.held:
        found = look.beside_single(found, single)
    return Steps(search, calm, own, current, look.cuts, len(pool)).of(found) if found is not None else None


def _with_twins(
    current: Current, places: Sequence[slice], keep: Sequence[int], twins: Sequence[tuple[int, Candidate, Array]]
) -> Iterator[Current]:
    """Some parts of the model, and the same with one of them exchanged for its twin: which of two that look alike is there
    decides how all the rest is off, and beside the wrong one the rest looks right."""
    yield Current(tuple(current.parts[k] for k in keep), values_at(current.u, places, keep))
    for at, twin, u in twins:
        if at in keep:
            values = [u if k == at else current.u[places[k]] for k in keep]
            yield Current(tuple(twin if k == at else current.parts[k] for k in keep), np.concatenate(values))


def instead(robot: Robot, current: Current, own: int) -> Iterator[list[int]]:
    """Numbers of the parts to begin with, beside all of them. What was added so far may stand in for what is wrong everywhere:
    without it; and what was found to be a little wrong everywhere for what was added last: that anew. What puts assumed
    drives right stays: nobody believes in what they were."""
    stay = [k for k, c in enumerate(current.parts) if k < own or puts_right(robot, c)]
    special = [k for k, c in enumerate(current.parts) if k >= own and stands_out(robot, c)]
    if special:
        yield stay
        if len(stay) + len(special) < len(current.parts):
            yield sorted([*stay, *special])


def stands_out(robot: Robot, c: Candidate) -> bool:
    """Whether it is no small wrong everywhere, nor puts right what was assumed."""
    return not c.effect.everywhere and not puts_right(robot, c)


@dataclass(frozen=True, eq=False)
class _Look:
    """``cuts``: what is held out, each with the held-out residual (n,) of the ``current`` model; ``calm``: the search on
    predictable trials, ``brief``: on the beginning of these; ``seen`` as in ``everywhere``."""

    search: Search
    calm: Search
    brief: Search
    own: int
    pool: tuple[Candidate, ...]
    current: Current
    cuts: tuple[tuple[Cut, Array], ...]
    seen: tuple[tuple[Candidate, Array], ...]

    def luck(self, energy: float) -> float:
        """By how much held-out energy of about this size may differ for no reason."""
        return luck(self.search.problem, len(self.pool), energy)

    def kept(self, base: Current, than: float, more: bool = True, beside_all: bool = False) -> Kept | None:
        """The base with all that is worth keeping, and (``more``), if need be, one effect beside; None where that is not worth
        more than the current model, or leaves more of what is fitted ``than`` another fit. ``beside_all``: the one
        effect is looked for also where much is left at one joint: small values that had to stand in for it are worth something
        too."""
        problem = self.search.problem
        single = apart(problem, base, self.own)
        fit = self._fit(single, singles(problem.robot, self._everywhere(single)))
        if fit is None:
            return None
        alone = self._worth(fit, {}, than)
        if alone is None or alone.held > FAR**2 * float(problem.floor.sum()):
            # Of a hundred values each may be worth no more than luck, where one number for all joints is worth much.
            few = shared(problem.robot, self._everywhere(base))
            other = self._fit(base, few, than + self.luck(than), None if alone is None else (fit, alone.held))
            together = self._worth(other, {}, than) if other is not None else None
            if other is not None and together is not None and (alone is None or together.held < alone.held):
                alone, fit, single = together, other, base
        if not more or (alone is not None and not (beside_all and self._one_sided(fit))):
            return alone
        # What stands out may show only where all the rest may move, and the rest be of use only beside it.
        beside_it = self._beside(fit, np.concatenate([single.u, np.zeros(len(fit.u) - len(single.u))]), than)
        if alone is None or beside_it is None:
            return beside_it or alone
        return beside_it if beside_it.held + self.luck(beside_it.held) < alone.held else alone

    def beside_single(self, found: Kept, single: Judged) -> Kept:
        """What was found, or what is left of it and a single proposal that were fitted together, where that is better."""
        alone = {c.name for c in single.proposal.parts}
        if alone & {c.name for c in found.model.parts}:
            return found
        model = Model((*found.model.parts, *single.proposal.parts))
        start = np.concatenate([found.model.u, single.own])
        (fit,) = follow_valley(self.calm, [(model, start)], self.calm.everything, PRIOR, widths=(AGAIN,))
        both = self._worth(fit, {}, np.inf)
        if both is None or both.held >= found.held:
            return found
        # Where nothing stays beside the single one, that is judged already.
        more = {c.name for c in both.model.parts} - {c.name for c in self.current.parts} - alone
        return both if more else found

    def _everywhere(self, base: Current) -> list[Candidate]:
        return [c for c in self._others(Model(base.parts)) if c.effect.everywhere]

    def _fit(
        self,
        base: Current,
        few: Sequence[Candidate],
        wanted: float = np.inf,
        beside_it: tuple[Fit, float] | None = None,
    ) -> Fit | None:
        """The base with all ``few`` that leave marks of their own, from neutral; None where these are too few to be fitted at
        once, or leave more of what they are fitted to than is ``wanted``, or than another fit did of what was held out
        (``beside_it``: that fit, and its energy on all held-out data), by the trial that tells most alone or by all of them."""
        robot = self.search.problem.robot
        few = distinct(self.calm, base, beside(robot, base.parts, base.hypothesis, few))
        if not few or len(base.parts) + len(few) < FEWEST:
            return None
        model, u = Model((*base.parts, *few)), np.concatenate([base.u, *(np.zeros(c.size) for c in few)])
        widths = WIDTHS if len(u) >= MANY else MORE_WIDTHS
        if beside_it is not None:
            best, held = beside_it
            one = telling_values(self.search.problem, best.residual, best.mask)
            share = float((best.residual[one] ** 2).sum()) / best.energy
            (first,) = follow_valley(self.calm, [(model, u)], one, PRIOR, widths=widths, wanted=share * held)
            if first.energy > share * held:
                return None
            wanted = min(wanted, held)
        # Of the beginnings alone nobody knows what they may leave.
        enough = wanted if self.brief is self.calm else np.inf
        (fit,) = follow_valley(self.brief, [(model, u)], self.brief.everything, PRIOR, widths=widths, wanted=enough)
        if fit.energy > enough:
            return None
        return self._on_all_of_it(over_ridges(self.brief, fit, PRIOR), wanted)

    def _on_all_of_it(self, fit: Fit, wanted: float = np.inf) -> Fit:
        """A fit to the beginnings, where these are looked at first: of long trials they tell in which valley to look. ``wanted``
        as in valley.py."""
        if self.brief is not self.calm:
            own = self.calm.everything
            (fit,) = follow_valley(self.calm, [(fit.model, fit.u)], own, PRIOR, widths=(AGAIN,), wanted=wanted)
        return fit

    def _one_sided(self, fit: Fit) -> bool:
        """Whether much more than noise is left, and most of it at one joint."""
        problem, own = self.search.problem, fit.mask
        above = fit.residual[own] ** 2 - problem.floor[own]
        if fit.energy <= FAR**2 * float(problem.floor[own].sum()):
            return False
        joints = [len(problem.channels) + c if j is None else j for c, j in enumerate(problem.layout.joint_of_channel)]
        at = np.bincount(np.array(joints)[problem.channel_of[own]], weights=above)
        return bool(at.max() > MOST_OF_IT * above.sum())

    def _worth(self, fit: Fit, ties: Mapping[str, Sequence[Fit]], than: float) -> Kept | None:
        """What is left of a fit after pruning, if it is worth more than luck beside the current model, on held-out data. These
        are not asked where all its values leave more of what was fitted ``than`` those of another fit: that descent ended in
        another valley, which is no lower without some of them."""
        if fit.energy > than + self.luck(than):
            return None
        kept = pruned(self.calm, fit, self.own, len(self.pool), self.cuts[0][0])
        names = {c.name for c in self.current.parts}
        added = tuple(c for c in kept.parts if c.name not in names)
        if not added:
            return None
        model = Model(kept.parts)
        # Many small effects may each be below the resolution, and not all together.
        problem, noise, worst, energy = (
            self.search.problem,
            float(self.search.problem.floor.mean()),
            self.cuts[0][0],
            0.0,
        )
        for cut, without in self.cuts:
            (held,) = cross_fit(self.search, [(model, kept.u)], cut)
            judged = judge(problem, without, held, Proposal(added), model, len(self.pool), noise)
            if not judged.earned:
                return None
            if float(judged.held.sum()) > energy:
                worst, energy = cut, float(judged.held.sum())
        return Kept(kept, energy, worst, ties, fit.energy)

    def _beside(self, alone: Fit, start: Array, than: float) -> Kept | None:
        """The model of a fit with one more effect, of those that promise most on top of it; all values from ``start`` (P,)."""
        search, model = self.calm, alone.model
        refit = Refit(slopes_at(search, alone.model, alone.u))
        now = search.on(alone.hypothesis)
        one = telling(search.problem, alone.residual, np.unique(search.problem.trial_of[search.everything]).tolist())
        others = possible(search.problem.robot, now.fixed, self._others(model))
        chosen = None if one is None else in_brief(search.among([one]), alone.model, alone.u, alone.residual, refit)
        screened = screen(now, others, refit=refit, few=None if chosen is None else chosen.ground)
        few = sorted((s for s in screened if s.starts), key=lambda s: -s.promise)[:TRIED]
        tried = []
        for s in few:
            c = s.candidate
            # Small values take in least of what is not theirs, where they do anything.
            tried.append((c, s.starts[0] if c.size > 1 or s.late else next(iter(c.hinted), np.zeros(c.size))))
        left = {c.name for c in others}.difference(c.name for c, _ in tried)
        tried += [(c, u) for c, u in self.seen if c.name in left]
        if not tried:
            return None
        starts = [(Model((*model.parts, c)), np.concatenate([start, u])) for c, u in tried]
        brief = self.brief
        problem, own = brief.problem, brief.everything
        heats = telling_values(problem, brief.on(alone.hypothesis).base(), own)
        best, *ended = race(brief, starts, own, HEATS, PRIOR, heats_on=heats, same=len(start))
        best = over_ridges(brief, best, PRIOR)
        noise = max(float(problem.floor[own].mean()), best.energy / int(own.sum()))
        ties = [f for f in ended if f.energy - best.energy < TIE_ENERGY * noise]
        return self._worth(self._on_all_of_it(best), {best.model.parts[-1].name: ties}, than)

    def _others(self, model: Model) -> list[Candidate]:
        return not_said(self.search.problem.robot, model.parts, self.pool)
