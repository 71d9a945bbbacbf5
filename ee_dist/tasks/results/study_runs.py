"""The runs of a study: found by their summaries, or told by earlier studies, so that one too long for a day or a machine
grows from one to the next."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from ee_dist.basics.quoted import quoted
from ee_dist.robots.untrusted import UntrustedError, json_of, text_of
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.results.commands import repeating
from ee_dist.tasks.results.study_table import method, row

FILE = "runs.json"
"""What a study keeps of each run, to count it again without its folder."""
KEPT = (
    "scenario", "title", "metric", "seed", "engine", "budget", "version", "restored", "wall_s", "distance_m",
    "recovered_fraction", "diagnosis", "doubt", "truth", "hypotheses", "dominants", "evaluations", "result_digest",
    "folder", "command",
)  # fmt: skip
LARGEST = 2**28
"""Bytes of a file that is read."""
RUN = "recover"
SORTED_BY: dict[str, type | tuple[type, ...]] = {
    "scenario": (int, str),
    "metric": str,
    "seed": int,
    "engine": str,
    "budget": str,
    "result_digest": str,
}
"""What runs are told apart by, and what that may be."""

Run = dict[str, Any]


def summaries(folder: Path) -> dict[Path, Run]:
    """All below a folder, by path in order. Raises ConfigError for a file that is none, and where no run finished."""
    found = {path: _summary(path) for path in sorted(folder.rglob("summary.json"))}
    if not any(content.get("task") == RUN for content in found.values()):
        raise ConfigError(f"log={folder}: no finished run below it; a run is finished when it has a summary.json")
    return found


def runs_of(told_by: Mapping[Path, Run], earlier: Sequence[Path]) -> list[Run]:
    """Of summaries those of finished recover runs, each with its own ``folder`` and the ``command`` that repeats it, and those
    that ``earlier`` studies keep (``runs.json`` or its folder), in order. Raises ConfigError for what is no run."""
    found = []
    for path, content in told_by.items():
        if content.get("task") != RUN:
            continue
        _check(content, path)
        # Before their way of repair counts as one: the command is of what the run was told.
        again = repeating(path.parent)
        found.append({**content, "metric": method(content), "folder": str(path.parent), "command": again})
    for path in earlier:
        found += _kept(path / FILE if path.is_dir() else path)
    return sorted(found, key=lambda s: (s["metric"], s["engine"], str(s["scenario"]).zfill(9), s["seed"]))


def kept(runs: Iterable[Mapping[str, Any]]) -> str:
    """The content of ``runs.json``: a run a line. Of beliefs the last one counts."""
    lines = []
    for run in runs:
        told = {k: run[k] for k in KEPT if k in run}
        lines.append(json.dumps({**told, "hypotheses": (told.get("hypotheses") or [])[-1:]}))
    return '{"runs": [\n' + ",\n".join(lines) + "\n]}\n"


def _kept(path: Path) -> list[Run]:
    """The runs that an earlier study keeps."""
    try:
        content = json_of(text_of(path, LARGEST))
    except (OSError, UntrustedError) as error:
        raise ConfigError(f"task.earlier={path}: not the {FILE} of a study ({error})") from None
    runs = content.get("runs") if isinstance(content, dict) else None
    if not isinstance(runs, list) or not all(isinstance(r, dict) for r in runs):
        raise ConfigError(f"task.earlier={path}: not the {FILE} of a study, which has a list of runs")
    for run in runs:
        _check(run, path)
    return runs


def _check(content: Run, path: Path) -> None:
    """Raises ConfigError for what a table cannot be made of."""
    try:
        row(content)
    except (KeyError, TypeError, ValueError, AttributeError) as error:
        raise ConfigError(f"{_what(path)} without {error}; take it out of the folder") from None
    for key, kinds in SORTED_BY.items():
        if not isinstance(content[key], kinds) or isinstance(content[key], bool):
            raise ConfigError(f"{_what(path)} whose {key} is {quoted(content[key])}; take it out of the folder")


def _what(path: Path) -> str:
    return f"{path}: a run" if path.name == FILE else f"{path}: a summary"


def _summary(path: Path) -> Run:
    try:
        content = json_of(text_of(path, LARGEST))
    except (OSError, UntrustedError) as error:
        raise ConfigError(f"{path}: not a summary ({error}); take it out of the folder") from None
    if not isinstance(content, dict):
        raise ConfigError(f"{path}: not a summary; take it out of the folder")
    return content
