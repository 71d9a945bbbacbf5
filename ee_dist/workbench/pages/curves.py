"""Curves of one channel of one trial: drawn thin, exact where one zooms in, and linked to what else is in sight."""

from __future__ import annotations

from typing import Any

import numpy as np

from ee_dist.discrepancy.problem import Series
from ee_dist.discrepancy.words import plain
from ee_dist.trials.log import Array
from ee_dist.viewing.curves import Overlay
from ee_dist.workbench import charts
from ee_dist.workbench.pages.desk import Desk
from ee_dist.workbench.pages.plot import Plot
from ee_dist.workbench.thin import POINTS, stretch

HOVERED = "(e) => window.robotAt?.(e.points[0].x)"
"""In the browser alone: a mouse that moves asks nothing of the session."""


class Curves:
    """A chart of the place that the page looks at."""

    def __init__(self, page: Desk, height: int = 400) -> None:
        self.page, self.height = page, height
        self.plot = Plot(height=height)
        self.plot.on("plotly_relayout", self._zoomed)
        self.plot.on("plotly_hover", js_handler=HOVERED)
        self.drawn = 0

    def draw(
        self,
        series: Series | None,
        mark: tuple[str, Array] | None = None,
        better: Array | None = None,
        points: int = POINTS,
    ) -> None:
        """``mark`` (T,) over the residual, ``better`` (T,) over the prediction; ``points`` that are drawn at most: fewer than
        all are for a hand that waits for them."""
        sight = self.page.session.sight
        if series is None or sight is None:
            return
        problem = sight.problem
        name = f"{plain(problem.channels[series.channel])}, {problem.trials[series.trial]}"
        curve = Overlay(
            name, problem.trials[series.trial], series.unit, series.times_s, series.measured, series.predicted, better
        )
        begin_s, end_s = self.page.span_s or (None, None)
        part = stretch(curve, begin_s, end_s, points)
        shown = None
        if mark is not None:
            shown = (mark[0], np.interp(part.curve.times_s, series.times_s, mark[1]))
        key = f"{series.trial}:{series.channel}:{begin_s is None}"
        figure = charts.overlay(part.curve, key, self.page.brushed_s, shown, self.height)
        if points < POINTS:
            self.plot.follow(figure)
        else:
            self.plot.draw(figure)
        self.drawn += 1

    def _zoomed(self, event: Any) -> None:
        moved = event.args if isinstance(event.args, dict) else {}
        if "xaxis.range[0]" in moved and "xaxis.range[1]" in moved:
            self.page.span_s = (float(moved["xaxis.range[0]"]), float(moved["xaxis.range[1]"]))
        elif moved.get("xaxis.autorange"):
            self.page.span_s = None
        else:
            return
        self.page.changed("span")
