"""One run of the loop in three pictures, as the paper's Fig. 6: fitness over the passes, distances of the trials, paths."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go

from ee_dist.recording.records import HARDWARE, PREDICTION, REPAIR, RunRecord, TrialRecord
from ee_dist.recovery.kinds import subject_of
from ee_dist.trials.log import Array
from ee_dist.viewing.report_figures import MEASURED, PREDICTED, styled
from ee_dist.viewing.story import beliefs, hardware_trials, told
from ee_dist.viewing.study_figures import STAGES

HEIGHT = 300
PATH_POINTS = 250
"""Of a path of a trial: a point every few steps is as good to see."""
ROOM = 0.06
"""Free share of an axis beyond what is drawn."""

Span = tuple[float, float]


@dataclass(frozen=True)
class Told:
    """A run as its figures need it. ``fitness``: best distance (m) of each generation, by repair pass; ``names`` of the trials,
    ``reached`` and ``expected`` distances (m; none of what was not foreseen); ``paths`` (n, 2) of the body seen from above, m,
    by stage: intact, after the change, last trial; ``believed``: after each diagnosis its error and the words for it."""

    fitness: Sequence[Sequence[float]]
    names: Sequence[str]
    reached: Sequence[float]
    expected: Sequence[float | None]
    paths: Mapping[str, Array]
    believed: Sequence[tuple[float, str]]


def told_of(run: RunRecord) -> Told:
    """What a recording says. Of a log without the body's pose there is no path."""
    trials, value = hardware_trials(run), subject_of(run.robot).value
    foreseen = {t.index: value(t.log) for t in run.trials if t.source == PREDICTION}
    passes: dict[int, list[float]] = {}
    for g in run.generations:
        if g.phase == REPAIR:
            passes.setdefault(g.pass_index, []).append(g.best)
    stages = dict(zip(STAGES, (*trials[:2], trials[-1]), strict=False)) if len(trials) > 2 else {}
    return Told(
        [passes[k] for k in sorted(passes)],
        [t.name for t in trials],
        [value(t.log) for t in trials],
        [foreseen.get(t.index) for t in trials],
        {name: path for name, t in stages.items() if (path := _path(t)) is not None},
        [(r.error, told(r.terms)) for _, r in sorted(beliefs(run).items())],
    )


