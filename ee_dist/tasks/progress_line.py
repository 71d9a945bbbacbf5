"""Progress of a search in the terminal: what is being done, how far it is, how long it will still take."""

from __future__ import annotations

import time

from rich.console import Console
from rich.status import Status

from ee_dist.discrepancy.search.search import Progress, quiet


class SearchProgress:
    """A live line on a terminal; elsewhere a plain line whenever another stage begins. ``told``: who else is told."""

    def __init__(self, console: Console, told: Progress = quiet) -> None:
        self.console, self.stage, self.told = console, "", told
        self.began = self.stage_began = time.monotonic()
        self.status: Status | None = console.status("starting") if console.is_terminal else None

    def __enter__(self) -> SearchProgress:
        if self.status:
            self.status.start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.status:
            self.status.stop()

    def __call__(self, what: str, share: float) -> None:
        now = time.monotonic()
        self.told(what, share)
        if what != self.stage:
            self.stage, self.stage_began = what, now
            if self.status is None:
                self.console.print(f"{now - self.began:6.0f} s  {what}", style="dim", highlight=False)
        if self.status:
            spent = now - self.stage_began
            left = spent * (1 - share) / share if share > 0 else 0.0
            self.status.update(
                f"{what} {share:.0%}, about {left:.0f} s left of this stage, {now - self.began:.0f} s so far"
            )
