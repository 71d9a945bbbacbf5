"""The page: a head with the error that is always in sight, and a view for each step: compare, explain, add, watch, keep."""

from __future__ import annotations

import asyncio
from typing import Any

from nicegui import background_tasks, ui
from nicegui.events import KeyEventArguments

from ee_dist.basics.names import counted
from ee_dist.discrepancy.accounts.account import error_name
from ee_dist.discrepancy.words import plain
from ee_dist.trials.log import Array
from ee_dist.workbench import verbs
from ee_dist.workbench.pages.add import AddView
from ee_dist.workbench.pages.compare import CompareView
from ee_dist.workbench.pages.explain import ExplainView
from ee_dist.workbench.pages.keep import KeepView
from ee_dist.workbench.pages.start import StartView
from ee_dist.workbench.pages.view import View, gauge, of
from ee_dist.workbench.pages.watch import WatchView
from ee_dist.workbench.session import Session
from ee_dist.workbench.sight import Place
from ee_dist.workbench.worker import BusyError

UNKNOWN = "looking ..."
"""Where the error is not known yet."""
MOVES = {"ArrowLeft": (-1, 0), "ArrowRight": (1, 0), "ArrowUp": (0, -1), "ArrowDown": (0, 1)}
IDLE_S = 4.0
"""After which the process of the long verbs is started: not while a page needs the processor to come up."""
KEYS = "Keys: 1 to 5 choose a view, arrows another trial or channel in Compare, e explains, u takes back, Esc cancels a search."


