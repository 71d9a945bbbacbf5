"""Progress of a search in the terminal: what is being done, how far it is, how long it will still take."""

from __future__ import annotations

import time

from rich.console import Console
from rich.status import Status
from rich.text import Text

from ee_dist.discrepancy.search.search import Progress, quiet
from ee_dist.discrepancy.words import percent

EVERY_S, STEPS_S = 15.0, 10.0
"""Where there is no terminal, a stage says so often how far it is, and, where it has several steps, at which of them."""


FITTING = "fitting"
"""The stage that ends as soon as nothing gets better by it."""


def left_of(what: str, left_s: float) -> str:
    """How long a stage goes on, for people; of one that may end before, at most."""
    return f"{'up to' if FITTING in what else 'about'} {left_s:.0f} s left of this stage"


class SearchProgress:
    """A live line on a terminal; elsewhere a plain line whenever another stage begins, and while it goes on for long, the
    first as soon as it is known that it will. ``told``: who else is told."""

    def __init__(self, console: Console, told: Progress = quiet) -> None:
        self.console, self.stage, self.told, self.share = console, "", told, 0.0
        self.said_of, self.other = "", False
        """Of which stage the last line was, and whether there was another since."""
        self.began = self.stage_began = self.said = self.heard = time.monotonic()
        self.short = True
        """Whether nothing was said yet of how long this stage takes."""
        self.status: Status | None = console.status("starting") if console.is_terminal else None

    def __enter__(self) -> SearchProgress:
        if self.status:
            self.status.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.status:
            self.status.stop()

    def __call__(self, what: str, share: float, error: float | None = None) -> None:
        now = time.monotonic()
        self.told(what, share, error)
        another = what != self.stage
        if another or share <= self.share:
            # It, or the same one once more, began when the last word of what came before was said. Of many alike in a row each
            # would say anew how long it takes.
            self.stage_began, self.short = self.heard, self.short or another
        begins = another and (not self.said_of or what.partition(": ")[0] != self.said_of.partition(": ")[0])
        self.other |= what != self.said_of
        another = begins or (self.other and now - self.said >= STEPS_S)
        self.stage, self.share, self.heard = what, share, now
        left = (now - self.stage_began) * (1 - share) / share if share > 0 else 0.0
        so_far = "" if error is None else f", error {error:.3g}"
        ahead = f"{what} {percent(share)}{so_far}, {left_of(what, left)}"
        if self.status:
            self.status.update(Text(f"{ahead}, {now - self.began:.0f} s so far"))
            return
        long = left >= EVERY_S and (self.short or now - self.said >= EVERY_S)
        if another or long:
            self.said, self.short, self.said_of, self.other = now, not long, what, False
            text = ahead if long else f"{what}{so_far}"
            self.console.print(f"{now - self.began:6.0f} s  {text}", style="dim", highlight=False, soft_wrap=True)

    def note(self, text: str) -> None:
        """A line that stays: something was found on the way."""
        self.console.print(
            f"{time.monotonic() - self.began:6.0f} s  {text}", highlight=False, markup=False, soft_wrap=True
        )
