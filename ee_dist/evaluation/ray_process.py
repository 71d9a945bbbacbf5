"""The process that has Ray's library in it: answers what a run asks through a pipe (``ray_apart``), and ends with the run."""

from __future__ import annotations

import os
import pickle
import signal
import threading
from multiprocessing.connection import Connection
from queue import SimpleQueue
from typing import Any

from ee_dist.effects.plugins import load_plugin
from ee_dist.evaluation.ray_session import EvaluatorError, RayLostError, stop_ray

DONE, FAILED, LOST = b"+", b"-", b"!"
"""How an answer begins: what was asked for, what was raised instead, or why there will be no more of them."""


class Desk:
    """What a run may ask for, by name."""

    def __init__(self) -> None:
        self.evaluators: list[Any] = []

    def know(self, plugins: tuple[str, ...]) -> None:
        """Robots and jobs may hold what a user's own file defines."""
        for path in plugins:
            load_plugin(path)

    def make(self, make_engine: Any, workers: int, chunk: int, address: str | None, folder: str | None) -> int:
        # Ray takes a second to load: a run that ends meanwhile is to be noticed.
        from ee_dist.evaluation.ray_actors import RayEvaluator

        self.evaluators.append(RayEvaluator(make_engine, workers, chunk, address, folder))
        return len(self.evaluators) - 1

    def evaluate(self, name: int, jobs: list[Any]) -> tuple[list[Any], float]:
        """Results, and the processor time that the workers took (s): nobody can ask the system for that of Ray's processes."""
        evaluator = self.evaluators[name]
        before = evaluator.worked_s
        return evaluator.evaluate(jobs), evaluator.worked_s - before

    def close(self, name: int) -> None:
        self.evaluators[name].close()

    def stop(self) -> None:
        stop_ray()


def answered(desk: object, request: bytes) -> bytes:
    """Raises RayLostError: there is no more to be asked then."""
    try:
        what, about = pickle.loads(request)
        return DONE + pickle.dumps(getattr(desk, what)(*about), pickle.HIGHEST_PROTOCOL)
    except RayLostError:
        raise
    except Exception as error:
        try:
            packed = pickle.dumps(error)
            pickle.loads(packed)
        except Exception:  # an error of a user's own need not be made to travel
            packed = pickle.dumps(EvaluatorError(f"{type(error).__name__}: {error}"))
        return FAILED + packed


def main(handle: int) -> None:
    # A request to end is for the run, and reaches this process by the run's end. Ignored, it would be by all of Ray.
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        signal.signal(number, lambda *_: None)
    link, desk = Connection(handle), Desk()
    asked: SimpleQueue[bytes] = SimpleQueue()

    def listen() -> None:
        try:
            while True:
                asked.put(link.recv_bytes())
        except (EOFError, OSError):
            os._exit(0)  # the run has ended, in whatever way

    threading.Thread(target=listen, daemon=True, name="questions").start()
    try:
        while True:
            link.send_bytes(answered(desk, asked.get()))
    except RayLostError as error:
        link.send_bytes(LOST + pickle.dumps(str(error)))
    finally:
        os._exit(1)
