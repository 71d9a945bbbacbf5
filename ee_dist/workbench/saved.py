"""A session on the disk: what is open, the model on the bench, its ladder and its commands, so that it can go on another day."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from ee_dist.basics.files import write_whole
from ee_dist.discrepancy.search.candidates import known
from ee_dist.effects.catalogue import from_dict
from ee_dist.effects.effect import EffectError
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import ConfigError
from ee_dist.workbench.bench import Bench, Entry, Step

FILE = "session.json"
FORMAT = 1


@dataclass(frozen=True)
class Saved:
    """``model``: the model file that the session began with; ``entries`` as they are written; the engine by its name."""

    measured: tuple[str, ...]
    model: str | None
    by: str
    engine: str
    entries: tuple[dict[str, Any], ...] = ()
    ladder: tuple[Step, ...] = ()
    commands: tuple[str, ...] = ()

    def bench(self, robot: Robot) -> Bench:
        """Raises EffectError for an effect that the catalogue does not have, or has otherwise."""
        return Bench(tuple(_entry(robot, e) for e in self.entries), self.ladder)


def saved_entry(entry: Entry) -> dict[str, Any]:
    more = {"on": entry.on, "origin": entry.origin, "intervals": entry.intervals, "flags": entry.flags}
    return {"term": entry.term.as_dict(), **more}


def _entry(robot: Robot, e: dict[str, Any]) -> Entry:
    term = from_dict(e["term"])
    intervals = tuple((str(n), float(low), float(high)) for n, low, high in e["intervals"])
    return Entry(known(robot, term), term, bool(e["on"]), str(e["origin"]), intervals, tuple(map(str, e["flags"])))


def write(folder: Path, saved: Saved) -> None:
    folder.mkdir(parents=True, exist_ok=True)
    content = {"format": FORMAT, **asdict(saved)}
    write_whole(folder / FILE, json.dumps(content, indent=1) + "\n")


def is_session(log: Path) -> bool:
    """Whether a folder holds a session, and no recovery to follow."""
    return (log / FILE).is_file()


def read(folder: Path) -> Saved:
    """Raises ConfigError where the file is none of ours, or damaged."""
    path = folder / FILE
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
        if found["format"] != FORMAT:
            raise ConfigError(f"{path}: written in format {found['format']!r}; this version reads {FORMAT}")
        ladder = tuple(Step(**s) for s in found["ladder"])
        saved = Saved(
            tuple(map(str, found["measured"])), found["model"], str(found["by"]), str(found["engine"]),
            tuple(found["entries"]), ladder, tuple(map(str, found["commands"])),
        )  # fmt: skip
        for e in saved.entries:
            from_dict(e["term"]), e["on"], e["origin"], e["intervals"], e["flags"]
    except (OSError, ValueError, KeyError, TypeError, AttributeError, EffectError) as error:
        if isinstance(error, ConfigError):
            raise
        raise ConfigError(
            f"{path}: no session of the workbench can be read from it ({error}); its models are whole, in {folder}/steps"
        ) from None
    return saved
