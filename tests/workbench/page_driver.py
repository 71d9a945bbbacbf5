"""The workbench as a process of its own, and a headless Chromium that looks at it and acts on it like a person."""

from __future__ import annotations

import base64
import contextlib
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from ee_dist.viewing.browser import HeadlessBrowser

READY_S, PATIENCE_S = 120.0, 120.0


class Bench:
    """``python -m ee_dist task=workbench ...`` in a folder, ended at the end of the block."""

    program: tuple[str, ...] = ("-m", "ee_dist")

    def __init__(self, folder: Path, *arguments: str) -> None:
        self.folder, self.arguments = folder, arguments
        self.address, self.lines = "", list[str]()

    def __enter__(self) -> Self:
        words = ["task=workbench", "task.port=0", "task.show=false", *self.arguments]
        command = [sys.executable, *self.program, *words]
        self.environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
        self.errors = (self.folder / "errors.txt").open("w+")
        self.process = subprocess.Popen(
            command, cwd=self.folder, env=self.environment, stdout=subprocess.PIPE, stderr=self.errors, text=True
        )
        assert self.process.stdout is not None
        for line in self.process.stdout:
            self.lines.append(line)
            found = re.search(r"http://\S+", line)
            if found:
                self.address = found[0]
                return self
        self.process.wait()
        raise AssertionError(f"the workbench ended: {self.said()}")

    @property
    def searcher(self) -> int:
        """The process in which long verbs run."""
        lists = Path(f"/proc/{self.process.pid}/task").glob("*/children")
        children = [int(child) for found in lists for child in found.read_text().split()]
        return next(c for c in children if b"spawn_main" in Path(f"/proc/{c}/cmdline").read_bytes())

    def said(self) -> str:
        if not self.errors.closed:
            self.errors.flush()
        return Path(self.errors.name).read_text()

    def end(self) -> int:
        if self.process.poll() is None:
            self.process.send_signal(signal.SIGINT)
        try:
            return self.process.wait(30.0)
        except subprocess.TimeoutExpired:
            self.process.kill()
            return self.process.wait()

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.end()
        assert self.process.stdout is not None
        self.process.stdout.close()
        self.errors.close()


