"""A slider that tells each value it comes to, and is told none of them back."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from nicegui.element import Element


class Slider(Element):
    """Quasar's own, which follows the hand by itself. The toolkit's is sent every value that it has just sent, and the whole page
    is gone through for it, before the curves come. ``moved`` and ``released`` are called with the toolkit's event, whose
    ``args`` are the value. On a slow page the last value may be told as moved after it was told as released."""

    def __init__(
        self,
        low: float,
        high: float,
        step: float,
        value: float,
        moved: Callable[[Any], Any],
        released: Callable[[Any], Any],
        throttle_s: float = 0.02,
    ) -> None:
        super().__init__("q-slider")
        with self._props.suspend_updates():
            self._props.update({"min": low, "max": high, "step": step, "model-value": value})
        self.on("update:model-value", moved, throttle=throttle_s)
        self.on("change", released)

    def show(self, value: float) -> None:
        """Where it stands, if the page was not told so last."""
        if self._props["model-value"] != value:
            self._props["model-value"] = value
