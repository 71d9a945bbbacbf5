"""summary.json, the file other programs read: documented keys, always the same, written whole or not at all."""

from __future__ import annotations

import hashlib
import json
import math
import os
import time
from collections.abc import Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from omegaconf import DictConfig, OmegaConf

from ee_dist.basics.files import write_whole
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.plugins import text_of_plugin
from ee_dist.evaluation.ray_apart import worked_s
from ee_dist.tasks.config import Config

FORMAT = 1


def package_version() -> str:
    try:
        return version("ee_dist")
    except PackageNotFoundError:
        return "0+checkout"


def config_yaml(config: Config, options: Any) -> str:
    """All settings of a job as YAML."""
    tree = OmegaConf.to_container(OmegaConf.structured(config))
    return OmegaConf.to_yaml(OmegaConf.create({"task": OmegaConf.to_container(OmegaConf.structured(options)), **tree}))  # type: ignore[dict-item]


def config_digest(config: Config, options: Any) -> str:
    """Of the settings that decide the result: not of where and how it is computed. Of the user's own effects it is their text."""
    tree = OmegaConf.create(config_yaml(config, options))
    assert isinstance(tree, DictConfig)
    for key in ("evaluator", "ray", "plugins"):
        tree.pop(key, None)
    if config.plugins:
        tree.plugins = [text_of_plugin(path) for path in config.plugins]
    if tree.noise is None:
        tree.noise = 0.0
    elif tree.noise == 0.0 and tree.task.name == "trial":  # where it takes the place of task.noise
        tree.noise = "none"
    if tree.hardware.address is None:
        tree.pop("hardware")
    for key in ("address", "timeout_s", "begin_s", "torque"):  # these end a trial or not, and alter none
        tree.get("hardware", {}).pop(key, None)
    tree.engine.pop("threads", None)
    if tree.repair.name == "paper":  # which has no settings of its own
        tree.pop("repair")
    for key in ("system", "trials", "held_out"):  # what says nothing was not there once
        if tree[key] is None:
            tree.pop(key)
    if tree.scenario is not None and not tree.scenario.name:
        tree.scenario.pop("name")
    return hashlib.sha256(OmegaConf.to_yaml(tree, sort_keys=True).encode()).hexdigest()


def digest_of(result: Any) -> str:
    """Digest of a result that is plain data."""
    return hashlib.sha256(repr(result).encode()).hexdigest()


class Stopwatch:
    """Wall and processor time (s) since it was made, children and Ray's workers included. It stops when it is first read, so that
    terminal and summary tell one time."""

    def __init__(self) -> None:
        self.wall, self.cpu = time.monotonic(), self._cpu()
        self.stopped: tuple[float, float] | None = None

    @staticmethod
    def _cpu() -> float:
        t = os.times()
        return t.user + t.system + t.children_user + t.children_system + worked_s()

    def read(self) -> tuple[float, float]:
        self.stopped = self.stopped or (time.monotonic() - self.wall, self._cpu() - self.cpu)
        return self.stopped


def hypothesis_list(hypothesis: Hypothesis) -> list[dict[str, Any]]:
    """[{effect, target, values}]."""
    return [{"effect": t.effect, "target": t.target, "values": dict(t.values)} for t in hypothesis]


def write_summary(
    out: Path, task: str, config: Config, options: Any, watch: Stopwatch, result_digest: str, rest: Mapping[str, Any]
) -> Path:
    """Write ``out/summary.json``. Numbers that are not finite become null: JSON has none."""
    wall, cpu = watch.read()
    content = {
        "format": FORMAT,
        "task": task,
        "version": package_version(),
        "config_digest": config_digest(config, options),
        "result_digest": result_digest,
        "seed": config.seed,
        "engine": config.engine.name,
        "wall_s": round(wall, 3),
        "cpu_s": round(cpu, 3),
        **rest,
    }
    path = out / "summary.json"
    write_whole(path, json.dumps(_finite(content), indent=2, allow_nan=False) + "\n")
    return path


def _finite(value: Any) -> Any:
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Mapping):
        return {str(k): _finite(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(v) for v in value]
    return value
