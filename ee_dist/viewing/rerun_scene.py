"""A whole run as a rerun recording: ``write_rrd``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import rerun.blueprint as rrb

from ee_dist.recording.records import HARDWARE, PREDICTION, RunRecord, TrialRecord
from ee_dist.robots.ranges import command_units
from ee_dist.viewing import blueprint, channels, search_scene, story, world
from ee_dist.viewing.channels import Shot
from ee_dist.viewing.robot3d import Appearance, Shown
from ee_dist.viewing.search_scene import SAID
from ee_dist.viewing.stream import interval_s, log_digest, recording, starts_of
from ee_dist.viewing.text import document
from ee_dist.viewing.trial_scene import write_trial_rrd
from ee_dist.viewing.world import Ghost

APPLICATION = "ee_dist"


def write_rrd(run: RunRecord, path: str | Path) -> None:
    """Write a run of the loop as an ``.rrd`` with its blueprint; a recording of trials alone as a scene of those.

    Equal runs give equal recordings but for rerun's own row ids.
    """
    if not _is_loop(run):
        write_trial_rrd(run, path)
        return
    trials = [t for t in story.hardware_trials(run) if len(t.log)]
    said = {(t.source, t.index): t for t in run.trials if len(t.log)}
    beside = [[said[s, t.index] for s in SAID if (s, t.index) in said] for t in trials]
    starts = starts_of([(t.index, [t.log, *(m.log for m in models)]) for t, models in zip(trials, beside, strict=True)])
    real, ghosts = _appearances(run, trials, starts, said)
    models = [SAID[s] for s in SAID if any((s, t.index) in said for t in trials)]
    identity = [run.robot.digest, repr(sorted(run.metadata.items())), *(log_digest(t.log) for t in run.trials)]
    with recording(path, APPLICATION, identity, story.title_of(run), _blueprint(run, trials, starts, real)) as stream:
        for place, text in (("texts/result", story.result_text(run)), ("texts/details", story.details_text(run))):
            stream.log(place, document(text), static=True)
        if trials:
            shots = [
                Shot(t.name, s, t.log, {SAID[m.source].key: m.log for m in own})
                for t, s, own in zip(trials, starts, beside, strict=True)
            ]
            switches = [s.name for s in run.robot.sensors if s.kind == "touch"]
            world.send_world(stream, run.robot, real, ghosts, starts)
            channels.send_sensors(stream, shots, models, switches)
            channels.send_commands(stream, shots)
            channels.send_touch(stream, shots, [SAID[PREDICTION]], switches)
            channels.send_trial_lane(stream, shots, [label(t) for t in trials])
        search_scene.send_search(stream, run)


def _is_loop(run: RunRecord) -> bool:
    """Whether a search was recorded, or at least models beside the trials."""
    return "scenario" in run.metadata or bool(run.generations) or any(t.source != HARDWARE for t in run.trials)


def _appearances(
    run: RunRecord,
    trials: Sequence[TrialRecord],
    starts: Sequence[float],
    said: Mapping[tuple[str, int], TrialRecord],
) -> tuple[Shown, list[Ghost]]:
    """The robot and what its models say, one of each for every trial."""
    truth = story.truth_of(run) or ()
    real: list[Appearance | None] = []
    for t, start in zip(trials, starts, strict=True):
        body = world.believed_model(run.robot, () if t.name == story.INTACT else truth)
        real.append(world.seen(Appearance(start, body, t.log, label(t))))
    ghosts = []
    for k, (source, model) in enumerate(SAID.items()):
        aside = (k + 1) * world.BESIDE_M if run.robot.free_base else 0.0
        shown: list[Appearance | None] = []
        for t, start in zip(trials, starts, strict=True):
            m = said.get((source, t.index))
            if m is None:
                shown.append(None)
                continue
            text = f"{model.label}: {m.log.travel_m:.2f} m"
            shown.append(world.seen(Appearance(start, world.believed_model(run.robot, m.believed), m.log, text, aside)))
        ghosts.append(Ghost(model.key, model.colour, shown))
    return real, ghosts


def label(trial: TrialRecord) -> str:
    """A trial by its name and how far the robot went."""
    return f"{trial.name}: {trial.log.travel_m:.2f} m"


def _blueprint(run: RunRecord, trials: Sequence[TrialRecord], starts: Sequence[float], real: Shown) -> rrb.Blueprint:
    text = rrb.Tabs(
        rrb.TextDocumentView(origin="/texts/result", name="Result"),
        rrb.TextDocumentView(origin="/texts/details", name="Details"),
        active_tab=0,
    )
    search = search_scene.search_views(run)
    if not trials:
        return blueprint.framed(rrb.Horizontal(*search, text))
    named = "Robot (blue), expected before (orange), explained after (violet)"
    scene = blueprint.scene_view(run.robot, named, world.eye(run.robot, real))
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
    # The names of the channels need the room.
    below = rrb.Horizontal(rrb.Tabs(*tabs, active_tab=0), *beside, column_shares=[3, 4][: 1 + len(beside)])
    left = rrb.Vertical(scene, below, row_shares=[13, 10])
    right = rrb.Vertical(text, *search, row_shares=[18, 5, 5][: 1 + len(search)])
    end_s = starts[-1] + interval_s(trials[-1].log)
    whole = rrb.Vertical(
        rrb.Horizontal(left, right, column_shares=[5, 3]), blueprint.chapters(end_s), row_shares=[10, 1]
    )
    return blueprint.framed(whole)