def _path(trial: TrialRecord) -> Array | None:
    """(n, 2) where the body was, from where it began, m."""
    assert trial.source == HARDWARE
    pose = trial.log.base_pose
    if pose is None or not len(pose):
        return None
    every = max(1, len(pose) // PATH_POINTS)
    return np.concatenate([pose[::every, :2], pose[-1:, :2]]) - pose[0, :2]


def span_of(values: Sequence[float], room: float = ROOM) -> Span:
    """A range that holds all of them and zero, and some room."""
    low, high = min([0.0, *values]), max([0.0, *values])
    free = room * ((high - low) or 1.0)
    return low - (free if low < 0 else 0.0), high + free


def fitness(run: Told, span: Span) -> go.Figure:
    """Best distance on the model, generation by generation, one line for each repair pass."""
    figure, start = go.Figure(), 0
    for k, curve in enumerate(run.fitness):
        what = "intact model" if k == 0 else f"after diagnosis {k}"
        figure.add_scatter(
            x=[start + i for i in range(len(curve))], y=list(curve), mode="lines", name=what, showlegend=False,
            line={"color": STAGES["intact"] if k == 0 else STAGES["last trial"], "width": 2},
            hovertemplate=what + ": %{y:.2f} m<extra></extra>",
        )  # fmt: skip
        if k:
            figure.add_vline(x=start - 0.5, line={"color": "#8899aa", "dash": "dot", "width": 1})
        middle = start + (len(curve) - 1) / 2
        # What a pass is called stands in the free room above the curves.
        figure.add_annotation(x=middle, y=span[1], yanchor="top", text="intact" if k == 0 else str(k), showarrow=False)
        start += len(curve)
    return _finished(figure, "Best distance on the model, by pass", "generation", "m", span)


def trials(run: Told, span: Span) -> go.Figure:
    """How far each trial went on the robot, and how far its model had foreseen."""
    figure, at = go.Figure(), list(range(len(run.names)))
    stage = ["intact", "after the change"]
    colours = [STAGES[s] for s in stage][: len(at)] + [STAGES["last trial"]] * max(0, len(at) - len(stage))
    figure.add_bar(x=at, y=list(run.reached), width=0.6, marker_color=colours, opacity=0.8, name="robot",
                   showlegend=False, hovertemplate="robot: %{y:.2f} m<extra></extra>")  # fmt: skip
    foreseen = [(k, e) for k, e in zip(at, run.expected, strict=True) if e is not None]
    figure.add_scatter(
        x=[k for k, _ in foreseen], y=[e for _, e in foreseen], mode="markers", name="foreseen by its model",
        marker={"symbol": "line-ew", "size": 26, "line": {"color": PREDICTED, "width": 3}},
        hovertemplate="foreseen: %{y:.2f} m<extra></extra>",
    )  # fmt: skip
    _finished(figure, "Distance of each trial (orange: foreseen)", "trial", "m", span)
    short = [n.replace("after the change", "after").replace("trial ", "") for n in run.names]
    figure.update_xaxes(tickmode="array", tickvals=at, ticktext=short, tickangle=0, showgrid=False)
    return figure


def paths(run: Told, along: Span, across: Span) -> go.Figure:
    """Where the body went, from above: +x is forward, as long as high."""
    figure = go.Figure()
    for name, path in run.paths.items():
        line, called = {"color": STAGES[name], "width": 2}, run.names[-1] if name == "last trial" else name
        figure.add_scatter(x=path[:, 0].tolist(), y=path[:, 1].tolist(), mode="lines", name=called, line=line,
                           hovertemplate=called + ": %{x:.2f} m, %{y:.2f} m<extra></extra>")  # fmt: skip
        figure.add_scatter(x=[float(path[-1, 0])], y=[float(path[-1, 1])], mode="markers", showlegend=False,
                           marker={"color": STAGES[name], "size": 8}, hoverinfo="skip")  # fmt: skip
    figure.add_scatter(x=[0.0], y=[0.0], mode="markers", showlegend=False, hoverinfo="skip",
                       marker={"color": MEASURED, "symbol": "cross", "size": 9})  # fmt: skip
    _finished(figure, "Path of the body from above", "forward (m)", "sideways (m)", across)
    figure.update_xaxes(range=list(along))
    figure.update_yaxes(scaleanchor="x", scaleratio=1, constrain="domain")
    figure.update_layout(showlegend=True, legend={"orientation": "h", "y": -0.28, "yanchor": "top", "x": 0})
    figure.update_layout(height=HEIGHT + 40, margin={"l": 50, "r": 10, "t": 30, "b": 90})
    return figure


def _finished(figure: go.Figure, title: str, x: str, y: str, span: Span) -> go.Figure:
    styled(figure, HEIGHT)
    figure.update_layout(
        title={"text": title, "font": {"size": 12}, "x": 0.02, "y": 0.98},
        showlegend=False,
        hovermode="closest",
        margin={"l": 50, "r": 10, "t": 30, "b": 45},
    )
    figure.update_xaxes(title_text=x)
    figure.update_yaxes(title_text=y, range=list(span))
    return figure


def spans(runs: Sequence[Told]) -> tuple[Span, Span, Span, Span]:
    """Ranges that fit all of these runs: fitness, distances, and paths forward and sideways."""
    heights = [v for r in runs for curve in r.fitness for v in curve]
    far = [v for r in runs for v in (*r.reached, *(e for e in r.expected if e is not None))]
    ways = [p for r in runs for p in r.paths.values()]
    along, across = ([float(v) for p in ways for v in p[:, k]] for k in (0, 1))
    least = span_of(along)
    # The start lies within the picture, not on its edge.
    begun = (min(least[0], -ROOM * least[1]), least[1])
    low, high = span_of(across)
    return span_of(heights, 0.15), span_of(far), begun, (low, max(high, low + 0.1))
