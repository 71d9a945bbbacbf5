"""The composed configuration as typed, validated data. Hydra composes; here it is checked, in one place, in plain words."""

from __future__ import annotations

import math
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, get_args, get_type_hints

from ee_dist.basics.names import did_you_mean
from ee_dist.basics.quoted import quoted
from ee_dist.effects.catalogue import Hypothesis, from_dict
from ee_dist.evaluation.jobs import Reduction, Travel
from ee_dist.evolution.ga import Budget
from ee_dist.recovery.loop import Plan
from ee_dist.recovery.map_search import Mapping
from ee_dist.recovery.metrics import Distance, Metric, RollingMean
from ee_dist.recovery.repertoire import Repertoire
from ee_dist.trials.hardware import Limits

ENGINES = ("pybullet", "mujoco", "kinetics")
EVALUATORS = ("auto", "ray", "serial")
AUTO = "auto"
"""task.by: the way of comparing is chosen by what was measured."""
SMALL_STEPS = 1_000_000
"""Robot-steps that the repair passes of a run ask for, below which Ray takes longer to start (5 s) than it saves."""


class ConfigError(ValueError):
    """A setting that cannot be: which one, why, and what would be right."""


def within(what: str, value: float, low: float, high: float) -> None:
    """Raises ConfigError outside of [low, high]: memory and time are taken only for what can come to an end."""
    if not low <= value <= high:
        raise ConfigError(f"{what}={value}: must be from {low:,} to {high:,}".replace(",", " "))


def one_of(what: str, value: str, allowed: tuple[str, ...]) -> str:
    """The value, if it is allowed. Raises ConfigError with the nearest names."""
    if value not in allowed:
        raise ConfigError(f"{what}={value}: no such choice; {did_you_mean(value, allowed)}")
    return value


@dataclass
class RobotConfig:
    name: str = "quadruped"
    urdf: str | None = None
    file: str | None = None
    drives: str | None = None


@dataclass
class EngineConfig:
    name: str = "pybullet"
    threads: int = 0

    def __post_init__(self) -> None:
        one_of("engine", self.name, ENGINES)
        within("engine.threads", self.threads, 0, 1024)


@dataclass
class EvaluatorConfig:
    name: str = "auto"
    workers: int = 0
    chunk: int = 0
    cache: bool = True
    recent: bool = False
    """Keep the last logs whole: for a person who asks one thing after another of few motions."""

    def __post_init__(self) -> None:
        one_of("evaluator", self.name, EVALUATORS)
        within("evaluator.workers", self.workers, 0, 100_000)
        within("evaluator.chunk", self.chunk, 0, 1_000_000)


@dataclass
class RayConfig:
    address: str | None = None


@dataclass
class HardwareConfig:
    """A robot of one's own: where it answers, how long to wait for it, and what is never asked of it."""

    address: str | None = None
    begin_s: float = 60.0
    timeout_s: float = 2.0
    range_share: float = 1.0
    speed: float = math.inf
    acceleration: float = math.inf
    torque: float = math.inf

    def __post_init__(self) -> None:
        for name in ("begin_s", "timeout_s"):
            if not 0.0 < getattr(self, name) <= 3600.0:
                raise ConfigError(f"hardware.{name}={getattr(self, name)}: must be above 0 and at most 3600 (s)")
        self.limits()
        given = [f.name for f in fields(self) if getattr(self, f.name) != f.default]
        if self.address is None and given:
            raise ConfigError(
                f"hardware.{given[0]}={getattr(self, given[0]):g}: it is for a robot of your own, and none is named: "
                f"hardware.address=host:port (docs/hardware.md); a slow simulated one has command_speed in its description"
            )

    def limits(self) -> Limits:
        try:
            return Limits(self.range_share, self.speed, self.acceleration, self.torque)
        except ValueError as error:
            raise ConfigError(f"hardware.{error}") from None


@dataclass
class MetricConfig:
    name: str = "rolling_mean"
    header: int = 60
    window: int = 10

    def __post_init__(self) -> None:
        one_of("metric", self.name, ("rolling_mean", "distance"))
        self.build()

    def build(self, function: Reduction | None = None) -> Metric:
        """``function``: what a system is for, where that is not the way that a robot goes."""
        if self.name == "distance":
            return Distance(function or Travel())
        try:
            return RollingMean(self.header, self.window)
        except ValueError as error:
            raise ConfigError(str(error)) from None


