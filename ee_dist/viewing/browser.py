"""Pages looked at without a screen, in headless Chromium: pictures, and what the page complains about or asks for."""

from __future__ import annotations

import base64
import json
import os
import select
import shutil
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from ee_dist.viewing.processes import gone

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
ANSWER_S = 300.0
PICTURE_S = 60.0
"""For a page that is drawn already."""
ENDING_S = 5.0
SWITCHES = (
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--hide-scrollbars",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-background-timer-throttling",
    "--disable-backgrounding-occluded-windows",
    "--disable-renderer-backgrounding",
    "--disable-component-update",
    "--disable-sync",
    "--disable-dev-shm-usage",
    "--remote-debugging-pipe",
)
# Chromium listens on handle 3 and answers on 4; a launcher puts them there whatever is open in this process.
LAUNCH = "import os, sys; r, w = map(int, sys.argv[1:3]); r, w = os.dup(r), os.dup(w)\n" + (
    "a, b = os.dup(r), os.dup(w)\nwhile min(a, b) < 5: a, b = os.dup(a), os.dup(b)\n"
    "os.dup2(a, 3); os.dup2(b, 4); os.execv(sys.argv[3], sys.argv[3:])"
)


class BrowserError(RuntimeError):
    """Chromium is not installed, or did not answer; said in one line."""


class _SilentError(BrowserError):
    """It runs, and does not answer."""


@dataclass(frozen=True)
class Look:
    """A page as it was seen. ``asked``: addresses outside that it wanted; ``complaints``: errors and warnings of its console;
    ``overflow``: pixels by which it is wider than the window."""

    png: bytes
    asked: tuple[str, ...]
    complaints: tuple[str, ...]
    overflow: int


def chromium() -> str:
    """Its path. Raises BrowserError."""
    for name in NAMES:
        found = shutil.which(name)
        if found:
            return found
    raise BrowserError(f"no Chromium to look at pages with; looked for {', '.join(NAMES)}")


