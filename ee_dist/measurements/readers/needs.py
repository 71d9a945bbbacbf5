"""Libraries that only some formats need: named in the error where they are absent."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

from ee_dist.measurements.errors import MeasurementError


def needed(module: str, extra: str, file: Path) -> Any:
    """The module. Raises MeasurementError with the command that installs it."""
    try:
        return importlib.import_module(module)
    except ImportError:
        package = module.split(".")[0]
        raise MeasurementError(
            f"{file}: this format needs {package}: pip install 'ee_dist[{extra}]', or pip install {package}"
        ) from None
