"""What ``--help`` and ``--version`` say: all verbs on one screen, or the settings of one with defaults, units and meaning.

The meaning of a setting is the comment above it in ``conf/``, so that who reads the file and who asks read the same.
"""

from __future__ import annotations

import ast
import re
import textwrap
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from omegaconf import OmegaConf

from ee_dist.tasks.compose import TASKS, config_folder, module_of
from ee_dist.tasks.config import one_of
from ee_dist.tasks.summary import package_version

PROGRAM = "python -m ee_dist"
WIDTH = 80
HELP = ("--help", "-h")
VERSION = "--version"


@dataclass(frozen=True)
class Verb:
    """``example``: its arguments. ``groups`` and ``shared``: which settings it takes besides its own (task.*)."""

    does: str
    example: str
    groups: tuple[str, ...] = ()
    shared: tuple[str, ...] = ()


_RUN = ("engine", "evaluator")
_LOG = ("measured", "model", "seed", "plugins", "ray.address")
_MODEL = (*_LOG[:1], "trials", "held_out", *_LOG[1:])
_HARDWARE = tuple(
    f"hardware.{key}" for key in ("address", "begin_s", "timeout_s", "range_share", "speed", "acceleration", "torque")
)
VERBS = {
    "recover": Verb(
        "the loop: break, diagnose, repair",
        "+scenario=8",
        ("scenario", "budget", "metric", "repair", "robot", "system", *_RUN),
        ("seed", "noise", "plugins", "ray.address", *_HARDWARE),
    ),
    "online": Verb(
        "evolution on the body alone",
        "task=online +scenario=3",
        ("scenario", "budget", "robot", *_RUN),
        ("seed", "plugins", "ray.address"),
    ),
    "study": Verb("table and figures of many runs", "task=study log=logs/recover", (), ("log",)),
    "trial": Verb(
        "robot trials, the hidden effect sealed",
        "task=trial +hidden=random",
        ("robot", "engine"),
        ("hidden", "seed", "noise", "plugins", *_HARDWARE),
    ),
    "import": Verb(
        "your logs as a recording",
        "task=import measured=FILE.csv",
        ("robot",),
        ("measured",),
    ),
    "robot": Verb("what a robot's file says and lacks", "task=robot urdf=FILE", (), ("urdf", "mjcf")),
    "compare": Verb("how far a model is off, and where", "task=compare measured=LOG model=MODEL", _RUN, _MODEL),
    "explain": Verb("which missing effect explains it", "task=explain measured=LOG model=MODEL", _RUN, _MODEL),
    "improve": Verb(
        "add what earns its place to the model",
        "task=improve measured=LOG effect=auto",
        _RUN,
        (*_MODEL, "effect"),
    ),
    "plan": Verb(
        "a trial that tells apart what is tied",
        "task=plan task.explained=FOLDER",
        _RUN,
        _MODEL,
    ),
    "export": Verb("the model for other simulators", "task=export model=MODEL to=mjcf", (), ("model", "to")),
    "reveal": Verb("open the seal, score what was found", "task=reveal log=TRIAL", (), ("log",)),
    "view": Verb("open a run in rerun", "task=view log=RUN", (), ("log",)),
    "workbench": Verb("all of it by hand, on a page", "task=workbench measured=LOG", ("robot", *_RUN), (*_LOG, "log")),
}


def answer(arguments: list[str]) -> str | None:
    """The text that these arguments ask for; None if they ask for a job. Raises ConfigError for an unknown verb."""
    if VERSION in arguments:
        return f"ee_dist {package_version()}"
    if not any(a in HELP for a in arguments):
        return None
    named = [a.removeprefix("task=") for a in arguments if a.startswith("task=")]
    return verb_help(named[-1]) if named else overview()


def overview() -> str:
    """All verbs, an example of each, and where to read on: one screen."""
    wide = max(len(v.example) for v in VERBS.values()) + 2
    lines = [
        "ee_dist: what is wrong with a robot, and which effect its model misses.",
        "",
        f"{PROGRAM} ...",
    ]
    lines += [f"  {verb.example:<{wide}}{verb.does}" for verb in VERBS.values()]
    lines += [
        "",
        "  +scenario=8 budget=quick     a small run, to see every part work",
        "  -m +scenario=1,5,9 seed=0,1  a sweep, each run in a folder of its own",
        "  engine=mujoco   evaluator=serial   hydra.run.dir=FOLDER   with every verb",
        f"{PROGRAM} task=explain --help     settings of a verb: name any",
        "To read: docs/tutorial.md, docs/bring_your_robot.md, docs/effects.md",
    ]
    return "\n".join(lines)


