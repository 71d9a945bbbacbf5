"""Looks whether all of Ray is still there, and tells the run when it is not.

Ray's own library waits a minute for a head that is gone, and a run in the middle of a trial on hardware asks it for nothing. So a
thread looks, interrupts the main thread, which unwinds and keeps what there is, and where that is stuck says the last words
itself. A trial on hardware is made to its end first.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from types import FrameType

import psutil

from ee_dist.basics.uncut import trial_on_hardware

LOOK_S = 0.5
TAKE_S = 1.5
"""How long the main thread has to find out by itself, as it does where it waits for results."""
UNWIND_S = 12.0
"""How long it has in all, beside a trial on hardware; Ray's own patience is 60 s."""
NUMBER = signal.SIGUSR1
HEADS = ("gcs_server", "raylet")
"""Without these processes of its own nothing of Ray goes on."""


class Heads:
    """These processes below the one that starts Ray (``pid``; none: this one), as soon as they are there."""

    def __init__(self, pid: int | None = None) -> None:
        self.pid = pid
        self.seen: dict[str, psutil.Process] = {}

    def ended(self) -> list[str]:
        """Names of those that were there at this look or an earlier one, and have ended."""
        if len(self.seen) < len(HEADS):
            with suppress(psutil.Error):
                for child in psutil.Process(self.pid).children():
                    with suppress(psutil.Error):
                        if child.name() in HEADS:
                            self.seen.setdefault(child.name(), child)
        return [name for name, process in self.seen.items() if not _runs(process)]


def _runs(process: psutil.Process) -> bool:
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.Error:
        return False


class Watch(threading.Thread):
    """``find`` says what is gone, ``error`` is what the main thread gets, ``farewell`` ends the process with a line."""

    def __init__(
        self,
        find: Callable[[], str | None],
        error: Callable[[str], BaseException],
        farewell: Callable[[str], None],
        look_s: float = LOOK_S,
    ) -> None:
        super().__init__(daemon=True, name="ray watch")
        self.find, self.error, self.farewell, self.look_s = find, error, farewell, look_s
        self.over, self.taken = threading.Event(), threading.Event()
        self.why: str | None = None
        self._before = signal.getsignal(NUMBER)
        self._main = threading.current_thread() is threading.main_thread()
        if self._main:
            signal.signal(NUMBER, self._interrupt)

    def run(self) -> None:
        while not self.over.wait(self.look_s):
            # Twice: a process that is on its way out, or one answer that did not come, is seen again a moment later.
            if self.find() is None or self.over.wait(self.look_s):
                continue
            self.why = self.find()
            if self.why is not None and not self.over.is_set():
                self._tell(self.why)
                return

    def _tell(self, why: str) -> None:
        end = time.monotonic() + UNWIND_S
        if not self.taken.wait(TAKE_S) and not self.over.is_set() and self._main:
            signal.pthread_kill(threading.main_thread().ident or 0, NUMBER)
        while trial_on_hardware.under_way and not self.over.wait(self.look_s):
            end = time.monotonic() + UNWIND_S
        if not self.over.wait(end - time.monotonic()):
            self.farewell(why)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        if self.why is not None and not self.taken.is_set() and not self.over.is_set():
            self.taken.set()
            trial_on_hardware.interrupt(self.error(self.why))
            return
        if callable(self._before):
            self._before(number, frame)

    def stop(self) -> None:
        """No more looks: Ray is to end now."""
        self.over.set()
        if self._main and threading.current_thread() is threading.main_thread():
            signal.signal(NUMBER, self._before)
