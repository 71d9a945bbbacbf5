"""From Hydra's composed tree to typed settings, and from a command line as people type it to one Hydra accepts."""

from __future__ import annotations

import hashlib
import importlib
import re
from pathlib import Path
from types import ModuleType
from typing import Any, NoReturn

from hydra._internal.utils import get_args_parser
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.core.override_parser.types import ChoiceSweep, RangeSweep
from omegaconf import DictConfig, OmegaConf
from omegaconf.errors import OmegaConfBaseException

from ee_dist.basics.quoted import short
from ee_dist.effects.catalogue import find
from ee_dist.effects.plugins import load_plugin
from ee_dist.tasks.config import Config, ConfigError, Handling, check_keys, groups_of, one_of

TASKS = (
    "recover",
    "view",
    "online",
    "study",
    "trial",
    "compare",
    "explain",
    "improve",
    "plan",
    "reveal",
    "import",
    "robot",
    "export",
    "workbench",
)
USED_BY = {
    "scenario": (("recover", "online"), "what task=trial hides is hidden=..."),
    "system": (("recover",), "the others know robots only"),
    "robot": (
        ("recover", "online", "trial", "import", "workbench"),
        "task=robot reads urdf=FILE or mjcf=FILE, the others take the robot from the log or the model file",
    ),
    "measured": (
        ("compare", "explain", "improve", "import", "plan", "workbench"),
        "a run or recording to look at is log=...",
    ),
    "trials": (
        ("compare", "explain", "improve", "plan"),
        "what task=import takes in is said by its mapping",
    ),
    "held_out": (("compare", "explain", "improve", "plan"), ""),
    "model": (("compare", "explain", "improve", "export", "plan", "workbench"), ""),
    "effect": (("improve",), "what explain tries is task.only=[...], what a trial hides is hidden=..."),
    "hidden": (("trial",), "what recover and online break is +scenario=..."),
    "log": (("view", "study", "reveal", "workbench"), "what the others read is measured=..."),
    "urdf": (("robot",), "elsewhere a robot's file is robot=urdf robot.urdf=..."),
    "mjcf": (("robot",), "elsewhere a robot's file is robot=mjcf robot.file=..."),
    "to": (("export",), ""),
    "hardware": (("recover", "trial"), ""),
    "metric": (("recover",), ""),
    "repair": (("recover",), ""),
    "budget": (("recover", "online"), ""),
    "noise": (
        ("recover", "trial"),
        "the others go by the noise that the description's sensors declare, or estimate it",
    ),
}
"""Settings that some verbs would pass over in silence: the verbs that have them, and what the others go by."""
LONGEST_NAME = 255
"""Characters of the folder name of a job of a sweep, as many as file systems take."""
_OPENS = re.compile(r"^\+{0,2}(measured|log)=(?!null$)")
_ELSEWHERE = {"import": "ee_dist.tasks.import_", "workbench": "ee_dist.workbench.task"}
"""Modules of verbs that do not have the name of the verb: the workbench stands above all tasks, which it runs."""
_SWEEP = ("-m", "--multirun")
MOST_RUNS = 10_000
_RESUME = re.compile(r"^\+{0,2}resume=(?!null$)(.+)$")
_OUTSIDE = re.compile(r"^[+~]{0,2}hydra\.output_subdir\b(?!=null$)")
NEEDED = ("task", "robot", "engine", "evaluator", "metric", "budget", "repair")
"""Groups without which the settings fall back to what nobody chose."""
_NO_CHOICE = re.compile(r"^\+{0,2}(\w+)=(true|false|null|nan|[-+]?inf|[-+]?[0-9][0-9_.eE+-]*|[\[{].*)$", re.IGNORECASE)
_AT_HOME = re.compile(r"^\+{0,2}([\w.]{1,80})=~(.*)$")
_SCENARIO = re.compile(r"^(\+{0,2}scenario)=([-0-9, ]+)$")


def quoted(arguments: list[str]) -> list[str]:
    """Quote bare integers of the scenario override: Hydra takes a group's choice only as a string."""

    def quote(argument: str) -> str:
        match = _SCENARIO.match(argument)
        if not match:
            return argument
        numbers = ",".join(f"'{n.strip()}'" for n in match.group(2).split(",") if n.strip())
        return f"{match.group(1)}={numbers}"

    # The parser of the command line takes flags only where they stand together.
    sweep = [a for a in arguments if a in _SWEEP]
    where = "hydra.sweep.dir" if sweep else "hydra.run.dir"
    resumed = [m.group(1) for a in arguments if (m := _RESUME.match(a))]
    arguments = [*arguments, *(f"{where}={folder}" for folder in resumed)]
    return [*sweep, *(quote(a) for a in arguments if a not in _SWEEP)]


