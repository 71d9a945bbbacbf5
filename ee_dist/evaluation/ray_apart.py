"""Ray in a process of its own, which a run speaks to through a pipe.

Where it loses its raylet at the wrong moment, Ray's library ends the process that it is loaded in, with status 1 and without a
word: while it joins, or while it puts away or fetches a large object. While it joins, which takes seconds, no Python goes on in
that process. A run in another process hears of any end, says its line, and is free for signals.
"""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from multiprocessing.connection import Pipe
from os import environ
from queue import Empty, SimpleQueue
from typing import Any

from ee_dist.effects.plugins import loaded_plugins
from ee_dist.engines.contract import Engine
from ee_dist.evaluation.jobs import Counts, Job
from ee_dist.evaluation.ray_folder import Guard
from ee_dist.evaluation.ray_process import DONE, FAILED, LOST
from ee_dist.evaluation.ray_session import EvaluatorError, RayGoneError, RayLostError, knock
from ee_dist.evaluation.ray_watch import LOOK_S, Heads, Watch

BEGIN = (
    "import json, sys; sys.path[:] = json.loads(sys.argv[1]); "
    "from ee_dist.evaluation.ray_process import main; main(int(sys.argv[2]))"
)
"""What the process does first: find what this one finds."""
KNOCK_S = 2.0
"""How often to look whether a cluster of others still answers."""
LEAVE_S = 10.0
"""How long Ray may take to end where it is asked to."""


class RayApart:
    """Implements ``ee_dist.evaluation.jobs.Evaluator`` by a ``RayEvaluator`` in that process. Raises EvaluatorError."""

    def __init__(
        self, make_engine: Callable[[], Engine], workers: int = 0, chunk: int = 0, address: str | None = None
    ) -> None:
        global _process
        self.counts = Counts()
        if _process is not None and _process.why is not None:
            abandon_ray()
        if _process is not None and _process.address != address:
            # A sweep over addresses: a process joins one cluster, and takes no notice of another address from then on.
            stop_ray()
        begun = _process is None
        if _process is None:
            _process = _Process(address)
        try:
            _process.ask("know", loaded_plugins())
            folder = _process.guard.folder if _process.guard else None
            self._name = _process.ask("make", make_engine, workers, chunk, address, folder)
        except EvaluatorError:
            if begun:  # it has joined nothing
                abandon_ray()
            raise

    def evaluate(self, jobs: Sequence[Job]) -> list[Any]:
        global _worked_s
        if _process is None:
            raise RayLostError("Ray is lost: it was ended")
        found: list[Any]
        found, took_s = _process.ask("evaluate", self._name, list(jobs))
        _worked_s += took_s
        self.counts.add(jobs)
        return found

    def close(self) -> None:
        if _process is not None:
            with suppress(EvaluatorError):
                _process.ask("close", self._name)


class _Process:
    """The process with Ray's library, and on this machine the guard of all that Ray starts."""

    def __init__(self, address: str | None) -> None:
        self.guard = None if address else Guard()
        self.link, theirs = Pipe()
        command = [sys.executable, "-c", BEGIN, json.dumps([str(place) for place in sys.path]), str(theirs.fileno())]
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,  # Ray has much to say of a Ray that is lost
            pass_fds=[theirs.fileno()],
            env={**environ, **(self.guard.environment if self.guard else {})},
            start_new_session=True,  # a terminal's Ctrl-C is for the run
        )
        theirs.close()
        self.answers: SimpleQueue[bytes] = SimpleQueue()
        self.why: str | None = None
        threading.Thread(target=self._listen, daemon=True, name="ray answers").start()
        self.address, self.heads = address, Heads(self.process.pid)
        self.watch = Watch(self._gone, RayGoneError, _say_farewell, KNOCK_S if address else LOOK_S)
        self.watch.start()

    def _listen(self) -> None:
        last = LOST + pickle.dumps("Ray is lost: the process that speaks to it has ended")
        with suppress(EOFError, OSError):
            while not (answer := self.link.recv_bytes()).startswith(LOST):
                self.answers.put(answer)
            last = answer
        self.why = pickle.loads(last[1:])
        self.answers.put(last)

    def _gone(self) -> str | None:
        """What is gone, if anything, seen from here: that process may be stuck in a call of Ray's for a minute."""
        if self.why is not None:
            return self.why
        if not self.address:
            ended = self.heads.ended()
            return f"Ray is lost: its process {ended[0]} has ended" if ended else None
        try:
            knock(self.address)
        except EvaluatorError as error:
            return f"Ray is lost: {error}"
        return None

    def ask(self, what: str, *about: Any, within_s: float | None = None) -> Any:
        """The answer. Raises what was raised there, and RayLostError where nobody is there any more or says anything in time."""
        request = pickle.dumps((what, about), pickle.HIGHEST_PROTOCOL)
        with suppress(OSError):  # that nobody is there is told as the answer
            self.link.send_bytes(request)
        try:
            answer = self.answers.get(timeout=within_s)
        except Empty:
            raise RayLostError("Ray is lost: no answer") from None
        found = pickle.loads(answer[1:])
        if answer.startswith(DONE):
            return found
        if answer.startswith(FAILED):
            raise found
        self.watch.taken.set()
        self.answers.put(answer)  # for whoever asks again
        raise RayLostError(found)

    def end(self, gently: bool) -> None:
        """``gently``: Ray is asked to end first."""
        self.watch.stop()
        if gently:
            with suppress(EvaluatorError):
                self.ask("stop", within_s=LEAVE_S)
        if self.guard is not None:
            self.guard.release()
        self.process.kill()
        with suppress(subprocess.TimeoutExpired):
            self.process.wait(LEAVE_S)


_worked_s = 0.0


def worked_s() -> float:
    """Processor time of all workers so far (s), wherever they are. Ray's own processes are not in it."""
    return _worked_s


_process: _Process | None = None
_farewell: list[Callable[[str], None]] = []


def _say_farewell(why: str) -> None:
    for say in _farewell:
        say(why)


def when_lost(farewell: Callable[[str], None]) -> None:
    """What to call, from another thread, where Ray is lost and the main thread does not come back to hear of it."""
    _farewell[:] = [farewell]


def stop_ray() -> None:
    """Stop what was started, or leave the cluster."""
    _end(gently=True)


def abandon_ray() -> None:
    """The same without a word to Ray, for a run that ends without more ado."""
    _end(gently=False)


def _end(gently: bool) -> None:
    global _process
    if _process is not None:
        ending, _process = _process, None
        ending.end(gently)