def verb_help(name: str) -> str:
    """One verb: what it does, an example, its settings with defaults, units and meaning. Raises ConfigError."""
    one_of("task", name, TASKS)
    verb, conf = VERBS[name], config_folder()
    parts = [
        *textwrap.wrap(_first_line(name), WIDTH),
        "",
        f"  {PROGRAM} {verb.example}",
        "",
        *_table(
            f"Settings of {name}", [s for s in settings_in(conf / "task" / f"{name}.yaml") if s.key != "task.name"]
        ),
    ]
    shared = [s for s in settings_in(conf / "config.yaml") if s.key in verb.shared]
    parts += _table("Settings it shares with other verbs", shared)
    for group in verb.groups:
        options = sorted((p.stem for p in (conf / group).glob("*.yaml")), key=lambda n: (len(n), n))
        plus = "+" if group in ("scenario", "system") else ""
        parts += textwrap.wrap(f"{plus}{group}=" + ", ".join(options), WIDTH, subsequent_indent="    ")
        if group == "scenario":
            continue
        known = {f"{group}.name"}
        for option in sorted(options, key=lambda o: o != _default(conf, group)):
            file = conf / group / f"{option}.yaml"
            prefix = "" if "@package _global_" in file.read_text(encoding="utf-8") else group
            own = [s for s in settings_in(file, prefix) if s.key not in known]
            known |= {s.key for s in own}
            parts += _table(f"  with {group}={option}", own)
    return "\n".join([*parts, f"Units stand in brackets. All verbs: {PROGRAM} --help"])


@dataclass(frozen=True)
class Setting:
    """One setting of a file in ``conf/``: its key as typed, its default, and the comment above it."""

    key: str
    default: Any
    meaning: str


def settings_in(path: Path, prefix: str = "") -> list[Setting]:
    """The settings of a file in the order they stand there. A task's own file without a package is ``task.``."""
    text = path.read_text(encoding="utf-8")
    if not prefix and path.parent.name == "task" and "@package _global_" not in text:
        prefix = "task"
    tree = OmegaConf.to_container(OmegaConf.create(text), resolve=False)
    found: list[Setting] = []
    owners: list[tuple[int, str]] = []
    comment: list[str] = []
    for line in text.splitlines():
        bare = line.strip()
        if bare.startswith("#"):
            if not bare.startswith("# @package"):
                comment.append(bare.lstrip("# "))
            continue
        match = re.match(r"( *)([A-Za-z_]\w*):", line)
        if match:
            indent, key = len(match.group(1)), match.group(2)
            owners = [o for o in owners if o[0] < indent]
            path_of_key = [o[1] for o in owners] + [key]
            value = _at(tree, path_of_key)
            if isinstance(value, dict):
                owners.append((indent, key))
            elif path_of_key[0] not in ("defaults", "hydra"):
                found.append(Setting(".".join([prefix, *path_of_key]).lstrip("."), value, " ".join(comment)))
        comment = []
    return found


def _at(tree: Any, keys: list[str]) -> Any:
    for key in keys:
        tree = tree.get(key) if isinstance(tree, dict) else None
    return tree


def _table(title: str, settings: list[Setting]) -> list[str]:
    """A line with key and default for each, the meaning folded below it."""
    if not settings:
        return []
    lines = [f"{title}:"]
    for s in settings:
        lines.append(f"  {s.key}={_shown(s.default)}")
        lines += textwrap.wrap(s.meaning, WIDTH, initial_indent="      ", subsequent_indent="      ")
    return [*lines, ""]


def _shown(value: Any) -> str:
    if value is None:
        return "null"
    if isinstance(value, bool):
        return str(value).lower()
    if isinstance(value, list) and len(str(value)) > WIDTH // 2:
        return f"[{value[0]}, ... {len(value)} in all]"
    return str(value).replace("'", "")


def options_with(setting: str) -> list[str]:
    """``evaluator=ray`` for ``evaluator.workers``: the choices that have a setting."""
    group = setting.partition(".")[0]
    return [f"{group}={name}" for name, keys in _by_choice(group).items() if setting in keys]


def settings_of(group: str) -> list[str]:
    """All settings that any choice of a group has, with the group's name before them."""
    return sorted({key for keys in _by_choice(group).values() for key in keys})


def _by_choice(group: str) -> dict[str, list[str]]:
    files = sorted((config_folder() / group).glob("*.yaml")) if group else []
    return {p.stem: [s.key for s in settings_in(p, "" if group == "task" else group)] for p in files}


def _default(conf: Path, group: str) -> str:
    """The option of a group that is taken where none is named."""
    tree = OmegaConf.to_container(OmegaConf.load(conf / "config.yaml"), resolve=False)
    chosen = [e[group] for e in _at(tree, ["defaults"]) if isinstance(e, dict) and group in e]
    return str(chosen[0]) if chosen else ""


def _first_line(name: str) -> str:
    """The first sentence of a verb's module; it is read, not imported, which would take seconds."""
    module = Path(__file__).parents[1].joinpath(*module_of(name).split(".")[1:]).with_suffix(".py")
    text = ast.get_docstring(ast.parse(module.read_text(encoding="utf-8"))) or ""
    return text.splitlines()[0]
