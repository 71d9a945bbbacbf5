"""Opening a recording for a person: in a window where there is a screen, as a hint where there is none."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from ee_dist.viewing.headless import ViewerError, viewer_binary


def open_viewer(rrd_path: str | Path) -> bool:
    """Start the rerun viewer on a recording and return at once; True if a window was asked for.

    Without a screen, or where the viewer cannot be started, says what to run elsewhere. Never waits, never raises.
    """
    path = Path(rrd_path)
    hint = f"to look at it, where there is a screen: rerun {path}"
    if not path.is_file():
        print(f"no such recording: {path}")
        return False
    if not has_display():
        print(hint)
        return False
    try:
        # A session of its own: the window stays when this program ends or is interrupted.
        subprocess.Popen(
            [str(viewer_binary()), str(path.absolute())],
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )
    except (ViewerError, OSError) as error:
        print(f"the rerun viewer did not start ({error}); {hint}")
        return False
    return True


def has_display() -> bool:
    """Whether a window can be opened here."""
    if sys.platform in ("win32", "darwin"):
        return True
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))
