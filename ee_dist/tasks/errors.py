"""Which errors are a user's to mend, and Hydra's messages in one line."""

from __future__ import annotations

import re

from hydra.errors import HydraException

from ee_dist.effects.catalogue import EffectError
from ee_dist.engines.contract import EngineError
from ee_dist.evaluation.ray_actors import EvaluatorError
from ee_dist.recording.errors import RecordingError
from ee_dist.robots.model import RobotError
from ee_dist.tasks.config import ConfigError, known_settings, unknown_key
from ee_dist.tasks.help import options_with
from ee_dist.trials.excitation import ExcitationError
from ee_dist.trials.log import LogError

USER_ERRORS = (
    ConfigError,
    EffectError,
    EngineError,
    EvaluatorError,
    LogError,
    RecordingError,
    RobotError,
    ExcitationError,
)


def hydra_message(error: HydraException) -> str:
    """What was wrong with the command line, without Hydra's advice to programmers."""
    text = str(error).strip()
    missing = re.match(
        r"(?s)(?:In '.*?': )?Could not find '([^']+)'\s*Available options in '([^']+)':\s*(.*?)(?:\nConfig search path|$)",
        text,
    )
    if missing:
        wanted, group, options = missing.groups()
        names = sorted(options.split(), key=lambda n: (0, int(n), "") if n.isdigit() else (1, 0, n))
        return f"{group}={wanted.split('/')[-1]}: no such choice; there are: {', '.join(names)}"
    absent = re.match(r"Could not override '([^']+)'", text)
    if absent:
        return _absent(absent.group(1))
    return text.splitlines()[0] if text else type(error).__name__


def _absent(name: str) -> str:
    """A setting without a plus that the configuration does not have."""
    if name == "scenario":
        return "scenario: there is none yet; add it with a plus sign: +scenario=8"
    if name.startswith("task."):
        return f"{name}: this verb has no such setting; 'python -m ee_dist task=VERB --help' lists those of a verb"
    if name in known_settings():
        group, having = name.partition(".")[0], options_with(name)
        there = (
            f"{' and '.join(having)} {'has' if len(having) == 1 else 'have'} it"
            if having
            else "add it with a plus sign"
        )
        return f"{name}: the chosen {group} has no such setting; {there}"
    return str(unknown_key("", name, known_settings(), "'python -m ee_dist task=VERB --help' lists them"))
