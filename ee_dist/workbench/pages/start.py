"""Start: a file dropped on the page, or the built-in story of a robot with a hidden effect."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nicegui import events, ui

from ee_dist.measurements.proposal.model import UNITS_TO_ASK
from ee_dist.robots.describe import BUILT_IN
from ee_dist.workbench.intake import Answers, Intake
from ee_dist.workbench.pages.view import View, heading, quiet

MOST_BYTES = 2 * 2**30
STORIES = {
    "servo_pendulum": "a pendulum on a servo (a quarter of a minute)",
    "quadruped_lab": "a quadruped (a minute or two)",
}


class StartView(View):
    name = "Start"

    def build(self) -> None:
        self.intake = Intake(self.session)
        with ui.element("section").classes("card"):
            heading("Measurements of your robot")
            quiet(
                "A recording (.mcap), or a file of another program (CSV, Parquet, JSON, bags, MATLAB, ...): columns are guessed."
            )
            self.robot = ui.select(self._robots(), value=self.session.config.robot.name,
                                   label="robot (not needed for a recording)").props(
                "dense outlined"
            ).style("min-width:260px").mark("robot-name")  # fmt: skip
            ui.upload(
                on_upload=self._dropped, auto_upload=True, max_file_size=MOST_BYTES, label="Drop a file here"
            ).classes("w-full").mark("drop")
        with ui.element("section").classes("card") as self.asking:
            heading("What the file says, and what it cannot say")
            self.rows = ui.column().classes("w-full gap-0").mark("mapping")
            self.questions = ui.column().classes("w-full gap-0").mark("questions")
            with ui.row().classes("items-end gap-2"):
                self.joints = ui.input("joints, in order of columns").props("dense outlined").mark("joints")
                self.gains = ui.input("motor gains (N.m or N per A)").props("dense outlined").mark("gains")
                self.unit = ui.select({"": "as guessed", **{u: u for u in UNITS_TO_ASK}}, value="", label="position unit").props(
                    "dense outlined"
                ).style("min-width:150px")  # fmt: skip
                self.rate = ui.number("rows a second").props("dense outlined")
                ui.button("Take it in", on_click=self._take_in).props("no-caps").mark("take-in")
            with ui.expansion("The mapping, to be changed by hand").classes("w-full"):
                self.mapping = (
                    ui.textarea()
                    .props("outlined autogrow")
                    .classes("w-full")
                    .style("font-family:monospace")
                    .mark("text")
                )
                ui.button("Take it in by this mapping", on_click=self._by_mapping).props("no-caps outline").mark(
                    "by-mapping"
                )
        self.asking.set_visibility(False)
        with ui.element("section").classes("card"):
            heading("Or the built-in story")
            quiet("Something is wrong with this robot, and only a sealed file knows what. Find it.")
            with ui.row():
                for name, words in STORIES.items():
                    ui.button(words, on_click=lambda _, n=name: self._story(n)).props("outline no-caps").mark(
                        f"story-{name}"
                    )
            self.busy = quiet()

    def _robots(self) -> dict[str, str]:
        """Those that are built in, and the one that the command line names."""
        own = self.session.config.robot
        file = own.drives or own.urdf
        return {**{n: n for n in BUILT_IN}, own.name: own.name if file is None else f"{own.name}: {Path(file).name}"}

    async def _dropped(self, event: events.UploadEventArguments) -> None:
        path = self.intake.place_for(event.file.name)
        await event.file.save(path)
        if path.suffix == ".mcap":
            await self.page.act(self.intake.open_recording, path)
            return
        await self._propose(path)

    async def _propose(self, path: Any) -> None:
        proposal = await self.page.act(self.intake.propose, path, str(self.robot.value), self._answers())
        self.asking.set_visibility(proposal is not None)
        if proposal is None:
            return
        self.rows.clear()
        with self.rows:
            for channel, column, unit, sure, why in proposal.rows:
                ui.label(f"{channel}: column {column}{f' ({unit})' if unit else ''}, {sure}").style("font-weight:600")
                quiet(why)
        self.questions.clear()
        with self.questions:
            for q in proposal.questions:
                ui.label(f"Open: {q}").classes("refused")
            for n in proposal.notes:
                quiet(n)
        self.mapping.set_value(proposal.text)

    def _answers(self) -> Answers:
        return Answers(
            str(self.joints.value or ""), str(self.gains.value or ""), str(self.unit.value or ""), self.rate.value
        )

    async def _take_in(self) -> None:
        path = self.intake.path
        if path is None:
            return
        await self._propose(path)
        await self.page.act(self.intake.take_in, str(self.robot.value), self._answers(), None)

    async def _by_mapping(self) -> None:
        await self.page.act(self.intake.take_in, str(self.robot.value), Answers(), str(self.mapping.value))

    async def _story(self, robot: str) -> None:
        self.busy.set_text("The robot is being tried ...")
        await self.page.act(self.intake.story, robot)
        self.busy.set_text("")