class Page:
    """One tab of a browser. What it looks at (``place``, ``span_s``) is its own; all else is the session's."""

    def __init__(self, session: Session) -> None:
        self.session = session
        self.place: Place | None = None
        self.span_s: tuple[float, float] | None = None
        self.brushed_s: Array | None = None
        self.views: list[View] = [v(self) for v in (CompareView, ExplainView, AddView, WatchView, KeepView)]
        self.start = StartView(self)
        self._waiting: set[str] = set()
        self._drawing = False

    def build(self) -> None:
        loop, client = asyncio.get_running_loop(), ui.context.client
        self.client = client

        def hear(topic: str) -> None:
            if not loop.is_closed():
                loop.call_soon_threadsafe(self.changed, topic)

        client.on_delete(self.session.listen(hear))
        # A hand that goes away with its page has let go.
        client.on_disconnect(lambda: self.session.attempt(self.session.release))
        with ui.element("main").classes("bench"):
            self._head()
            with ui.column().classes("w-full gap-3") as self.started:
                # What is open stays open: there is nothing to drop a file on then.
                if self.session.measured is None:
                    self.start.build()
            with ui.column().classes("w-full gap-2") as self.opened:
                with (
                    ui.tabs(on_change=lambda: self.changed("tab"))
                    .classes("w-full")
                    .props("align=left dense no-caps outside-arrows mobile-arrows") as self.tabs
                ):
                    tabs = [ui.tab(v.name, icon=v.icon).mark(v.name.lower()) for v in self.views]
                with ui.tab_panels(self.tabs, value=tabs[0], animated=False, keep_alive=True).classes(
                    "w-full bg-transparent"
                ):
                    for view, tab in zip(self.views, tabs, strict=True):
                        with ui.tab_panel(tab).classes("p-0"):
                            view.panel = ui.column().classes("w-full gap-3")
                    self.views[0].set_up()
                ui.label(KEYS).classes("quiet")
        ui.keyboard(on_key=self._key, ignore=["input", "select", "textarea"])
        ui.timer(IDLE_S, self.session.worker.warm, once=True)
        self.changed("opened")

    def _head(self) -> None:
        with ui.element("header").classes("card pinned").style("margin-bottom:8px"):
            with ui.row().classes("w-full items-center no-wrap gap-3"):
                with ui.column().classes("gap-0").style("min-width:0; flex: 1 1 auto"):
                    self.title = (
                        ui.label("ee_dist workbench").classes("ellipsis").style("font-weight:600; max-width:100%")
                    )
                    self.subtitle = ui.label("").classes("quiet ellipsis").style("max-width:100%")
                with ui.column().classes("gap-0 items-end"):
                    self.number = ui.label("").classes("number").mark("error")
                    self.number_of = ui.label("").classes("quiet gt-xs").style("white-space:nowrap")
                ui.button(icon="undo", on_click=self.undo).props('flat dense aria-label="Undo"').tooltip(
                    "Undo (u)"
                ).mark("undo")
            self.gauge = ui.html("", sanitize=False).classes("w-full")
            self.notice = ui.label("").classes("refused").props('role="status"').mark("notice")
            with ui.row().classes("w-full items-center no-wrap gap-3") as self.working:
                self.bar = ui.linear_progress(0, show_value=False, size="10px").style("flex: 1 1 auto")
                self.doing = ui.label("").classes("quiet").mark("doing")
                ui.button("Cancel", on_click=self.session.cancel).props("dense outline").mark("cancel")
            ui.timer(1.0, self._tick)

    # -- drawing -------------------------------------------------------------------------------------------------------

    def changed(self, topic: str) -> None:
        """Draw what shows the topic, soon; several changes at once are drawn once."""
        self._waiting.add(topic)
        if not self._drawing:
            self._drawing = True
            background_tasks.create(self._draw())

    async def _draw(self) -> None:
        try:
            while self._waiting and not self.client.is_deleted:
                topics, self._waiting = self._waiting, set()
                if topics & {"opened"}:
                    self.place, self.span_s, self.brushed_s = None, None, None
                if self.place is None and self.session.seen is not None:
                    self.place = await of(self.session.attempt(self.session.place))
                    topics |= {"place", "seen"}
                if "brush" in topics or "span" in topics:
                    topics |= {"look"}
                with self.client:
                    self._draw_head(topics)
                    for view in self.views:
                        view.stale |= topics & view.topics
                    front = self.in_front
                    front.set_up()
                    if front.stale and self.session.seen is not None:
                        stale, front.stale = front.stale, set()
                        await front.draw(stale)
                    if topics & {"opened", "seen", "notice"}:
                        await self.start.draw(topics)
        finally:
            self._drawing = False

    @property
    def in_front(self) -> View:
        return next((v for v in self.views if v.name == self.tabs.value), self.views[0])

    def _draw_head(self, topics: set[str]) -> None:
        session = self.session
        measured, seen, sight = session.measured, session.seen, session.sight
        self.started.set_visibility(measured is None)
        self.opened.set_visibility(measured is not None)
        if measured is not None:
            names = ", ".join(f.name for f in measured.files[:3])
            self.title.set_text(f"{plain(measured.robot.name)}: {names}")
            way = "" if sight is None else f", compared by {plain(sight.way.name)}"
            self.subtitle.set_text(
                f"{counted(len(measured.trials), 'trial')}{way}; {counted(len(session.bench.terms), 'effect')} in the model"
            )
        if seen is not None and sight is not None and topics & {"seen", "opened"}:
            self.show_error(seen.found.error)
        elif seen is not None and sight is not None and seen.terms != session.bench.terms and not session.at_pauses:
            self.show_error(None)  # it takes a while to compare what stands there now
        elif seen is None:
            self.number.set_text("" if measured is None or session.notice else UNKNOWN)
            self.number_of.set_text("")
            self.gauge.set_content("")
        self.notice.set_text(session.notice)
        self.notice.set_visibility(bool(session.notice))
        self._tick()

    def show_error(self, error: float | None) -> None:
        """The error of the moment, while a hand is on a slider or after it; None until it is known."""
        sight, seen, ladder = self.session.sight, self.session.seen, self.session.bench.ladder
        if sight is None or seen is None:
            return
        self.number_of.set_text(error_name(sight.problem))
        if error is None:
            self.number.set_text(UNKNOWN)
            self.gauge.set_content("")
            return
        floor, problem = seen.found.noise_floor, sight.problem
        told = problem.told(error) if error < float("inf") else "cannot be simulated"
        self.number.set_text(told)
        top = ladder[0].error_fit if ladder else error
        self.gauge.set_content(gauge(error, floor, told, problem.told(floor), 1.05 * top))

    def _tick(self) -> None:
        progress = self.session.progress
        self.working.set_visibility(progress is not None)
        if progress is None:
            return
        self.bar.set_value(progress.clock.share)
        self.doing.set_text(f"{progress.request.verb}: {progress.told}")

    # -- acting --------------------------------------------------------------------------------------------------------

    async def act(self, what: Any, *arguments: Any) -> Any:
        """Something of the session's, in its thread; what goes wrong is told in the head."""
        self.session.notice = ""
        found = await of(self.session.attempt(what, *arguments))
        self.changed("notice")
        return found

    async def begin(self, verb: str, effect: str = "") -> None:
        """A long verb."""
        try:
            await self.act(self.session.start, verb, effect)
        except BusyError as error:
            self.session.say(str(error))

    async def undo(self) -> None:
        await self.act(self.session.undo)

    def look_at(self, place: Place) -> None:
        self.place, self.span_s, self.brushed_s = place, None, None
        self.changed("place")

    def _step(self, trials: int, channels: int) -> None:
        """To the next trial or channel."""
        sight = self.session.sight
        if self.place is None or sight is None:
            return
        size = (len(sight.problem.trials), len(sight.problem.channels))
        trial, channel = ((self.place[k] + by) % size[k] for k, by in enumerate((trials, channels)))
        self.look_at((trial, channel))

    def show(self, name: str) -> None:
        self.tabs.set_value(name)

    async def _key(self, event: KeyEventArguments) -> None:
        if not event.action.keydown or event.modifiers.ctrl or event.modifiers.alt or event.modifiers.meta:
            return
        key = event.key.name
        if key in ("1", "2", "3", "4", "5"):
            self.show(self.views[int(key) - 1].name)
        elif key in MOVES and self.in_front is self.views[0]:
            self._step(*MOVES[key])
        elif key == "u":
            await self.undo()
        elif key == "e":
            self.show("Explain")
            await self.begin(verbs.EXPLAIN)
        elif key == "Escape":
            self.session.cancel()
