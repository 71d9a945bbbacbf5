"""What the views of a page share: drawing only what is in sight, and waiting for the session without holding up the page."""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from concurrent.futures import Future
from html import escape
from pathlib import Path
from typing import Any, Generic, TypeVar

from nicegui import ui

from ee_dist.workbench.pages.desk import Desk
from ee_dist.workbench.pages.plot import preload

T = TypeVar("T")
SHEETS = [Path(__file__).with_name(name) for name in ("base.css", "style.css")]


def dress() -> None:
    """The looks of a page, and what its charts need, in its head."""
    for sheet in SHEETS:
        ui.add_css(sheet)
    ui.add_head_html(preload())


async def of(future: Future[T]) -> T:
    """What the session's thread gives, awaited."""
    return await asyncio.wrap_future(future)


class Latest(Generic[T]):
    """One thing at a time; of what is asked for meanwhile only the last is done."""

    def __init__(self, do: Callable[[T], Awaitable[None]]) -> None:
        self._do, self._waiting, self._busy = do, list[T](), False
        self.dropped = 0

    @property
    def newer(self) -> bool:
        """Whether something has been asked for since what is being done."""
        return bool(self._waiting)

    async def ask(self, what: T) -> None:
        self.dropped += len(self._waiting)
        self._waiting = [what]
        if self._busy:
            return
        self._busy = True
        try:
            while self._waiting:
                await self._do(self._waiting.pop())
        finally:
            self._busy = False


class View:
    """A tab of the page. ``topics``: what it shows; drawn when one of them changed and the tab is in sight. ``panel``: where it
    goes."""

    name = ""
    icon = ""
    topics: frozenset[str] = frozenset()

    def __init__(self, page: Desk) -> None:
        self.page, self.session = page, page.session
        self.stale: set[str] = set(self.topics)
        self.panel: ui.column | None = None
        self._set_up = False

    def set_up(self) -> None:
        """Build it in its panel, when it first comes to the front."""
        if self.panel is not None and not self._set_up:
            self._set_up = True
            with self.panel:
                self.build()

    def build(self) -> None:
        """Make the elements."""

    async def draw(self, topics: set[str]) -> None:
        """Bring them up to date with what changed."""


def gauge(error: float, floor: float, told: str, told_floor: str, top: float) -> str:
    """The error beside the floor as HTML, for eyes and for readers of screens. ``top``: the largest error on the gauge."""
    scale = max(top, error if error < float("inf") else top, floor, 1e-12)
    fill, tick = min(100.0, 100 * error / scale), min(99.0, 100 * floor / scale)
    ratio = error / floor if floor else float("inf")
    good = " good" if ratio < 1.1 else ""
    text = escape(f"error {told}, noise floor {told_floor}: {ratio:.3g} times the noise")
    return (
        f'<div class="gauge" role="meter" aria-label="{text}" aria-valuenow="{error:.6g}" aria-valuemin="0" '
        f'aria-valuemax="{scale:.6g}"><div class="fill{good}" style="width:{fill:.2f}%"></div>'
        f'<div class="tick" style="left:{tick:.2f}%"></div></div>'
    )


def heading(text: str) -> None:
    ui.html(f'<h2 class="part">{escape(text)}</h2>', sanitize=False)


def quiet(text: str = "") -> Any:
    return ui.label(text).classes("quiet")
