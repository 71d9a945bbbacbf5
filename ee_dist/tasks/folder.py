"""The folder of a run: its alone while it runs, not overwritten unasked, and left as it was found by a mistake.

What a run did not make it does not delete: only files that were written here by name, and folders that were not there
before and are empty.
"""

from __future__ import annotations

import fcntl
import math
import os
import socket
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from hydra.experimental.callback import Callback
from omegaconf import DictConfig, OmegaConf

from ee_dist.basics.files import numbered, write_whole
from ee_dist.basics.quoted import quoted
from ee_dist.tasks.config import ConfigError

LOCK = ".running"
"""Locked by the run that writes into the folder, and gone at its end; the system unlocks it if the run is killed."""
SETTINGS = "config"
EARLIER = "of an earlier run"
_NAMED, LARGE_MB = 3, 50.0

_SWEEP = "multirun.yaml"
NO_NAME = "{key}=: which folder? a run writes into one of its own, such as {key}=logs/mine"
HELD = (
    "{key}={folder}: holds something already ({content}), and a run does not overwrite; "
    "{onward}name another folder, or say overwrite=true"
)
ONWARD = "the same command and resume={folder} goes on with it; "
UNFINISHED, BEGUN = "unfinished", "run.json"
"""What a run leaves for its resumption (see unfinished.py): the folder, and the file in it that is there first."""

_made: tuple[Path, ...] = ()
_sweep: Path | None = None
"""Folder of a sweep that was empty before; Hydra notes the sweep's settings there before anybody looked at them."""


class Refused(BaseException):
    """A folder that cannot be used, found where Hydra turns exceptions of the ordinary kind into warnings."""


class NotedFolders(Callback):
    """Hydra makes a job's folder before it calls the job: notes before that which of its folders are not there yet."""

    def __init__(self) -> None:
        self._missing: tuple[Path, ...] = ()

    def on_run_start(self, config: DictConfig, **_: Any) -> None:
        self._missing = missing(Path(str(config.hydra.run.dir)))

    def on_multirun_start(self, config: DictConfig, **_: Any) -> None:
        # Hydra itself writes into the sweep's folder, before any job.
        if not str(config.hydra.sweep.dir).strip():
            raise Refused(NO_NAME.format(key="hydra.sweep.dir"))
        if (Path(str(config.hydra.sweep.dir)) / _SWEEP).exists() and not (config.overwrite or config.resume):
            there = config.hydra.sweep.dir
            onward = ONWARD.format(folder=there)
            raise Refused(HELD.format(key="hydra.sweep.dir", folder=there, content="a sweep", onward=onward))
        global _made, _sweep
        folder = Path(str(config.hydra.sweep.dir))
        self._missing = _made = missing(folder)
        _sweep = None if held(folder) else folder

    def on_job_start(self, config: DictConfig, **_: Any) -> None:
        # A launcher may have brought this object to another process, and with it what was noted.
        global _made
        out = Path(str(config.hydra.runtime.output_dir))
        above = {p for p in self._missing if p in (out, *out.parents)}
        if above:
            outermost = min(above, key=lambda p: len(p.parts))
            within = {p: Path(os.path.normpath(p)) for p in (out, *out.parents)}
            above |= {p for p, q in within.items() if outermost in (q, *q.parents)}
        _made = tuple(sorted(above, key=lambda p: -len(p.parts)))


def missing(folder: Path) -> tuple[Path, ...]:
    """The folder and those above it that do not exist."""
    folder = folder.absolute()  # with its '..': a folder on the way to one is made too
    return tuple(
        p for p in (folder, *folder.parents) if not os.path.exists(p) and not os.path.exists(os.path.normpath(p))
    )


def free_name(folder: Path) -> Path:
    """The folder, or with a number behind it the first that does not exist: two runs may start in one second."""
    if not held(folder) and not (folder / LOCK).exists():
        return folder
    return numbered(folder)


@contextmanager
def claimed(folder: Path, settings: Mapping[str, str], overwrite: bool) -> Iterator[None]:
    """The folder for this run alone, with ``settings`` (text by file name) in it. ``overwrite``: resumed runs, too.

    Where the run fails before it wrote anything, its folder is left as it was found. Raises ConfigError where another
    run writes there, or where something lies there and ``overwrite`` is not set.
    """
    made = [*missing(folder), *_made]
    folder.mkdir(parents=True, exist_ok=True)
    lock = _locked(folder)
    found: list[str] = []
    before: dict[Path, bytes | None] = {}
    try:
        found = held(folder)
        if found and not overwrite:
            onward = ONWARD.format(folder=shown(folder)) if can_go_on(folder) else ""
            told = HELD.format(key="hydra.run.dir", folder=shown(folder), content=_listed(found), onward=onward)
            raise ConfigError(told)
        _place(folder / SETTINGS, settings, before)
        yield
    except BaseException:
        if set(held(folder)) <= ({*found, SETTINGS} if before else set(found)):
            _restore(before)
        raise
    finally:
        (folder / LOCK).unlink(missing_ok=True)
        os.close(lock)
        remove_made(made)


