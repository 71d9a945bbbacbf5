"""A slider that tells each value it comes to, and is told none of them back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui.element import Element


class Slider(Element, component="slider.js"):
    """Quasar's own, which follows the hand by itself. The toolkit's is sent every value that it has just sent, and the whole page
    is gone through for it, before the curves come. ``moved`` and ``released`` are called with a value: while a hand is on it, and
    once, last, where the hand let go."""

    def __init__(
        self,
        low: float,
        high: float,
        step: float,
        value: float,
        moved: Callable[[float], Any],
        released: Callable[[float], Any],
    ) -> None:
        super().__init__()
        self._stands = value
        with self._props.suspend_updates():
            self._props.update({"min": low, "max": high, "step": step, "begin": value})
        self.on("moved", lambda e: moved(self._heard(e)))
        self.on("released", lambda e: released(self._heard(e)))

    def show(self, value: float) -> None:
        """Where it stands, if that is not where the page has it."""
        if self._stands != value:
            self._stands = value
            self.run_method("show", value)

    def _heard(self, event: Any) -> float:
        self._stands = float(event.args)
        return self._stands
