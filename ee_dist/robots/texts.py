"""YAML and JSON of strangers as plain data, with what a reader of robots says of a file that is neither."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from ee_dist.robots.model import RobotError
from ee_dist.robots.untrusted import json_of, text_of, told_as, yaml_of


def read_text(path: str | Path, what: str) -> Any:
    """What a ``.json`` or else YAML file holds. Raises RobotError in one line: no file, not what it says, too large."""
    file = Path(path)
    with told_as(RobotError, file, what):
        return json_of(text_of(file)) if file.suffix.lower() == ".json" else yaml_of(file)
