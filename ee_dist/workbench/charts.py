"""The charts of the page as plain data for plotly: what is drawn, and in which colours.

Colours are those of Okabe and Ito, which the colour-blind can tell; what matters is told apart by shape or width too.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from ee_dist.discrepancy.words import plain
from ee_dist.trials.log import Array
from ee_dist.viewing.curves import Overlay
from ee_dist.viewing.labels import STANDOFF, cut, cut_marks, left_edge, wrapped
from ee_dist.workbench.bench import Step
from ee_dist.workbench.sight import Cloud

Chart = dict[str, Any]
MEASURED, PREDICTED, RESIDUAL, MARK, FLOOR, MARKED = "#0072b2", "#e69f00", "#c04a00", "#009e73", "#8a5fbf", "#cc79a7"
DOTS = 1500
"""Points of a cloud that are drawn."""
NUMBERED = 150
"""Cells of a map up to which each has its number in it."""
CHANNEL, TRIAL, ACROSS = 18, 20, 36
"""Letters beside a map in a line of a channel's name, of a trial's name on end, and of all trials' names side by side."""
NAME, LINE = 24, 18
"""Letters that fit beside the upper curves before they run into what is told of the lower ones, and pixels of another line."""
MARGIN = {"l": 56, "r": 14, "t": 28, "b": 40}
DIGITS = 6
TIME_DIGITS = 6
"""Of a second, so that every row of a fast log has its own place."""
_FONT = {"family": "Inter, Segoe UI, Helvetica Neue, Arial, sans-serif", "size": 12, "color": "#1d2733"}
_CONFIG = {
    "displaylogo": False,
    "modeBarButtonsToRemove": ["toImage", "lasso2d", "autoScale2d"],
    # Plotly would offer to send what was measured to its makers' servers.
    "showSendToCloud": False,
}
_STILL = {"displayModeBar": False}
"""Of charts in which there is nothing to zoom into."""


