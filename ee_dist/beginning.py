"""The first word of a run, said before the libraries are there: they take two seconds and more to load."""

from __future__ import annotations

import gc
from collections.abc import Sequence
from typing import TextIO

QUESTIONS = ("--help", "-h", "--hydra-help", "--version", "--info", "-i", "--cfg", "-c", "--shell-completion", "-sc")


def load() -> None:
    """What is loaded from here on stays: to look through it for garbage again and again takes a tenth of the time."""
    gc.disable()


def loaded() -> None:
    """The end of that; what was loaded is not looked through later, either."""
    if not gc.isenabled():
        gc.freeze()
        gc.enable()


def announce(arguments: Sequence[str], stream: TextIO) -> None:
    """Tell whoever sits at a terminal that the run has begun; programs that read the stream, and questions, get nothing."""
    asked = any(a.split("=")[0] in QUESTIONS for a in arguments)
    if not asked and stream.isatty():
        verb = next((a.split("=", 1)[1] for a in arguments if a.startswith("task=")), "recover")
        print(f"ee_dist {verb}: loading", file=stream, flush=True)
