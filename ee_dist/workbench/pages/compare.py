"""Compare: how far the model is off, and where: channel by trial, over time, against what the joint did, by regime."""

from __future__ import annotations

import asyncio
from typing import Any

import numpy as np
from nicegui import background_tasks, ui

from ee_dist.discrepancy.accounts.of_compare import compare_account
from ee_dist.discrepancy.compare import by_trial
from ee_dist.discrepancy.evidence.left import leftovers
from ee_dist.tasks.results.labels import axis_of, drawn
from ee_dist.workbench import charts
from ee_dist.workbench.pages.curves import Curves
from ee_dist.workbench.pages.plot import Plot
from ee_dist.workbench.pages.robot import RobotPanel
from ee_dist.workbench.pages.view import Latest, View, heading, of, quiet
from ee_dist.workbench.sight import Cloud

AFTER_S = 0.1
"""By which points come after curves."""
CLICK = "Click on a cell to look at it. Arrow keys move on from there."
GLOWS = 3.0
"""Standard deviations at which the map's colours end at the least: noise alone is dark."""


class CompareView(View):
    name, icon = "Compare", "compare_arrows"
    topics = frozenset({"seen", "place", "look", "kept"})

    def build(self) -> None:
        with ui.element("section").classes("card"):
            self.headline = ui.label("").style("font-weight:600").mark("headline")
            self.lines = ui.column().classes("gap-0")
        with ui.element("div").classes("two"):
            with ui.element("section").classes("card"):
                heading("Measured and predicted")
                quiet("Drag sideways to zoom: every row is drawn then. Double click shows all.")
                self.curves = Curves(self.page)
            with ui.element("section").classes("card"):
                heading("Where it fails: channel by trial")
                self.map_note = quiet(CLICK)
                self.map = Plot().mark("map")
                self.map.on("plotly_click", self._clicked)
                heading("By regime")
                self.regimes = Plot()
        with ui.element("section").classes("card"):
            heading("Residual against what the joint did")
            self.cloud_note = quiet()
            self.clouds = ui.element("div").classes("clouds")
            self._parts: list[Cloud] = []
            self._unit = ""
            self.later = Latest[None](self._soon)
            self._plots: list[Any] = []
        self.robot = RobotPanel(self.page)

    async def draw(self, topics: set[str]) -> None:
        session, place = self.session, self.page.place
        sight, seen = session.sight, session.seen
        if sight is None or seen is None or place is None:
            return
        problem = sight.problem
        if "seen" in topics:
            account = compare_account(problem, seen.found, leftovers(problem, seen.residual))
            self.headline.set_text(account.headline)
            self.lines.clear()
            with self.lines:
                for line in account.lines:
                    quiet(line)
            regimes, floor = seen.found.regimes, drawn(problem, seen.found.noise_floor)
            errors = [drawn(problem, r.error) for r in regimes]
            self.regimes.draw(charts.bars([r.name for r in regimes], errors, floor, axis_of(problem)))
            self.map_note.set_text(f"{CLICK} Numbers: {axis_of(problem)}.")
        if topics & {"seen", "place"}:
            names = [f"{k}. {t}" for k, t in zip(problem.numbers, problem.trials, strict=True)]
            cells = drawn(problem, by_trial(problem, np.nan_to_num(seen.residual, posinf=0.0)))
            self.map.draw(charts.heat(cells, problem.channels, names, place, drawn(problem, GLOWS)))
        self.curves.draw(await of(session.do(sight.series, seen.terms, place)))
        if topics & {"seen", "place"}:
            self._parts = await of(session.do(sight.clouds, seen.residual, place))
            self._unit = problem.layout.units[place[1]]
        if "seen" in topics:
            self._draw_clouds()
        else:
            background_tasks.create(self.later.ask(None))
        if topics & {"kept", "seen", "place", "look"}:
            self.robot.draw(topics)

    async def _soon(self, _: None) -> None:
        """Thousands of points take a browser longer to draw than the curves, which a hand waits for."""
        await asyncio.sleep(AFTER_S)
        if not self.later.newer:
            self._draw_clouds()

    def _draw_clouds(self) -> None:
        figures = [charts.cloud(p, self._unit, self.page.span_s) for p in self._parts]
        self.cloud_note.set_text(
            "What is in sight above is coloured; a box around points marks them above."
            if figures
            else "This channel belongs to no joint."
        )
        if len(figures) != len(self._plots):
            self.clouds.clear()
            with self.clouds:
                self._plots = [Plot(f) for f in figures]
            for plot in self._plots:
                plot.on("plotly_selected", self._brushed)
                plot.on("plotly_deselect", self._unbrushed)
        else:
            for plot, figure in zip(self._plots, figures, strict=True):
                plot.draw(figure)

    def _clicked(self, event: Any) -> None:
        points = (event.args or {}).get("points") or []
        if points and points[0].get("customdata") is not None:
            trial, channel = points[0]["customdata"]
            self.page.look_at((int(trial), int(channel)))

    def _brushed(self, event: Any) -> None:
        points = (event.args or {}).get("points") or []
        times = [p["customdata"] for p in points if p.get("customdata") is not None]
        self.page.brushed_s = np.array(sorted(times)) if times else None
        self.page.changed("brush")

    def _unbrushed(self, event: Any) -> None:
        self.page.brushed_s = None
        self.page.changed("brush")
