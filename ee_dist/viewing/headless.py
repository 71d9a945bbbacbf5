"""The rerun viewer without a screen: started, driven and always ended by us."""

from __future__ import annotations

import ctypes
import importlib.util
import shutil
import socket
import subprocess
import tempfile
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from types import TracebackType
from typing import IO, Self, TypeVar

from rerun.experimental import ViewerClient, ViewerState

from ee_dist.viewing.processes import gone

Answer = TypeVar("Answer")

START_S = 30.0
LAY_OUT_S = 4.0
"""Time in which a view must come to the screen."""
LOAD_S = 60.0
BEGINNING = b"RRF"
"""What every recording of rerun begins with; one digit follows, its format."""
REST_S = 40.0
"""Time in which a picture must come to rest,"""
FEWEST = 12
"""and pictures that it has for that at least: a busy machine takes seconds for each."""
GREETING_S = 4.0
"""For so long after it begins to draw the viewer lays a note over the picture that it runs without a screen."""


class ViewerError(RuntimeError):
    """The viewer is not installed, did not start, or did not show what it was given; said in one line."""


def viewer_binary() -> Path:
    """The viewer itself. The ``rerun`` command wraps it, and ending the wrapper leaves the viewer running."""
    found = importlib.util.find_spec("rerun_cli")
    for folder in (found.submodule_search_locations or ()) if found else ():
        for name in ("rerun", "rerun.exe", "Rerun.app/Contents/MacOS/Rerun"):
            binary = Path(folder) / name
            if binary.is_file():
                return binary
    other = shutil.which("rerun")
    if other:
        return Path(other)
    raise ViewerError("the rerun viewer is not installed: pip install rerun-sdk")


def vulkan_devices() -> int:
    """How many devices (a software one counts) Vulkan offers on this machine; 0 without a loader or driver."""
    for library in ("libvulkan.so.1", "vulkan-1.dll", "libvulkan.1.dylib"):
        try:
            vulkan = ctypes.CDLL(library)
            break
        except OSError:
            continue
    else:
        return 0
    # VkInstanceCreateInfo with every field but the type left empty: no layers, no extensions.
    info = (ctypes.c_uint64 * 8)(1)
    instance, count = ctypes.c_void_p(), ctypes.c_uint32()
    if vulkan.vkCreateInstance(ctypes.byref(info), None, ctypes.byref(instance)) != 0:
        return 0
    failed = vulkan.vkEnumeratePhysicalDevices(instance, ctypes.byref(count), None)
    vulkan.vkDestroyInstance(instance, None)
    return 0 if failed else count.value


def check_recording(path: str | Path) -> Path:
    """Its absolute path. Raises ViewerError for what is no recording: of some foreign files the viewer says nothing at all."""
    file = Path(path).absolute()
    if not file.is_file():
        raise ViewerError(f"no such recording: {path}")
    try:
        with file.open("rb") as content:
            beginning = content.read(len(BEGINNING))
    except OSError as error:
        raise ViewerError(f"cannot read {path}: {error.strerror}") from None
    if beginning != BEGINNING:
        raise ViewerError(f"cannot read {path}: not a recording of rerun (.rrd)")
    return file