def begun_s(folder: Path) -> float:
    """When the last run put its settings into the folder, as times of files are told: with overwrite=true what it does not write
    stays from before. Negative infinity where none did."""
    return min((p.stat().st_mtime for p in (folder / SETTINGS).glob("*.yaml")), default=-math.inf)


def remove_made(folders: Sequence[Path] | None = None) -> None:
    """Remove those folders that this run made and left empty, innermost first."""
    for path in _made if folders is None else folders:
        with suppress(OSError):
            path.rmdir()


def forget_sweep() -> None:
    """Remove what Hydra noted of a sweep, none of whose jobs left anything."""
    if _sweep is not None and held(_sweep) == [_SWEEP]:
        (_sweep / _SWEEP).unlink()
        remove_made()


def check_file_name(key: str, name: str, example: str) -> None:
    """Raises ConfigError for what is no plain name of a file with the suffix of the example."""
    suffix = Path(example).suffix
    if Path(name).name != name or Path(name).suffix != suffix or not name.isprintable():
        raise ConfigError(
            f"{key}={quoted(name)[1:-1]}: expected the name of a file that ends in {suffix}, such as {example}"
        )


def shown(folder: Path) -> str:
    """As short as it is clear: relative where it lies below the working folder."""
    relative = os.path.relpath(folder)
    return str(folder) if relative.startswith("..") else relative


def kept(folder: Path) -> str:
    """What a run that was stopped leaves behind, in words."""
    names = [n + _size(folder / n) for n in held(folder) if n != SETTINGS]
    return f"kept in {shown(folder)}: {_listed(names)}" if names else "nothing was recorded yet, so nothing is kept"


def can_go_on(folder: Path) -> bool:
    """Whether ``resume=`` of that folder would find anything."""
    return (folder / UNFINISHED / BEGUN).exists()


def settings_of(composed: DictConfig, hydra: DictConfig) -> dict[str, str]:
    """What was asked for, as files: the composed settings, Hydra's own, and the overrides of the command line."""
    return {
        "config.yaml": OmegaConf.to_yaml(composed),
        "hydra.yaml": OmegaConf.to_yaml(OmegaConf.create({"hydra": hydra})),
        "overrides.yaml": OmegaConf.to_yaml(hydra.overrides.task),
    }


def _locked(folder: Path) -> int:
    """Handle of the folder's lock, which is ours."""
    path = folder / LOCK
    while True:
        handle = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            fcntl.flock(handle, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            who = os.read(handle, 200).decode(errors="replace").strip()
            os.close(handle)
            raise ConfigError(
                f"hydra.run.dir={shown(folder)}: another run writes there now ({who}); wait for it, or name another folder"
            ) from None
        # Its last owner may have removed it after we opened it: then it locks nothing.
        if path.exists() and os.path.samestat(os.fstat(handle), path.stat()):
            with suppress(OSError):  # on a full disk it locks without a name
                os.ftruncate(handle, 0)
                os.write(handle, f"process {os.getpid()} on {socket.gethostname()}\n".encode())
            return handle
        os.close(handle)


def held(folder: Path) -> list[str]:
    """Names of what lies in a folder, without hidden files and what is empty."""
    if not folder.is_dir():
        return []
    seen = [p for p in sorted(folder.iterdir()) if not p.name.startswith(".")]
    return [p.name for p in seen if not (p.is_dir() and not any(p.iterdir()))]


def _size(path: Path) -> str:
    """Of what is large: what was simulated of long logs takes gigabytes, and who does not go on may want them back."""
    files = [path] if path.is_file() else [p for p in path.rglob("*") if p.is_file()]
    large = sum(p.stat().st_size for p in files) / 1e6
    return f" ({large:.0f} MB)" if large >= LARGE_MB else ""


def _listed(names: Sequence[str]) -> str:
    more = len(names) - _NAMED
    return ", ".join(names[:_NAMED]) + (f" and {more} more" if more > 0 else "")


def _place(folder: Path, texts: Mapping[str, str], before: dict[Path, bytes | None]) -> None:
    """Write files, and note what was there ``before``."""
    folder.mkdir(exist_ok=True)
    for name, text in texts.items():
        path = folder / name
        before[path] = path.read_bytes() if path.is_file() else None
        write_whole(path, text)


def _restore(before: Mapping[Path, bytes | None]) -> None:
    for path, content in before.items():
        with suppress(OSError):
            if content is None:
                path.unlink()
            else:
                write_whole(path, content)
    for parent in {p.parent for p in before}:
        with suppress(OSError):
            parent.rmdir()