def _chart(data: list[Chart], height: int, **layout: Any) -> Chart:
    for axis in ("xaxis", "yaxis", *(["yaxis2"] if "yaxis2" in layout else [])):
        # To find out whether a number at an axis has room plotly measures the page, and a browser lays all of it out for that.
        layout[axis] = {"zeroline": axis == "yaxis2", "ticklabeloverflow": "allow", **layout.get(axis, {})}
    return {
        "data": data,
        "layout": {
            "font": _FONT,
            "height": height,
            "margin": MARGIN,
            "legend": {"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
            "paper_bgcolor": "rgba(0,0,0,0)",
            "plot_bgcolor": "#ffffff",
            "hovermode": "closest",
            "modebar": {"bgcolor": "rgba(0,0,0,0)", "color": "#8899aa", "activecolor": "#0072b2"},
            **layout,
        },
        "config": _STILL if layout.get("dragmode") is False else _CONFIG,
    }


Row = tuple[float | None, ...]
"""Numbers as they are sent. No list: the toolkit watches each item of a list for changes, which takes longer than to draw."""


def _short(values: Array) -> Row:
    """As many digits of the largest as can be seen; gaps where there is no number."""
    finite = np.isfinite(values)
    top = np.abs(values[finite]).max(initial=0.0)
    out = np.round(values, DIGITS - int(np.ceil(np.log10(top))) if top > 0 else 0).tolist()
    return tuple(out if finite.all() else (v if ok else None for v, ok in zip(out, finite, strict=True)))


def _times(values: Array) -> Row:
    """(n,) s."""
    return tuple(np.round(values, TIME_DIGITS).tolist())


def overlay(
    curve: Overlay, key: str, brushed_s: Array | None = None, mark: tuple[str, Array] | None = None, height: int = 400
) -> Chart:
    """Measured over predicted, and below it what is left. ``key``: as long as it stays, so does the zoom; ``brushed_s`` (k,):
    times to point out; ``mark``: a name, and what that would make of the residual."""
    times = _times(curve.times_s)
    left = curve.measured - curve.predicted
    data: list[Chart] = [
        _line(times, curve.measured, "measured", MEASURED, 4.0, opacity=0.55),
        _line(times, curve.predicted, "predicted", PREDICTED, 2.0),
        _line(times, left, "measured - predicted", RESIDUAL, 1.5, yaxis="y2"),
    ]
    if curve.improved is not None:
        data.insert(2, _line(times, curve.improved, "with it", MARK, 2.0, dash="dash"))
    if mark is not None:
        data.append(_line(times, mark[1], mark[0], MARK, 3.0, yaxis="y2", dash="dash"))
    if brushed_s is not None and len(brushed_s):
        near = np.searchsorted(curve.times_s, brushed_s).clip(0, len(times) - 1)
        near = np.unique(near)
        data.append({"type": "scatter", "mode": "markers", "x": [times[k] for k in near], "y": _short(left[near]),
                     "name": "chosen", "yaxis": "y2",
                     "marker": {"color": MARKED, "size": 5, "symbol": "circle-open"}})  # fmt: skip
    unit = "" if curve.unit == "1" else f" ({curve.unit})"
    name = wrapped(f"{curve.channel}{unit}", NAME)
    lines = name.count("<br>")
    return _chart(
        data,
        height,
        uirevision=key,
        margin=MARGIN | {"l": MARGIN["l"] + lines * LINE},
        hovermode="x unified",
        dragmode="zoom",
        xaxis={"title": {"text": "s", "standoff": 4}, "anchor": "y2", "gridcolor": "#e8edf2"},
        yaxis={
            "domain": [0.38, 1.0],
            # Where it is left to plotly, further lines go towards the numbers.
            "title": {"text": name, **({"standoff": 4 + lines * LINE} if lines else {})},
            "gridcolor": "#e8edf2",
            "fixedrange": True,
        },
        yaxis2={
            "domain": [0.0, 0.3],
            "title": {"text": f"residual{unit}"},
            "gridcolor": "#e8edf2",
            "zerolinecolor": "#8899aa",
            "fixedrange": True,
        },
    )


def _line(x: Row, y: Array, name: str, colour: str, width: float, **more: Any) -> Chart:
    line = {"color": colour, "width": width}
    if "dash" in more:
        line["dash"] = more.pop("dash")
    return {"type": "scatter", "mode": "lines", "x": x, "y": _short(y), "name": name, "line": line, **more}


def cloud(part: Cloud, channel_unit: str, span_s: tuple[float, float] | None = None) -> Chart:
    """Residuals of a channel against one thing; those of a stretch of time are pointed out, and a box chooses some."""
    thin = slice(None, None, max(1, len(part.x) // DOTS))
    x, y, t = part.x[thin], part.residual[thin], part.times_s[thin]
    inside = np.ones(len(t), dtype=bool) if span_s is None else (t >= span_s[0]) & (t <= span_s[1])
    data = []
    for mask, colour, size, name in ((~inside, "#b8c2cc", 4, "elsewhere"), (inside, RESIDUAL, 5, "in sight")):
        data.append({"type": "scatter", "mode": "markers", "x": _short(x[mask]),
                     "y": _short(y[mask]), "customdata": _times(t[mask]), "name": name,
                     "marker": {"color": colour, "size": size, "opacity": 0.5}, "hoverinfo": "x+y"})  # fmt: skip
    return _chart(
        data,
        210,
        showlegend=False,
        dragmode="select",
        margin={"l": 52, "r": 8, "t": 8, "b": 38},
        xaxis={"title": {"text": f"{part.against} ({part.unit})", "standoff": 4}, "gridcolor": "#e8edf2",
               "zeroline": True, "zerolinecolor": "#8899aa"},
        yaxis={"title": {"text": f"residual ({channel_unit})"}, "gridcolor": "#e8edf2",
               "zeroline": True, "zerolinecolor": "#8899aa"},
    )  # fmt: skip


def heat(
    table: Array, channels: Sequence[str], trials: Sequence[str], chosen: tuple[int, int] | None, least_top: float
) -> Chart:
    """(trials, channels) errors, to click on; channels without a value are left out by the caller's names being empty.
    ``least_top``: where the colours end at the least, so that noise alone does not glow."""
    shown = [k for k in range(table.shape[1]) if table[:, k].any()]
    z = table[:, shown].T
    top = max(least_top, float(np.nanquantile(z, 0.98))) if z.size else least_top
    names = [plain(channels[k]) for k in shown]
    rows = [wrapped(cut(n, 2 * CHANNEL), CHANNEL) for n in names]
    # Where a word would be broken, names stand on end; all of a name is told where the mouse is.
    each = ACROSS // max(len(trials), 1)
    on_end = any(len(word) > each for t in trials for word in t.split())
    labels = [cut(t, TRIAL) if on_end else wrapped(t, each) for t in trials]
    trace: Chart = {
        "type": "heatmap", "z": [_short(row) for row in z], "x": list(range(len(trials))), "y": list(range(len(shown))),
        "customdata": [[[t, k] for t in range(len(trials))] for k in shown], "zmin": 0.0, "zmax": top, "colorscale": "Cividis",
        "text": [[f"{names[r]}<br>{trials[t]}<br>{z[r, t]:.3g}" for t in range(len(trials))] for r in range(len(shown))],
        "hoverinfo": "text", "xgap": 2, "ygap": 2,
        "colorbar": {"thickness": 10, "nticks": 4, "title": {"text": "error", "side": "right"}},
    }  # fmt: skip
    if z.size <= NUMBERED:
        trace |= {"texttemplate": "%{z:.2~r}", "textfont": {"size": 11}}
    shapes = []
    if chosen is not None and chosen[1] in shown:
        row = shown.index(chosen[1])
        shapes.append({"type": "rect", "x0": chosen[0] - 0.5, "x1": chosen[0] + 0.5, "y0": row - 0.5, "y1": row + 0.5,
                       "line": {"color": "#d55e00", "width": 3}})  # fmt: skip
    return _rows(
        trace,
        90 + (30 if any("<br>" in r for r in rows) else 24) * len(shown) + (90 if on_end else 0),
        {"tickvals": list(range(len(trials))), "ticktext": labels, "automargin": True, "showgrid": False,
         "tickangle": -90 if on_end else 0},
        {"tickvals": list(range(len(shown))), "ticktext": rows, "showgrid": False},
        shapes=shapes,
        margin={"l": 10, "r": 10, "t": 8, "b": 30},
    )  # fmt: skip


def bars(names: Sequence[str], values: Sequence[float], floor: float, axis: str = "error") -> Chart:
    """Errors by regime, largest first, and where noise alone would end them."""
    order = sorted(range(len(names)), key=lambda k: -values[k])
    trace = {"type": "bar", "orientation": "h", "x": _short(np.array([values[k] for k in order])),
             "y": [names[k] for k in order], "marker": {"color": RESIDUAL}, "hoverinfo": "x+y"}  # fmt: skip
    return _rows(
        trace,
        70 + 22 * len(names),
        {"title": {"text": axis}, "rangemode": "tozero"},
        {"ticklabelstandoff": STANDOFF},
        margin={"l": 10, "r": 14, "t": 24, "b": 36},
        shapes=[_floor_line(floor, "x")],
        annotations=[{"x": floor, "y": 1, "yref": "paper", "yanchor": "bottom", "showarrow": False, "text": "noise floor",
                      "font": {"color": FLOOR, "size": 11}}],
    )  # fmt: skip


def _rows(trace: Chart, height: int, xaxis: Chart, yaxis: Chart, **layout: Any) -> Chart:
    """A chart that lists things, the first on top; nothing in it to zoom into."""
    across = {"fixedrange": True, **xaxis}
    down = {"autorange": "reversed", "automargin": True, "fixedrange": True, **yaxis}
    return _chart([trace], height, dragmode=False, xaxis=across, yaxis=down, **layout)


def _floor_line(floor: float, axis: str) -> Chart:
    other = "y" if axis == "x" else "x"
    return {"type": "line", f"{axis}0": floor, f"{axis}1": floor, f"{other}0": 0, f"{other}1": 1, f"{other}ref": "paper",
            "line": {"color": FLOOR, "width": 2, "dash": "dot"}}  # fmt: skip


def ladder(steps: Sequence[Step], floor: float, axis: str = "error") -> Chart:
    """Fitted and held-out error of each step apart; what was refused is crossed out."""
    places = list(range(len(steps)))
    held = [k for k in places if steps[k].error_heldout is not None and not steps[k].refused]
    hand = [k for k in places if steps[k].error_heldout is None]
    refused = [k for k in places if steps[k].refused]
    fitted = [k for k in places if k not in hand]

    def at(rows: Sequence[int], values: Sequence[float | None], name: str, **more: Any) -> Chart:
        return {"type": "scatter", "x": list(rows), "y": _short(np.array(values, dtype=float)), "name": name, **more}

    tops = [v for s in steps for v in (s.error_fit, s.error_heldout) if v is not None and np.isfinite(v)]
    top = 1.2 * max([floor, *tops])
    numbers = [f"{steps[k].error_heldout:.3g}" for k in held]
    written = [_beside(steps[k].error_heldout or 0.0, floor, top) for k in held]
    data = [
        at(fitted, [steps[k].error_fit for k in fitted], "where it was fitted", mode="lines+markers",
           line={"color": PREDICTED, "dash": "dot", "width": 2},
           marker={"symbol": "circle-open", "size": 16, "line": {"width": 2}}),
        at(held, [steps[k].error_heldout for k in held], "held out", mode="lines+markers+text", text=numbers,
           textposition=written, line={"color": MEASURED, "width": 3}, marker={"symbol": "square", "size": 10}),
        at(hand, [steps[k].error_fit for k in hand], "set by hand, all data seen", mode="markers",
           marker={"symbol": "diamond-open", "size": 11, "color": "#5a6672", "line": {"width": 2}}),
        at(refused, [steps[k].error_heldout for k in refused], "refused", mode="markers",
           marker={"symbol": "x", "size": 13, "color": RESIDUAL}),
    ]  # fmt: skip
    labels = [wrapped(s.name, 16) + ("<br><b>refused</b>" if s.refused else "") for s in steps]
    return _chart(
        [d for d in data if d["x"]],
        360,
        dragmode=False,
        shapes=[_floor_line(floor, "y")],
        annotations=[{"x": 0, "xref": "paper", "xanchor": "left", "y": floor, "yanchor": "bottom", "showarrow": False,
                      "text": f"noise floor {floor:.3g}", "font": {"color": FLOOR}}],
        xaxis={"tickvals": places, "ticktext": labels, "range": [-0.5, len(steps) - 0.5], "automargin": True, "fixedrange": True},
        yaxis={"title": {"text": axis}, "range": [0, top], "gridcolor": "#e8edf2", "fixedrange": True},
    )  # fmt: skip


def _beside(value: float, floor: float, top: float) -> str:
    """Where a number is written, so that the line of the floor does not go through it."""
    return "bottom center" if 0 <= floor - value < 0.1 * top and value > 0.08 * top else "top center"


def ranking(
    names: Sequence[str], gains: Sequence[float], intervals: Sequence[tuple[float, float]], kinds: Sequence[str]
) -> Chart:
    """Gain above the noise on held-out data with its interval, in percent; hatched: refused."""
    fill = {"best": "#0072b2", "tied": "#56b4e9", "earned": "#8fa3b5", "not": "#ffffff"}
    low = [max(0.0, 100 * (g - i[0])) for g, i in zip(gains, intervals, strict=True)]
    high = [max(0.0, 100 * (i[1] - g)) for g, i in zip(gains, intervals, strict=True)]
    trace = {
        "type": "bar", "orientation": "h", "x": _short(100 * np.array(gains)), "y": [wrapped(n) for n in names],
        "marker": {"color": [fill[k] for k in kinds], "line": {"color": "#56636f", "width": 1},
                   "pattern": {"shape": ["/" if k == "not" else "" for k in kinds], "fgcolor": "#56636f", "size": 6}},
        "error_x": {"type": "data", "array": _short(np.array(high)), "arrayminus": _short(np.array(low)), "symmetric": False,
                    "color": "#1d2733", "thickness": 1.2, "width": 4}, "hovertemplate": "%{y}: %{x:.1f} %<extra></extra>",
    }  # fmt: skip
    return _rows(
        trace,
        104 + 36 * len(names),
        {
            "title": {"text": "gain above the noise,<br>held out (%)", "standoff": 4},
            "range": [left_edge(intervals), 106],
        },
        {"ticklabelstandoff": STANDOFF},
        showlegend=False,
        annotations=cut_marks(names, gains, intervals),
        margin={"l": 10, "r": 20, "t": 8, "b": 56},
    )


def course(
    curves: Sequence[tuple[str, Sequence[float], str]],
    unit: str,
    height: int = 260,
    places: Sequence[str] | None = None,
) -> Chart:
    """Some numbers one after the other: (name, values, colour)."""
    data = [
        {"type": "scatter", "mode": "lines+markers", "x": list(range(len(values))), "y": _short(np.array(values, dtype=float)),
         "name": name, "line": {"color": colour, "width": 2}, "marker": {"symbol": symbol, "size": 8 if places else 4}}
        for (name, values, colour), symbol in zip(curves, ("circle", "square", "diamond", "x"), strict=False)
    ]  # fmt: skip
    axis: Chart = {"fixedrange": True, "automargin": True}
    if places is not None:
        axis |= {"tickvals": list(range(len(places))), "ticktext": [wrapped(p, 12) for p in places]}
    return _chart(data, height, dragmode=False, xaxis=axis,
                  yaxis={"title": {"text": unit}, "gridcolor": "#e8edf2", "rangemode": "tozero", "fixedrange": True})  # fmt: skip
