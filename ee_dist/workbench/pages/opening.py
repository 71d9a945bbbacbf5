"""The page as it is opened: what a browser has to read for it takes longer than all else, so it is sent to do that first."""

from __future__ import annotations

import json
from pathlib import Path

from nicegui import ui

from ee_dist.workbench.commands import going_on
from ee_dist.workbench.pages.view import dress
from ee_dist.workbench.session import Session

UNSAID = "<script>if (location.search) history.replaceState(null, '', location.pathname);</script>"
"""The token has become a cookie: it need not stand in the address bar and in the browser's memory."""
FOLLOW = Path(__file__).with_name("follow.js")
GONE = "The workbench does not answer: it was ended, or its process is gone."
ONWARD = f"{GONE} Nothing is lost: where a log was open, %s goes on with it."
SAID = "<script>addEventListener('DOMContentLoaded', () => { document.querySelector('#popup span').textContent = %s; });</script>"
"""In the place of the toolkit's own words for it, which know of no process."""


def show_session(session: Session) -> None:
    """Serve the session at the root: every tab of every browser shows the same one."""

    @ui.page("/")
    async def root() -> None:
        dress()
        ui.add_head_html(UNSAID)
        ui.add_head_html(f"<script>{FOLLOW.read_text()}</script>")
        ui.add_head_html(SAID % json.dumps(ONWARD % going_on(session.folder)).replace("<", "\\u003c"))
        ui.colors(primary="#0072b2", positive="#009e73", negative="#c04a00")
        client = ui.context.client
        if session.seen is None:
            # While the browser reads its scripts there is time to look at the log, and to load what the page is made of.
            await client.connected()
            if client.is_deleted:
                return  # whoever asked for it never came back
        from ee_dist.workbench.pages.page import Page

        Page(session).build()
