"""Which errors are a user's to mend, and Hydra's messages in one line."""

from __future__ import annotations

import os
import re
import traceback
from pathlib import Path

from hydra.errors import HydraException, OverrideParseException

from ee_dist.basics.names import listed_or, nearest
from ee_dist.basics.quoted import quoted
from ee_dist.effects.effect import EffectError
from ee_dist.effects.plugins import loaded_plugins
from ee_dist.engines.contract import EngineError
from ee_dist.engines.drivers import DriverError
from ee_dist.evaluation.ray_apart import abandon_ray, when_lost
from ee_dist.evaluation.ray_folder import remove_orphans
from ee_dist.evaluation.ray_session import EvaluatorError, RayGoneError, RayLostError
from ee_dist.recording.errors import RecordingError
from ee_dist.robots.model import RobotError
from ee_dist.tasks.config import ConfigError, known_settings, unknown_key
from ee_dist.tasks.help import options_with, settings_of
from ee_dist.trials.excitation import ExcitationError
from ee_dist.trials.hardware import HardwareError
from ee_dist.trials.log import LogError

__all__ = (
    "USER_ERRORS",
    "RayGoneError",
    "RayLostError",
    "abandon_evaluators",
    "defect",
    "hydra_message",
    "remove_orphans",
    "unasked_end",
    "unforeseen",
    "when_lost",
)

_LONGEST = 300
"""Characters of an error that nobody foresaw: some libraries put whole arrays into theirs."""
ALIKE = 0.6
"""Likeness from which a setting of any verb is proposed."""
_FILES = {
    ".urdf": "robot=urdf robot.urdf={}",
    ".xml": "robot=mjcf robot.file={}",
    ".mjcf": "robot=mjcf robot.file={}",
    ".yaml": "robot=urdf robot.drives={}",
    ".yml": "robot=urdf robot.drives={}",
}
"""How a robot's file is named, by its suffix: ``robot=`` itself takes a choice."""
USER_ERRORS = (
    ConfigError,
    DriverError,
    EffectError,
    EngineError,
    EvaluatorError,
    HardwareError,
    LogError,
    RecordingError,
    RobotError,
    ExcitationError,
)


UNREAD = "whoever read what this prints has ended, and so the run has"


def abandon_evaluators() -> None:
    """End what this process started beside itself, for one that ends without more ado."""
    abandon_ray()


def unasked_end(error: BaseException) -> str:
    """A run that was ended from within: by code of the user's that calls ``sys.exit``, or for want of memory."""
    if isinstance(error.__context__, BrokenPipeError):
        return UNREAD
    where = _of_plugin(error)
    if isinstance(error, MemoryError):
        return (
            f"{where}not enough memory for this; ask for less at a time: a smaller population, fewer steps or workers"
        )
    stop = error.code if isinstance(error, SystemExit) else error
    return (
        f"{where}sys.exit({stop!r}) was called in the middle of the run; code of your own must raise an error instead"
    )


def unforeseen(error: Exception) -> str:
    """An error that nobody foresaw, in one line."""
    return " ".join(f"{type(error).__name__}: {error}".split())[:_LONGEST]


def defect(error: Exception, out: Path) -> str:
    """The same of a run; its trace goes into ``out/error.txt``."""
    said = unforeseen(error)
    trace = "".join(traceback.format_exception(error))
    path = out / "error.txt"
    try:
        out.mkdir(parents=True, exist_ok=True)
        path.write_text(trace, encoding="utf-8")
    except OSError:
        return said
    whose = _of_plugin(error)
    blame = "" if whose else "; this is a defect of ee_dist: please report it"
    return f"{whose}{said}{blame} (the trace is in {os.path.relpath(path)})"


def _of_plugin(error: BaseException) -> str:
    """File and line of a plugin in which the error arose, if it was one."""
    plugins = set(loaded_plugins())
    found = [f for f in traceback.extract_tb(error.__traceback__) if os.path.abspath(f.filename) in plugins]
    return f"plugin {os.path.relpath(found[-1].filename)}, line {found[-1].lineno}: " if found else ""


def hydra_message(error: HydraException) -> str:
    """What was wrong with the command line, without Hydra's advice to programmers."""
    text = str(error).strip()
    unread = getattr(error, "override", None)
    if unread is not None or isinstance(error, OverrideParseException):
        return (
            f"{quoted(str(unread))}: cannot be read; settings are written key=value, signs within quotes: key=\"'a=b'\""
        )
    twice = re.match(r"Multiple values for (\S+)\. ", text)
    if twice:
        return f"{twice.group(1)}: given more than once; name one, or several with -m: -m +{twice.group(1)}=1,2"
    several = re.match(r"(?:Ambiguous value for argument|Sweep parameters) '(.*?)'(?:\n| requires|$)", text)
    if several:
        key, _, values = several.group(1).partition("=")
        return (
            f"{quoted(several.group(1))}: several values for one run; a list stands in brackets, {key}=[{values[:80]}]; "
            "for a run with each of them add -m"
        )
    missing = re.match(
        r"(?s)(?:In '.*?': )?Could not find '([^']+)'\s*Available options in '([^']+)':\s*(.*?)(?:\nConfig search path|$)",
        text,
    )
    if missing:
        wanted, group, options = missing.groups()
        names = sorted(options.split(), key=lambda n: (0, int(n), "") if n.isdigit() else (1, 0, n))
        file = _FILES.get(Path(wanted).suffix.lower(), "") if group == "robot" else ""
        hint = f"; a file is named by {file.format(wanted.removeprefix('robot/'))}" if file else ""
        return f"{group}={wanted.removeprefix(f'{group}/')}: no such choice; there are: {', '.join(names)}{hint}"
    absent = re.match(r"Could not override '([^']+)'", text)
    if absent:
        return _absent(absent.group(1))
    return text.splitlines()[0] if text else type(error).__name__


def _absent(name: str) -> str:
    """A setting without a plus that the configuration does not have."""
    if name == "scenario":
        return "scenario: there is none yet; add it with a plus sign: +scenario=8"
    if name.startswith("task."):
        return f"{name}: this verb has no such setting; {_elsewhere(name)}"
    if name in known_settings():
        group, having = name.partition(".")[0], options_with(name)
        there = (
            f"{' and '.join(having)} {'has' if len(having) == 1 else 'have'} it"
            if having
            else "add it with a plus sign"
        )
        return f"{name}: the chosen {group} has no such setting; {there}"
    return str(unknown_key("", name, ("task", *known_settings()), "'python -m ee_dist task=VERB --help' lists them"))


def _elsewhere(name: str) -> str:
    """What a setting of a verb may have meant: one that another verb has, or one that is called much like it."""
    having = options_with(name)
    if having:
        return f"{listed_or(having)} {'has' if len(having) == 1 else 'have'} it"
    group, _, key = name.partition(".")
    # Some stand beside the verb, not below it.
    known = {k: k for k in known_settings() if "." not in k} | {
        k.removeprefix(f"{group}."): k for k in settings_of(group)
    }
    alike = [known[k] for k in nearest(key, known, ALIKE)]
    everywhere = "'python -m ee_dist task=VERB --help' lists those of a verb"
    return f"did you mean {listed_or(alike)}? {everywhere}" if alike else everywhere