class Person(HeadlessBrowser):
    """A browser with hands. Elements are found by the marks that the page gives them, through its own accessibility."""

    def go(self, address: str, width: int = 1280, height: int = 900, *, dark: bool = False) -> None:
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": False}
        self._ask("Emulation.setDeviceMetricsOverride", metrics, page=True)
        scheme = {"name": "prefers-color-scheme", "value": "dark" if dark else "light"}
        self._ask("Emulation.setEmulatedMedia", {"features": [scheme]}, page=True)
        self._events.clear()
        self._ask("Page.navigate", {"url": address}, page=True)
        self._until("Page.loadEventFired")

    @contextlib.contextmanager
    def unwatched(self) -> Iterator[None]:
        """As whoever has no tools for programmers open: while these listen, a browser finds out for every error within a script
        where in it that is, and reads all of the script again."""
        self._ask("Runtime.disable", page=True)
        try:
            yield
        finally:
            self._ask("Runtime.enable", page=True)

    def wait(self, expression: str, seconds: float = PATIENCE_S) -> Any:
        """Until an expression on the page is true; what it came to."""
        deadline = time.monotonic() + seconds
        while True:
            found = self.evaluate(f"(() => {{ try {{ return ({expression}); }} catch (e) {{ return null; }} }})()")
            if found:
                return found
            if time.monotonic() > deadline:
                raise AssertionError(f"waited in vain for: {expression}; the page says: {self.text()[:1500]}")
            time.sleep(0.1)

    def text(self) -> str:
        return str(self.evaluate("document.body.innerText"))

    def waits_for(self, text: str) -> None:
        self.wait(f"document.body.innerText.includes({json.dumps(text)})")

    def click(self, label: str, role: str = "button, [role=tab]") -> None:
        """What is in sight and has this text, icon or label for readers of screens."""
        find = f"""(() => {{ const wanted = {json.dumps(label)};
            const fits = (e) => e.offsetParent !== null && !e.disabled && (e.getAttribute('aria-label') === wanted
              || [...e.querySelectorAll('*')].concat(e).some((n) => n.children.length === 0 && n.textContent.trim() === wanted));
            const found = [...document.querySelectorAll({json.dumps(role)})].find(fits);
            if (!found) return null; found.scrollIntoView({{block: 'center'}}); const r = found.getBoundingClientRect();
            const [x, y] = [r.x + r.width / 2, r.y + r.height / 2];
            return found.contains(document.elementFromPoint(x, y)) && [x, y]; }})()"""
        # Charts that are drawn move it, and a list that opens begins below the window: not before it is in sight, and stays.
        place = None
        while (now := self.wait(find)) != place:
            place = now
            time.sleep(0.1)
        self.press(*place)

    def open(self, view: str) -> None:
        """A tab of the page, until it is in front."""
        chosen = f"[...document.querySelectorAll('[role=tab][aria-selected=true]')].some((t) => t.innerText.includes('{view}'))"
        for _ in range(10):
            self.click(view, "[role=tab]")
            for _ in range(30):
                if self.evaluate(chosen):
                    return
                time.sleep(0.1)
        raise AssertionError(f"the view {view} does not come to the front")

    def press(self, x: float, y: float) -> None:
        for kind in ("mousePressed", "mouseReleased"):
            self.mouse(kind, x, y)

    def received(self) -> int:
        """Bytes that came over the network and the websocket since the page was asked for."""
        self.evaluate("1")
        files = [e["params"]["encodedDataLength"] for e in self._events if e["method"] == "Network.loadingFinished"]
        frames = [
            e["params"]["response"]["payloadData"]
            for e in self._events
            if e["method"] == "Network.webSocketFrameReceived"
        ]
        return int(sum(files)) + sum(map(len, frames))

    def mouse(self, kind: str, x: float, y: float) -> None:
        event = {"type": kind, "x": x, "y": y, "button": "left", "buttons": 1, "clickCount": 1}
        self._ask("Input.dispatchMouseEvent", event, page=True)

    def drop(self, path: Path) -> None:
        """A file into the page's place for files."""
        asked = {"expression": "document.querySelector('input[type=file]')"}
        place = self._ask("Runtime.evaluate", asked, page=True)["result"]["objectId"]
        self._ask("DOM.setFileInputFiles", {"files": [str(path)], "objectId": place}, page=True)

    def type(self, text: str) -> None:
        self._ask("Input.insertText", {"text": text}, page=True)

    def key(self, name: str, code: int = 0, text: str = "") -> None:
        for kind in ("keyDown", "keyUp"):
            event: dict[str, Any] = {"type": kind, "key": name, "code": name, "windowsVirtualKeyCode": code}
            if text and kind == "keyDown":
                event["text"] = text
            self._ask("Input.dispatchKeyEvent", event, page=True)

    def picture(self, path: Path, *, whole: bool = False) -> None:
        """Of what is in sight, or of the ``whole`` page."""
        clip: dict[str, Any] = {}
        if whole:
            width, height = self.evaluate("[innerWidth, document.documentElement.scrollHeight]")
            part = {"x": 0, "y": 0, "width": width, "height": height, "scale": 1}
            clip = {"clip": part, "captureBeyondViewport": True}
        shot = self._ask("Page.captureScreenshot", {"format": "png", **clip}, page=True)["data"]
        path.write_bytes(base64.b64decode(shot))

    def complaints(self) -> tuple[str, ...]:
        self.evaluate("1")
        return self._complaints()

    def asked_outside(self, address: str) -> list[str]:
        return [a for a in self._asked() if not a.startswith((address, address.replace("http", "ws")))]
