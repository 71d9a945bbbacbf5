"""Measured trials without a search, of any robot: ``write_trial_rrd``."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rerun.blueprint as rrb

from ee_dist.recording.records import HARDWARE, RunRecord, TrialRecord
from ee_dist.robots.model import Robot
from ee_dist.viewing import blueprint, channels, palette, world
from ee_dist.viewing.channels import Shot
from ee_dist.viewing.robot3d import Appearance
from ee_dist.viewing.stream import interval_s, log_digest, recording, starts_of
from ee_dist.viewing.text import document

APPLICATION = "ee_dist_trial"


def write_trial_rrd(run: RunRecord, path: str | Path) -> None:
    """Write the hardware trials of a recording as an ``.rrd``: the robot, and its channels kind by kind."""
    robot = run.robot
    trials = sorted((t for t in run.trials if t.source == HARDWARE and len(t.log)), key=lambda t: t.index)
    starts = starts_of([(t.index, [t.log]) for t in trials])
    names = trial_names(trials)
    real = [world.seen(Appearance(s, robot, t.log, n)) for s, t, n in zip(starts, trials, names, strict=True)]
    shots = [Shot(n, s, t.log) for n, s, t in zip(names, starts, trials, strict=True)]
    title = f"Trials of {robot.name}".replace("_", " ")
    text = trial_text(run, trials, names, title)
    identity = ["trial", robot.digest, text, *(log_digest(t.log) for t in trials)]
    view: list[rrb.View | rrb.Container] = [rrb.TextDocumentView(origin="/texts/result", name="Trials")]
    if not trials:
        layout = blueprint.framed(rrb.Vertical(*view))
    else:
        end_s = starts[-1] + interval_s(trials[-1].log)
        scene = blueprint.scene_view(robot, "Robot", world.eye(robot, real))
        left = rrb.Vertical(*view, scene, row_shares=[1, 1])
        whole = rrb.Horizontal(left, _channel_pages(robot, shots, end_s), column_shares=[2, 3])
        layout = blueprint.framed(rrb.Vertical(whole, blueprint.chapters(end_s), row_shares=[10, 1]))
    with recording(path, APPLICATION, identity, title, layout) as stream:
        stream.log("texts/result", document(text), static=True)
        if trials:
            switches = [s.name for s in robot.sensors if s.kind == "touch"]
            world.send_world(stream, robot, real, [], starts)
            channels.send_measured(stream, shots, kinds_of(robot, shots).values(), switches)
            channels.send_commands(stream, shots)
            channels.send_trial_lane(stream, shots, names)


def trial_names(trials: Sequence[TrialRecord]) -> list[str]:
    """Number and name."""
    return [f"{k + 1}. {t.name}" if t.name else f"trial {k + 1}" for k, t in enumerate(trials)]


def trial_text(run: RunRecord, trials: Sequence[TrialRecord], names: Sequence[str], title: str) -> str:
    """What was done and what is there. Markdown."""
    robot, about = run.robot, run.metadata
    lines = [f"### {title}", "", "**Blue**: what the robot did, as far as it was measured. "]
    if any(s.kind == "touch" for s in robot.sensors):
        lines[-1] += "**Green**: a part whose sensor reports a touch. "
    lines[-1] += "Press play: the trials run one after another."
    if about.get("seal"):
        lines += ["", "What is hidden in this robot, if anything, is sealed: nothing here tells it."]
    lines += ["", "| trial | seconds | rows | channels |", "|---|---|---|---|"]
    asked = _excitations(about)
    for k, (t, name) in enumerate(zip(trials, names, strict=True)):
        done = f" ({asked[k]})" if k < len(asked) else ""
        lines.append(f"| {name}{done} | {interval_s(t.log):.3g} | {len(t.log)} | {len(t.log.sensor_names)} |")
    gone = [t.log.travel_m for t in trials if t.log.base_pose is not None and math.isfinite(t.log.travel_m)]
    if robot.free_base and gone and max(map(abs, gone)) > 0.01:
        lines += ["", "Went forward: " + ", ".join(f"{m:.2f}" for m in gone) + " m."]
    if robot.free_base and any(t.log.base_pose is None for t in trials):
        lines += ["", "Where its body was, was not measured: it is drawn where it starts."]
    told = [f"{key} {about[key]}" for key in ("engine", "seed") if about.get(key)]
    told += [f"noise {100 * float(about['noise']):.3g} % of each channel's range"] if about.get("noise") else []
    if told:
        lines += ["", ", ".join(told).capitalize() + "."]
    if not run.complete:
        lines += ["", "*This recording was cut short: its program did not reach its end.*"]
    return "\n".join(lines)


def _excitations(about: dict[str, str]) -> list[str]:
    """What was asked for in each trial, in short, where the recording tells it."""
    try:
        entries: list[dict[str, Any]] = json.loads(about.get("trials", "[]"))
    except ValueError:
        return []
    return [f"amplitude {e['amplitude']:g}" if "amplitude" in e else "" for e in entries]


def kinds_of(robot: Robot, shots: Sequence[Shot]) -> dict[str, list[str]]:
    """Channels that belong into one plot, by its title: those of one kind and unit, touch apart."""
    kind = {s.name: s.kind for s in robot.sensors}
    found: dict[str, list[str]] = {}
    for name, unit in channels.units_of(shots).items():
        title = kind.get(name, "other channels").capitalize().replace("_", " ") + blueprint.in_brackets(unit)
        found.setdefault(title, []).append(name)
    return found


def _channel_pages(robot: Robot, shots: Sequence[Shot], end_s: float) -> rrb.Container:
    """A plot for each kind of channel, its channels told apart by colour; kinds with one channel share a page."""
    axis = blueprint.whole_axis(end_s)
    plots = [
        blueprint.plot("/sensors", title, axis, contents=[f"/sensors/{n}/{palette.MEASURED_NAME}" for n in names])
        for title, names in kinds_of(robot, shots).items()
    ]
    commands = blueprint.plot("/commands", "Commands" + blueprint.command_unit(robot), axis)
    together = [*plots, commands]
    if len(together) <= 4:
        return rrb.Vertical(*together)
    pages = [together[k : k + 3] for k in range(0, len(together), 3)]
    tabs = [rrb.Vertical(*page, name=", ".join(str(v.name).split(" (")[0] for v in page)) for page in pages]
    return rrb.Tabs(*tabs, active_tab=0)
