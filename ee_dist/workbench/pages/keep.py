"""Keep: the model as a file, what task=compare says of it, the reports, the exports, and the commands that do it all again."""

from __future__ import annotations

from pathlib import Path
from urllib.parse import quote

from nicegui import ui

from ee_dist.export import FORMATS
from ee_dist.tasks.folder import EARLIER, begun_s
from ee_dist.workbench.pages.view import View, heading, quiet
from ee_dist.workbench.session import MODEL_FILE


class KeepView(View):
    name, icon = "Keep", "save"
    topics = frozenset({"model", "seen", "kept", "explained", "progress", "exported"})

    def build(self) -> None:
        with ui.element("section").classes("card"):
            heading("The model as a file")
            with ui.row().classes("items-center"):
                ui.button("Keep the model", icon="save", on_click=lambda: self.page.act(self.session.keep)).props(
                    "no-caps"
                ).mark("keep")
                quiet("Written as a model file, and compared by task=compare, which writes a report.")
            self.kept = ui.label("").style("font-weight:600").mark("kept")
            self.files = ui.column().classes("gap-0").mark("files")
        with ui.element("section").classes("card"):
            heading("For other simulators")
            with ui.row().classes("items-center"):
                self.to = (
                    ui.select(list(FORMATS), value=FORMATS[0], label="format")
                    .props("dense outlined")
                    .style("width:130px")
                )
                ui.button("Export", on_click=self._export).props("outline no-caps").mark("export")
        with ui.element("section").classes("card"):
            heading("The same from the command line")
            self.commands = ui.column().classes("w-full gap-0").mark("commands")

    async def draw(self, topics: set[str]) -> None:
        session, kept = self.session, self.session.kept
        self.kept.set_text(
            "" if kept is None else f"task=compare says {kept.told} (error {kept.error:.6g}). {kept.headline}"
        )
        self.files.clear()
        with self.files:
            for path, earlier in listed(session.folder):
                name = path.relative_to(session.folder).as_posix()
                with ui.row().classes("items-center gap-2"):
                    ui.link(name, f"/files/{quote(name)}", new_tab=True)
                    if earlier:
                        quiet(f"({EARLIER})")
        self.commands.clear()
        with self.commands:
            for line in session.commands:
                ui.label(line).classes("command w-full")

    async def _export(self) -> None:
        await self.page.act(self.session.export, str(self.to.value))
        self.page.changed("exported")


def listed(folder: Path) -> list[tuple[Path, bool]]:
    """Files worth a link (models, reports, recordings, exports), and whether each lay there before this session began: those
    last, for they tell of another model."""
    wanted = {".yaml", ".html", ".rrd", ".xml", ".urdf", ".py", ".mcap"}
    found = [p for p in folder.rglob("*") if p.is_file() and p.suffix in wanted and "config" not in p.parts]
    begun = begun_s(folder)
    own = [(p, p.stat().st_mtime < begun) for p in found if p.parent.name != "steps" or p.name == MODEL_FILE]
    return sorted(own, key=lambda f: (f[1], f[0]))
