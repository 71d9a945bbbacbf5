"""A whole run as a rerun recording: ``write_rrd``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import rerun as rr
import rerun.blueprint as rrb

from ee_dist.recording.records import DIAGNOSIS, PREDICTION, REPAIR, RunRecord, TrialRecord
from ee_dist.robots.ranges import command_units
from ee_dist.viewing import blueprint, channels, search_curves, story, world
from ee_dist.viewing.channels import Pair
from ee_dist.viewing.robot3d import Appearance, Shown
from ee_dist.viewing.stream import interval_s, log_digest, recording, starts_of

APPLICATION = "ee_dist"


def write_rrd(run: RunRecord, path: str | Path) -> None:
    """Write a run as an ``.rrd`` with its blueprint. Equal runs give equal recordings but for rerun's own row ids."""
    trials = [t for t in story.hardware_trials(run) if len(t.log)]
    predicted = {t.index: t for t in run.trials if t.source == PREDICTION and len(t.log)}
    logs = [(t.index, [t.log, *([predicted[t.index].log] if t.index in predicted else [])]) for t in trials]
    starts = starts_of(logs)
    real, ghost = _appearances(run, trials, starts, predicted)
    identity = [run.robot.digest, repr(sorted(run.metadata.items())), *(log_digest(t.log) for t in run.trials)]
    with recording(path, APPLICATION, identity, story.title_of(run), _blueprint(run, trials, starts, real)) as stream:
        for place, text in (("texts/result", story.result_text(run)), ("texts/details", story.details_text(run))):
            stream.log(place, rr.TextDocument(text, media_type=rr.MediaType.MARKDOWN), static=True)
        if trials:
            pairs = [
                Pair(t.name, s, g[0], g[1] if len(g) > 1 else None)
                for t, s, (_, g) in zip(trials, starts, logs, strict=True)
            ]
            switches = [s.name for s in run.robot.sensors if s.kind == "touch"]
            world.send_world(stream, run.robot, real, ghost, starts)
            channels.send_sensors(stream, pairs, switches)
            channels.send_commands(stream, pairs)
            channels.send_touch(stream, pairs, switches)
            channels.send_trial_lane(stream, pairs, [label(t) for t in trials])
        for phase, where, what in ((REPAIR, "search/distance", "repair"), (DIAGNOSIS, "search/error", "diagnosis")):
            search_curves.send_curve(stream, where, [g for g in run.generations if g.phase == phase], what)


def _appearances(
    run: RunRecord, trials: Sequence[TrialRecord], starts: Sequence[float], predicted: Mapping[int, TrialRecord]
) -> tuple[Shown, Shown]:
    """The robot and its prediction, one of each for every trial."""
    truth = story.truth_of(run) or ()
    aside = world.BESIDE_M if run.robot.free_base else 0.0
    real: list[Appearance | None] = []
    ghost: list[Appearance | None] = []
    for t, start in zip(trials, starts, strict=True):
        body = world.believed_model(run.robot, () if t.name == story.INTACT else truth)
        real.append(world.seen(Appearance(start, body, t.log, label(t))))
        p = predicted.get(t.index)
        if p is None:
            ghost.append(None)
            continue
        model, text = world.believed_model(run.robot, p.believed), f"predicted: {p.log.travel_m:.2f} m"
        ghost.append(world.seen(Appearance(start, model, p.log, text, aside)))
    return real, ghost


def label(trial: TrialRecord) -> str:
    """A trial by its name and how far the robot went."""
    return f"{trial.name}: {trial.log.travel_m:.2f} m"


def _blueprint(run: RunRecord, trials: Sequence[TrialRecord], starts: Sequence[float], real: Shown) -> rrb.Blueprint:
    text = rrb.Tabs(
        rrb.TextDocumentView(origin="/texts/result", name="Result"),
        rrb.TextDocumentView(origin="/texts/details", name="Details"),
        active_tab=0,
    )
    search = rrb.Vertical(
        blueprint.bars("/search/distance", "Repair: best distance (m), generation by generation"),
        blueprint.bars("/search/error", "Diagnosis: least error, generation by generation"),
    )
    if not trials:
        return blueprint.framed(rrb.Horizontal(search, text))
    scene = blueprint.scene_view(
        run.robot, "Robot (blue) and what its model expected (orange)", world.eye(run.robot, real)
    )
    axis = blueprint.moving_axis()
    touch = [s for s in run.robot.sensors if s.kind == "touch"]
    others = [s for s in run.robot.sensors if s.kind != "touch"]
    tabs: list[rrb.View | rrb.Container] = []
    if touch:
        tabs.append(blueprint.lanes("/touch", "Feet on the floor"))
        tabs.append(blueprint.sensor_plots(touch, "Touch values", axis))
    units = sorted({u for u in command_units(run.robot).values() if u is not None})
    tabs.append(blueprint.plot("/commands", f"Commands ({', '.join(units)})", axis))
    beside = [blueprint.sensor_plots(others, "Other channels", axis)] if others else []
    below = rrb.Horizontal(rrb.Tabs(*tabs, active_tab=0), *beside)
    left = rrb.Vertical(scene, below, row_shares=[13, 10])
    right = rrb.Vertical(text, search, row_shares=[9, 5])
    end_s = starts[-1] + interval_s(trials[-1].log)
    whole = rrb.Vertical(
        rrb.Horizontal(left, right, column_shares=[5, 3]), blueprint.chapters(end_s), row_shares=[10, 1]
    )
    return blueprint.framed(whole)
