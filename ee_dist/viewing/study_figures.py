"""Figures of a study: distances by case (the paper's Fig. 7), dominants (Fig. 8), and evolution on the body (Fig. 1)."""

from __future__ import annotations

import textwrap
from collections import defaultdict
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import plotly.graph_objects as go

from ee_dist.viewing.report_figures import styled

STAGES = {"intact": "#8a94a6", "after the change": "#e08a1e", "last trial": "#3b7dd8"}
"""What the bars of a case are, and their colours."""
METRICS = {"rolling_mean": "diagnosed by rolling means", "distance": "diagnosed by distance"}
LINES = ("#3b7dd8", "#e08a1e", "#7a5bd0", "#2f9e6e")
LABEL = 13
"""Characters of a line of a case's name below its bars."""
MANY, SHORT_LABEL = 10, 10
"""Of more cases than this the lines have fewer characters."""
ROOM = 0.12
"""Free share of the axis beyond the farthest bar with its spread."""

Tests = Mapping[tuple[str, int], str]
"""By metric and scenario what a test said, in a few words."""
Curve = Sequence[tuple[int, float]]
"""(trials on the body so far, best distance in m) of each generation."""


def distances(
    summaries: Sequence[dict[str, Any]], metric: str, tests: Tests, also: Sequence[dict[str, Any]] = (),
    last: str = "last trial",
) -> go.Figure:  # fmt: skip
    """Mean forward distance intact, after the change and at the last trial for each case, every run as a dot.

    Runs of ``also`` are not drawn, but the axis has room for them: figures of several metrics are then of one scale. ``last``:
    what the last trial is called.
    """
    groups: dict[int, list[dict[str, Any]]] = defaultdict(list)
    for s in summaries:
        groups[s["scenario"]].append(s)
    cases = sorted(groups)
    figure = go.Figure()
    low, high = 0.0, 0.0
    for k, (name, colour) in enumerate(STAGES.items()):
        values = [np.array([_distance(s["distance_m"], name) for s in groups[c]]) for c in cases]
        means, spread = [float(v.mean()) for v in values], [float(v.std()) for v in values]
        # Cases stand at whole numbers, the bars of a case and the dots of its runs beside each other.
        at = [i + (k - 1) * 0.27 for i in range(len(cases))]
        figure.add_bar(
            x=at,
            y=means,
            width=0.25,
            name=(called := last if name == "last trial" else name),
            marker_color=colour,
            opacity=0.75,
            error_y={"array": spread, "width": 3, "color": "#7d8b9a"},
            hovertemplate=f"{called}: %{{y:.2f}} m<extra></extra>",
        )
        figure.add_scatter(
            x=[a for a, v in zip(at, values, strict=True) for _ in v],
            y=[float(x) for v in values for x in v],
            mode="markers",
            marker={"color": colour, "size": 5, "line": {"color": "#ffffff", "width": 0.5}},
            showlegend=False,
            hovertemplate=f"{called}: %{{y:.2f}} m<extra></extra>",
        )
        for v, mean, wide in zip(values, means, spread, strict=True):
            low, high = min(low, mean - wide, float(v.min())), max(high, mean + wide, float(v.max()))
    for s in also:
        values_m = [_distance(s["distance_m"], name) for name in STAGES]
        low, high = min(low, *values_m), max(high, *values_m)
    room = ROOM * ((high - low) or 1.0)
    said = [(i, tests[metric, c]) for i, c in enumerate(cases) if tests.get((metric, c))]
    for i, told in said:
        figure.add_annotation(x=i, y=high + room / 5, yanchor="bottom", text=told, showarrow=False)
    styled(figure, 430)
    width = LABEL if len(cases) <= MANY else SHORT_LABEL
    full = [_wrapped(f"{c}. {groups[c][0].get('title') or 'scenario'}", width) for c in cases]
    # On a narrow page a case has room for its number alone, and what the test says stands upright.
    short = [str(c) for c in cases] if len(cases) > 3 else full
    upright = -90 if len(cases) > 3 else 0
    least = low - (room if low < 0 else 0.0)
    wide_range, narrow_range = [least, high + room], [least, high + (2.5 if upright else 1.0) * room]
    figure.update_layout(
        barmode="overlay",
        hovermode="closest",
        meta={
            "narrow": {"xaxis.ticktext": short, "yaxis.range": narrow_range, **_turned(len(said), upright)},
            "wide": {"xaxis.ticktext": full, "yaxis.range": wide_range, **_turned(len(said), 0)},
        },
    )
    figure.update_xaxes(
        tickmode="array", tickvals=list(range(len(cases))), ticktext=full, tickangle=0, automargin=True, showgrid=False
    )
    figure.update_yaxes(title_text="distance (m)", range=wide_range)
    return figure


