"""A chart on the page, which plotly draws in the browser."""

from __future__ import annotations

from typing import Any

from nicegui.element import Element

from ee_dist.workbench.charts import Chart
from ee_dist.workbench.drawing import ADDRESS


class Plot(Element, component="plot.js"):
    """Nothing is drawn before there is a figure. ``height``: pixels that are kept free until then."""

    def __init__(self, figure: Chart | None = None, height: int = 0) -> None:
        super().__init__()
        self.figure = figure
        # The class that plotly gives it, too: it stays when the toolkit writes the classes anew.
        self.classes("js-plotly-plot w-full")
        if height:
            self.style(f"min-height: {height}px")
        with self._props.suspend_updates():
            self._props["figure"] = figure
        self._update_method = "update"

    def draw(self, figure: Chart) -> None:
        """Another figure."""
        self.figure = figure
        with self._props.suspend_updates():
            self._props["figure"] = figure
        self.update()

    def follow(self, figure: Chart) -> None:
        """Another figure, for a hand that waits for it. Where it differs in the numbers of its lines alone only these are sent,
        and the toolkit, which goes through the whole page at every message of its own, has nothing to do."""
        if self.figure is None or not same_but_numbers(self.figure, figure):
            self.draw(figure)
            return
        self.figure = figure
        self.run_method("renumber", [line["x"] for line in figure["data"]], [line["y"] for line in figure["data"]])


def preload() -> str:
    """HTML for the head of the page: plotly is loaded while the page is built, not when the first chart asks for it."""
    return f'<link rel="modulepreload" href="{ADDRESS}" />'


def same_but_numbers(figure: Chart, other: Chart) -> bool:
    """Whether they differ in the numbers of their lines at most."""
    return _without_numbers(figure) == _without_numbers(other)


def _without_numbers(figure: Chart) -> Any:
    lines = [{k: v for k, v in line.items() if k not in ("x", "y")} for line in figure["data"]]
    return lines, figure["layout"], figure["config"]
