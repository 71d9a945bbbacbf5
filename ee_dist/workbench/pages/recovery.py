"""A recovery followed while it runs, or looked at afterwards: distances, what it believes, fitness, robot and ghost."""

from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any
from urllib.parse import quote

from nicegui import background_tasks, ui

from ee_dist.recording.errors import RecordingError
from ee_dist.recording.reader import read_run
from ee_dist.recording.records import DIAGNOSIS, REPAIR, RunRecord
from ee_dist.tasks.config import ConfigError
from ee_dist.viewing import story
from ee_dist.workbench import charts
from ee_dist.workbench.pages.plot import Plot
from ee_dist.workbench.pages.robot import shown
from ee_dist.workbench.pages.view import dress, heading, quiet

EVERY_S = 2.0


class Followed:
    """The recording of a run, read again when it has grown. ``note``: why it could not be read."""

    def __init__(self, log: Path, out: Path) -> None:
        self.log, self.out = log, out
        self.run: RunRecord | None = None
        self.note = ""
        self._state: tuple[str, int, int] | None = None

    def file(self) -> Path | None:
        """The recording, finished or in the making."""
        if not self.log.is_dir():
            return self.log if self.log.is_file() else None
        return next(iter(sorted([*self.log.glob("*.mcap"), *self.log.glob("*.mcap.part")])), None)

    def look(self) -> bool:
        """Read what is there; whether anything is new. A file that is being written may be unreadable for a moment."""
        path = self.file()
        if path is None:
            self.note = f"{self.log}: no recording there yet; waiting"
            return False
        try:
            stat = path.stat()
            state = (path.name, stat.st_size, stat.st_mtime_ns)
            if state == self._state:
                return False
            self.run = read_run(path)
        except (RecordingError, OSError) as error:
            self.note = f"{error}; looking again"
            return False
        self._state, self.note = state, ""
        return True

    def scene(self) -> Path:
        """The run so far as a rerun recording."""
        assert self.run is not None
        from ee_dist.viewing.rerun_scene import write_rrd  # slow to load, and needed only when somebody looks

        self.out.mkdir(parents=True, exist_ok=True)
        path = self.out / "run.rrd"
        write_rrd(self.run, path)
        return path


def show_recovery(log: Path, out: Path) -> None:
    """Serve the run at the root. Raises ConfigError where there is nothing to follow."""
    if not (log.is_dir() or log.is_file()):
        raise ConfigError(f"log={log}: no such run; name the folder of one, such as log=logs/recover/...")
    followed = Followed(log, out)
    if not log.is_dir() and not followed.look():
        raise ConfigError(followed.note)

    @ui.page("/")
    def root() -> None:
        RecoveryPage(followed).build()


class RecoveryPage:
    def __init__(self, followed: Followed) -> None:
        self.followed = followed
        self._busy = False

    def build(self) -> None:
        self.client = ui.context.client
        dress()
        with ui.element("main").classes("bench"), ui.column().classes("w-full gap-3"):
            with ui.element("header").classes("card"):
                self.title = ui.label("").style("font-weight:600")
                self.state = quiet().mark("state")
            with ui.element("div").classes("two"):
                with ui.element("section").classes("card"):
                    heading("How far it went, trial by trial")
                    self.distance = Plot(charts.course([], "m"))
                with ui.element("section").classes("card"):
                    heading("What it believes has changed")
                    self.beliefs = ui.column().classes("gap-1").mark("beliefs")
                with ui.element("section").classes("card"):
                    heading("Repair: best distance by generation")
                    self.repair = Plot(charts.course([], "m"))
                with ui.element("section").classes("card"):
                    heading("Diagnosis: least error by generation")
                    self.diagnosis = Plot(charts.course([], "error"))
            with ui.element("section").classes("card"):
                heading("Robot and ghost")
                ui.button("Show in 3-D", icon="view_in_ar", on_click=self._show).props("outline no-caps")
                self.place = ui.element("div").classes("w-full")
        self._draw()
        ui.timer(EVERY_S, self._look)

    async def _look(self) -> None:
        if self._busy:
            return
        self._busy = True
        try:
            await asyncio.to_thread(self.followed.look)
            self._draw()
        finally:
            self._busy = False

    def _draw(self) -> None:
        run = self.followed.run
        if run is None:
            self.state.set_text(self.followed.note or "looking ...")
            return
        self.title.set_text(story.title_of(run))
        trials = story.hardware_trials(run)
        running = "finished" if run.complete else "running, or cut short"
        self.state.set_text(
            f"{running}; {len(trials)} trials, {len(run.generations)} generations. {self.followed.note}"
        )
        self.distance.draw(
            charts.course(
                [("measured", [t.log.travel_m for t in trials], charts.MEASURED)], "m", places=[t.name for t in trials]
            )
        )
        courses = (
            (self.repair, REPAIR, "m", charts.PREDICTED),
            (self.diagnosis, DIAGNOSIS, "error", charts.RESIDUAL),
        )
        for plot, phase, unit, colour in courses:
            own: Any = [g.best for g in run.generations if g.phase == phase]
            plot.draw(charts.course([(phase, own, colour)], unit))
        self.beliefs.clear()
        with self.beliefs:
            for k, r in sorted(story.beliefs(run).items()):
                ui.label(f"{story.diagnosed_after(k).capitalize()} (error {r.error:.4g}): {story.told(r.terms)}")
            truth = story.truth_of(run)
            if truth is not None:
                ui.label(f"Truth: {story.told(truth)}").style("font-weight:600")

    def _show(self) -> None:
        background_tasks.create(self._shown())

    async def _shown(self) -> None:
        if self.followed.run is None:
            return
        path = await asyncio.to_thread(self.followed.scene)
        with self.client, self.place:
            self.place.clear()
            frame = ui.element("iframe").props('title="robot in 3-D"').classes("robot")
            ui.run_javascript(shown(frame.html_id, quote(path.name)))
