"""Ray as a run has it: started here with a guard beside it, or a cluster that is there already.

Ray itself is loaded by whoever starts it: its errors are known, and its end is asked for, in runs without it too.
"""

from __future__ import annotations

import logging
import os
import socket
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from typing import Any

import psutil

from ee_dist.basics.arithmetic import SETTINGS
from ee_dist.evaluation.ray_folder import Guard
from ee_dist.evaluation.ray_watch import Watch


class EvaluatorError(RuntimeError):
    """Ray could not be started or reached, or was lost on the way; said in one line."""


class RayLostError(EvaluatorError):
    """Ray was there and is gone: its libraries in this process are of no use any more, not even to end it."""


ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Workers are one process a core: numerical libraries must not start threads of their own in them."""
PER_CORE = 8
"""More workers than this on each core only take memory."""
LOOK_S = 0.5
"""How often to look whether Ray is still there while it starts."""
KNOCK_S = 2.0
"""How often to look whether a cluster of others still answers."""
_HEADS = ("gcs_server", "raylet")
"""Without these processes of its own nothing of Ray goes on."""


class _Hush:
    """What Ray's compiled part says of a Ray that is lost would stand beside our line: it writes to the system's error
    stream, from which Python's own is taken apart meanwhile."""

    def __init__(self) -> None:
        sys.stderr.flush()
        self.before, self.stream = sys.stderr, os.dup(2)
        with suppress(OSError, ValueError):  # a stream that is not the system's stays as it is
            if sys.stderr.fileno() == 2:
                sys.stderr = open(self.stream, "w", 1, sys.stderr.encoding, "backslashreplace", closefd=False)  # noqa: SIM115
        with open(os.devnull, "wb") as nothing:
            os.dup2(nothing.fileno(), 2)

    def end(self) -> None:
        sys.stderr.flush()
        os.dup2(self.stream, 2)
        os.close(self.stream)
        sys.stderr = self.before


_guard: Guard | None = None
_hush: _Hush | None = None
_watch: Watch | None = None
_address: str | None = None
_farewell: list[Callable[[str], None]] = []
_begun: dict[str, psutil.Process] = {}
"""Ray's processes by name while it starts: what has it in its own books is not there yet."""


def when_lost(farewell: Callable[[str], None]) -> None:
    """What to call, from another thread, where Ray is lost and the main thread does not come back to hear of it."""
    _farewell[:] = [farewell]


def start_ray(address: str | None, workers: int) -> None:
    """Connect to the cluster at ``address``, or start Ray on this machine. Raises EvaluatorError."""
    import ray
    from ray._private import auto_init_hook, ray_constants

    global _guard, _address, _hush
    if ray.is_initialized():
        return
    # Ray's answer to SIGTERM is a dump of stacks; ours is a line.
    ray_constants.RAY_DISABLE_FAILURE_SIGNAL_HANDLER = True
    # Asked for anything once it is gone, Ray would start another one by itself.
    auto_init_hook.enable_auto_connect = False
    options: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.CRITICAL}
    if address:
        _knock(address)
        # On machines of a cluster libraries are to compute as they do here.
        alike = {name: os.environ[name] for name in SETTINGS if name in os.environ}
        options |= {"address": address, "runtime_env": {"env_vars": {**alike, **ONE_THREAD}}}
        environment: dict[str, str] = {}
    else:
        cores = os.cpu_count() or 1
        if workers > PER_CORE * cores:
            raise EvaluatorError(
                f"evaluator.workers={workers}: this machine has {cores} cores, and more than {PER_CORE * cores} workers "
                "only take memory; choose fewer, or evaluator.workers=0 for one a core"
            )
        _guard = Guard()
        options |= {
            "address": "local",
            "include_dashboard": False,
            "num_cpus": max(workers, cores),
            "_temp_dir": _guard.folder,
        }
        # Inherited by the workers that Ray has ready: with a runtime_env it would start others, and a second later.
        environment = {**ONE_THREAD, **_guard.environment}
    if _hush is None:
        _hush = _Hush()
    starter = _Starter(options)
    _begun.clear()
    with _environment(environment):
        starter.start()
        while not starter.over.wait(LOOK_S):
            if not address and (gone := lost()):
                abandon_ray()
                raise RayLostError(f"Ray did not start: {gone}; evaluator=serial does without it")
    error = starter.error
    if isinstance(error, Exception):
        first = str(error).strip().splitlines()[0] if str(error).strip() else type(error).__name__
        abandon_ray()
        if address:
            raise _unreachable(address, first)
        raise RayLostError(f"Ray did not start ({first}); evaluator=serial does without it")
    _address = address
    _look_on(address)