def _turned(count: int, angle: int) -> dict[str, object]:
    """Angle of what is written above the bars, in degrees."""
    return {f"annotations[{k}].textangle": angle for k in range(count)}


def dominants(summaries: Sequence[dict[str, Any]]) -> go.Figure:
    """New bests found so far in the diagnosis passes for each metric: the mean of all runs, and in the band the middle half of
    the runs (each the mean of its passes)."""
    figure, longest, most = go.Figure(), 0, 0.0
    for k, metric in enumerate(sorted({s["metric"] for s in summaries})):
        runs = [_mean_curve(s["dominants"]["diagnosis"]) for s in summaries if s["metric"] == metric]
        shortest = min(map(len, runs))
        curves = np.array([c[:shortest] for c in runs])
        low, high = np.quantile(curves, [0.25, 0.75], axis=0)
        longest, most = (
            max(longest, shortest),
            max(most, float(high.max(initial=0.0)), float(curves.mean(axis=0).max())),
        )
        name, colour, at = METRICS.get(metric, metric), LINES[k % len(LINES)], list(range(shortest))
        figure.add_scatter(x=[*at, *reversed(at)], y=[*map(float, high), *map(float, low[::-1])], fill="toself", mode="none",
                           fillcolor=colour, opacity=0.18, showlegend=False, hoverinfo="skip", name=name)  # fmt: skip
        line = {"color": colour, "width": 2.5}
        mean = [float(v) for v in curves.mean(axis=0)]
        figure.add_scatter(x=at, y=mean, name=name, mode="lines", line=line, hovertemplate="%{y:.1f}")
    styled(figure, 330)
    figure.update_layout(showlegend=True)
    figure.update_xaxes(title_text="generation", rangemode="tozero", dtick=1 if longest < 10 else None)
    figure.update_yaxes(title_text="new bests so far", range=[0, (1 + ROOM) * (most or 1.0)])
    return figure


def _mean_curve(passes: Sequence[Sequence[int]]) -> list[float]:
    """Mean over the passes of a run, as long as the shortest."""
    shortest = min(map(len, passes))
    return [float(v) for v in np.mean([p[:shortest] for p in passes], axis=0)]


def on_the_body(before: Curve, after: Curve) -> go.Figure:
    """Best distance over the trials on the body, before the change and after it."""
    figure = go.Figure()
    for name, curve in (("intact", before), ("after the change", after)):
        line = {"color": STAGES[name], "width": 2}
        figure.add_scatter(x=[n for n, _ in curve], y=[d for _, d in curve], name=name, mode="lines+markers", line=line)
    figure.add_vline(x=before[-1][0], line={"color": "#8899aa", "dash": "dot"})
    styled(figure, 400)
    figure.update_xaxes(title_text="trials on the body", rangemode="tozero")
    figure.update_yaxes(title_text="best forward distance (m)")
    return figure


def _wrapped(text: str, width: int) -> str:
    # A per cent sign stays with its number.
    return "<br>".join(textwrap.wrap(text.replace(" %", "\u00a0%"), width))


def _distance(distances_m: dict[str, Any], name: str) -> float:
    if name == "last trial":
        return float(distances_m["trials"][-1])
    return float(distances_m["intact" if name == "intact" else "after"])