def check_flags(arguments: list[str]) -> None:
    """Raises ConfigError for a flag that there is not: the parser itself would print eight lines."""

    def complain(message: str) -> NoReturn:
        raise ConfigError(f"{short(message)}; settings are written key=value, and --help lists them")

    parser = get_args_parser()
    parser.error = complain  # type: ignore[method-assign]
    for setting in parser.parse_args(arguments).overrides:
        if not setting.lstrip("+~").partition("=")[0].strip():
            raise ConfigError(f"{short(setting)}: which setting? they are written key=value, and --help lists them")
        _check_choice(setting)
        group = setting[1:].partition("=")[0] if setting.startswith("~") else ""
        if group in NEEDED:
            raise ConfigError(f"{short(setting)}: a run needs one; choose it with {group}=NAME, or say nothing of it")
        if _OUTSIDE.match(setting):
            raise ConfigError(
                f"{short(setting)}: a run writes its settings itself, into the folder config; leave it out"
            )
        at_home = _AT_HOME.match(setting)
        if at_home:
            key, rest = at_home.groups()
            raise ConfigError(f"{key}=~: the shell puts in no home folder here; write {key}=$HOME{short(rest)}")
        key, _, value = setting.lstrip("+").partition("=")
        if key == "resume" and (not value or value[0] in "[{"):
            raise ConfigError(
                f"resume={short(value)}: which folder? name that of a run that was stopped, such as resume=logs/recover/..."
            )
    folders = [a.partition("=")[2] for a in arguments if re.match(r"\+{0,2}hydra\.(run|sweep)\.dir=", a)]
    if len({*folders}) > 1 and any(_RESUME.match(a) for a in arguments):
        raise ConfigError(f"resume={folders[-1]}: goes on in that folder; leave out the other, {folders[0]}")


def check_sweep(arguments: list[str]) -> None:
    """Raises ConfigError for a sweep of more runs than anybody has time for: Hydra would write all of them down first."""
    if not any(a in _SWEEP for a in arguments):
        return
    runs = 1.0
    for override in OverridesParser.create().parse_overrides([a for a in arguments if not a.startswith("-")]):
        value = override.value()
        if isinstance(value, RangeSweep) and value.start is not None and value.stop is not None and value.step:
            runs *= max(0.0, (value.stop - value.start) / value.step)
        elif isinstance(value, ChoiceSweep):
            runs *= len(value.list)
    if runs > MOST_RUNS:
        raise ConfigError(f"-m: a sweep of {runs:.3g} runs; at most {MOST_RUNS} at a time")


def _check_choice(setting: str) -> None:
    """Raises ConfigError for a number or the like where a group takes a name: Hydra itself fails on it."""
    match = _NO_CHOICE.match(setting)
    if match and match.group(1) in {p.name for p in config_folder().iterdir() if p.is_dir()}:
        names = ", ".join(sorted(p.stem for p in (config_folder() / match.group(1)).glob("*.yaml")))
        raise ConfigError(f"{match.group(1)}={short(match.group(2))}: no such choice; there are: {names}")


def check_used(overrides: list[str], task: str) -> None:
    """Raises ConfigError for a setting that the verb would pass over in silence."""
    for override in overrides:
        name, _, value = override.lstrip("+").partition("=")
        verbs, instead = USED_BY.get(name.partition(".")[0], ((task,), ""))
        if task not in verbs and value != "null":
            *most, last = (f"task={v}" for v in verbs)
            having = f"{', '.join(most)} and {last}" if most else last
            hint = f", {instead}" if instead else ""
            raise ConfigError(f"{short(override)}: task={task} has no use for it; it is for {having}{hint}")
        other = next((o for o in overrides if re.match(r"\+{0,2}system=", o)), None)
        if name.partition(".")[0] == "robot" and other is not None:
            raise ConfigError(f"{short(override)}: of no use beside {other}, which takes the place of the robot")
        opened = next((o for o in overrides if _OPENS.match(o)), None) if task == "workbench" else None
        if name.partition(".")[0] == "robot" and opened is not None:
            raise ConfigError(
                f"{short(override)}: of no use beside {opened}, which names the robot (with a model file, model= does); "
                "robot= is for files that are dropped on the page"
            )


def folder_name(overrides: str) -> str:
    """A job's overrides as the name of its folder, without signs that mean something to a shell. Of a longer name than file
    systems take the end is a digest of all."""
    name = re.sub(r"[^A-Za-z0-9._=-]+", "_", overrides.replace("'", "").replace("+", "")).strip("_")
    if len(name) <= LONGEST_NAME:
        return name
    digest = hashlib.sha256(overrides.encode()).hexdigest()[:16]
    return f"{name[: LONGEST_NAME - len(digest) - 1]}_{digest}"