_MOST = {
    "population": 100_000, "generations": 100_000, "diagnosis_population": 100_000, "diagnosis_generations": 100_000,
    "crossovers": 25_000, "compensating_trials": 1000, "steps": 1_000_000, "polish": 1000, "restarts": 1000,
}  # fmt: skip
"""Far beyond use, and still within the memory of a machine and the time of a cluster."""


@dataclass
class BudgetConfig:
    name: str = "paper"
    population: int = 200
    generations: int = 40
    diagnosis_population: int = 200
    diagnosis_generations: int = 40
    tournament: int = 3
    mutation: float = 0.01
    crossovers: int = 24
    compensating_trials: int = 4
    steps: int = 1000
    parsimony: float = 0.1
    polish: int = 8
    restarts: int = 3
    related: float = 1.0

    def __post_init__(self) -> None:
        for name, most in _MOST.items():
            within(f"budget.{name}", getattr(self, name), 0, most)
        self.plan()

    @property
    def small(self) -> bool:
        """Whether starting Ray takes longer than it saves."""
        return self.population * self.generations * self.steps * (self.compensating_trials + 1) < SMALL_STEPS

    def plan(self) -> Plan:
        shared = (self.tournament, self.mutation, self.crossovers)
        try:
            return Plan(
                repair=Budget(self.population, self.generations, *shared),
                diagnosis=Budget(self.diagnosis_population, self.diagnosis_generations, *shared),
                compensating_trials=self.compensating_trials,
                steps=self.steps,
                parsimony=self.parsimony,
                polish=self.polish,
                restarts=self.restarts,
                related=self.related,
            )
        except ValueError as error:
            raise ConfigError(str(error)) from None


@dataclass
class RepairConfig:
    """How a repair pass searches."""

    name: str = "paper"
    map_passes: int = 0
    bins: int = 8
    first: float = 0.3
    kept: float = 0.2
    narrow: float = 0.9

    def __post_init__(self) -> None:
        one_of("repair", self.name, ("paper", "gaits"))
        within("repair.map_passes", self.map_passes, 0, 1000)
        within("repair.bins", self.bins, 1, 100)
        for f in fields(self)[1:]:
            if self.name == "paper" and getattr(self, f.name) != f.default:
                raise ConfigError(f"repair.{f.name}={getattr(self, f.name)}: is of repair=gaits, not of repair=paper")
        self.build()

    def build(self) -> Repertoire | None:
        """None for the paper's own."""
        try:
            mapping = Mapping(self.bins, self.first, self.kept, self.narrow)
        except ValueError as error:
            raise ConfigError(str(error)) from None
        return None if self.name == "paper" else Repertoire(mapping, self.map_passes)


@dataclass
class ScenarioConfig:
    """``number``: of the paper's situations. Others have a ``name``."""

    number: int = -1
    name: str = ""
    title: str = ""
    changes: list[dict[str, Any]] = field(default_factory=list)

    def hidden(self) -> Hypothesis:
        """What happens to the physical robot. Raises EffectError for an unknown effect or value, ConfigError without one."""
        if self.number < 0 and not self.name and not self.changes:
            raise ConfigError("scenario: neither one of the scenarios, such as +scenario=8, nor scenario.changes=[...]")
        return tuple(from_dict(entry) for entry in self.changes)

    @property
    def label(self) -> str:
        return self.name or str(self.number)


KINETICS = "kinetics"
"""The engine of gene networks, and of nothing else."""


def _possible(value: Any) -> bool:
    return isinstance(value, (int, float)) and 0.0 <= value <= 1e6


@dataclass
class SystemConfig:
    """Another system than a robot: which, what of it a controller sees and commands, and what it is wanted for."""

    name: str = "gene_network"
    network: str = "dream4_size10_1"
    output: str = "G4"
    levels: list[Any] = field(default_factory=lambda: [[4.0, 0.3], [9.0, 0.3], [12.0, 0.5]])
    stimulated: list[str] = field(default_factory=lambda: ["G1", "G8", "G9"])
    reported: list[str] = field(default_factory=lambda: ["G2", "G4", "G5", "G7"])

    def __post_init__(self) -> None:
        one_of("system", self.name, ("gene_network",))
        one_of("system.network", self.network, ("dream4_size10_1",))
        for pair in self.levels:
            if not isinstance(pair, list) or len(pair) != 2 or not all(_possible(v) for v in pair):
                raise ConfigError(f"system.levels: {pair}; expected [hours, level] each, such as [[4, 0.3], [12, 0.6]]")