class HeadlessBrowser:
    """Chromium in the background, used in a ``with`` block, at whose end its processes are gone."""

    def __enter__(self) -> Self:
        binary = chromium()
        theirs, self._to = os.pipe()
        self._from, answers = os.pipe()
        self._profile = tempfile.TemporaryDirectory(ignore_cleanup_errors=True)
        command = [sys.executable, "-c", LAUNCH, str(theirs), str(answers), binary, *SWITCHES]
        command.append(f"--user-data-dir={self._profile.name}")
        self._process = subprocess.Popen(
            command, pass_fds=(theirs, answers), stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
        )  # fmt: skip
        os.close(theirs)
        os.close(answers)
        self._buffer, self._count = b"", 0
        self._events: list[dict[str, Any]] = []
        try:
            target = self._ask("Target.createTarget", {"url": "about:blank"})["targetId"]
            self._session = self._ask("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"]
            for part in ("Page", "Runtime", "Log", "Network"):
                self._ask(f"{part}.enable", page=True)
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def open(self, page: Path, width: int, *, dark: bool = False, height: int = 900) -> None:
        """Open a page, of which what is in sight is drawn. Raises BrowserError."""
        self._events.clear()
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self._ask("Emulation.setDeviceMetricsOverride", metrics, page=True)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._ask("Emulation.setEmulatedMedia", {"features": [scheme]}, page=True)
        self._ask("Page.navigate", {"url": page.resolve().as_uri()}, page=True)
        self._until("Page.loadEventFired")

    def look(self, page: Path, width: int, *, dark: bool = False, height: int = 900, whole: bool = False) -> Look:
        """Open a page and scroll through all of it; a picture of its first screen or of the ``whole``. Raises BrowserError."""
        try:
            return self._look(page, width, dark, height, whole)
        except _SilentError:
            # On a busy machine a frame may never come, of which then no picture is taken; another Chromium draws it.
            self._end()
            self.__enter__()
            return self._look(page, width, dark, height, whole)

    def _look(self, page: Path, width: int, dark: bool, height: int, whole: bool) -> Look:
        self.open(page, width, dark=dark, height=height)
        # Every part is opened and comes into sight once, so that whatever can go wrong in drawing it does.
        self.evaluate(
            "(async () => { const open = [...document.querySelectorAll('details:not([open])')];"
            # On a busy machine a frame may never come.
            "const frame = () => new Promise((done) => { requestAnimationFrame(done); setTimeout(done, 1000); });"
            "const rest = async () => { await frame(); await frame(); await new Promise((done) => setTimeout(done, 20)); };"
            "open.forEach((part) => { part.open = true; });"
            "for (let y = 0; y < document.body.scrollHeight; y += 500) { scrollTo(0, y); await rest(); }"
            "window.seenOverflow = document.documentElement.scrollWidth - innerWidth;"
            "open.forEach((part) => { part.open = false; }); scrollTo(0, 0); await rest(); await rest(); })()"
        )
        overflow = int(self.evaluate("window.seenOverflow"))
        clip = {}
        if whole:
            tall = int(self.evaluate("document.documentElement.scrollHeight"))
            clip = {"clip": {"x": 0, "y": 0, "width": width, "height": tall, "scale": 1}, "captureBeyondViewport": True}
        shot = self._ask("Page.captureScreenshot", {"format": "png", **clip}, page=True, patience_s=PICTURE_S)["data"]
        return Look(base64.b64decode(shot), self._asked(), self._complaints(), max(0, overflow))

    def evaluate(self, script: str) -> Any:
        """What an expression on the page comes to, once it is settled. Raises BrowserError."""
        asked = {"expression": script, "awaitPromise": True, "returnByValue": True}
        answer = self._ask("Runtime.evaluate", asked, page=True)
        if "exceptionDetails" in answer:
            raise BrowserError(f"on the page: {answer['exceptionDetails'].get('text')}")
        return answer["result"].get("value")

    def _asked(self) -> tuple[str, ...]:
        addresses = [e["params"]["request"]["url"] for e in self._events if e["method"] == "Network.requestWillBeSent"]
        return tuple(a for a in addresses if not a.startswith(("file:", "data:", "blob:", "about:")))

    def _complaints(self) -> tuple[str, ...]:
        found = []
        for event in self._events:
            said = event["params"]
            if event["method"] == "Runtime.consoleAPICalled" and said["type"] in ("error", "warning", "assert"):
                found.append(" ".join(str(a.get("value", a.get("description", ""))) for a in said["args"]))
            elif event["method"] == "Runtime.exceptionThrown":
                details = said["exceptionDetails"]
                found.append(str(details.get("exception", {}).get("description", details.get("text"))))
            elif event["method"] == "Log.entryAdded" and said["entry"]["level"] in ("error", "warning"):
                found.append(said["entry"]["text"])
        return tuple(found)

    def _ask(
        self,
        method: str,
        parameters: dict[str, Any] | None = None,
        page: bool = False,
        patience_s: float = ANSWER_S,
    ) -> dict[str, Any]:
        self._count += 1
        message: dict[str, Any] = {"id": self._count, "method": method, "params": parameters or {}}
        if page:
            message["sessionId"] = self._session
        try:
            os.write(self._to, json.dumps(message).encode() + b"\0")
        except BrokenPipeError as error:
            raise BrowserError("Chromium ended by itself") from error
        deadline = time.monotonic() + patience_s
        while True:
            answer = self._next(deadline, method)
            if answer.get("id") == self._count:
                if "error" in answer:
                    raise BrowserError(f"{method}: {answer['error']['message']}")
                return dict(answer["result"])
            self._events.append(answer)

    def _until(self, method: str) -> None:
        deadline = time.monotonic() + ANSWER_S
        while not any(e.get("method") == method for e in self._events):
            self._events.append(self._next(deadline, method))

    def _next(self, deadline: float, waiting: str) -> dict[str, Any]:
        while b"\0" not in self._buffer:
            ready, _, _ = select.select([self._from], [], [], max(0.0, deadline - time.monotonic()))
            chunk = os.read(self._from, 1 << 20) if ready else b""
            if not ready:
                raise _SilentError(f"Chromium did not answer {waiting}")
            if not chunk:
                raise BrowserError("Chromium ended by itself")
            self._buffer += chunk
        message, self._buffer = self._buffer.split(b"\0", 1)
        return dict(json.loads(message))

    def _end(self) -> None:
        # Without anybody to listen to, Chromium ends itself and its children.
        os.close(self._to)
        gone(self._process, ENDING_S)
        os.close(self._from)
        self._profile.cleanup()
