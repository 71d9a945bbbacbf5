"""Figures of a study as one page that opens offline: distances by case (the paper's Fig. 7), dominants (Fig. 8)."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import plotly.graph_objects as go
import plotly.io as pio


def write_figures(summaries: Sequence[dict[str, Any]], path: Path) -> None:
    """``summaries`` are those of recover runs."""
    figures = [distances(summaries), dominants(summaries)]
    body = "\n".join(pio.to_html(f, full_html=False, include_plotlyjs=k == 0) for k, f in enumerate(figures))
    title = "ee_dist: a study of " + str(len(summaries)) + " runs"
    page = (
        f"<!doctype html><html lang='en'><head><meta charset='utf-8'><title>{title}</title>"
        "<style>body{font-family:system-ui,sans-serif;max-width:1100px;margin:2rem auto}</style></head>"
        f"<body><h1>{title}</h1>{body}</body></html>"
    )
    path.write_text(page, encoding="utf-8")


def distances(summaries: Sequence[dict[str, Any]]) -> go.Figure:
    """Mean distance intact, after the change and at the last trial, for each case and metric."""
    figure = go.Figure()
    metrics = sorted({s["metric"] for s in summaries})
    for metric in metrics:
        groups: dict[int, list[dict[str, Any]]] = defaultdict(list)
        for s in summaries:
            if s["metric"] == metric:
                groups[s["scenario"]].append(s["distance_m"])
        cases = sorted(groups)
        for name in ("intact", "after the change", "last trial"):
            values = [[_distance(d, name) for d in groups[c]] for c in cases]
            figure.add_bar(
                x=[str(c) for c in cases],
                y=[float(np.mean(v)) for v in values],
                error_y={"type": "data", "array": [float(np.std(v)) for v in values]},
                name=f"{name} ({metric})" if len(metrics) > 1 else name,
            )
    figure.update_layout(title="Forward distance, mean and standard deviation over runs", barmode="group")
    figure.update_xaxes(title="scenario", type="category")
    figure.update_yaxes(title="distance (m)")
    return figure


def _distance(distances_m: dict[str, Any], name: str) -> float:
    if name == "last trial":
        return float(distances_m["trials"][-1])
    return float(distances_m["intact" if name == "intact" else "after"])


def dominants(summaries: Sequence[dict[str, Any]]) -> go.Figure:
    """New bests found so far in the diagnosis passes, mean over passes and runs, for each metric."""
    figure = go.Figure()
    for metric in sorted({s["metric"] for s in summaries}):
        curves = [c for s in summaries if s["metric"] == metric for c in s["dominants"]["diagnosis"]]
        shortest = min(map(len, curves))
        mean = np.mean([c[:shortest] for c in curves], axis=0)
        figure.add_scatter(x=list(range(shortest)), y=[float(v) for v in mean], name=metric)
    figure.update_layout(title="Dominants of the diagnosis passes (new bests so far)", showlegend=True)
    figure.update_xaxes(title="generation")
    figure.update_yaxes(title="dominants")
    return figure
