"""The plots of the reports: overlay and residual, the map of where it fails, ranked effects, the ladder, signatures."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from plotly.subplots import make_subplots

from ee_dist.trials.log import Array

MEASURED, PREDICTED, IMPROVED, RESIDUAL = "#3f7fbf", "#e08a00", "#2e8b57", "#c0392b"
_FONT = {"family": "Inter, Segoe UI, Helvetica Neue, Arial, sans-serif", "size": 12, "color": "#1d2733"}


@dataclass(frozen=True, eq=False)
class Overlay:
    """One channel of one trial: series (T,), and with what the improved model says, if there is one."""

    title: str
    unit: str
    times_s: Array
    measured: Array
    predicted: Array
    improved: Array | None = None


@dataclass(frozen=True, eq=False)
class Cloud:
    """Residuals (n,) over something (n,), before and perhaps after."""

    label: str
    x: Array
    before: Array
    after: Array | None = None


def _styled(figure: go.Figure, height: int) -> go.Figure:
    figure.update_layout(
        template="plotly_white",
        font=_FONT,
        height=height,
        margin={"l": 60, "r": 20, "t": 40, "b": 45},
        legend={"orientation": "h", "y": 1.0, "yanchor": "bottom", "x": 0},
        hovermode="x unified",
    )
    return figure


def overlays(items: Sequence[Overlay]) -> go.Figure:
    """A row for each channel: measured and predicted on the left, residual on the right."""
    titles = [t for o in items for t in (o.title, "residual")]
    figure = make_subplots(rows=len(items), cols=2, column_widths=[0.62, 0.38], subplot_titles=titles,
                           vertical_spacing=0.32 / max(len(items), 1), horizontal_spacing=0.07)  # fmt: skip
    for r, o in enumerate(items, start=1):
        first = r == 1
        series = [("measured", o.measured, MEASURED, 3.0), ("model", o.predicted, PREDICTED, 1.4)]
        if o.improved is not None:
            series.append(("improved model", o.improved, IMPROVED, 1.4))
        for name, values, colour, width in series:
            line = {"color": colour, "width": width}
            opacity = 0.55 if name == "measured" else 1.0
            figure.add_scatter(x=o.times_s, y=values, name=name, line=line, opacity=opacity, legendgroup=name,
                               showlegend=first, mode="lines", row=r, col=1)  # fmt: skip
            if name != "measured":
                figure.add_scatter(x=o.times_s, y=o.measured - values, line={"color": colour, "width": 1.0}, mode="lines",
                                   name=f"measured - {name}", legendgroup=name, showlegend=False, row=r, col=2)  # fmt: skip
        figure.update_yaxes(title_text=o.unit, row=r, col=1)
    figure.update_xaxes(title_text="s", row=len(items))
    figure = _styled(figure, 90 + 190 * len(items))
    figure.update_layout(legend={"orientation": "h", "y": 1.0 + 0.16 / len(items), "yanchor": "bottom"})
    return figure


def heat_map(
    tables: Sequence[Array], segments: Sequence[str], channels: Sequence[str], floor: float = 1.0
) -> go.Figure:
    """(segments, channels) root mean squares, one table or before and after; white is the noise."""
    shown = [k for k in range(tables[0].shape[1]) if any(t[:, k].any() for t in tables)]
    top = max(4.0, float(np.quantile(tables[0][:, shown], 0.98)))
    titles = ["before", "after"] if len(tables) > 1 else None
    figure = make_subplots(rows=len(tables), cols=1, shared_xaxes=True, subplot_titles=titles, vertical_spacing=0.06)
    for row, table in enumerate(tables, start=1):
        figure.add_trace(
            go.Heatmap(
                z=table[:, shown].T,
                x=list(segments),
                y=[channels[k].replace("_", " ") for k in shown],
                coloraxis="coloraxis",
                hovertemplate="%{y}<br>%{x}<br>%{z:.2f} standard deviations<extra></extra>",
            ),
            row=row,
            col=1,
        )
    _styled(figure, 140 + (20 + 17 * len(shown)) * len(tables))
    scale = [[0, "#f7fbff"], [min(1.3 * floor / top, 0.9), "#e6eef7"], [0.95, "#b5261e"], [1, "#7a0f0a"]]
    bar = {"title": {"text": "standard deviations", "side": "right"}, "thickness": 12}
    figure.update_layout(
        coloraxis={"cmin": 0.0, "cmax": top, "colorscale": scale, "colorbar": bar},
        hovermode="closest",
        margin={"l": 170, "r": 20, "t": 30, "b": 110},
    )
    figure.update_yaxes(autorange="reversed")
    figure.update_xaxes(tickangle=-60, tickfont={"size": 10})
    return figure


def ranking(
    names: Sequence[str], gains: Sequence[float], intervals: Sequence[tuple[float, float]], kinds: Sequence[str]
) -> go.Figure:
    """Gain on held-out data with its interval, in percent. ``kinds``: best, tied, earned or not."""
    colours = {"best": "#1769aa", "tied": "#67a9d8", "earned": "#a9b8c6", "not": "#dde3e9"}
    low = [max(0.0, 100 * (g - i[0])) for g, i in zip(gains, intervals, strict=True)]
    high = [max(0.0, 100 * (i[1] - g)) for g, i in zip(gains, intervals, strict=True)]
    figure = go.Figure(
        go.Bar(
            x=[100 * g for g in gains],
            y=list(names),
            orientation="h",
            marker_color=[colours[k] for k in kinds],
            error_x={
                "type": "data",
                "array": high,
                "arrayminus": low,
                "color": "#5d6b7a",
                "thickness": 1.2,
                "width": 4,
            },
            hovertemplate="%{y}: %{x:.1f} %<extra></extra>",
        )
    )
    _styled(figure, 110 + 34 * len(names))
    least = min([100 * i[0] for i in intervals] + [0.0])
    figure.update_xaxes(
        title_text="of what is above the noise, taken off on held-out data (%)", range=[max(least - 3, -25), 104]
    )
    figure.update_yaxes(autorange="reversed", automargin=True)
    figure.update_layout(margin={"l": 20, "r": 20, "t": 10, "b": 45}, hovermode="closest")
    return figure


def ladder(names: Sequence[str], fit: Sequence[float], heldout: Sequence[float], floor: float) -> go.Figure:
    """Error of each model from the first to the last, and the noise floor."""
    figure = go.Figure()
    figure.add_scatter(
        x=list(names),
        y=list(heldout),
        name="held out",
        mode="lines+markers+text",
        line={"color": MEASURED, "width": 3},
        marker={"size": 10},
        text=[f"{v:.2f}" for v in heldout],
        textposition="top center",
    )
    figure.add_scatter(
        x=list(names), y=list(fit), name="fitted", mode="lines+markers", line={"color": PREDICTED, "dash": "dot"}
    )
    figure.add_hline(y=floor, line={"color": IMPROVED, "dash": "dash"}, annotation_text=f"noise floor {floor:.2f}",
                     annotation_position="bottom left")  # fmt: skip
    _styled(figure, 340)
    figure.update_xaxes(range=[-0.4, len(names) - 0.6])
    figure.update_layout(yaxis_range=[0, 1.25 * max(max(heldout), floor)])
    figure.update_yaxes(title_text="error (standard deviations)", rangemode="tozero")
    return figure


def signatures(panels: Sequence[tuple[str, Sequence[Cloud]]]) -> go.Figure:
    """For each channel, residuals against position, speed, command and load, with the mean over each tenth of the range."""
    columns = max(len(p) for _, p in panels)
    labels = [c.label for _, p in panels for c in p]
    figure = make_subplots(rows=len(panels), cols=columns, subplot_titles=labels, vertical_spacing=0.3 / len(panels),
                           horizontal_spacing=0.05)  # fmt: skip
    for r, (title, parts) in enumerate(panels, start=1):
        for c, cloud in enumerate(parts, start=1):
            series = [("before", cloud.before, RESIDUAL)]
            if cloud.after is not None:
                series.append(("after", cloud.after, IMPROVED))
            for name, y, colour in series:
                first = r == 1 and c == 1
                marker = {"color": colour, "size": 4, "opacity": 0.25}
                figure.add_scattergl(x=cloud.x, y=y, mode="markers", marker=marker, name=name, legendgroup=name,
                                     showlegend=first and len(series) > 1, row=r, col=c)  # fmt: skip
                at, mean = _trend(cloud.x, y)
                line = {"color": colour, "width": 3}
                figure.add_scatter(x=at, y=mean, mode="lines", line=line, showlegend=False, legendgroup=name,
                                   hoverinfo="skip", row=r, col=c)  # fmt: skip
        figure.update_yaxes(title_text=title, row=r, col=1)
    figure = _styled(figure, 80 + 220 * len(panels))
    figure.update_layout(hovermode="closest")
    return figure


def _trend(x: Array, y: Array, bins: int = 24) -> tuple[Array, Array]:
    """Middles and means of the bins that hold anything."""
    edges = np.linspace(float(x.min()), float(x.max()) + 1e-12, bins + 1)
    which = np.clip(np.digitize(x, edges) - 1, 0, bins - 1)
    count = np.bincount(which, minlength=bins)
    mean = np.bincount(which, weights=np.nan_to_num(y), minlength=bins) / np.maximum(count, 1)
    middle = (edges[:-1] + edges[1:]) / 2
    return middle[count > 2], mean[count > 2]


def bars(names: Sequence[str], values: Sequence[float], label: str, floor: float | None = None) -> go.Figure:
    """Horizontal bars, the longest first."""
    figure = go.Figure(go.Bar(x=list(values), y=list(names), orientation="h", marker_color=MEASURED))
    if floor is not None:
        figure.add_vline(x=floor, line={"color": IMPROVED, "dash": "dash"}, annotation_text="noise floor")
    _styled(figure, 110 + 24 * len(names))
    figure.update_xaxes(title_text=label)
    figure.update_yaxes(autorange="reversed", automargin=True)
    figure.update_layout(margin={"l": 20, "r": 20, "t": 20, "b": 45}, hovermode="closest")
    return figure
