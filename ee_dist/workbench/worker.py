"""The process in which long verbs run: started when first needed, told what to do, ended to cancel, started anew."""

from __future__ import annotations

import multiprocessing
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from multiprocessing.connection import Connection
from multiprocessing.process import BaseProcess
from typing import Any

from ee_dist.tasks.steps import Clock
from ee_dist.workbench.verbs import Ended, Request, Told, serve

STARTING = "starting"
GONE = "the process that searched is gone (status {status}); nothing is lost: start it again"
CANCELLED = "cancelled; nothing was changed"
BUSY = "still at work: wait for it, or cancel it"


class BusyError(RuntimeError):
    """One verb at a time."""


@dataclass(frozen=True)
class Progress:
    """Of the verb under way. ``stages``: what was done before, with the seconds that each took; ``clock``: what is done now, and
    since when."""

    request: Request
    clock: Clock = field(default_factory=Clock)
    error: float | None = None
    since_s: float = field(default_factory=time.monotonic)
    stages: tuple[tuple[str, float], ...] = ()

    def after(self, told: Told) -> Progress:
        now, clock = time.monotonic(), self.clock.after(told.what, told.share)
        if told.what == self.what:
            return replace(self, clock=clock, error=told.error)
        past = (*self.stages, (self.what, now - self.since_s))
        return replace(self, clock=clock, error=told.error, since_s=now, stages=past)

    @property
    def what(self) -> str:
        return self.clock.what or STARTING

    @property
    def told(self) -> str:
        """All of it in words."""
        ahead = self.clock.ahead(self.error) if self.clock.what else STARTING
        return f"{ahead}, {self.clock.spent_s:.0f} s so far in all"


class Worker:
    """``heard`` is called from another thread with each Progress, ``ended`` once with the result or what failed."""

    def __init__(self, heard: Callable[[Progress], None], ended: Callable[[Request, Ended], None]) -> None:
        self._heard, self._ended = heard, ended
        self._process: BaseProcess | None = None
        self._pipe: Connection | None = None
        self._lock = threading.Lock()
        self.progress: Progress | None = None

    def warm(self) -> None:
        """Start the process, which loads for some seconds, before it is needed."""
        with self._lock:
            self._up()

    def start(self, request: Request) -> None:
        """Raises BusyError."""
        with self._lock:
            if self.progress is not None:
                raise BusyError(BUSY)
            pipe = self._up()
            self.progress = Progress(request)
            try:
                pipe.send(request)
            except OSError:
                # It died in idleness: once more with a new one.
                self._end()
                pipe = self._up()
                pipe.send(request)
            begun = self.progress
            threading.Thread(target=self._listen, args=(request, pipe), daemon=True).start()
        self._heard(begun)

    def cancel(self) -> None:
        """End the verb under way, if there is one, and its process with it."""
        with self._lock:
            progress, self.progress = self.progress, None
            if progress is not None:
                self._end()
        if progress is not None:
            self._ended(progress.request, Ended(failed=CANCELLED))

    def close(self) -> None:
        with self._lock:
            self.progress = None
            self._end()

    @property
    def pid(self) -> int | None:
        return None if self._process is None else self._process.pid

    def _up(self) -> Connection:
        if self._process is None or not self._process.is_alive() or self._pipe is None:
            self._end()
            # Not forked: this process has threads, and libraries with threads of their own.
            context = multiprocessing.get_context("spawn")
            mine, theirs = context.Pipe()
            self._process = context.Process(target=serve, args=(theirs,), daemon=True, name="ee_dist verbs")
            self._process.start()
            theirs.close()
            self._pipe = mine
        return self._pipe

    def _end(self) -> None:
        if self._pipe is not None:
            self._pipe.close()
        if self._process is not None:
            # What it writes, it writes whole or not at all; and what it started beside itself has a guard of its own.
            self._process.kill()
            self._process.join()
        self._process, self._pipe = None, None

    def _listen(self, request: Request, pipe: Connection) -> None:
        while True:
            try:
                message: Any = pipe.recv()
            except (EOFError, OSError):
                self._lost(request)
                return
            with self._lock:
                if self.progress is None or self.progress.request is not request:
                    return
                if isinstance(message, Told):
                    self.progress = self.progress.after(message)
                else:
                    self.progress = None
                now = self.progress
            if now is not None:
                self._heard(now)
            else:
                self._ended(request, message)
                return

    def _lost(self, request: Request) -> None:
        """The process is gone: killed from outside, or out of memory."""
        with self._lock:
            if self.progress is None or self.progress.request is not request:
                return
            self.progress = None
            if self._process is not None:
                self._process.join(2.0)
            status = None if self._process is None else self._process.exitcode
            self._end()
        self._ended(request, Ended(failed=GONE.format(status=status)))
