"""A user's own files of effects: loaded once, known by their text, gone without a trace where they fail."""

from __future__ import annotations

import hashlib
import importlib.util
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from ee_dist.basics.files import real
from ee_dist.effects.catalogue import registered
from ee_dist.effects.effect import EffectError
from ee_dist.effects.laws import LAWS, TEXTS

MOST_BYTES = 2**24
_plugins: dict[str, str] = {}
"""The digest of each file's text as it was loaded last, by absolute path."""


def load_plugin(path: str | Path, text: str = "") -> None:
    """Run a user's file that registers effects of their own; again only if it has changed. ``text``: the digest it must have.

    Raises EffectError where it cannot be read, fails, registers nothing or has another text; the catalogue is then as it was.
    """
    file, content = _read(path)
    if text and content != text:
        raise EffectError(f"plugins={path}: its text is not the one that the run began with; begin the run anew")
    if _plugins.get(str(file)) == content:
        return
    # Two files may share a name; the module's name tells them apart and is the same in every process.
    name = f"ee_dist_plugin_{file.stem}_{hashlib.sha256(str(file).encode()).hexdigest()[:8]}"
    spec = importlib.util.spec_from_file_location(name, file)
    if spec is None or spec.loader is None:
        raise EffectError(f"not a Python file: {path}")
    try:
        with _all_or_nothing():
            for registry in (registered, LAWS):
                for key in [k for k, v in registry.items() if getattr(v, "transform", v).__module__ == name]:
                    del registry[key]
            sys.modules[name] = module = importlib.util.module_from_spec(spec)
            TEXTS[name] = content
            spec.loader.exec_module(module)
            if not any(e.transform.__module__ == name for e in registered.values()):
                raise EffectError("it registers no effect; decorate its transform with @effect(...)")
    except (KeyboardInterrupt, MemoryError):
        raise
    except BaseException as error:
        said = f"{error}" if isinstance(error, EffectError) else f"{type(error).__name__}: {error}"
        if isinstance(error, SystemExit):
            said = f"sys.exit({error.code!r}) was called; a file of effects only defines them"
        raise EffectError(f"{path}{_line_of(error, file)}: {said}") from error
    _plugins[str(file)] = content


def loaded_plugins() -> tuple[str, ...]:
    """Absolute paths of the files loaded so far, in order: what a worker process must load to know the same effects."""
    return tuple(_plugins)


def text_of_plugin(path: str | Path) -> str:
    """Digest of a user's file as it was loaded last; of one that was not loaded, as it is now.

    Of the file alone: what it imports from others is not in it. Raises EffectError where there is none.
    """
    return _plugins.get(str(real(path))) or _read(path)[1]


def _read(path: str | Path) -> tuple[Path, str]:
    """A file's absolute path and the digest of its text as it is now. Raises EffectError where there is none."""
    file = real(path)
    if not file.is_file():
        raise EffectError(f"no such file of effects: {path}")
    if file.stat().st_size > MOST_BYTES:
        raise EffectError(f"plugins={path}: {file.stat().st_size} bytes; a file of effects has at most {MOST_BYTES:,}")
    return file, hashlib.sha256(file.read_bytes()).hexdigest()


@contextmanager
def _all_or_nothing() -> Iterator[None]:
    """Effects, laws and texts as they were, where what is done under it fails."""
    registries: tuple[dict[str, Any], ...] = (registered, LAWS, TEXTS)
    before = [dict(r) for r in registries]
    try:
        yield
    except BaseException:
        for registry, was in zip(registries, before, strict=True):
            registry.clear()
            registry.update(was)
        raise


def _line_of(error: BaseException, file: Path) -> str:
    if isinstance(error, SyntaxError):
        return f", line {error.lineno}"
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(file)]
    return f", line {lines[-1]}" if lines else ""
