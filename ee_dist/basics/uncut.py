"""Stretches of work that nothing may cut: what would interrupt one of them is raised at its end."""

from __future__ import annotations

from types import TracebackType


class Stretch:
    """To be entered with ``with`` by the main thread; again inside of itself, too. Handlers of signals call ``interrupt``."""

    def __init__(self) -> None:
        self._depth = 0
        self._waiting: BaseException | None = None

    @property
    def under_way(self) -> bool:
        return self._depth > 0

    def interrupt(self, error: BaseException) -> None:
        """Raise it, here or at the end of the stretch under way."""
        if not self.under_way:
            raise error
        self._waiting = error

    def __enter__(self) -> None:
        self._depth += 1

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._depth -= 1
        if self._depth == 0 and self._waiting is not None:
            waiting, self._waiting = self._waiting, None
            raise waiting


trial_on_hardware = Stretch()
"""It may be the only one of its kind: that something was lost elsewhere is no reason to break it off. A person's wish to
stop is, for the body has to stop moving."""
keeping = Stretch()
"""From the end of a trial until it is on the disk."""
