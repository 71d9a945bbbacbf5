"""Whether a model says anything of the motion: its error beside that of a robot that never moves, in windows and run through.

In windows a model goes on with the speed that it is given, and with enough friction it stands still, as a robot does for most of
many records. Neither shows in an error by itself.
"""

from __future__ import annotations

import math
from collections.abc import Callable

HARDLY_BETTER = 0.8
"""Share of the error of a robot that stays where it is, from which a model says next to nothing of the motion."""
WORSE = 1.5
"""Times as far off as a robot that stays where it is, from which a model goes the wrong way or too far,"""
ASTRAY = (
    "It goes the wrong way, or too far: are sign, scale and unit of commands and positions right, and gains and inertia of the "
    "description?"
)
"""which is asked before"""
MOVES = "Is there more in the record than rest, and is friction no more than what moved the joints?"
AT_NOISE = 1.3
"""Times the noise floor up to which a model is right, be it of a robot at rest."""


def hardly_better(off: float, at_rest: float, noise: float, told: Callable[[float], str]) -> str:
    """Why a model says next to nothing of the motion in windows, by the errors of it, of a robot at rest and of noise alone;
    empty: it does say something, or cannot be simulated. ``told``: an error as people read it."""
    if not max(AT_NOISE * noise, math.sqrt(HARDLY_BETTER) * at_rest) <= off < math.inf:
        return ""
    return (
        f"a robot that stays where each window begins would be off by {told(at_rest)}, this model is by {told(off)}: it says "
        "next to nothing of the motion"
    )


def stands_still(described: float, through: float, at_rest: float, told: Callable[[float], str]) -> str:
    """Why a model says next to nothing of the motion when it is run through, where the robot as it is described, by its error,
    does; empty: it does say something, or that one does not either."""
    if not described < math.sqrt(HARDLY_BETTER) * at_rest <= through < math.inf:
        return ""
    return (
        f"run through without starting anew a robot that never moves would be off by {told(at_rest)}, this model is by "
        f"{told(through)}, and as it is described by {told(described)}: it says next to nothing of the motion"
    )


def doubt(why: str, off: float, at_rest: float) -> str:
    """What to ask where a model says next to nothing of the motion: ``why``, as a line for people."""
    return f"{why[0].upper()}{why[1:]}. {ASTRAY + ' ' if off > WORSE * at_rest else ''}{MOVES}"
