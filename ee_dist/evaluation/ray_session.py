"""Ray as a process has it: started here, or a cluster that is there already.

Ray itself is loaded by whoever starts it: its errors are known in runs without it too.
"""

from __future__ import annotations

import logging
import os
import socket
import sys
import threading
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from typing import Any

from ee_dist.basics.arithmetic import SETTINGS
from ee_dist.basics.cores import usable
from ee_dist.evaluation.ray_folder import Guard
from ee_dist.evaluation.ray_watch import Heads


class EvaluatorError(RuntimeError):
    """Ray could not be started or reached, or was lost on the way; said in one line."""


class RayLostError(EvaluatorError):
    """Ray was there and is gone, or did not come up."""


class RayGoneError(BaseException):
    """The same, said to a run in the midst of something else. No library that swallows what goes wrong in it may swallow this:
    rerun's makes a warning of every ``Exception``, and a broken picture of what it was at."""


ONE_THREAD = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
"""Workers are one process a core: numerical libraries must not start threads of their own in them."""
NICENESS = "RAY_worker_niceness"
"""Ray makes its workers give way to all else (15), so that beside other programs a search hardly gets on while a person waits
for it: only where that is asked for."""
PER_CORE = 8
"""More workers than this on each core only take memory."""
LOOK_S = 0.5
"""How often to look whether Ray is still there while it starts."""
_guard: Guard | None = None
_started = False
_address: str | None = None
_heads = Heads()
"""While Ray starts: what has its processes in its own books is not there yet."""


def start_ray(address: str | None, workers: int, folder: str | None = None) -> None:
    """Connect to the cluster at ``address``, or start Ray on this machine. ``folder``: Ray's, where somebody guards it already.
    Raises EvaluatorError."""
    import ray
    from ray._private import auto_init_hook, ray_constants

    global _guard, _address, _started, _heads
    cores = usable()
    if not address:
        # Before anything else: a Ray that is there already would begin to start them all, and take all memory.
        _check(workers, cores, "this machine")
    if ray.is_initialized():
        if address:
            _check(workers, _cores_of_cluster(), "the cluster")
        return
    # Ray's answer to SIGTERM is a dump of stacks; ours is a line.
    ray_constants.RAY_DISABLE_FAILURE_SIGNAL_HANDLER = True
    # Asked for anything once it is gone, Ray would start another one by itself.
    auto_init_hook.enable_auto_connect = False
    options: dict[str, Any] = {"log_to_driver": False, "logging_level": logging.CRITICAL}
    if address:
        knock(address)
        # On machines of a cluster libraries are to compute as they do here.
        alike = {name: os.environ[name] for name in SETTINGS if name in os.environ}
        options |= {"address": address, "runtime_env": {"env_vars": {**alike, **ONE_THREAD}}}
        environment: dict[str, str] = {}
    else:
        _guard = None if folder else Guard()
        options |= {
            "address": "local",
            "include_dashboard": False,
            "num_cpus": max(workers, cores),
            "_temp_dir": _guard.folder if _guard else folder,
        }
        # Inherited by the workers that Ray has ready: with a runtime_env it would start others, and a second later.
        environment = {**ONE_THREAD, NICENESS: os.environ.get(NICENESS, "0"), **(_guard.environment if _guard else {})}
    _started, _address = not address, None
    starter = _Starter(options)
    _heads = Heads()
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
    if address:
        _check(workers, _cores_of_cluster(), "the cluster")


def _cores_of_cluster() -> int:
    import ray

    return int(ray.cluster_resources().get("CPU", 1))


def _check(workers: int, cores: int, whose: str) -> None:
    if workers > PER_CORE * cores:
        raise EvaluatorError(
            f"evaluator.workers={workers}: {whose} has {cores} cores, and more than {PER_CORE * cores} workers "
            "only take memory; choose fewer, or evaluator.workers=0 for one a core of this machine"
        )


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
    global _started, _address
    _started, _address = False, None
    ray = sys.modules.get("ray")
    if ray is not None and ray.is_initialized():
        ray.shutdown()
    abandon_ray()


def abandon_ray() -> None:
    """End the processes of a Ray that we started and guard, without a word to them."""
    global _guard, _started
    _started = False
    if _guard is not None:
        _guard.release()
        _guard = None


def lost(within_s: float = 0.0) -> str | None:
    """What of Ray is gone, if anything: a process that we started, or the cluster. ``within_s``: how long to wait for it,
    where something has failed already: what is on its way out is still there for a while."""
    end = time.monotonic() + within_s
    while (gone := _gone()) is None and time.monotonic() < end:
        time.sleep(0.1)
    return gone


def _gone() -> str | None:
    if _started:
        import ray

        node = getattr(ray._private.worker, "_global_node", None)
        dead = [name for name, _ in node.dead_processes()] if node is not None else _heads.ended()
        return f"its process {dead[0]} has ended" if dead else None
    if _address:
        try:
            knock(_address)
        except EvaluatorError as error:
            return str(error)
    return None


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


def knock(address: str) -> None:
    """Ray waits for minutes where nobody answers: see first whether somebody does. Raises EvaluatorError."""
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
