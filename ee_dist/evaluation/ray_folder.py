"""Ray's folder and the guard beside it; what runs left that ended together with their guards."""

from __future__ import annotations

import fcntl
import os
import re
import shutil
import subprocess
import sys
import tempfile
import uuid
from contextlib import suppress
from pathlib import Path

from ee_dist.evaluation.ray_guard import end_all

MARK = "EE_DIST_RAY"
"""Variable in the environment of all processes of a Ray that we started, by which its guard knows them."""
_SOCKET_PATH = 40
"""Longest name of Ray's folder, characters: sockets lie in it, and the system takes 107 for the name of one."""
_FOLDER, _HELD = "ee_dist_", ".held"
_LEAVE_S = 10.0


class Guard:
    """The process that ends what is left of Ray when this one is gone, and the folder that it removes."""

    def __init__(self) -> None:
        self.mark = f"{MARK}={uuid.uuid4().hex}"
        remove_orphans()
        self.folder = tempfile.mkdtemp(prefix=_FOLDER, dir=_place())
        self.lock = _locked(Path(self.folder), self.mark)
        script = str(Path(__file__).with_name("ray_guard.py"))
        command = [sys.executable, "-I", "-S", script, self.mark, self.folder]
        self.process = subprocess.Popen(
            command,
            stdin=subprocess.PIPE,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    @property
    def environment(self) -> dict[str, str]:
        """The mark, for all that is to be ended."""
        name, _, value = self.mark.partition("=")
        return {name: value}

    def release(self) -> None:
        """Let it do its work, and wait until it has."""
        with suppress(OSError, subprocess.TimeoutExpired):
            if self.process.stdin:
                self.process.stdin.close()
            self.process.wait(_LEAVE_S)
        with suppress(OSError):
            os.close(self.lock)


def _locked(folder: Path, mark: str) -> int:
    """Handle of a lock in the folder that goes with this process, however it ends. It holds the mark."""
    part = folder / f"{_HELD}.part"
    handle = os.open(part, os.O_RDWR | os.O_CREAT, 0o600)
    fcntl.flock(handle, fcntl.LOCK_EX)
    os.write(handle, mark.encode())
    part.rename(folder / _HELD)  # nobody sees it unlocked
    return handle


def _place() -> Path:
    place = tempfile.gettempdir()
    return Path(place if len(place) < _SOCKET_PATH - 16 else "/tmp")


def remove_orphans() -> None:
    """What is left of runs that ended together with their guards, as when a machine fails: folders of ours with a lock that
    nobody holds. Some of Ray's processes wait for a minute for a Ray that is gone: they are ended with them."""
    for lock in _place().glob(f"{_FOLDER}*/{_HELD}"):
        with suppress(OSError):
            handle = os.open(lock, os.O_RDWR | os.O_NOFOLLOW)
            try:
                fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
                if lock.parent.stat().st_uid == os.getuid():
                    mark = os.read(handle, 100).decode(errors="replace")
                    if re.fullmatch(f"{MARK}=[0-9a-f]{{32}}", mark):
                        end_all(mark, str(lock.parent), {os.getpid()})
                    shutil.rmtree(lock.parent, ignore_errors=True)
            finally:
                os.close(handle)
