"""The charts of docs/speed.md: made with plotly, turned into pictures by a headless Chromium where there is one."""

from __future__ import annotations

import math
import shutil
import subprocess
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
import plotly.io as pio

BROWSERS = ("chromium", "chromium-browser", "google-chrome", "chrome")
COLOURS = ("#3b6ea5", "#d1793b", "#4f9d69", "#8a5fa8", "#888888")
SIZE = (1000, 520)


def save(figure: go.Figure, path: Path) -> Path:
    """``path`` as a PNG; without a browser the same chart as a page beside it. Returns what was written."""
    figure.update_layout(
        template="plotly_white", font={"family": "DejaVu Sans, sans-serif", "size": 15}, margin={"t": 70}
    )
    figure.update_layout(width=SIZE[0], height=SIZE[1])
    path.parent.mkdir(parents=True, exist_ok=True)
    page = pio.to_html(figure, include_plotlyjs=True, config={"displayModeBar": False})
    page = page.replace("<body>", '<body style="margin:0;background:white">')
    browser = next((found for name in BROWSERS if (found := shutil.which(name))), None)
    if browser is None:
        other = path.with_suffix(".html")
        other.write_text(page, encoding="utf-8")
        return other
    with tempfile.TemporaryDirectory() as folder:
        source = Path(folder) / "chart.html"
        source.write_text(page, encoding="utf-8")
        subprocess.run(
            [
                browser,
                "--headless=new",
                "--no-sandbox",
                "--disable-gpu",
                "--hide-scrollbars",
                f"--window-size={SIZE[0]},{SIZE[1]}",
                "--virtual-time-budget=15000",
                f"--screenshot={path.resolve()}",
                source.as_uri(),
            ],
            check=True,
            capture_output=True,
        )
    return path


def draw_table(content: Mapping[str, Any], folder: Path) -> list[Path]:
    """Where the time of a robot-step and of a run goes, from the JSON of the benchmark."""
    written = []
    if content["bare"]:
        written.append(save(step_chart(content["bare"]), folder / "speed_step.png"))
    if content["runs"] and content["peers"]:
        written.append(save(run_chart(content), folder / "speed_run.png"))
    return written


def step_chart(bare: Mapping[str, Mapping[str, float]]) -> go.Figure:
    """Bare engine step and rollout, a robot-step."""
    figure = go.Figure()
    names = {"pybullet": "PyBullet", "mujoco": "MuJoCo"}
    engines = list(bare)
    for key, label, colour in (
        ("bare_cpu_us", "bare engine step (the limit)", COLOURS[4]),
        ("rollout_cpu_us", "our rollout: sense, network, drives, step, record", COLOURS[0]),
    ):
        values = [bare[e][key] for e in engines]
        text = [f"{v:.1f} us" for v in values]
        if key == "rollout_cpu_us":
            text = [f"{v:.1f} us ({bare[e]['ratio_cpu']:.2f} x)" for v, e in zip(values, engines, strict=True)]
        figure.add_bar(x=[names[e] for e in engines], y=values, name=label, text=text, marker_color=colour)
    figure.update_layout(
        title="Processor time of a robot-step", barmode="group", legend={"orientation": "h", "y": -0.12}
    )
    figure.update_yaxes(title="us of a core")
    return figure


def run_chart(content: Mapping[str, Any]) -> go.Figure:
    """Processor time of scenario 8: peers and our engines."""
    runs = [r for r in content["runs"] if r["workers"] == max(x["workers"] for x in content["runs"])]
    bars: list[tuple[str, float, str]] = []
    titles = {"naive_program": "naive program", "deap_program": "DEAP program"}
    for peer, cost in content["peers"].items():
        seconds = runs[0]["whole_steps"] * cost["cpu_s"] / cost["steps"]
        bars.append((f"{titles[peer]}<br>(scaled)", seconds, COLOURS[1]))
    for run in runs:
        bars.append((f"ee_dist<br>{run['engine']}", run["cpu_s"], COLOURS[0]))
    figure = go.Figure()
    figure.add_bar(
        x=[b[0] for b in bars],
        y=[b[1] for b in bars],
        marker_color=[b[2] for b in bars],
        text=[f"{b[1]:,.0f} s" for b in bars],
    )
    figure.update_layout(title=f"Scenario 8, budget {runs[0]['budget']}: processor time of all processes")
    figure.update_yaxes(title="s")
    return figure


def scaling_chart(
    cores: Sequence[int], lines: Mapping[str, Sequence[float]], measured: Mapping[str, Sequence[tuple[int, float]]]
) -> go.Figure:
    """Wall time over cores, both logarithmic; measured points as crosses."""
    figure = go.Figure()
    for k, (name, values) in enumerate(lines.items()):
        colour = COLOURS[k % len(COLOURS)]
        figure.add_scatter(x=list(cores), y=list(values), name=name, mode="lines+markers", line={"color": colour})
        perfect = [values[0] * cores[0] / c for c in cores]
        figure.add_scatter(
            x=list(cores), y=perfect, mode="lines", line={"color": colour, "dash": "dot", "width": 1}, showlegend=False
        )
    for name, points in measured.items():
        figure.add_scatter(
            x=[p[0] for p in points],
            y=[p[1] for p in points],
            name=name,
            mode="markers",
            marker={"symbol": "x", "size": 12, "color": "black"},
        )
    lowest = min(min(v) for v in lines.values())
    highest = max(max(v) for v in lines.values())
    figure.update_xaxes(type="log", title="cores (one worker each)", dtick=1)
    figure.update_yaxes(type="log", title="wall time (s)", range=[_log(lowest / 3), _log(highest * 1.5)], dtick=1)
    figure.update_layout(
        title="Wall time as cores are added (dotted: perfect)", legend={"orientation": "h", "y": -0.18}
    )
    return figure


def _log(value: float) -> float:
    return math.log10(value)
