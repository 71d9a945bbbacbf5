"""Programs that run beside this one and must be gone when it is done with them."""

from __future__ import annotations

import subprocess


def gone(process: subprocess.Popen[bytes], patience_s: float) -> None:
    """Wait until a process that was told to end has; kill it where it does not in ``patience_s``."""
    try:
        process.wait(timeout=patience_s)
    except subprocess.TimeoutExpired:
        process.kill()
        process.wait()