OmegaConf.register_new_resolver("folder_name", folder_name, replace=True)


def config_folder() -> Path:
    """The folder of configs: beside the package in a checkout, inside it where it was installed."""
    package = Path(__file__).resolve().parent.parent
    for folder in (package.parent / "conf", package / "conf"):
        if (folder / "config.yaml").is_file():
            return folder
    raise ConfigError(f"no conf/config.yaml beside {package} or in it: the installation is incomplete")


def module_of(name: str) -> str:
    """The name of the module of a verb. Raises ConfigError for an unknown one."""
    return _ELSEWHERE.get(one_of("task", name, TASKS), f"ee_dist.tasks.{name}")


def task_module(name: str) -> ModuleType:
    """The module of a verb. Raises ConfigError for an unknown one."""
    return importlib.import_module(module_of(name))


_HANDLING = Handling.__dataclass_fields__


def handling(composed: DictConfig) -> Handling:
    """How the folder of the run is to be treated. Raises ConfigError."""
    found: Handling = _typed(Handling, OmegaConf.create({k: composed[k] for k in _HANDLING if k in composed}), "")
    return found


def settings(composed: DictConfig) -> tuple[Config, ModuleType, Any]:
    """Checked settings, the module of the task and its options. Raises ConfigError in one line."""
    tree = {str(k): v for k, v in composed.items() if k != "hydra" and k not in _HANDLING}
    task = tree.pop("task")
    check_keys("", tree, Config, tuple(_HANDLING))
    for name, kind in groups_of(Config).items():
        if isinstance(tree.get(name), DictConfig):
            check_keys(name, tree[name], kind)
    module = task_module(str(task.name))
    check_keys("task", task, module.Options)
    config = _typed(Config, OmegaConf.create(tree), "")
    for path in config.plugins:
        load_plugin(path)
    options = _typed(module.Options, task, "task.")
    for text in getattr(options, "without", None) or ():
        find(str(text).partition("@")[0])
    return config, module, options


def _typed(kind: Any, tree: Any, prefix: str) -> Any:
    try:
        merged = OmegaConf.merge(OmegaConf.structured(kind), tree)
        return OmegaConf.to_object(merged)
    except OmegaConfBaseException as error:
        raise ConfigError(plain(error, prefix)) from None


_EXPECTED = (
    (r"Value '(.*)' of type '.*' could not be converted to Integer", "a whole number"),
    (r"Value '(.*)' of type '.*' could not be converted to Float", "a number"),
    (r"Value '(.*)' is not a valid bool", "true or false"),
    (r"Cannot convert '(?:List|Dict)Config' to string: '(.*)'", "one value, without brackets"),
    (r"Cannot convert '(?:list|dict)' to string: '(.*)'", "a text"),
    (r"Invalid type assigned: \w+ is not a subclass of str. value: (.*)", "a text"),
    (
        r"Invalid type assigned: \w+ is not a subclass of Dict.* value: (.*)",
        "a mapping, such as {{effect: ..., target: ...}}",
    ),
    (r"Merge error: \w+ is not a subclass of \w+. value: (.*)", "settings of its own, such as {key}.NAME=..."),
    (r"field '\w+' is not Optional", "settings of its own, such as {key}.NAME=..."),
    (r"Invalid value assigned: .* is not a ListConfig", "a list, such as {key}=[one,two]"),
    (r"Cannot assign \w+ to Dict", "a list of mappings, such as [{{effect: ..., target: ...}}]"),
    (r"Incompatible value 'None' for field of type", "a value, not null"),
)
"""What OmegaConf says of a value of the wrong kind, and what would be right."""


def plain(error: OmegaConfBaseException, prefix: str = "") -> str:
    """OmegaConf's message in one line, with the key in front."""
    text = str(error.msg or error).strip().splitlines()[0]
    cause = error.__cause__
    if isinstance(cause, ValueError) and not isinstance(cause, OmegaConfBaseException):
        text = str(cause)
    key = f"{prefix}{error.full_key}" if error.full_key else ""
    for pattern, expected in _EXPECTED:
        match = re.match(pattern, text)
        if match:
            value = f"={match.group(1)}" if match.groups() else ""
            # What lies within a list has no name of its own.
            where = f"{key}{value}: " if key else f"{text}: "
            return f"{where}expected {expected.format(key=key or 'setting')}"
    return f"{key}: {text}" if key else text
