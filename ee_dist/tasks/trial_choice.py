"""Which of the measured trials are looked at, and which are kept for the last word on a model."""

from __future__ import annotations

import fnmatch
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from ee_dist.basics.names import listed, nearest
from ee_dist.basics.quoted import quoted
from ee_dist.tasks.config import ConfigError


@dataclass(frozen=True)
class TrialName:
    """``number``: as reports count them, from 1 on; ``file``: the stem of its recording."""

    number: int
    file: str
    name: str

    def called(self, entry: str) -> bool:
        return entry in self.names

    def like(self, pattern: str) -> bool:
        return any(fnmatch.fnmatchcase(n, pattern) for n in self.names)

    @property
    def names(self) -> tuple[str, ...]:
        return (self.name, f"{self.file}/{self.name}", self.file)


def divided(trials: Sequence[TrialName], only: Any, held_out: Any) -> tuple[list[int], list[int]]:
    """Indices of the trials to look at (all, or those that ``only`` names) without those that ``held_out`` names, and of
    these. Raises ConfigError for what names none, and where none is left."""
    held = _named(trials, "held_out", held_out)
    asked = _named(trials, "trials", only) if entries(only) else list(range(len(trials)))
    kept = [k for k in asked if k not in held]
    if not kept:
        raise ConfigError(f"held_out={_shown(held_out)}: no trial is left to look at; hold out fewer of {_all(trials)}")
    return kept, held


def entries(asked: Any) -> list[Any]:
    """One name, or a list of them, as a list; empty for none."""
    if asked is None or asked == "":
        return []
    return list(asked) if isinstance(asked, (list, tuple)) else [asked]


def _named(trials: Sequence[TrialName], key: str, asked: Any) -> list[int]:
    found: set[int] = set()
    for entry in entries(asked):
        text = str(entry)
        mine = [k for k, t in enumerate(trials) if t.called(text)] or [k for k, t in enumerate(trials) if t.like(text)]
        if not mine and text.isascii() and text.isdigit():
            mine = [k for k, t in enumerate(trials) if t.number == int(text)]
        if not mine:
            near = nearest(text, dict.fromkeys(n for t in trials for n in t.names))
            hint = f"did you mean {' or '.join(near)}? " if near else ""
            raise ConfigError(f"{key}={_shown(asked)}: no trial {quoted(text)}; {hint}there are {_all(trials)}")
        found |= set(mine)
    return sorted(found)


def _all(trials: Sequence[TrialName]) -> str:
    return listed(f"{t.number}. {t.name}" for t in trials)


def _shown(asked: Any) -> str:
    return f"[{','.join(str(e) for e in entries(asked))}]"
