"""A xacro made a URDF by ROS's own program, where that is installed.

A xacro is a program: it may name other files and compute. It runs only where its name ends in .xacro, as the user's own command
would, and what comes out is read within the same bounds as any other file.
"""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

from ee_dist.robots.model import RobotError

PROGRAM = "xacro"
LONGEST_S = 60.0


class XacroError(RobotError):
    """A xacro that cannot be expanded; one line."""


def is_xacro(file: Path) -> bool:
    return file.suffix.lower() == ".xacro"


def expanded(file: Path) -> bytes | None:
    """The URDF that a xacro makes; None where the program is not installed. Raises XacroError with what it said."""
    program = shutil.which(PROGRAM)
    if program is None:
        return None
    try:
        done = subprocess.run([program, str(file.resolve())], capture_output=True, timeout=LONGEST_S, check=False)
    except subprocess.TimeoutExpired:
        raise XacroError(f"{file}: xacro took more than {LONGEST_S:g} s") from None
    except OSError as error:
        raise XacroError(f"{file}: xacro cannot be run ({error.strerror})") from None
    if done.returncode:
        raise XacroError(f"{file}: xacro failed: {_cause(done.stderr.decode(errors='replace').strip().splitlines())}")
    return done.stdout


def _cause(said: list[str]) -> str:
    """What it said last, and before that what was wrong, which it follows with a line for each file on the way."""
    if not said:
        return "nothing was said"
    causes = [line for line in said[:-1] if not line.startswith("when ")] if said[-1].startswith("when ") else []
    return " ".join([*(c[:300] for c in causes[-1:]), said[-1][:300]])
