"""Scenes of compare, explain and improve for any robot: ``write_compare_rrd``, ``write_explain_rrd``, ``write_improve_rrd``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import rerun.blueprint as rrb

from ee_dist.viewing import blueprint, channels, finding_text, palette, world
from ee_dist.viewing.channels import Model, Shot
from ee_dist.viewing.finding import Account, ChannelError, Finding
from ee_dist.viewing.finding_text import plain
from ee_dist.viewing.robot3d import Appearance, Shown
from ee_dist.viewing.stream import interval_s, log_digest, recording, starts_of
from ee_dist.viewing.text import document
from ee_dist.viewing.world import Ghost

SHOWN = 4
"""So many channels are drawn large, the worst; all others are in the tables and behind another tab."""
CANDIDATES = 5
GIVEN = palette.PREDICTED_NAME
LEAST_WINDOW_S = 1.0
"""A plot around the place where a channel is worst shows no less than this."""


@dataclass(frozen=True, eq=False)
class _Stage:
    """A finding on the timeline."""

    found: Finding
    shots: tuple[Shot, ...]
    models: tuple[Model, ...]
    real: Shown
    ghosts: tuple[Ghost, ...]
    starts: tuple[float, ...]

    @property
    def end_s(self) -> float:
        return max(s.start_s + interval_s(log) for s in self.shots for log in (s.measured, *s.said.values()))

    def worst(self) -> list[ChannelError]:
        measured = channels.units_of(self.shots)
        return [c for c in self.found.worst_first if c.name in measured][:SHOWN]

    def window(self, channel: ChannelError) -> tuple[float, float]:
        """Where a channel is worst, on the timeline, within its trial."""
        for shot in self.shots:
            if shot.name == channel.worst_case:
                middle = (channel.worst_from_s + channel.worst_to_s) / 2
                half = max(channel.worst_to_s - channel.worst_from_s, LEAST_WINDOW_S)
                end_s = interval_s(shot.measured)
                start, end = max(middle - half, 0.0), min(middle + half, end_s)
                return shot.start_s + min(start, max(end - half, 0.0)), shot.start_s + end
        return 0.0, self.end_s


def write_compare_rrd(found: Finding, path: str | Path) -> None:
    """Channels worst first, and the robot with its model where the error is largest."""
    stage = _stage(found, [(GIVEN, found.model, palette.PREDICTED)])
    text = [*finding_text.colours(found), *finding_text.channel_table(found)]
    _write(stage, path, "compare", text, _channel_tabs(stage, stage.models))


def write_explain_rrd(found: Finding, path: str | Path) -> None:
    """The ranking, and a tab for each of the first candidates: what it says where the model fails."""
    tried = [c for c in found.candidates if c.account is not None][:CANDIDATES]
    accounts = [(_key(k), c.account, palette.HINDSIGHT) for k, c in enumerate(tried) if c.account]
    stage = _stage(found, [(GIVEN, found.model, palette.PREDICTED), *accounts])
    text = [*finding_text.colours(found), *finding_text.candidate_table(found.candidates)]
    tabs: list[rrb.View | rrb.Container] = []
    for k in range(len(tried)):
        models = [m for m in stage.models if m.key in (GIVEN, _key(k))]
        plots = _worst_plots(stage, models, around=True)
        tabs.append(_grid(plots, f"{k + 1}. {models[-1].label}"))
    given = _grid(_worst_plots(stage, stage.models[:1], around=True), "The model")
    parts = rrb.Tabs(*tabs, given, active_tab=0)
    _write(stage, path, "explain", text, parts)


def write_improve_rrd(found: Finding, path: str | Path) -> None:
    """Before and after, and the ladder between them."""
    better = [(_key(0), found.better, palette.HINDSIGHT)] if found.better is not None else []
    stage = _stage(found, [(GIVEN, found.model, palette.PREDICTED), *better])
    channel_text = finding_text.channel_table(found)
    text = [*finding_text.colours(found), *finding_text.ladder_table(found), "", *channel_text]
    _write(stage, path, "improve", text, _channel_tabs(stage, stage.models))


def _key(k: int) -> str:
    """Place of another model among the entities."""
    return f"{GIVEN}_{k + 1}"


def _stage(found: Finding, accounts: Sequence[tuple[str, Account, palette.Rgb]]) -> _Stage:
    """Trials one after another, those without rows left out, the models beside what was measured."""
    kept = [k for k, c in enumerate(found.cases) if len(c.measured)]
    said = [{key: a.logs[k] for key, a, _ in accounts if len(a.logs[k])} for k in kept]
    starts = starts_of([(k, [found.cases[k].measured, *s.values()]) for k, s in zip(kept, said, strict=True)])
    shots = tuple(
        Shot(found.cases[k].name, t, found.cases[k].measured, s) for k, t, s in zip(kept, starts, said, strict=True)
    )
    real = [world.seen(Appearance(s.start_s, found.robot, s.measured, "measured")) for s in shots]
    ghosts = []
    # The model and the first of the others: more would hide each other.
    for place, (key, account, colour) in enumerate(accounts[:2]):
        if account.body is None:
            continue
        aside = (place + 1) * world.BESIDE_M if found.robot.free_base else 0.0
        shown: list[Appearance | None] = []
        for shot in shots:
            log = shot.said.get(key)
            seen = None if log is None else Appearance(shot.start_s, account.body, log, account.label, aside)
            shown.append(None if seen is None else world.seen(seen))
        ghosts.append(Ghost(key, colour, shown))
    models = tuple(Model(key, account.label, colour) for key, account, colour in accounts)
    return _Stage(found, shots, models, real, tuple(ghosts), tuple(starts))


def _write(stage: _Stage, path: str | Path, verb: str, text: Sequence[str], right: rrb.Container) -> None:
    found, shots = stage.found, stage.shots
    lines = [*finding_text.headline(found), *text]
    logs = [g for s in shots for g in (s.measured, *s.said.values())]
    identity = [verb, found.robot.digest, "\n".join(lines), *(log_digest(g) for g in logs)]
    layout = _layout(stage, right)
    # An application for each verb: a viewer keeps one layout for each.
    with recording(path, f"ee_dist_{verb}", identity, found.title, layout) as stream:
        stream.log("texts/result", document("\n".join(lines)), static=True)
        if shots:
            switches = [s.name for s in found.robot.sensors if s.kind == "touch"]
            world.send_world(stream, found.robot, stage.real, stage.ghosts, stage.starts)
            channels.send_sensors(stream, shots, stage.models, switches)
            channels.send_residuals(stream, shots, stage.models)
            channels.send_commands(stream, shots)
            channels.send_trial_lane(stream, shots, [s.name for s in shots])


def _layout(stage: _Stage, right: rrb.Container) -> rrb.Blueprint:
    text = rrb.TextDocumentView(origin="/texts/result", name="Result")
    if not stage.shots:
        return blueprint.framed(rrb.Vertical(text))
    view = blueprint.scene_view(
        stage.found.robot,
        "Robot and model (play: where the error is largest)",
        world.eye(stage.found.robot, stage.real),
    )
    left = rrb.Vertical(text, view, row_shares=[5, 4])
    whole = rrb.Horizontal(left, right, column_shares=[2, 3])
    worst = stage.worst()
    loop = stage.window(worst[0]) if worst else None
    return blueprint.framed(rrb.Vertical(whole, blueprint.chapters(stage.end_s), row_shares=[10, 1]), loop)


def _channel_tabs(stage: _Stage, models: Sequence[Model]) -> rrb.Container:
    """The worst channels where they are worst, the same over all trials, what is left of all, commands."""
    axis = blueprint.whole_axis(stage.end_s) if stage.shots else blueprint.moving_axis()
    units = channels.units_of(stage.shots)
    left = [
        blueprint.plot(
            "/residuals",
            "Measured - model" + blueprint.in_brackets(unit),
            axis,
            contents=[f"/residuals/{n}/{models[-1].key}" for n, u in units.items() if u == unit],
        )
        for unit in dict.fromkeys(units.values())
    ]
    commands = blueprint.plot("/commands", "Commands" + blueprint.command_unit(stage.found.robot), axis)
    return rrb.Tabs(
        _grid(_worst_plots(stage, models, around=True), "Where it is worst"),
        _grid(_worst_plots(stage, models, around=False), "All trials"),
        _grid(left, "What is left after" if len(models) > 1 else "What is left"),
        commands,
        active_tab=0,
    )


def _worst_plots(stage: _Stage, models: Sequence[Model], around: bool) -> list[rrb.View]:
    views: list[rrb.View] = []
    for c in stage.worst():
        start, end = stage.window(c)
        axis = blueprint.fixed_axis(start, end) if around else blueprint.whole_axis(stage.end_s)
        where = f", {c.worst_case}" if around and c.worst_case else ""
        views.append(
            blueprint.plot(
                f"/sensors/{c.name}",
                plain(c.name) + blueprint.in_brackets(c.unit) + where,
                axis,
                contents=[f"/sensors/{c.name}/{key}" for key in ("measured", *(m.key for m in models))],
                legend=not views,
            )
        )
    return views


def _grid(views: Sequence[rrb.View], name: str) -> rrb.Container:
    return rrb.Grid(*views, grid_columns=1 if len(views) < 3 else 2, name=name)
