"""Concrete parts from settings: robot, engine, evaluator. Tasks build with these and nothing else does."""

from __future__ import annotations

import atexit
import gc
import os
from dataclasses import dataclass, replace

from ee_dist.basics.cores import usable
from ee_dist.effects.plugins import load_plugin, text_of_plugin
from ee_dist.engines.contract import Engine
from ee_dist.evaluation.cache import CachedEvaluator
from ee_dist.evaluation.jobs import Evaluator
from ee_dist.evaluation.journal import JournaledEvaluator
from ee_dist.evaluation.ray_apart import RayApart, stop_ray
from ee_dist.evaluation.recent import RecentEvaluator
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.evaluation.socket_body import SocketBody
from ee_dist.evaluation.stepped import SteppedRobot
from ee_dist.networks.dream4 import dream4
from ee_dist.robots.describe import robot_of
from ee_dist.robots.model import Robot
from ee_dist.robots.system import System
from ee_dist.tasks.config import KINETICS, Config
from ee_dist.tasks.unfinished import note_in

ONE_JOINT = "one_joint"
HOUR_S = 3600.0
LARGE = 1024
"""Robots of one joint that are simulated in one batch."""


@dataclass(frozen=True)
class EngineMaker:
    """Makes an engine in whatever process it is called; picklable. Loads the user's own effects there first: ``plugins`` are
    files and the digests of their texts, of which no other will do."""

    name: str
    threads: int = 1
    plugins: tuple[tuple[str, str], ...] = ()

    def __call__(self) -> Engine:
        for path, text in self.plugins:
            load_plugin(path, text)
        # An engine is imported where it is used: a run with one does not wait for the other.
        if self.name == ONE_JOINT:
            from ee_dist.engines.one_joint import OneJointEngine

            return OneJointEngine(LARGE)
        if self.name == KINETICS:
            from ee_dist.engines.kinetics.engine import KineticsEngine

            return KineticsEngine()
        if self.name == "mujoco":
            from ee_dist.engines.mujoco.engine import MuJoCoEngine

            return MuJoCoEngine(threads=self.threads)
        from ee_dist.engines.pybullet.engine import PyBulletEngine

        return PyBulletEngine()


def engine_maker(config: Config, alone: bool, name: str = "") -> EngineMaker:
    """``alone``: whether the engine has the machine for itself, or shares its cores with other workers. ``name``: another
    engine than the one of the settings."""
    threads = config.engine.threads or (usable() if alone else 1)
    plugins = tuple((os.path.abspath(p), text_of_plugin(p)) for p in config.plugins)
    return EngineMaker(name or config.engine.name, threads, plugins)


def build_robot(config: Config) -> Robot:
    """The robot by name. Raises RobotError for an unknown one."""
    return robot_of(config.robot.name, config.robot.urdf, config.robot.drives)[0]


def build_system(config: Config) -> System:
    """What the loop works on: the robot, or the system that was chosen instead. Raises RobotError for a name it does not have."""
    chosen = config.system
    if chosen is None:
        return build_robot(config)
    levels = tuple((float(hours) * HOUR_S, float(level)) for hours, level in chosen.levels)
    return dream4(chosen.output, levels, tuple(chosen.stimulated), tuple(chosen.reported))


def hardware_of(config: Config, robot: System) -> SteppedRobot | None:
    """The user's own robot, where ``hardware.address`` names one. Raises HardwareError for an address that is none."""
    own = config.hardware
    if not own.address or not isinstance(robot, Robot):
        return None
    return SteppedRobot(SocketBody(own.address, own.timeout_s, own.begin_s), robot, own.limits())


_kept: dict[tuple[object, str], Evaluator] = {}
"""By settings and engine."""


def evaluator_name(config: Config) -> str:
    """``serial`` or ``ray``: as asked for, or (``auto``) by the size of what is to be simulated."""
    settings = config.evaluator
    if settings.name != "auto":
        return settings.name
    return "serial" if config.budget.small and not settings.workers and not config.ray.address else "ray"


def for_few(config: Config) -> Config:
    """Settings for a handful of rollouts: Ray takes longer to start than they do, unless it is asked for."""
    asked = config.evaluator.name != "auto" or config.evaluator.workers or config.ray.address
    return config if asked else replace(config, evaluator=replace(config.evaluator, name="serial"))


def evaluator_of(config: Config, engine: str = "") -> Evaluator:
    """The evaluator of these settings, its counts at zero. Raises EvaluatorError where Ray cannot be reached.

    The jobs of a sweep run one after the other in this process and share it: its warm worlds and actors, and what it
    simulated already. A sweep over scenarios evolves the intact robot's controllers once.
    """
    settings = config.evaluator
    name = evaluator_name(config)
    key = (
        name,
        settings.workers,
        settings.chunk,
        settings.cache,
        settings.recent,
        config.ray.address,
        engine_maker(config, True),
    )
    if any(settled != key for settled, _ in _kept):
        close_evaluators()
    # A run may ask for several engines: a plan for the usual one while its problem goes on being simulated by that of one joint.
    if (key, engine) not in _kept:
        inner: Evaluator
        chunk = LARGE if engine == ONE_JOINT else 256
        if name == "serial":
            inner = SerialEvaluator(engine_maker(config, True, engine)(), settings.chunk or chunk)
        else:
            inner = RayApart(engine_maker(config, False, engine), settings.workers, settings.chunk, config.ray.address)
        inner = JournaledEvaluator(RecentEvaluator(inner) if settings.recent else inner)
        _kept[key, engine] = CachedEvaluator(inner) if settings.cache else inner
    evaluator = _kept[key, engine]
    evaluator.counts.reset()
    note_in(evaluator)
    return evaluator


def close_evaluators() -> None:
    """End the actors and close the worlds of all evaluators made so far."""
    while _kept:
        _kept.popitem()[1].close()


@atexit.register
def _leave() -> None:
    close_evaluators()
    stop_ray()
    # Memory goes back with the process. To look through it for garbage first takes half a second.
    gc.freeze()
