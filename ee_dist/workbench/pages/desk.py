"""What a view may ask of the page that it is part of."""

from __future__ import annotations

from typing import Any, Protocol

from ee_dist.trials.log import Array
from ee_dist.workbench.session import Session
from ee_dist.workbench.sight import Place


class Desk(Protocol):
    """``place``: the trial and channel looked at; ``span_s``: the stretch zoomed into; ``brushed_s`` (k,): times chosen."""

    session: Session
    place: Place | None
    span_s: tuple[float, float] | None
    brushed_s: Array | None

    def changed(self, topic: str) -> None: ...

    def show_error(self, error: float | None) -> None: ...

    async def act(self, what: Any, *arguments: Any) -> Any: ...

    async def begin(self, verb: str, effect: str = "") -> None: ...

    async def undo(self) -> None: ...

    def look_at(self, place: Place) -> None: ...

    def show(self, name: str) -> None: ...
