"""Progress of a search in the terminal: what is being done, how far it is, how long it will still take."""

from __future__ import annotations

import time

from rich.console import Console
from rich.status import Status
from rich.text import Text

from ee_dist.discrepancy.search.search import Progress, quiet
from ee_dist.tasks.steps import Clock, found, stage_of

EVERY_S, STEPS_S = 15.0, 10.0
"""Where there is no terminal, a step says so often how far it is, and a stage of several steps at which of them."""


class SearchProgress:
    """A live line on a terminal; elsewhere a plain line whenever another stage begins, and while a step goes on for long, the
    first as soon as it is known that it will. ``told``: who else is told."""

    def __init__(self, console: Console, told: Progress = quiet) -> None:
        self.console, self.told, self.clock = console, told, Clock()
        self.said_of, self.other = "", False
        """Of which step the last line was, and whether there was another since."""
        self.said = self.clock.began_s
        self.short = True
        """Whether nothing was said yet of how long this step takes."""
        self.status: Status | None = console.status("starting") if console.is_terminal else None

    def __enter__(self) -> SearchProgress:
        if self.status:
            self.status.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.status:
            self.status.stop()

    def __call__(self, what: str, share: float, error: float | None = None) -> None:
        before, self.clock = self.clock, self.clock.after(what, share)
        self.told(what, share, error)
        # Of many alike in a row each would say anew how long it takes.
        self.short |= what != before.what
        begins = what != before.what and (not self.said_of or stage_of(what) != stage_of(self.said_of))
        self.other |= what != self.said_of
        if self.status:
            self.status.update(Text(f"{self.clock.ahead(error)}, {self.clock.spent_s:.0f} s so far in all"))
            return
        now = time.monotonic()
        long = (self.clock.left_s or 0.0) >= EVERY_S and (self.short or now - self.said >= EVERY_S)
        if begins or long or (self.other and now - self.said >= STEPS_S):
            self.said, self.short, self.said_of, self.other = now, not long, what, False
            text = self.clock.ahead(error) if long else f"{what}{found(error)}"
            self.console.print(f"{self.clock.spent_s:6.0f} s  {text}", style="dim", highlight=False, soft_wrap=True)

    def note(self, text: str) -> None:
        """A line that stays: something was found on the way."""
        self.console.print(f"{self.clock.spent_s:6.0f} s  {text}", highlight=False, markup=False, soft_wrap=True)
