"""task=workbench: a page to compare, explain, add and watch the error fall, or to follow a run, or to go on with either."""

from __future__ import annotations

import importlib.util
from dataclasses import dataclass
from pathlib import Path

from ee_dist import beginning
from ee_dist.tasks.config import AUTO, Config, ConfigError, one_of, within
from ee_dist.tasks.unfinished import note_nothing
from ee_dist.tasks.ways import WAYS

TOOLKIT = "nicegui"


@dataclass
class Options:
    name: str = "workbench"
    by: str = AUTO
    host: str = "127.0.0.1"
    port: int = 8765
    show: bool = True

    def __post_init__(self) -> None:
        one_of("task.by", self.by, (AUTO, *WAYS))
        within("task.port", self.port, 0, 65535)


def run(config: Config, options: Options, out: Path) -> None:
    """Serve the page until it is ended. Raises ConfigError, LogError, RecordingError for what cannot be opened."""
    if importlib.util.find_spec(TOOLKIT) is None:
        raise ConfigError(
            f"task=workbench needs {TOOLKIT}, which is not installed: pip install -c constraints.txt -e '.[workbench]'"
        )
    if config.log and config.measured:
        raise ConfigError("log= follows a recovery, measured= compares a model with a log: give one of them")
    note_nothing()
    # The toolkit takes a second to load: not before it is known to be needed.
    beginning.load()
    from ee_dist.workbench.serve import serve

    serve(config, options.by, options.host, options.port, options.show, out)
