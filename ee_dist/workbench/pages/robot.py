"""The robot and what the model says of it in 3-D, in rerun's viewer, at the instant that the curves show."""

from __future__ import annotations

import json
from urllib.parse import quote

from nicegui import ui

from ee_dist.workbench import verbs
from ee_dist.workbench.pages.desk import Desk
from ee_dist.workbench.pages.view import heading, quiet

SHOWN = """
(() => { const frame = document.getElementById(%(id)s); if (!frame) return;
  const probe = document.createElement('canvas');
  if (!(navigator.gpu || probe.getContext('webgl2'))) {
    frame.replaceWith(Object.assign(document.createElement('p'), {textContent:
      'This browser draws no 3-D (no WebGL): open the recording below in rerun instead.'})); return; }
  frame.src = %(address)s; })()
"""


def shown(element: str, recording: str) -> str:
    """The script that opens a recording of the session's folder in a frame, once the page has it."""
    viewer = "/viewer/index.html?hide_welcome_screen&persist=0&notebook=0&theme="
    theme = "(document.body.classList.contains('body--dark') ? 'dark' : 'light') + '&url='"
    address = (
        f"{json.dumps(viewer)} + {theme} + encodeURIComponent(location.origin + {json.dumps('/files/' + recording)})"
    )
    return SHOWN % {"id": json.dumps(element), "address": address}


class RobotPanel:
    """Asked for by a button: the viewer is 43 MB to load."""

    def __init__(self, page: Desk) -> None:
        self.page = page
        self._shown, self._wanted = "", False
        with ui.element("section").classes("card"):
            heading("The robot, and the model's ghost")
            self.note = quiet(
                "Measured robot and predicted ghost, in rerun, from task=compare of this model. It goes to the instant that the "
                "mouse points at in the curves, and to where they are zoomed in."
            )
            ui.button("Show in 3-D", icon="view_in_ar", on_click=self._ask).props("outline no-caps").mark("robot")
            self.place = ui.element("div").classes("w-full")

    async def _ask(self) -> None:
        self._wanted = True
        await self.page.begin(verbs.COMPARE)

    def draw(self, topics: set[str]) -> None:
        seen = self.page.session.shown
        if seen is None or not self._wanted or str(seen.folder) == self._shown:
            self._follow(topics)
            return
        recording = seen.folder / f"{verbs.COMPARE}.rrd"
        if not recording.is_file():
            self.note.set_text("Nothing is simulated in this way of comparing, so there is no robot to show.")
            return
        self._shown = str(seen.folder)
        path = quote(recording.relative_to(self.page.session.folder).as_posix())
        self.place.clear()
        with self.place:
            frame = ui.element("iframe").props('title="robot in 3-D"').classes("robot")
            ui.link("the recording", f"/files/{path}").classes("quiet")
        ui.run_javascript(shown(frame.html_id, path))
        self._follow(topics | {"place"})

    def _follow(self, topics: set[str]) -> None:
        """Tell the page where on the recording's clock the trial begins that the charts show; go where they are zoomed to."""
        seen, place = self.page.session.shown, self.page.place
        if seen is None or place is None or not topics & {"place", "look"}:
            return
        span = self.page.span_s
        at = "" if span is None else f" window.robotAt({span[0]});"
        ui.run_javascript(f"window.robotOn = {json.dumps([seen.timeline, seen.starts_s[place[0]]])};{at}")
