"""PyBullet behind the engine contract. Its import prints a line to the process's own output: kept off the terminal."""

from __future__ import annotations

import os


def _import_quietly() -> None:
    kept = [os.dup(1), os.dup(2)]
    silence = os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(silence, 1)
        os.dup2(silence, 2)
        import pybullet  # noqa: F401
    finally:
        for target, saved in zip((1, 2), kept, strict=True):
            os.dup2(saved, target)
            os.close(saved)
        os.close(silence)


_import_quietly()
