"""Reports of one story: runs beside this one that looked at the same measurements, and the one that made its model."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import quote

from ee_dist.basics.files import real
from ee_dist.robots.untrusted import yaml_of

REPORT = "report.html"
MOST = 100
"""Folders beside this one that are looked into, the newest first."""
Link = tuple[str, str]
"""Name, and relative address."""


def links(out: Path, files: Sequence[Path], model: str | Path | None) -> list[Link]:
    """Reports that were there before the one in ``out``: what cannot be read is no part of the story."""
    own = {f.resolve() for f in files}
    found: dict[Path, str] = {}
    if model is not None and (Path(model).parent / REPORT).is_file():
        folder = Path(model).resolve().parent
        found[folder] = f"where the model comes from ({folder.name})"
    beside = sorted((p.parent for p in out.parent.glob(f"*/{REPORT}")), key=lambda p: -p.stat().st_mtime)
    for folder in beside[:MOST]:
        if folder.resolve() in {out.resolve(), *found}:
            continue
        task, measured = _asked(folder)
        if any(f == m or m in f.parents for f in own for m in measured):
            found[folder.resolve()] = folder.name if task in folder.name else f"{task} ({folder.name})"
    start = out.resolve()
    return [(name, quote(Path(os.path.relpath(f / REPORT, start)).as_posix())) for f, name in found.items()]


def _asked(folder: Path) -> tuple[str, list[Path]]:
    """The task of a run and the measurements it was given; nothing where its settings say nothing."""
    try:
        asked, hydra = (yaml_of(folder / "config" / f"{name}.yaml") for name in ("config", "hydra"))
        where, measured = Path(hydra["hydra"]["runtime"]["cwd"]), asked["measured"] or []
        several = [measured] if isinstance(measured, str) else measured
        return str(asked["task"]["name"]), [real(where / str(m)) for m in several]
    except (OSError, ValueError, KeyError, TypeError):
        return "", []
