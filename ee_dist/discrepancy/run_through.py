"""What windows rank first for its many numbers, and a run of the whole record does not.

Windows begin at what was measured. Where a joint comes as late as a window is long (a goal that gathers speed slowly, by a
third of a second), soft controllers that are damped and limited mimic that from window to window, and run through they are
nowhere: of a WidowX-200's waist six values of such left 14 mrad in windows and 117 run through, one acceleration of its goals 18
and 20. Whole records are no evidence by themselves, since one that sticks a moment longer is far off by luck: a law of one or two
numbers is judged by windows alone.
"""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.discrepancy.evidence.judge import Judged, ranked
from ee_dist.discrepancy.problem import Problem
from ee_dist.effects.catalogue import Hypothesis

MANY = 4
"""Numbers of one proposal that mimic anything by windows."""
STRAYS, AS_GOOD = 2.0, 2.0
"""Times as far off, run through, as another explanation that goes before it then, if by windows that one leaves more, and no more
than so many times as much."""
NO_WORSE = 1.2
"""Times as far off as the model without it that it may be."""
ASTRAY = "run through without starting anew it is off by {off}, {other} by {by}"


def that_hold_run_through(
    problem: Problem, fixed: Hypothesis, current: Hypothesis, judged: Sequence[Judged]
) -> list[Judged]:
    """Ranked anew without what has many numbers and strays, run through, from what another that earned its place does as well by
    windows, or from the model as it is, the ``current`` terms on top of the ``fixed``; as it was where nothing does or a way runs
    no windows."""
    earned = [j for j in judged if j.earned]
    if not any(j.proposal.size >= MANY for j in earned):
        return list(judged)
    through = problem.run_through([(*fixed, *current), *((*fixed, *j.hypothesis) for j in earned)])
    if through is None:
        return list(judged)
    as_it_is, *off = through
    for j, mine in zip(earned, off, strict=True):
        if j.proposal.size < MANY:
            continue
        rivals = [
            (whole, k.name.replace("_", " ").replace("@", " at "))
            for k, whole in zip(earned, off, strict=True)
            if float(j.held.sum()) <= float(k.held.sum()) <= AS_GOOD * float(j.held.sum())
        ]
        rivals = [r for r in rivals if STRAYS * r[0].size <= mine.size]
        if NO_WORSE * as_it_is.size <= mine.size:
            rivals.append((as_it_is, "the model without it"))
        if rivals:
            best, name = min(rivals, key=lambda r: r[0].size)
            j.why_not = ASTRAY.format(off=mine.told, other=name, by=best.told)
    return list(judged) if all(j.earned for j in earned) else ranked(judged)
