"""What an open loop does not compare, or counts for less, in lines for people."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence

from ee_dist.basics.names import counted, listed
from ee_dist.discrepancy.ways.open_loop.stretches import SETTLED_S

NOTED = 1.2
"""Times that channels count less, from which it is told."""


def uncompared(repeating: Iterable[str], rugged: Collection[str] = ()) -> list[str]:
    """A line on each kind of sensor of which it is not compared how often it repeats a reading, and of the ``rugged`` among them
    how rough it is."""
    lines = []
    for kind in sorted(repeating):
        more, compared = "repeat readings more often", "how often they do is not compared"
        if kind in rugged:
            more, compared = f"{more} or jump more", "neither how often they do nor how rough they are is compared"
        lines.append(
            f"Most {kind} sensors {more} than the model's (coarse steps, rows that were filled in): {compared}."
        )
    return lines


def begun_in_motion(trials: Sequence[str]) -> list[str]:
    if not trials:
        return []
    begun = f"{counted(len(trials), 'trial')} that begin{'s' if len(trials) == 1 else ''} in motion ({listed(trials)})"
    why = "nobody knows what the controllers were told before"
    return [f"The first {SETTLED_S:g} s of {begun} is simulated and not compared: {why}."]


def counted_less(loosened: float, of_lag: bool = False) -> list[str]:
    """Where channels beside the positions count so many times less; ``of_lag``: for what comes late."""
    if not loosened > NOTED:
        return []
    off = "what comes late" if of_lag else "the robot as described"
    return [
        f"What joints report beside their positions is to count no more than these do, and {off} is off "
        f"by {loosened:.3g} times more in it than in positions: so many times more of it counts as one."
    ]


def some_of_it(stretches: int, compared_s: float, lasting_s: float) -> str:
    """That a search goes by so many stretches of all that was measured."""
    parts = counted(stretches, "stretch", "stretches")
    return (
        f"So that the search ends, it goes by {compared_s:.0f} of the {lasting_s:.0f} s, in {parts}, each begun from the "
        "measured positions; compare takes all of it."
    )
