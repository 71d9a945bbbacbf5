"""task=reveal: open the sealed truth beside a log, and score an explanation or a model against it if one is given."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from ee_dist.recording.reader import read_run
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.seal import FILE, opened
from ee_dist.tasks.summary import Stopwatch, hypothesis_list, write_summary


@dataclass
class Options:
    name: str = "reveal"
    explained: str | None = None


def run(config: Config, options: Options, out: Path) -> None:
    """Print the truth; ``options.explained`` is the folder of an explain or improve run to score."""
    console, watch = Console(), Stopwatch()
    if not config.log:
        raise ConfigError("log=: whose truth? name the folder of a trial, such as log=logs/trial/...")
    folder = Path(config.log)
    folder = folder if folder.is_dir() else folder.parent
    logs = sorted(folder.glob("*.mcap"))
    digest = read_run(logs[0]).metadata.get("seal") if logs else None
    hidden, _ = opened(folder / FILE, digest)
    console.print("The truth: " + ("; ".join(map(str, hidden)) or "nothing was changed"), highlight=False)
    rest: dict[str, object] = {"truth": hypothesis_list(hidden)}
    if options.explained:
        named = _named(Path(options.explained))
        real = {(t.effect, t.target) for t in hidden}
        right = real <= named if real else not named
        console.print(f"Named: {', '.join(f'{e} at {t}' for e, t in sorted(named)) or 'nothing'}. "
                      f"{'Right.' if right else 'Not right.'}", highlight=False)  # fmt: skip
        rest["right"] = right
    out.mkdir(parents=True, exist_ok=True)
    write_summary(out, "reveal", config, options, watch, digest or "", rest)


def _named(folder: Path) -> set[tuple[str, str]]:
    """What an explain (first and its ties) or improve (all terms) run says."""
    path = folder / "summary.json" if folder.is_dir() else folder
    try:
        data = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        raise ConfigError(f"task.explained={folder}: no summary.json of explain or improve there") from None
    if data.get("task") == "improve":
        return {(t["effect"], t["target"]) for t in data["model_terms"]}
    found = [c for c in data.get("candidates", []) if data.get("verdict") == "effect"]
    if not found:
        return set()
    return {(c["effect"], c["target"]) for c in found if c["rank"] == 1 or c["name"] in found[0]["tied_with"]}
