"""A finished run of explain or improve, read again: what it measured with, its best explanation and what is tied with it."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from ee_dist.basics.quoted import one_line
from ee_dist.discrepancy.accounts.of_improve import EACH
from ee_dist.discrepancy.contenders import with_others_for
from ee_dist.effects.catalogue import Hypothesis, apply, term
from ee_dist.effects.effect import EffectError
from ee_dist.effects.plugins import load_plugin
from ee_dist.robots.model import Robot
from ee_dist.robots.untrusted import UntrustedError, json_of, text_of, yaml_of
from ee_dist.tasks.config import Config, ConfigError, EngineConfig
from ee_dist.tasks.folder import SETTINGS
from ee_dist.tasks.summary import FORMAT

Explanations = list[tuple[str, Hypothesis]]
KEY = "task.explained"
LARGEST_SUMMARY = 2**28
"""Bytes."""


@dataclass(frozen=True)
class Explained:
    """``explanations``: (name, all terms of the model with it), the best first; one alone where nothing is tied with it, or
    nothing was found (then the model as it is). ``way``: of comparing; ``config``: settings that look at the same again;
    ``by_name``: what is tied with it too, of which no values were kept."""

    folder: Path
    task: str
    verdict: str
    way: str
    explanations: tuple[tuple[str, Hypothesis], ...]
    config: Config
    by_name: tuple[str, ...] = ()


def summary_of(path: Path) -> Mapping[str, Any]:
    """The summary.json in a folder, or that file. Raises ConfigError."""
    file = path / "summary.json" if path.is_dir() else path
    try:
        found = json_of(text_of(file, LARGEST_SUMMARY))
    except OSError:
        raise ConfigError(f"{KEY}={path}: no summary.json of explain or improve there") from None
    except UntrustedError as error:
        raise ConfigError(
            f"{KEY}={path}: its summary cannot be read ({one_line(str(error), 120)}); it was cut or changed: run it again"
        ) from None
    if not isinstance(found, dict) or "task" not in found:
        raise ConfigError(f"{KEY}={path}: {file.name} there is none of ours; expected that of explain or improve")
    if found.get("format", FORMAT) != FORMAT:
        raise ConfigError(
            f"{KEY}={path}: its summary has format {one_line(str(found['format']), 40)}, and this version of ee_dist knows "
            f"{FORMAT}: read it with the version that wrote it, or run it again"
        )
    return found


def explained(path: str | None, config: Config) -> Explained:
    """What a run found. ``measured``, ``model`` and engine are those of that run, unless ``config`` names others. Raises
    ConfigError."""
    if not path:
        raise ConfigError(
            f"{KEY}=: which run? name the folder of a finished explain or improve, such as {KEY}=logs/explain"
        )
    given = Path(path)
    if not given.exists():
        raise ConfigError(f"{KEY}={path}: no such folder; name that of a finished explain or improve")
    summary = summary_of(given)
    folder = given if given.is_dir() else given.parent
    read = {"explain": _of_explanation, "improve": _of_model}
    task = str(summary["task"])
    if task not in read:
        raise ConfigError(
            f"{KEY}={path}: a run of task={one_line(task, 40)}, which names no explanations; expected explain or improve"
        )
    settings = _settings(folder, config)
    try:
        found, by_name = read[task](summary)
        verdict, way, engine = str(summary["verdict"]), str(summary["way"]), str(summary["engine"])
        settings = settings if settings.engine.name == engine else replace(settings, engine=EngineConfig(engine))
    except (EffectError, KeyError, TypeError, ValueError, IndexError, AttributeError):
        raise ConfigError(
            f"{KEY}={path}: its summary is not as task={task} writes it; it was changed, or is of another version: run it again"
        ) from None
    return Explained(folder, task, verdict, way, tuple(found), settings, tuple(by_name))


def fitting(found: Explained, robot: Robot) -> None:
    """Raises ConfigError where an explanation is none of this robot: the log is another one now."""
    for name, terms in found.explanations:
        try:
            apply(robot, terms)
        except EffectError as error:
            raise ConfigError(f"{KEY}={found.folder}: {name} does not fit the robot of the log: {error}") from None


def _of_explanation(summary: Mapping[str, Any]) -> tuple[Explanations, list[str]]:
    model = _terms(summary["model_terms"])
    ranked = [c for c in summary["candidates"] if c["earned"]]
    if summary["verdict"] != "effect" or not ranked:
        return [("the model as it is", model)], []
    best = ranked[0]
    tied = [best, *(c for c in ranked[1:] if c["name"] in best["tied_with"])]
    return [(str(c["name"]), (*model, *_terms(c["terms"]))) for c in tied], []


def _of_model(summary: Mapping[str, Any]) -> tuple[Explanations, list[str]]:
    """The model in the end, and that with what a step added exchanged for what was tied with it then, or does as well in the
    end; and what was tied with the best that there is, by name alone."""
    model = _terms(summary["model_terms"])
    present = {t.name for t in model}
    found: Explanations = [("the model as it is", model)]
    by_name: list[str] = []
    for rung in summary["ladder"]:
        added = _terms(rung["added"])
        if not added or not {t.name for t in added} <= present:
            continue
        others = [(str(a.get("name", _terms([a])[0].name)), _terms(a.get("terms", [a]))) for a in rung["alternatives"]]
        others = [(name, terms) for name, terms in others if not {t.name for t in terms} <= present]
        if others and len(found) == 1:
            found = [(str(rung.get("name", added[0].name)), model)]
        found += [(name, with_others_for(model, added, terms)) for name, terms in others]
        by_name += [str(name) for name in rung.get("tied_with", ()) if not is_there(str(name), present)]
    found += [(_terms([t])[0].name, _terms(t["terms"])) for t in summary.get("twins", ())]
    return list(dict(found).items()), [name for name in dict.fromkeys(by_name) if name not in dict(found)]


def is_there(name: str, present: Collection[str]) -> bool:
    """Whether the model has what such a name says, a kind of effect at each of some joints too."""
    effect, _, place = name.partition("@")
    return name in present or (place.startswith(EACH) and any(p.startswith(f"{effect}@") for p in present))


def _terms(entries: Sequence[Mapping[str, Any]]) -> Hypothesis:
    return tuple(term(e["effect"], e["target"], **{str(k): float(v) for k, v in e["values"].items()}) for e in entries)


def _settings(folder: Path, config: Config) -> Config:
    """``config`` with measurements, model and the user's own effects of the run in the folder, where it names none itself."""
    try:
        asked, hydra = (yaml_of(folder / SETTINGS / f"{name}.yaml") for name in ("config", "hydra"))
        where = Path(hydra["hydra"]["runtime"]["cwd"])
        measured, model = asked["measured"], asked["model"]
        trials, held_out = asked.get("trials"), asked.get("held_out")
        plugins = [str(where / str(p)) for p in asked["plugins"]]
    except (OSError, ValueError, KeyError, TypeError):
        if config.measured:
            return config
        raise ConfigError(
            f"{KEY}={folder}: no settings of its run there; say measured=LOG, and model=MODEL if it had one"
        ) from None
    files = [str(where / str(m)) for m in (measured if isinstance(measured, list) else [measured])]
    for file in plugins:
        load_plugin(file)
    return replace(
        config,
        measured=config.measured or files,
        # Names of trials are those of its own log.
        trials=config.trials or (None if config.measured else trials),
        held_out=config.held_out or (None if config.measured else held_out),
        model=config.model or (None if model is None else str(where / str(model))),
        plugins=[*config.plugins, *(p for p in plugins if p not in config.plugins)],
    )
