"""A whole run as a rerun recording: ``write_rrd``."""

from __future__ import annotations

from pathlib import Path

import rerun.blueprint as rrb

from ee_dist.recording.records import HARDWARE, PREDICTION, RunRecord, TrialRecord
from ee_dist.robots.ranges import command_units
from ee_dist.viewing import blueprint, channels, search_scene, story, world
from ee_dist.viewing.robot3d import Appearance, Shown
from ee_dist.viewing.search_scene import SAID, Course
from ee_dist.viewing.stream import recording
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
    course = search_scene.course_of(run)
    real, ghosts = _appearances(run, course)
    layout = search_scene.layout(run, course, _body(run, real) if course.trials else None)
    with recording(path, APPLICATION, search_scene.identity_of(run), story.title_of(run), layout) as stream:
        search_scene.send_texts(stream, run)
        if course.trials:
            shots = course.shots
            switches = [s.name for s in run.robot.sensors if s.kind == "touch"]
            world.send_world(stream, run.robot, real, ghosts, course.starts)
            channels.send_sensors(stream, shots, course.models, switches)
            channels.send_commands(stream, shots)
            channels.send_touch(stream, shots, [SAID[PREDICTION]], switches)
            channels.send_trial_lane(stream, shots, [label(t) for t in course.trials])
        search_scene.send_search(stream, run)


def _is_loop(run: RunRecord) -> bool:
    """Whether a search was recorded, or at least models beside the trials."""
    return "scenario" in run.metadata or bool(run.generations) or any(t.source != HARDWARE for t in run.trials)


def _appearances(run: RunRecord, course: Course) -> tuple[Shown, list[Ghost]]:
    """The robot and what its models say, one of each for every trial."""
    truth = story.truth_of(run) or ()
    real: list[Appearance | None] = []
    for t, start in zip(course.trials, course.starts, strict=True):
        body = world.believed_model(run.robot, () if t.name == story.INTACT else truth)
        real.append(world.seen(Appearance(start, body, t.log, label(t))))
    ghosts = []
    for k, (source, model) in enumerate(SAID.items()):
        aside = (k + 1) * world.BESIDE_M if run.robot.free_base else 0.0
        shown: list[Appearance | None] = []
        for t, start in zip(course.trials, course.starts, strict=True):
            m = course.said.get((source, t.index))
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


def _body(run: RunRecord, real: Shown) -> rrb.Container:
    """The robot, what it touches, commands and channels."""
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
    return rrb.Vertical(scene, below, row_shares=[13, 10])
