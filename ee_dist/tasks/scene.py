"""The rerun scene of a run: drawn last, because it can be drawn again and what it shows cannot be measured again."""

from __future__ import annotations

import os
from pathlib import Path

from ee_dist.recording.reader import ANY, read_run
from ee_dist.tasks.config import ConfigError


def drawn(log: Path) -> Path:
    """Draw a whole recording into the ``.rrd`` beside it. Raises ConfigError that says what is whole all the same."""
    from ee_dist.viewing.scenes import write_scene  # slow to load, and needed only now

    scene = log.with_suffix(".rrd")
    try:
        write_scene(read_run(log, ANY), scene)
    except OSError as error:
        raise ConfigError(
            f"{os.path.relpath(scene)}: cannot be drawn ({error.strerror or error}); recording and summary are whole: "
            f"draw it later with: python -m ee_dist task=view log={os.path.relpath(log)}"
        ) from error
    return scene
