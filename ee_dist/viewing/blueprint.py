"""Which views a scene has, and where: saved into the recording, so that everybody sees the same first screen."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import rerun as rr
import rerun.blueprint as rrb
from rerun.blueprint.components import AbsoluteTimeRange

from ee_dist.recording.clock import SECOND_NS
from ee_dist.robots.model import Robot, Sensor
from ee_dist.robots.ranges import command_units
from ee_dist.viewing.stream import RUN_TIME

WINDOW_S = (-0.5, 3.5)
"""What the plots show around the moment being played."""
WHOLE_S = 60.0
LONG_WINDOW_S = (-5.0, 25.0)
DARK = (18, 21, 28)
GRID_M = 0.1


def scene_view(robot: Robot, name: str, eye: rrb.EyeControls3D) -> rrb.Spatial3DView:
    """The robot on its floor."""
    grid = rrb.LineGrid3D(
        visible=robot.world.has_floor,
        spacing=GRID_M,
        plane=rr.components.Plane3D.XY,
        stroke_width=0.75,
        color=(255, 255, 255, 14),
    )
    background = rrb.Background(kind=rrb.BackgroundKind.SolidColor, color=DARK)
    return rrb.Spatial3DView(origin="/world", name=name, eye_controls=eye, background=background, line_grid=grid)


def moving_axis(before_s: float = WINDOW_S[0], after_s: float = WINDOW_S[1]) -> rrb.TimeAxis:
    """A window of time that moves with the cursor."""
    start, end = (rr.TimeRangeBoundary.cursor_relative(seconds=s) for s in (before_s, after_s))
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))


def fixed_axis(start_s: float, end_s: float) -> rrb.TimeAxis:
    """A window of time that stays."""
    start, end = (rr.TimeRangeBoundary.absolute(seconds=s) for s in (start_s, end_s))
    return rrb.TimeAxis(view_range=rr.TimeRange(start=start, end=end))


def whole_axis(end_s: float) -> rrb.TimeAxis:
    """The whole recording where it is short enough to be read at once, else a window that moves with the cursor."""
    return fixed_axis(0.0, end_s) if end_s <= WHOLE_S else moving_axis(*LONG_WINDOW_S)


def plot(
    origin: str,
    name: str,
    axis: rrb.TimeAxis,
    *,
    contents: Sequence[str] | None = None,
    span: tuple[float, float] | None = None,
    legend: bool = True,
) -> rrb.TimeSeriesView:
    """A plot of all scalars below ``origin`` or of ``contents``; ``span`` fixes its vertical axis."""
    # The legend is at the left: errors grow with time, and what a curve comes to is at its right end.
    return rrb.TimeSeriesView(
        origin=origin,
        contents="$origin/**" if contents is None else list(contents),
        name=name,
        axis_x=axis,
        axis_y=None if span is None else rrb.ScalarAxis(range=span),
        plot_legend=rrb.PlotLegend(rrb.Corner2D.LeftTop, visible=legend),
    )


def sensor_plots(sensors: Sequence[Sensor], name: str, axis: rrb.TimeAxis) -> rrb.Grid:
    """A plot for each channel; the first alone carries a legend, the colours are the same in all."""
    views = []
    for k, sensor in enumerate(sensors):
        scaled = sensor.kind in ("touch", "angle")
        title = sensor.name.replace("_", " ") + in_brackets(sensor.unit)
        span = (-1.1, 1.1) if scaled else None
        views.append(plot(f"/sensors/{sensor.name}", title, axis, span=span, legend=k == 0))
    return rrb.Grid(*views, grid_columns=1 if len(views) < 2 else 2 if len(views) < 9 else 3, name=name)


def in_brackets(unit: str) -> str:
    """A unit behind a name; nothing for numbers without one."""
    return "" if unit in ("", "1") else f" ({unit})"


def command_unit(robot: Robot) -> str:
    """The unit of a robot's commands, in brackets; nothing where they have several."""
    units = {u for u in command_units(robot).values() if u is not None}
    return in_brackets(units.pop()) if len(units) == 1 else ""


def lanes(origin: str, name: str) -> rrb.StateTimelineView:
    """States over time, one lane for each entity below ``origin``."""
    return rrb.StateTimelineView(origin=origin, name=name, time_view=moving_axis())


def chapters(end_s: float) -> rrb.StateTimelineView:
    """A strip that names the trial of each stretch of time, the whole run in sight."""
    axis = fixed_axis(0.0, end_s)
    return rrb.StateTimelineView(origin="/trial", name="Trials on the timeline", titlebar=False, time_view=axis)


def bars(origin: str, name: str, legend: bool = False) -> rrb.BarChartView:
    """Bars of all entities below ``origin``, told apart by colour."""
    return rrb.BarChartView(origin=origin, name=name, plot_legend=rrb.PlotLegend(rrb.Corner2D.RightTop, visible=legend))


def framed(content: rrb.Container, loop_s: tuple[float, float] | None = None) -> rrb.Blueprint:
    """The whole window: the content and the play bar, side panels folded away. Play repeats ``loop_s``, or everything."""
    selected = None
    if loop_s is not None:
        start, end = (round(s * SECOND_NS) for s in loop_s)
        selected = AbsoluteTimeRange(start, end)
    loop: Literal["all", "selection"] = "all" if selected is None else "selection"
    return rrb.Blueprint(
        content,
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed", timeline=RUN_TIME, loop_mode=loop, time_selection=selected),
        auto_views=False,
    )
