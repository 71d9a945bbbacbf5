"""Ctrl-C, a request to end and a closed terminal: the run unwinds, says one line and ends with the status of the signal.

A first signal unwinds the run, so that files are closed (a trial that was just made is written first); a second ends the
process at once. What was started beside it (Ray) has a guard of its own, and is gone a moment later in either case.
"""

from __future__ import annotations

import os
import signal
import sys
import threading
from types import FrameType
from typing import NoReturn

from ee_dist.basics.uncut import keeping

SIGNALS = {signal.SIGINT: "Ctrl-C", signal.SIGTERM: "asked to end", signal.SIGHUP: "terminal closed"}

LONGEST = 700
"""Characters of a complaint: names and values of a user's may be of any length."""


class Left(KeyboardInterrupt):
    """A run that was told to leave; ``status`` as a shell knows it: 128 and the number of the signal."""

    def __init__(self, number: int) -> None:
        super().__init__(number)
        self.why = SIGNALS[signal.Signals(number)]
        self.status = 128 + number


_leaving = False
_left: Left | None = None


def arm(unwinds: bool = True) -> None:
    """Answer signals from now on. ``unwinds``: something was begun; otherwise the line and the end come at once.

    To be called again after libraries that set handlers of their own.
    """
    if threading.current_thread() is not threading.main_thread():
        return
    for number in SIGNALS:
        # A run in the background of a shell ignores Ctrl-C, one under nohup the closed terminal: that stays.
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, _unwind if unwinds else _at_once)


def disarm() -> None:
    """Put back what Python does with these signals."""
    if threading.current_thread() is threading.main_thread():
        for number in SIGNALS:
            if signal.getsignal(number) in (_unwind, _at_once):
                signal.signal(number, signal.default_int_handler if number == signal.SIGINT else signal.SIG_DFL)


def line(text: str) -> str:
    """A complaint as it is printed: one line, and not longer than anybody reads."""
    flat = " ".join(text.split())
    return f"ee_dist: {flat if len(flat) <= LONGEST else flat[: LONGEST - 80] + ' ... ' + flat[-55:]}"


def leave(text: str, status: int) -> NoReturn:
    """Say it and end without what libraries do at the end of a process: it takes seconds."""
    global _leaving
    _leaving = True
    try:
        print(line(text), file=sys.stderr, flush=True)
        sys.stdout.flush()
    except OSError:
        pass  # whoever read it is gone
    os._exit(status)


def told(stop: KeyboardInterrupt) -> Left:
    """Why the run is to leave. Compiled libraries make a Ctrl-C out of whatever was raised while they waited."""
    return stop if isinstance(stop, Left) else _left or Left(signal.SIGINT)


def asked() -> Left | None:
    """The signal that the run is unwinding for, if there was one: a library that it met while it was being loaded makes an
    error of its own out of it."""
    return _left


def _unwind(number: int, frame: FrameType | None) -> None:
    global _leaving, _left
    if _leaving:
        os._exit(128 + number)
    _leaving, _left = True, Left(number)
    keeping.interrupt(_left)


def _at_once(number: int, frame: FrameType | None) -> None:
    left = Left(number)
    leave(f"stopped ({left.why}); nothing was begun", left.status)