@dataclass
class Config:
    """Everything but the options of the chosen task, which are the task's own dataclass."""

    seed: int = 0
    noise: float | None = None
    """None: of task=trial its own, elsewhere none."""
    plugins: list[str] = field(default_factory=list)
    measured: Any = None
    trials: Any = None
    held_out: Any = None
    model: str | None = None
    effect: Any = None
    hidden: Any = None
    log: str | None = None
    urdf: str | None = None
    mjcf: str | None = None
    to: str | None = None
    robot: RobotConfig = field(default_factory=RobotConfig)
    engine: EngineConfig = field(default_factory=EngineConfig)
    evaluator: EvaluatorConfig = field(default_factory=EvaluatorConfig)
    ray: RayConfig = field(default_factory=RayConfig)
    hardware: HardwareConfig = field(default_factory=HardwareConfig)
    metric: MetricConfig = field(default_factory=MetricConfig)
    budget: BudgetConfig = field(default_factory=BudgetConfig)
    repair: RepairConfig = field(default_factory=RepairConfig)
    scenario: ScenarioConfig | None = None
    system: SystemConfig | None = None

    def __post_init__(self) -> None:
        if (self.engine.name == KINETICS) != (self.system is not None):
            here, right = ("a gene network", KINETICS) if self.system else ("a robot", "pybullet or engine=mujoco")
            raise ConfigError(f"engine={self.engine.name}: cannot simulate {here}; it takes engine={right}")
        if self.system is not None and self.hardware.address is not None:
            raise ConfigError(
                f"hardware.address={self.hardware.address}: is for a robot; the cells of +system={self.system.name} are simulated"
            )
        for name in self.plugins:
            if not isinstance(name, str):
                raise ConfigError(
                    f"plugins={quoted(name)}: expected names of files, such as plugins=[mine.py,other.py]"
                )
        if not 0 <= self.seed < 2**63:
            raise ConfigError(f"seed={self.seed}: must be a whole number from 0 to 2^63 - 1")
        if self.metric.name == "rolling_mean" and self.metric.header > self.budget.steps:
            raise ConfigError(
                f"metric.header={self.metric.header}: longer than a trial; must be at most budget.steps ({self.budget.steps})"
            )
        if self.noise is not None and not 0.0 <= self.noise <= 1.0:
            raise ConfigError(f"noise={self.noise}: must be a share of the channels' range, from 0 to 1")


@dataclass
class Handling:
    """How the folder of a run is treated. Decides nothing of the result, so it is not part of the recorded settings."""

    overwrite: bool = False
    resume: str | None = None


def unknown_key(owner: str, key: str, known: tuple[str, ...], otherwise: str = "") -> ConfigError:
    """``otherwise`` is said where no name is near; without it all are listed."""
    hint = did_you_mean(key, known, otherwise, cutoff=0.6)
    where = f"{owner}.{key}" if owner else key
    return ConfigError(f"{where}: no such setting; {hint}")


def groups_of(kind: Any) -> dict[str, Any]:
    """The fields of a dataclass of settings that are dataclasses of settings themselves, optional or not."""
    hints = get_type_hints(kind)
    found = {f.name: [a for a in (hints[f.name], *get_args(hints[f.name])) if is_dataclass(a)] for f in fields(kind)}
    return {name: inner[0] for name, inner in found.items() if inner}


def known_settings(kind: Any = Config, prefix: str = "") -> tuple[str, ...]:
    """Names of all settings but those of a task, with their owners: ``seed``, ``budget.population``."""
    groups = groups_of(kind)
    names = [f.name for f in fields(Handling)] if kind is Config else []
    for f in fields(kind):
        names.append(prefix + f.name)
        if f.name in groups:
            names += known_settings(groups[f.name], f"{prefix}{f.name}.")
    return tuple(names)


def check_keys(owner: str, given: Any, kind: type, others: tuple[str, ...] = ()) -> None:
    """Raise ConfigError for keys that the dataclass does not have; ``others`` are known beside its own."""
    known = (*(f.name for f in fields(kind)), *others)
    for key in given:
        if str(key) not in known:
            raise unknown_key(owner, str(key), known)
