"""YAML and JSON of strangers as plain data, with what a reader of robots says of a file that is neither."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ee_dist.robots.model import RobotError
from ee_dist.robots.untrusted import UntrustedError, json_of, text_of, yaml_of


def read_text(path: str | Path, what: str) -> Any:
    """What a ``.json`` or else YAML file holds. Raises RobotError in one line: no file, not what it says, too large."""
    file = Path(path)
    try:
        return json_of(text_of(file)) if file.suffix.lower() == ".json" else yaml_of(file)
    except FileNotFoundError:
        raise RobotError(f"{file}: no such file; expected {what}") from None
    except UntrustedError as error:
        raise RobotError(f"{file}: {error}; expected {what}") from None
    except OSError as error:
        raise RobotError(f"{file}: cannot be read ({error.strerror}); expected {what}") from None
