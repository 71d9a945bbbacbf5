"""Add: effects on the model, a slider for each value, and the curves that follow the hand."""

from __future__ import annotations

import asyncio
from html import escape
from typing import Any

from nicegui import background_tasks, ui

from ee_dist.discrepancy.words import placed, plain, quantity
from ee_dist.effects.catalogue import CATALOGUE
from ee_dist.workbench import verbs
from ee_dist.workbench.bench import Entry
from ee_dist.workbench.pages.curves import Curves
from ee_dist.workbench.pages.slider import Slider
from ee_dist.workbench.pages.view import Latest, View, heading, of, quiet
from ee_dist.workbench.sight import Glance

STEPS = 400
"""Positions of a slider."""
SKETCHED = 300
"""Points of a curve while the hand is on a slider; all of them when it rests."""
TOLD_S = 0.1
"""By which numbers come after the curves of a move: what is sent with these is drawn before them."""
Move = tuple[int, str, str, float]
"""The place of an entry and its name, the name of a value, and the value."""
Told = tuple[Move, Glance]


class AddView(View):
    name, icon = "Add", "tune"
    topics = frozenset({"model", "seen", "place", "look", "opened", "explained"})

    def build(self) -> None:
        self._built: tuple[Any, ...] = ()
        self._sliders: dict[tuple[int, str], tuple[Any, Any]] = {}
        self.moves = Latest[Move](self._move)
        self.told = Latest[Told](self._tell)
        with ui.element("div").classes("two"):
            with ui.element("section").classes("card pinned below"):
                heading("Measured and predicted")
                self.where = quiet()
                self.curves = Curves(self.page, 360)
            with ui.element("section").classes("card"):
                heading("Effects in the model")
                with ui.row().classes("w-full items-center no-wrap"):
                    self.choice = (
                        ui.select(self._options(), with_input=True, clearable=True, label="Add an effect: type to search")
                        .classes("w-full").props("dense outlined use-input").mark("choice")
                    )  # fmt: skip
                    ui.button("Add", on_click=self._add).props("no-caps").mark("add")
                self.physics = quiet()
                self.choice.on_value_change(self._chosen)
                with ui.row().classes("gap-2"):
                    ui.button("Fit the values", icon="straighten", on_click=lambda: self.page.begin(verbs.FIT)).props(
                        "outline no-caps dense"
                    ).mark("fit")
                    ui.button(
                        "Let it go on by itself", icon="auto_awesome", on_click=lambda: self.page.begin(verbs.AUTO)
                    ).props("outline no-caps dense").mark("auto")
                    ui.button("Undo", icon="undo", on_click=self.page.undo).props("flat no-caps dense")
                self.entries = ui.column().classes("w-full gap-0").mark("entries")

    async def draw(self, topics: set[str]) -> None:
        session, place = self.session, self.page.place
        sight, seen = session.sight, session.seen
        if sight is None or seen is None or place is None:
            return
        if topics & {"opened", "explained"} and self.choice.options != (names := self._options()):
            self.choice.set_options(names)  # what is being typed there would be forgotten for the same ones
        self._draw_entries()
        self.where.set_text(
            f"{plain(sight.problem.channels[place[1]])}, {sight.problem.trials[place[0]]}; choose another in Compare."
        )
        self.curves.draw(await of(session.do(sight.series, session.bench.terms, place)))

    def _options(self) -> dict[str, str]:
        """What explain found first, then the whole catalogue at every place."""
        measured, found = self.session.measured, self.session.explained
        if measured is None:
            return {}
        robot = measured.robot
        names: dict[str, str] = {}
        for c in () if found is None else found.candidates:
            for t in c.terms:
                names.setdefault(t.name, f"{placed(t.name)} (of the ranking)")
        for effect in CATALOGUE.values():
            for target in (*effect.targets(robot), *effect.shared(robot)):
                name = f"{effect.name}@{target}" if target else effect.name
                names.setdefault(name, placed(name))
        return names

    def _chosen(self) -> None:
        name = self.choice.value
        entry = CATALOGUE.get(str(name).partition("@")[0]) if name else None
        self.physics.set_text("" if entry is None else f"{entry.physics} Mark in a residual: {entry.signature}")

    async def _add(self) -> None:
        if self.choice.value:
            name = str(self.choice.value)
            self.choice.set_value(None)
            await self.page.act(self.session.add, name)

    # -- entries and their sliders -------------------------------------------------------------------------------------

    def _draw_entries(self) -> None:
        entries = self.session.bench.entries
        shape = tuple((e.name, e.on, e.origin, e.intervals, e.flags) for e in entries)
        if shape != self._built:
            self._built, self._sliders = shape, {}
            self.entries.clear()
            with self.entries:
                if not entries:
                    quiet("None yet: the robot as it is described.")
                for k, entry in enumerate(entries):
                    self._entry(k, entry)
        for k, entry in enumerate(entries):
            for name, value in entry.term.values:
                slider, number = self._sliders.get((k, name), (None, None))
                if slider is not None:
                    slider.show(value)
                    number.set_value(float(f"{value:.5g}"))

    def _entry(self, k: int, entry: Entry) -> None:
        with ui.element("div").classes("entry w-full" + ("" if entry.on else " off")):
            with ui.row().classes("w-full items-center no-wrap"):
                ui.switch(
                    value=entry.on, on_change=lambda e: self.page.act(self.session.switch, k, bool(e.value), entry.name)
                ).props(f'dense aria-label="{escape(placed(entry.name))} on or off"').mark(f"switch-{k}")
                ui.label(placed(entry.name)).style("font-weight:600; flex:1 1 auto")
                quiet(entry.origin)
                ui.button(icon="straighten", on_click=lambda: self.page.begin(verbs.ADD, entry.name)).props(
                    'flat dense aria-label="judge and fit"'
                ).tooltip("Judge it on held-out data, and fit it").mark(f"judge-{k}")
                ui.button(icon="delete", on_click=lambda: self.page.act(self.session.remove, k, entry.name)).props(
                    'flat dense aria-label="remove"'
                ).mark(f"remove-{k}")
            for p, (low, high) in zip(entry.candidate.effect.parameters, entry.candidate.bounds, strict=True):
                self._slider(k, entry, p.name, low, high)
            for flag in entry.flags:
                quiet(flag)

    def _slider(self, k: int, entry: Entry, name: str, low: float, high: float) -> None:
        value, effect, term = dict(entry.term.values)[name], entry.candidate.effect, entry.term
        robot = self.session.measured.robot if self.session.measured else None
        unit = effect.parameter(name).unit if robot is None else effect.unit(name, robot, term.target)
        shown, said = "" if unit in ("1", "channel") else f" ({unit})", quantity(term, name, robot)
        with ui.row().classes("w-full items-center no-wrap gap-2"):
            with ui.column().classes("gap-0").style("flex: 1 1 auto; min-width: 0"):
                quiet(f"{said}{shown}, {low:.3g} to {high:.3g}")
                slider = Slider(low, high, (high - low) / STEPS, value,
                                lambda v: self.moves.ask((k, entry.name, name, v)),
                                lambda v: self._release((k, entry.name, name, v)))  # fmt: skip
                slider.props(f'aria-label="{escape(f"{said} of {placed(entry.name)}{shown}")}"')
                slider.mark(f"slider-{k}-{name}")
                for label, a, b in entry.intervals:
                    if label == name and high > low:
                        left, right = (min(max((v - low) / (high - low), 0.0), 1.0) for v in (a, b))
                        part = f"left:{100 * left:.1f}%; width:{100 * (right - left):.1f}%"
                        ui.html(f'<div class="band"><i style="{part}"></i></div>', sanitize=False).classes("w-full")
                        quiet(f"95 %: {a:.4g} to {b:.4g}")
            number = (
                ui.number(value=float(f"{value:.5g}"), min=low, max=high, format="%.5g")
                .style("width:104px")
                .props("dense outlined")
            )
            number.mark(f"number-{k}-{name}")
            number.on("keydown.enter", lambda: self._typed((k, entry.name, name), number.value))
            number.on("blur", lambda: self._typed((k, entry.name, name), number.value))
        self._sliders[(k, name)] = (slider, number)

    async def _move(self, move: Move) -> None:
        """While the hand is on the slider: the curve first, numbers when there is a moment for them."""
        k, entry, name, value = move
        place = self.page.place
        if place is None:
            return
        glance = await of(self.session.attempt(self.session.slide, k, {name: value}, place, entry))
        if glance is None:
            return
        self.curves.draw(glance.series, points=SKETCHED)
        background_tasks.create(self.told.ask((move, glance)))

    async def _tell(self, told: Told) -> None:
        """The value and the error of a move, unless the model is another one by then: what is settled is told otherwise."""
        await asyncio.sleep(TOLD_S)
        (k, _, name, value), glance = told
        session, error = self.session, glance.error
        if error is None and session.at_pauses and not self.moves.newer:
            error = await of(session.attempt(session.glance_whole))
        if not session.gripped or session.bench.terms != glance.terms:
            return
        number = self._sliders.get((k, name), (None, None))[1]
        if number is not None:
            number.set_value(float(f"{value:.5g}"))
        if error is not None or not session.at_pauses:
            self.page.show_error(error)

    async def _release(self, last: Move) -> None:
        """The hand is off the slider, where it stands then."""
        await self.moves.ask(last)
        while self.moves.newer:
            await asyncio.sleep(0.02)
        await self.page.act(self.session.release)

    async def _typed(self, which: tuple[int, str, str], value: float | None) -> None:
        k, entry, name = which
        had = self.session.bench.value(k, entry, name)
        if value is not None and had is not None and f"{had:.5g}" != f"{value:.5g}":
            await self._release((*which, float(value)))
