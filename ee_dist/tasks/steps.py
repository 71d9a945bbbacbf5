"""Since when a search does what it is doing, and how long that still takes: only of the step under way is that known."""

from __future__ import annotations

import time
from dataclasses import dataclass, field

from ee_dist.discrepancy.words import percent

FITTING = "fitting"
"""The step that ends as soon as nothing gets better by it."""
LONGER_S = 1.0
"""By how much a stage has gone on for longer than its step where that is worth a word."""


@dataclass(frozen=True)
class Clock:
    """``what`` is "step", or "stage: step" where a stage has several, and nobody knows how many. Times in seconds."""

    began_s: float = field(default_factory=lambda: time.monotonic())
    what: str = ""
    share: float = 0.0
    """Of the step, in [0, 1]."""
    stage_began_s: float = 0.0
    step_began_s: float = 0.0
    heard_s: float | None = None
    """When the last word came."""

    def after(self, what: str, share: float) -> Clock:
        """Another step began when the last word of what came before was said; and the same step once more does where the share
        falls, or is whole again. One that stays has made no headway."""
        now = time.monotonic()
        heard = self.began_s if self.heard_s is None else self.heard_s
        again = what != self.what or share < self.share or share == self.share == 1.0
        return Clock(
            began_s=self.began_s,
            what=what,
            share=share,
            stage_began_s=self.stage_began_s if stage_of(what) == stage_of(self.what) else heard,
            step_began_s=heard if again else self.step_began_s,
            heard_s=now,
        )

    @property
    def left_s(self) -> float | None:
        """Of the step, by what its share has taken; None where nothing of it is done."""
        if self.share <= 0.0:
            return None
        return (time.monotonic() - self.step_began_s) * (1.0 - self.share) / self.share

    @property
    def spent_s(self) -> float:
        return time.monotonic() - self.began_s

    def ahead(self, error: float | None = None) -> str:
        """What is done, how much of the step, how long that goes on, and how long its stage has, in words."""
        text = f"{self.what} {percent(self.share)}{found(error)}"
        fits, left = FITTING in self.what, self.left_s
        if left is not None:
            text += f", {'up to' if fits else 'about'} {left:.0f} s left of this {'fit' if fits else 'step'}"
        if ": " in self.what and self.step_began_s - self.stage_began_s >= LONGER_S:
            text += f" (this stage: {time.monotonic() - self.stage_began_s:.0f} s so far)"
        return text


def stage_of(what: str) -> str:
    """The stage that a step is of."""
    return what.partition(": ")[0]


def found(error: float | None) -> str:
    """The error of the best so far, in words; nothing where there is none."""
    return "" if error is None else f", error {error:.3g}"
