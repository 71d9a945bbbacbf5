"""Command lines of ours, as a shell takes them: what to type next, and what does again what was done."""

from __future__ import annotations

import os
import re
import shlex
from collections.abc import Sequence
from pathlib import Path

from omegaconf import OmegaConf
from omegaconf.errors import OmegaConfBaseException
from yaml import YAMLError

from ee_dist.robots.model import Robot
from ee_dist.robots.untrusted import UntrustedError, text_of
from ee_dist.tasks.config import AUTO, Config
from ee_dist.tasks.folder import SETTINGS
from ee_dist.tasks.trial_choice import entries
from ee_dist.trials.family import driven


def command(words: Sequence[str]) -> str:
    """A command line of ours that a shell takes as it is, whatever is in its paths."""
    return " ".join(map(_for_shell, ["python", "-m", "ee_dist", *words]))


def _for_shell(word: str) -> str:
    """In double quotes where it holds single ones and nothing that a shell looks for in them: those can be read."""
    readable = "'" in word and not _ALIVE & {*word}
    return f'"{word}"' if readable else shlex.quote(word)


_ALIVE = frozenset('"\\$`!')
"""What means something between double quotes."""


def setting(key: str, value: str | os.PathLike[str] | Sequence[str | os.PathLike[str]]) -> str:
    """``key=value``, or ``key=[one,two]`` of several, as Hydra reads it, quoted where it must be."""
    if isinstance(value, str | os.PathLike):
        return f"{key}={_quoted(value)}"
    return f"{key}={_quoted(value[0])}" if len(value) == 1 else f"{key}=[{','.join(map(_quoted, value))}]"


def _quoted(value: str | os.PathLike[str]) -> str:
    text = os.path.relpath(value) if os.path.exists(value) else str(value)
    plain = bool(text) and all((ch.isascii() and ch.isalnum()) or ch in "/._-@:+*" for ch in text)
    return text if plain and not _OTHER.fullmatch(text) else _in_quotes(text)


_OTHER = re.compile(r"null|true|false|[-+]?(inf|nan|[\d_.]+(e[-+]?[\d_]+)?)", re.IGNORECASE)
"""Words that Hydra takes for something else than text."""


def _in_quotes(text: str) -> str:
    """As Hydra escapes it: a quote, and the backslashes right before one or at the end."""
    return "'" + re.sub(r"(\\*)('|$)", lambda m: 2 * m[1] + (m[2] and "\\'"), text) + "'"


def asked(task: str, config: Config, by: str = AUTO, *more: str) -> list[str]:
    """The words that ask for a verb on the measurements and the model of ``config``, with all of its settings that decide
    what comes out."""
    words = [f"task={task}", setting("measured", config.measured)]
    for key in ("trials", "held_out"):
        chosen = entries(getattr(config, key))
        if all(isinstance(name, int) for name in chosen):
            words += [f"{key}=[{','.join(map(str, chosen))}]"] if chosen else []
        else:
            words.append(setting(key, [str(name) for name in chosen]))
    if config.model is not None:
        words.append(setting("model", config.model))
    words += more
    if by != AUTO:
        words.append(f"task.by={by}")
    return [*words, *simulated(config)]


def planning(out: str | os.PathLike[str], robot: Robot) -> str:
    """The command that finds what to record next, for the explain or improve that lies in ``out``; empty for a robot that obeys
    no commands."""
    return command(["task=plan", setting("task.explained", out)]) if driven(robot) else ""


def simulated(config: Config) -> list[str]:
    """The words for what simulates, where it is not what every run has, and for effects of one's own."""
    usual = Config()
    words = [] if config.engine.name == usual.engine.name else [f"engine={config.engine.name}"]
    if config.evaluator.name != usual.evaluator.name:
        words.append(f"evaluator={config.evaluator.name}")
    if config.plugins:
        words.append(f"plugins=[{','.join(map(_quoted, config.plugins))}]")
    return words


LARGEST = 2**20
"""Bytes of what a run was asked for."""


def told_to(folder: Path) -> list[str]:
    """The words that a run in ``folder`` was asked for; none where they are not beside it. Not those that say where it lies."""
    try:
        words = OmegaConf.to_container(OmegaConf.create(text_of(folder / SETTINGS / "overrides.yaml", LARGEST)))
    except (OSError, UntrustedError, YAMLError, OmegaConfBaseException, ValueError):
        return []
    if not isinstance(words, list):
        return []
    asked = [str(w) for w in words if not str(w).startswith(("resume=", "overwrite=", "hydra."))]
    # A sweep notes the scenario in quotes, which a shell would need quotes for.
    return [w.replace("'", "") if w.startswith("+scenario=") else w for w in asked]


def repeating(folder: Path) -> str:
    """What repeats a run; nothing where nobody knows what it was asked for."""
    words = told_to(folder)
    return command(words) if words else ""


def with_seeds(folder: Path, scenario: int) -> str:
    """What repeats a run with three seeds, and all else as it was."""
    own = [w for w in told_to(folder) if not w.startswith(("+scenario=", "scenario=", "seed="))]
    return command(["-m", f"+scenario={scenario}", "seed=0,1,2", *own])
