"""Rerun's viewer for the browser, as files to serve: taken from the SDK, cut off from the network.

The SDK serves it from a port of its own. Taken from there once, it can come from the same origin as the page around it,
which a browser needs to let the page set its time, and which lets a content policy forbid it to call elsewhere.
"""

from __future__ import annotations

import re
import socket
import time
from dataclasses import dataclass
from functools import cache
from urllib.error import URLError
from urllib.request import urlopen

PARTS = {
    "index.html": "text/html; charset=utf-8",
    "re_viewer.js": "text/javascript",
    "re_viewer_bg.wasm": "application/wasm",
    "favicon.ico": "image/x-icon",
    "apple-touch-icon.png": "image/png",
}
NEEDED = ("index.html", "re_viewer.js", "re_viewer_bg.wasm")
QUIET = """<script>
// Nothing is asked of other machines: what the viewer would like to know of them is answered here, with nothing.
(() => {
  const own = (to) => new URL(to, location.href).origin === location.origin;
  const ask = window.fetch.bind(window);
  window.fetch = (to, ...more) => own(to.url ?? to) ? ask(to, ...more) : Promise.resolve(new Response("{}", {status: 503}));
  // It has little to say to whoever looks at the console of the page around it.
  for (const kind of ["debug", "info", "log", "warn"]) console[kind] = () => {};
})();
</script>"""


class WebViewerError(RuntimeError):
    """The SDK did not give its viewer; said in one line."""


@dataclass(frozen=True)
class Part:
    """A file of the viewer."""

    content: bytes
    kind: str


@cache
def web_viewer() -> dict[str, Part]:
    """The files by name; the page of the viewer is index.html. About 43 MB. Raises WebViewerError."""
    import rerun as rr  # slow to load, and needed only when somebody looks at the robot

    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        port = probe.getsockname()[1]
    try:
        rr.serve_web_viewer(web_port=port, open_browser=False)
    except (RuntimeError, OSError, ValueError) as error:
        raise WebViewerError(f"rerun's viewer for the browser cannot be had from the SDK: {error}") from error
    found = {name: _get(port, name, kind) for name, kind in PARTS.items()}
    missing = [name for name in NEEDED if found[name] is None]
    if missing:
        raise WebViewerError(f"rerun's SDK has no viewer for the browser ({', '.join(missing)} is missing)")
    parts = {name: part for name, part in found.items() if part is not None}
    page = parts["index.html"].content.decode("utf-8")
    parts["index.html"] = Part(cut_off(page).encode(), PARTS["index.html"])
    return parts


def cut_off(page: str) -> str:
    """The viewer's page without what it takes from elsewhere."""
    page = re.sub(r"<link[^>]*https?://[^>]*>", "", page, flags=re.S)
    return page.replace("<head>", f"<head>{QUIET}", 1)


def _get(port: int, name: str, kind: str) -> Part | None:
    deadline = time.monotonic() + 5.0
    path = "" if name == "index.html" else name
    while True:
        try:
            with urlopen(f"http://127.0.0.1:{port}/{path}", timeout=10.0) as answer:
                return Part(answer.read(), kind)
        except URLError as error:
            if getattr(error, "code", None) is not None:
                return None
            if time.monotonic() > deadline:
                raise WebViewerError(f"rerun's viewer for the browser did not answer: {error.reason}") from error
            time.sleep(0.05)
