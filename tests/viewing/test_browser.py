"""Chromium that stops answering."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest

from ee_dist.viewing import browser
from ee_dist.viewing.browser import BrowserError, HeadlessBrowser, chromium


@pytest.fixture
def page(tmp_path: Path) -> Path:
    try:
        chromium()
    except BrowserError as error:
        pytest.skip(str(error))
    path = tmp_path / "page.html"
    path.write_text("<html><body><p>still here</p></body></html>")
    return path


def test_another_one_takes_the_picture(page: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with HeadlessBrowser() as window:
        asked, first = window._ask, window._process.pid

        def stuck_at_the_picture(method: str, *args: object, **more: object) -> object:
            if method == "Page.captureScreenshot" and window._process.pid == first:
                os.kill(first, signal.SIGSTOP)
                more["patience_s"] = 0.2
            return asked(method, *args, **more)

        monkeypatch.setattr(window, "_ask", stuck_at_the_picture)
        monkeypatch.setattr(browser, "ENDING_S", 0.2)
        seen = window.look(page, 400)
        assert seen.png.startswith(b"\x89PNG") and seen.complaints == ()
        assert window._process.pid != first
        assert window.evaluate("document.body.innerText") == "still here"
    with pytest.raises(ProcessLookupError):
        os.kill(first, 0)
