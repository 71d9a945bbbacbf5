"""Measurements beside what a model makes of them, for any robot: ``write_comparison_rrd``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.log import SensorLog
from ee_dist.viewing import blueprint, channels, world
from ee_dist.viewing.channels import Model, Shot
from ee_dist.viewing.palette import GROUND, PREDICTED, PREDICTED_NAME
from ee_dist.viewing.robot3d import Appearance, Shown
from ee_dist.viewing.stream import interval_s, log_digest, recording, starts_of

APPLICATION = "ee_dist_comparison"
"""Not that of runs: a viewer keeps one layout for each application."""
WHOLE_S = 60.0
"""Plots show the whole of a recording up to this length, and a window of the longer ones."""
WINDOW_S = (-5.0, 25.0)
ONE_PAGE = 4
"""Up to so many channels are shown together."""
MODELS = (Model(PREDICTED_NAME, PREDICTED_NAME),)
BAR, LADDER_SHIFT = 0.4, 0.2


@dataclass(frozen=True)
class Rung:
    """A model on the way from the first to the last: what was added, and its errors, lower is better."""

    label: str
    error_heldout: float
    error_fit: float | None = None


def write_comparison_rrd(
    robot: Robot,
    pairs: Sequence[tuple[str, SensorLog, SensorLog]],
    path: str | Path,
    ladder: Sequence[Rung] | None = None,
    title: str = "",
) -> None:
    """Write (name, measured, predicted) pairs one after another as an ``.rrd``: robot, channels, residuals, ladder.

    ``robot`` is the model behind the predictions. Pairs without rows are left out; logs of a pair may differ in length.
    """
    kept = [(name, m, p) for name, m, p in pairs if len(m) and len(p)]
    starts = starts_of([(k, [m, p]) for k, (_, m, p) in enumerate(kept)])
    shown = [Shot(name, s, m, {PREDICTED_NAME: p}) for (name, m, p), s in zip(kept, starts, strict=True)]
    aside = world.BESIDE_M if robot.free_base else 0.0
    real = [world.seen(Appearance(p.start_s, robot, p.measured, p.name)) for p in shown]
    ghost = [world.seen(Appearance(s, robot, p, "", aside)) for s, (_, _, p) in zip(starts, kept, strict=True)]
    rungs = list(ladder or ())
    title = title or f"{robot.name}: measured against predicted".replace("_", " ")
    identity = [robot.digest, title, repr(rungs), *(log_digest(g) for _, m, p in kept for g in (m, p))]
    with recording(path, APPLICATION, identity, title, _blueprint(robot, shown, real, bool(rungs))) as stream:
        text = comparison_text(title, shown, rungs)
        stream.log("texts/result", rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
        _send_ladder(stream, rungs)
        if shown:
            world.send_world(stream, robot, real, [world.Ghost(PREDICTED_NAME, PREDICTED, ghost)], starts)
            channels.send_sensors(stream, shown, MODELS, [s.name for s in robot.sensors if s.kind == "touch"])
            channels.send_residuals(stream, shown, MODELS)
            channels.send_commands(stream, shown)
            channels.send_trial_lane(stream, shown, [p.name for p in shown])


def comparison_text(title: str, pairs: Sequence[Shot], ladder: Sequence[Rung]) -> str:
    """The first thing to read: how far apart, channel by channel, and what each added effect brought. Markdown."""
    lines = [f"### {title}", "", "**Blue**: measured. **Orange**: predicted.", ""]
    if pairs:
        lines += ["| channel | RMS residual | unit | RMS measured |", "|---|---|---|---|"]
        for name, unit in channels.units_of(pairs).items():
            measured = np.concatenate([p.measured.channel(name) for p in pairs if name in p.measured.sensor_names])
            lines.append(
                f"| {name} | {_rms(channels.residual(pairs, name, PREDICTED_NAME)):.4g} | {unit} | {_rms(measured):.4g} |"
            )
    if ladder:
        lines += ["", "| # | model | error held out | error in the fit |", "|---|---|---|---|"]
        for k, rung in enumerate(ladder):
            fit = "" if rung.error_fit is None else f"{rung.error_fit:.4g}"
            lines.append(f"| {k} | {rung.label} | {rung.error_heldout:.4g} | {fit} |")
    return "\n".join(lines)


def _rms(values: np.ndarray) -> float:
    known = values[np.isfinite(values)]
    return float(np.sqrt(np.mean(np.square(known)))) if len(known) else float("nan")


def _send_ladder(stream: rr.RecordingStream, ladder: Sequence[Rung]) -> None:
    fits = [(k, r.error_fit) for k, r in enumerate(ladder) if r.error_fit is not None]
    held = [(k, r.error_heldout) for k, r in enumerate(ladder)]
    for name, bars, shift, colour in (
        ("held_out", held, -LADDER_SHIFT, PREDICTED),
        ("fit", fits, LADDER_SHIFT, GROUND),
    ):
        if bars:
            chart = rr.BarChart(
                np.array([b[1] for b in bars], dtype=float),
                abscissa=np.array([b[0] + shift for b in bars]),
                widths=[BAR] * len(bars),
                color=colour,
            )
            stream.log(f"ladder/{name}", chart, static=True)


def _blueprint(robot: Robot, pairs: Sequence[Shot], real: Shown, with_ladder: bool) -> rrb.Blueprint:
    text = rrb.TextDocumentView(origin="/texts/result", name="Result")
    ladder = [blueprint.bars("/ladder", "Error of each model, numbered as above", legend=True)] if with_ladder else []
    if not pairs:
        return blueprint.framed(rrb.Horizontal(text, *ladder))
    end_s = max(p.start_s + interval_s(log) for p in pairs for log in (p.measured, *p.said.values()))
    axis = blueprint.fixed_axis(0.0, end_s) if end_s <= WHOLE_S else blueprint.moving_axis(*WINDOW_S)
    scene = blueprint.scene_view(robot, "Robot (blue) and its model (orange)", world.eye(robot, real))
    left = rrb.Vertical(scene, text, *ladder, row_shares=[3, 4, 3][: 2 + len(ladder)])
    whole = rrb.Horizontal(left, _channel_tabs(robot, channels.units_of(pairs), axis), column_shares=[2, 3])
    return blueprint.framed(rrb.Vertical(whole, blueprint.chapters(end_s), row_shares=[10, 1]))


def _channel_tabs(robot: Robot, units: dict[str, str], axis: rrb.TimeAxis) -> rrb.Tabs:
    """Channels above, what is left of them below; a tab for each kind of channel where they are many."""
    known = {s.name: s for s in robot.sensors}
    shown = [known.get(n, Sensor(n, "channel", "", u)) for n, u in units.items()]
    pages = {"channels": shown}
    if len(shown) > ONE_PAGE:
        pages = {kind: [s for s in shown if s.kind == kind] for kind in dict.fromkeys(s.kind for s in shown)}
    tabs: list[rrb.View | rrb.Container] = []
    for page, sensors in pages.items():
        channels_above = blueprint.sensor_plots(sensors, "Measured and predicted", axis)
        residuals = []
        for unit in dict.fromkeys(s.unit for s in sensors):
            paths = [f"/residuals/{s.name}/**" for s in sensors if s.unit == unit]
            name = "Measured - predicted" + blueprint.in_brackets(unit)
            residuals.append(blueprint.plot("/residuals", name, axis, contents=paths))
        below = residuals[0] if len(residuals) == 1 else rrb.Horizontal(*residuals)
        tabs.append(rrb.Vertical(channels_above, below, row_shares=[3, 2], name=page.capitalize()))
    return rrb.Tabs(*tabs, blueprint.plot("/commands", "Commands", axis), active_tab=0)
