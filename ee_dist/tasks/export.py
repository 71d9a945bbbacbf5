"""task=export: an improved model for other simulators, and what became of each of its effects on the way."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import yaml
from rich.console import Console
from rich.table import Table

from ee_dist.basics.files import write_whole
from ee_dist.effects.model_file import ModelFile, read_model
from ee_dist.export import FORMATS
from ee_dist.export.plan import NOT, Fate, fates, native_damping, needs_shim
from ee_dist.export.python import controller_text
from ee_dist.export.urdf import urdf_text
from ee_dist.robots.model import Robot
from ee_dist.robots.serial import robot_to_dict
from ee_dist.tasks.config import Config, ConfigError, one_of
from ee_dist.tasks.summary import Stopwatch, digest_of, write_summary
from ee_dist.tasks.terminal import terminal


@dataclass
class Options:
    name: str = "export"
    to: str = "mjcf"


def run(config: Config, options: Options, out: Path) -> None:
    """Write ``config.model`` in the format ``to``. Raises ConfigError, RobotError, EffectError, EngineError."""
    watch = Stopwatch()
    to = one_of("to", options.to if config.to is None else config.to, FORMATS)
    if not config.model:
        raise ConfigError(
            "model=: which model file? one that task=improve wrote, or one with 'robot' and 'effects', or a robot's description"
        )
    found = read_model(config.model)
    model, told = found.model, fates(found.robot, found.terms, to)
    files = files_of(found, model, to, told)
    out.mkdir(parents=True, exist_ok=True)
    for name, text in files.items():
        write_whole(out / name, text)
    rest = {
        "to": to,
        "robot": model.name,
        "files": list(files),
        "shim": "controller.py" in files,
        "effects": [{**f.term.as_dict(), "how": f.how, "why": f.why} for f in told],
    }
    write_summary(out, "export", config, options, watch, digest_of(sorted(files.items())), rest)
    tell(terminal(), model, told, list(files), out)


def files_of(found: ModelFile, model: Robot, to: str, told: Sequence[Fate]) -> dict[str, str]:
    """Texts by name: the body, and beside it the controller shim where it is needed."""
    head = "\n".join(
        [f"{model.name}: a model written by task=export", *(f"{f.how}: {f.term} {f.why}".strip() for f in told)]
    )
    shim = needs_shim(model, to)
    files: dict[str, str] = {}
    if to == "mjcf":
        # An engine is imported where it is used.
        from ee_dist.engines.mujoco.mjcf_out import mjcf_text

        files["robot.xml"] = mjcf_text(model, shim, native_damping(model))
    elif to == "urdf":
        files["robot.urdf"] = urdf_text(model)
    elif to == "yaml":
        comment = "".join(f"# {line}\n" for line in head.splitlines())
        files["robot.yaml"] = comment + yaml.safe_dump(robot_to_dict(model), sort_keys=False, width=120)
    if shim:
        files["controller.py"] = controller_text(model, head)
    return files


def tell(console: Console, model: Robot, told: Sequence[Fate], files: Sequence[str], out: Path) -> None:
    """Print what became of each effect, and the files."""
    if told:
        table = Table(title=model.name, title_justify="left", box=None)
        for column in ("effect", "becomes", "note"):
            table.add_column(column)
        for f in told:
            table.add_row(str(f.term), f.how, f.why)
        console.print(table)
    lost = [f for f in told if f.how == NOT]
    if lost:
        console.print(f"{len(lost)} of {len(told)} effects are not in what was written.", highlight=False)
    if "controller.py" in files:
        console.print(
            "controller.py: drives, friction, stops and sensors; call it every step, as its end shows. It needs NumPy alone.",
            highlight=False, soft_wrap=True,
        )  # fmt: skip
    for name in files:
        console.print(f"  {out / name}", highlight=False, soft_wrap=True)
