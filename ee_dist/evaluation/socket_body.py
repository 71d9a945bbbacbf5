"""A body at the other end of a socket: lines of JSON, one question and one answer a step, each within a time.

=====================================================  ==========================================================
we say                                                 it answers
=====================================================  ==========================================================
``{"do": "begin", "trial", "steps", "step_s"}``        ``{"sensors": [...]}`` at rest in the start pose
``{"do": "step", "commands": [...]}``                  ``{"sensors": [...]}``, ``torques`` too if it measures them
the same, after the last step                          ``{"done": true, "travel_m": ...}``, and where known
                                                       ``base_pose``, ``joints``, ``torques``, ``supply_v`` by row
``{"do": "abort"}``                                    nothing; it stops moving
=====================================================  ==========================================================

Instead of any answer it may say ``{"error": "..."}``. docs/examples/socket_robot.py is the other end.
"""

from __future__ import annotations

import json
import socket
from contextlib import suppress
from typing import Any

import numpy as np

from ee_dist.robots.untrusted import UntrustedError, json_of
from ee_dist.trials.hardware import HardwareError, Reading
from ee_dist.trials.log import Array

LONGEST = 64 * 2**20
"""Bytes of one answer."""


class SocketBody:
    """Implements ``ee_dist.trials.hardware.Body``. ``address`` is host:port; it connects when a trial begins, for which the
    robot has ``begin_s`` (it may have to be put upright first); every further answer has ``timeout_s``."""

    def __init__(self, address: str, timeout_s: float, begin_s: float = 60.0) -> None:
        host, _, port = address.rpartition(":")
        if not host or not port.isdigit() or not 0 < int(port) < 65536:
            raise HardwareError(f"hardware.address={address}: expected host:port, such as 127.0.0.1:5555")
        self.address, self.place = address, (host, int(port))
        self.timeout_s, self.begin_s = timeout_s, begin_s
        self._socket: socket.socket | None = None
        self._rest = b""

    def knock(self) -> None:
        """Raises HardwareError where no robot answers: to be said before a search of hours, not after."""
        try:
            socket.create_connection(self.place, self.begin_s).close()
        except OSError as error:
            raise self._silent(error, "no robot answers there") from None

    def begin(self, trial: int, steps: int, step_s: float) -> Reading:
        self.abort()
        try:
            self._socket = socket.create_connection(self.place, self.begin_s)
            self._socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        except OSError as error:
            raise self._silent(error, "no robot answers there") from None
        first = self._ask({"do": "begin", "trial": trial, "steps": steps, "step_s": step_s})
        self._socket.settimeout(self.timeout_s)
        return first

    def step(self, commands: Array) -> Reading:
        return self._ask({"do": "step", "commands": commands.tolist()})

    def abort(self) -> None:
        if self._socket is not None:
            with suppress(OSError):
                self._socket.sendall(b'{"do": "abort"}\n')
            with suppress(OSError):
                self._socket.close()
        self._socket, self._rest = None, b""

    def _ask(self, question: dict[str, Any]) -> Reading:
        assert self._socket is not None
        try:
            self._socket.sendall(json.dumps(question).encode() + b"\n")
            answer = json_of(self._line())
        except OSError as error:
            raise self._silent(error, "the robot does not answer any more") from None
        except UntrustedError as error:
            raise HardwareError(f"hardware.address={self.address}: the robot's answer is {error}") from None
        if not isinstance(answer, dict) or "error" in answer:
            said = answer["error"] if isinstance(answer, dict) else answer
            raise HardwareError(f"hardware.address={self.address}: the robot says: {str(said)[:200]}")
        try:
            if answer.get("done"):
                return Reading(rest={k: v for k, v in answer.items() if k != "done"})
            torques = answer.get("torques")
            return Reading(
                np.array(answer["sensors"], dtype=np.float64),
                None if torques is None else np.array(torques, dtype=np.float64),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise HardwareError(f"hardware.address={self.address}: an answer without {error}") from None

    def _line(self) -> bytes:
        assert self._socket is not None
        while b"\n" not in self._rest:
            piece = self._socket.recv(1 << 16)
            if not piece:
                raise ConnectionResetError("the connection was closed")
            self._rest += piece
            if len(self._rest) > LONGEST:
                raise UntrustedError("longer than any answer")
        line, _, self._rest = self._rest.partition(b"\n")
        return line

    def _silent(self, error: OSError, what: str) -> HardwareError:
        waited = (self._socket.gettimeout() if self._socket else None) or self.begin_s
        why = f"nothing within {waited:g} s" if isinstance(error, TimeoutError) else error.strerror or str(error)
        return HardwareError(f"hardware.address={self.address}: {what} ({why})")
