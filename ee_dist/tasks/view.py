"""task=view: a run in rerun, from its recording or rebuilt from the MCAP alone."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from ee_dist.recording.reader import ANY, read_run
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.terminal import terminal
from ee_dist.viewing.headless import ViewerError, check_recording
from ee_dist.viewing.scenes import write_scene
from ee_dist.viewing.viewer import open_viewer


@dataclass
class Options:
    name: str = "view"
    rebuild: bool = False
    open: bool = True


def run(config: Config, options: Options, out: Path) -> None:
    """Find or rebuild the .rrd of ``config.log`` and open it. Raises ConfigError, RecordingError."""
    if not config.log:
        raise ConfigError(
            "log=: which log? name an .mcap, an .rrd or the folder of a run, such as log=logs/recover/..."
        )
    recording = find(Path(config.log), options.rebuild, out)
    terminal().print(f"rerun recording: {recording}", highlight=False, soft_wrap=True)
    if options.open:
        open_viewer(recording)


def find(path: Path, rebuild: bool, out: Path) -> Path:
    """The .rrd for a log; a missing one is rebuilt into ``out``."""
    if path.is_dir():
        logs = sorted([*path.glob("*.mcap"), *path.glob("*.mcap.part")])
        if not logs:
            raise ConfigError(f"log={path}: no .mcap in this folder; name the folder of one run or an .mcap")
        path = logs[0]
    if path.suffix == ".rrd" and path.is_file():
        try:
            check_recording(path)
        except ViewerError as error:
            raise ConfigError(f"log={path}: {error}; name the folder of one run or an .mcap") from None
        return path
    beside = path.with_suffix(".rrd")
    if beside.is_file() and not rebuild:
        return beside
    out.mkdir(parents=True, exist_ok=True)
    rebuilt = out / f"{path.stem}.rrd"
    write_scene(read_run(path, ANY), rebuilt)
    return rebuilt