def _look_on(address: str | None) -> None:
    global _watch

    def find() -> str | None:
        ray = sys.modules.get("ray")
        return _gone() if ray is not None and ray.is_initialized() else None

    def farewell(why: str) -> None:
        for say in _farewell:
            say(f"Ray is lost: {why}")

    if _watch is not None:
        _watch.stop()
    _watch = Watch(find, lambda why: RayLostError(f"Ray is lost: {why}"), farewell, KNOCK_S if address else LOOK_S)
    _watch.start()


class _Starter(threading.Thread):
    """Starts Ray beside the main thread, which so stays free for signals, and keeps Ray from setting handlers for them.

    Ray's processes end with the thread that started them: it stays.
    """

    def __init__(self, options: dict[str, Any]) -> None:
        super().__init__(daemon=True, name="ray")
        self.options, self.over = options, threading.Event()
        self.error: BaseException | None = None

    def run(self) -> None:
        import ray

        try:
            ray.init(**self.options)
        except BaseException as error:
            self.error = error
        self.over.set()
        threading.Event().wait()


def stop_ray() -> None:
    """Stop what ``start_ray`` started, or leave the cluster. Ray's own way at the end of a process begins with a nap."""
    global _hush
    _stop_watch()
    ray = sys.modules.get("ray")
    if ray is not None and ray.is_initialized():
        ray.shutdown()
    abandon_ray()
    if _hush is not None:
        _hush.end()
        _hush = None


def abandon_ray() -> None:
    """End the processes of a Ray that we started, without a word to them. Does nothing for a cluster of others."""
    global _guard
    _stop_watch()
    if _guard is not None:
        _guard.release()
        _guard = None


def _stop_watch() -> None:
    global _watch
    if _watch is not None:
        _watch.stop()
        _watch = None


def lost(within_s: float = 0.0) -> str | None:
    """What of Ray is gone, if anything: a process that we started, or the cluster. ``within_s``: how long to wait for it,
    where something has failed already: what is on its way out is still there for a while."""
    end = time.monotonic() + within_s
    while (gone := _gone()) is None and time.monotonic() < end:
        time.sleep(0.1)
    if gone is not None and _watch is not None:
        _watch.taken.set()
    return gone


def _gone() -> str | None:
    if _guard is not None:
        import ray

        node = getattr(ray._private.worker, "_global_node", None)
        dead = [name for name, _ in node.dead_processes()] if node is not None else _ended()
        return f"its process {dead[0]} has ended" if dead else None
    if _address:
        try:
            _knock(_address)
        except EvaluatorError as error:
            return str(error)
    return None


def _ended() -> list[str]:
    """Names of Ray's processes that were there at an earlier look, while it starts, and have ended."""
    with suppress(psutil.Error):
        for child in psutil.Process().children():
            with suppress(psutil.Error):
                if child.name() in _HEADS:
                    _begun.setdefault(child.name(), child)
    return [name for name, process in _begun.items() if not _runs(process)]


def _runs(process: psutil.Process) -> bool:
    try:
        return process.is_running() and process.status() != psutil.STATUS_ZOMBIE
    except psutil.Error:
        return False


@contextmanager
def _environment(variables: Mapping[str, str]) -> Iterator[None]:
    """Set environment variables for a while."""
    before = {name: os.environ.get(name) for name in variables}
    os.environ.update(variables)
    try:
        yield
    finally:
        for name, value in before.items():
            if value is None:
                os.environ.pop(name, None)
            else:
                os.environ[name] = value


def _knock(address: str) -> None:
    """Ray waits for minutes where nobody answers: see first whether somebody does."""
    host, _, port = address.removeprefix("ray://").rpartition(":")
    if not host:
        if address in ("auto", "local"):
            return
        raise EvaluatorError(f"ray.address={address}: neither 'auto' nor host:port, such as 127.0.0.1:6379")
    try:
        socket.create_connection((host, int(port)), timeout=5).close()
    except (OSError, ValueError, OverflowError) as error:
        raise _unreachable(address, str(error)) from None


def _unreachable(address: str, why: str) -> EvaluatorError:
    return EvaluatorError(
        f"ray.address={address}: no Ray cluster answers there ({why}); "
        "start one with 'ray start --head', or leave ray.address empty to use this machine"
    )
