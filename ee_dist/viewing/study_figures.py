"""Figures of a study as one page that opens offline: distances by case (the paper's Fig. 7), dominants (Fig. 8)."""

from __future__ import annotations

import textwrap
from collections import defaultdict
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go

from ee_dist.viewing.templates import plot, rendered

STAGES = {"intact": "#8a94a6", "after the change": "#e08a1e", "last trial": "#3b7dd8"}
"""What the bars of a case are, and their colours."""
METRICS = {"rolling_mean": "diagnosed by rolling means", "distance": "diagnosed by distance"}
LINES = ("#3b7dd8", "#e08a1e", "#7a5bd0", "#2f9e6e")
LABEL = 13
"""Characters of a line of a case's name below its bars."""
ROOM = 0.12
"""Free share of the axis beyond the farthest bar with its spread."""

Tests = Mapping[tuple[str, int], str]
"""By metric and scenario what a test said, in a few words."""


def write_figures(summaries: Sequence[dict[str, Any]], tests: Tests, caption: str, path: Path) -> None:
    """``summaries`` are those of recover runs; ``caption`` names the test, its correction and what bars and lines are."""
    metrics = sorted({s["metric"] for s in summaries})
    figures = [distances([s for s in summaries if s["metric"] == m], m, tests) for m in metrics]
    figures.append(dominants(summaries))
    title = f"A study of {len(summaries)} runs"
    page = rendered(
        "study.html", title=title, caption=caption, figures=[plot(f, f"plot{k}") for k, f in enumerate(figures)]
    )
    path.write_text(page, encoding="utf-8")


def distances(summaries: Sequence[dict[str, Any]], metric: str, tests: Tests) -> go.Figure:
    """Mean forward distance intact, after the change and at the last trial for each case, every run as a dot."""
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
            name=name,
            marker_color=colour,
            opacity=0.75,
            error_y={"array": spread, "width": 3},
        )
        figure.add_scatter(
            x=[a for a, v in zip(at, values, strict=True) for _ in v],
            y=[float(x) for v in values for x in v],
            mode="markers",
            marker={"color": colour, "size": 5, "line": {"color": "#ffffff", "width": 0.5}},
            showlegend=False,
            hovertemplate=f"{name}: %{{y:.2f}} m<extra></extra>",
        )
        for v, mean, wide in zip(values, means, spread, strict=True):
            low, high = min(low, mean - wide, float(v.min())), max(high, mean + wide, float(v.max()))
    room = ROOM * ((high - low) or 1.0)
    for i, c in enumerate(cases):
        told = tests.get((metric, c))
        if told:
            figure.add_annotation(x=i, y=high + room / 2, text=told, showarrow=False, font_size=11)
    _styled(figure, f"How far the robot went forward, {METRICS.get(metric, metric)}", "distance (m)")
    figure.update_layout(barmode="overlay")
    labels = [_wrapped(f"{c}. {groups[c][0].get('title') or 'scenario'}") for c in cases]
    figure.update_xaxes(
        tickmode="array", tickvals=list(range(len(cases))), ticktext=labels, tickangle=0, tickfont_size=10
    )
    figure.update_yaxes(range=[low - (room if low < 0 else 0.0), high + room])
    return figure


def dominants(summaries: Sequence[dict[str, Any]]) -> go.Figure:
    """New bests found so far in the diagnosis passes, mean over passes and runs, for each metric."""
    figure = go.Figure()
    for k, metric in enumerate(sorted({s["metric"] for s in summaries})):
        curves = [c for s in summaries if s["metric"] == metric for c in s["dominants"]["diagnosis"]]
        shortest = min(map(len, curves))
        mean = np.mean([c[:shortest] for c in curves], axis=0)
        name = METRICS.get(metric, metric)
        line = {"color": LINES[k % len(LINES)]}
        figure.add_scatter(x=list(range(shortest)), y=[float(v) for v in mean], name=name, mode="lines", line=line)
    _styled(figure, "Dominants: new best hypotheses found so far in a diagnosis pass", "new bests so far")
    figure.update_xaxes(title="generation", rangemode="tozero", tickformat="d")
    figure.update_yaxes(rangemode="tozero")
    return figure


def _styled(figure: go.Figure, title: str, y_title: str) -> None:
    """One style for all figures."""
    figure.update_layout(
        template="plotly_white",
        title={"text": title, "x": 0.0, "xref": "paper", "font": {"size": 17}},
        font={"family": "system-ui, sans-serif", "size": 13},
        legend={"orientation": "h", "y": 1.02, "yanchor": "bottom", "x": 0.0},
        margin={"l": 60, "r": 20, "t": 90, "b": 110},
        height=470,
        showlegend=True,
    )
    figure.update_yaxes(title=y_title)


def _wrapped(text: str) -> str:
    return "<br>".join(textwrap.wrap(text, LABEL))


def _distance(distances_m: dict[str, Any], name: str) -> float:
    if name == "last trial":
        return float(distances_m["trials"][-1])
    return float(distances_m["intact" if name == "intact" else "after"])