class HeadlessViewer:
    """A viewer in the background, used in a ``with`` block, at whose end its process is gone."""

    def __init__(self, size: tuple[int, int] = (1600, 1000)) -> None:
        self.size = size
        self._process: subprocess.Popen[bytes] | None = None
        self._output: IO[bytes] | None = None
        self._client: ViewerClient | None = None
        self._started = 0.0

    def __enter__(self) -> Self:
        port = _free_port()
        command = [str(viewer_binary()), "--headless", "--bind", "127.0.0.1", "--port", str(port)]
        command += ["--hide-welcome-screen", "--window-size", f"{self.size[0]}x{self.size[1]}"]
        self._output = tempfile.TemporaryFile()
        self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=self._output, stderr=self._output)
        try:
            self._client = self._connected(f"rerun+http://127.0.0.1:{port}/proxy")
            self._started = time.monotonic()  # It greets once it draws.
        except BaseException:
            self._end()
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._end()

    def open(self, path: str | Path) -> None:
        """Load a recording and wait until all of it is there. Raises ViewerError."""
        file = check_recording(path)
        with suppress(TimeoutError):  # It was told: whether it loads is seen below.
            self.client.open(str(file))
        deadline = time.monotonic() + LOAD_S
        while time.monotonic() < deadline:
            with suppress(TimeoutError):
                state = self.client.get_state()
                if state.recordings and not state.loading:
                    return
                failed = [entry.message for entry in self.client.get_logs() if entry.level == "ERROR"]
                if failed:
                    raise ViewerError(f"the viewer cannot read {path}: {failed[0].splitlines()[0]}")
            time.sleep(0.05)
        raise ViewerError(f"the viewer did not finish loading {path} in {LOAD_S:g} s")

    @property
    def client(self) -> ViewerClient:
        if self._client is None:
            raise ViewerError("the viewer is not running: use it in a with block")
        return self._client

    @property
    def state(self) -> ViewerState:
        return _patient(self.client.get_state)

    def hide_menu(self) -> None:
        """Take the menu and its warnings off the picture."""
        with suppress(TimeoutError):  # It was told; told twice, the menu would be back.
            self.client.run_command("ui.toggle_top_panel")

    def go_to(self, timeline: str, time_s: float) -> None:
        """Stop at a time of a timeline."""
        _patient(lambda: self.client.set_time(timeline, duration=time_s, play_state="paused"))

    def settled_picture(self, view: str | None = None) -> bytes:
        """A PNG of the window, or of one view, taken until two in a row agree: nothing is still loading or moving."""
        view_id = None if view is None else self._view_id(view)
        last, taken = b"", 0
        began = time.monotonic()
        while taken < FEWEST or time.monotonic() < began + REST_S:
            try:
                png = _patient(lambda: self.client.take_screenshot(view_id))
            except ConnectionError as error:
                if view is None:
                    raise ViewerError(f"the viewer gave no picture: {error}") from error
                if time.monotonic() < began + LAY_OUT_S:
                    # A view that the blueprint has is drawn a little later on a busy machine.
                    time.sleep(0.1)
                    continue
                raise ViewerError(f"the view {view!r} is not on the screen: it lies behind another tab") from error
            if png == last and time.monotonic() > self._started + GREETING_S:
                return png
            last, taken = png, taken + 1
            time.sleep(0.1)
        raise ViewerError(f"the picture did not come to rest in {time.monotonic() - began:.0f} s")

    def _view_id(self, name: str) -> str:
        views = self.state.views
        for found in views:
            if found.name == name:
                return found.view_id
        raise ViewerError(f"no view named {name!r}; there are: {', '.join(v.name for v in views)}")

    def _connected(self, url: str) -> ViewerClient:
        assert self._process is not None
        deadline = time.monotonic() + START_S
        while time.monotonic() < deadline:
            if self._process.poll() is not None:
                raise ViewerError(f"the viewer stopped at its start: {self._last_line()}")
            try:
                client = ViewerClient.connect(url)
                client.get_state()
            except (RuntimeError, ConnectionError, ValueError):
                time.sleep(0.1)
                continue
            return client
        raise ViewerError(f"the viewer did not answer in {START_S:g} s: {self._last_line()}")

    def _last_line(self) -> str:
        assert self._output is not None
        self._output.seek(0)
        lines = [line.strip() for line in self._output.read().decode(errors="replace").splitlines() if line.strip()]
        told = [line for line in lines if "rror" in line or "panick" in line or "adapter" in line]
        return (told or lines or ["it said nothing"])[-1]

    def _end(self) -> None:
        self._client = None
        process, self._process = self._process, None
        if process is not None and process.poll() is None:
            process.terminate()
            gone(process, 3.0)
        if self._output is not None:
            self._output.close()
            self._output = None


def _patient(ask: Callable[[], Answer]) -> Answer:
    """What the viewer answers: on a busy machine the client gives up sooner than it. Raises ViewerError."""
    deadline = time.monotonic() + LOAD_S
    while True:
        try:
            return ask()
        except TimeoutError as error:
            if time.monotonic() > deadline:
                raise ViewerError(f"the viewer did not answer in {LOAD_S:g} s") from error


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
