"""task=trial: a simulated physical robot with a hidden change is tried, and only what its sensors said is written down."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.table import Table

from ee_dist.basics.files import write_whole
from ee_dist.basics.names import listed
from ee_dist.discrepancy.draw import draw
from ee_dist.discrepancy.measured_trial import driver_of
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.effects.catalogue import Hypothesis, Term, apply, find, from_dict, term
from ee_dist.effects.described import check_written
from ee_dist.effects.effect import EffectError
from ee_dist.effects.fixture import STAND
from ee_dist.engines.drivers import Commands
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.recording.records import HARDWARE, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.instruments import with_motor_torques
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.results.commands import asked, command
from ee_dist.tasks.scene import drawn
from ee_dist.tasks.seal import FILE, sealed
from ee_dist.tasks.summary import Stopwatch, package_version, write_summary
from ee_dist.tasks.terminal import terminal
from ee_dist.tasks.unfinished import remembered
from ee_dist.tasks.wiring import build_robot, engine_maker, hardware_of
from ee_dist.trials.excitation import Excitation, parse
from ee_dist.trials.hardware import Hardware
from ee_dist.trials.log import SensorLog
from ee_dist.trials.noise import with_noise

TYPICAL = 0.35
"""How far from neutral, as a share of the range worth trying, an effect chosen by name alone is put."""


@dataclass
class Options:
    name: str = "trial"
    excitations: list[str] = field(default_factory=list)
    repeats: int = 2
    noise: float = 0.02
    motor_torque: bool = False

    def __post_init__(self) -> None:
        if self.repeats < 1:
            raise ConfigError(f"task.repeats={self.repeats}: must be 1 or more")
        if not 0 <= self.noise <= 1:
            raise ConfigError(f"task.noise={self.noise}: must be a share of the channels' range, from 0 to 1")
        if not self.excitations:
            raise ConfigError("task.excitations: name at least one, such as task.excitations=[multisine]")


def run(config: Config, options: Options, out: Path) -> None:
    """Write trial.mcap, sealed.json, trial.rrd and summary.json into ``out``."""
    console, watch = terminal(), Stopwatch()
    seeds = np.random.SeedSequence(config.seed)
    hidden_seed, noise_seed = seeds.spawn(2)
    engine = engine_maker(config, alone=True)()
    described = build_robot(config)
    if options.motor_torque:
        described = with_motor_torques(described)
    noise = options.noise if config.noise is None else config.noise
    robot = with_noise(described, noise)
    if not robot.drives:
        raise ConfigError(
            f"robot: {robot.name} has no drives, so nothing moves it; name them with robot.drives=FILE.yaml, which "
            "'task=robot urdf=FILE.urdf' begins"
        )
    hidden = hypothesis(config.hidden, robot, hidden_seed)
    apply(robot, hidden)
    plan = [parse(text) for text in options.excitations]
    for excitation in plan:
        excitation.steps(robot)  # too many are refused before the envelope is written
    body = hardware_of(config, robot)
    if body is not None and (hidden or any(e.fixture != "floor" for e in plan)):
        raise ConfigError(
            f"hardware.address={config.hardware.address}: a robot of your own hides what it hides, and stands on its "
            "floor: leave out hidden, and name task.excitations without fixture=stand"
        )
    text, digest = sealed({"hidden": [t.as_dict() for t in hidden], "seed": config.seed, "engine": config.engine.name})
    metadata = {
        "task": "trial",
        "version": package_version(),
        "engine": config.engine.name,
        "noise": str(noise),
        **({} if body is not None else {"seal": digest}),
        "trials": json.dumps([e.as_dict() for e in plan * options.repeats]),
    }
    floor_seed, stand_seed = noise_seed.spawn(2)
    hardware = {
        "floor": PhysicalRobot(engine, robot, hidden, floor_seed),
        "stand": PhysicalRobot(engine, robot, (*hidden, term(STAND)), stand_seed),
    }
    tried = {name: remembered(name, body or simulated, robot) for name, simulated in hardware.items()}
    path, sums = out / "trial.mcap", hashlib.sha256()
    what = "of your own" if body else "nothing hidden" if config.hidden is None else "hidden change sealed"
    table = Table(title=f"Trials of {robot.name}, {what}", title_justify="left")
    for column in ("trial", "what was done", "seconds", "rows"):
        table.add_column(column)
    # The truth before the log that is sealed with it: a log without its envelope could never be opened.
    if body is None:
        write_whole(out / FILE, text)
    with RunWriter(path, robot, metadata) as writer:
        for k, excitation in enumerate(plan * options.repeats):
            log, record = one_trial(tried[excitation.fixture], excitation, robot, k, body is not None)
            writer.trial(record)
            sums.update(np.ascontiguousarray(log.sensors).tobytes())
            table.add_row(str(k + 1), str(excitation), f"{excitation.seconds:g}", str(len(log)))
        writer.finish({"result_digest": sums.hexdigest()})
    engine.close()
    console.print(table)
    if body is None:
        told = f"Noise: {100 * noise:.3g} % of each channel's range. Seal {digest[:16]}."
        console.print(told, highlight=False)
    write_summary(out, "trial", config, options, watch, sums.hexdigest(), {
        "trials": [e.as_dict() for e in plan * options.repeats], "noise": noise,
        "seal": None if body else digest,
        "log": str(path), "channels": [{"name": s.name, "unit": s.unit} for s in robot.sensors],
    })  # fmt: skip
    scene = drawn(path)
    files = [("log", path), ("rerun", scene), *([] if body else [("truth", out / FILE)])]
    for label, file in files:
        console.print(f"  {label:<10}{os.path.relpath(file)}", highlight=False, soft_wrap=True)
    following = command(asked("explain", replace(config, measured=str(path))))
    console.print(f"Next: {following}", highlight=False, markup=False, soft_wrap=True)


def one_trial(
    hardware: Hardware, excitation: Excitation, robot: Robot, index: int, own: bool = False
) -> tuple[SensorLog, TrialRecord]:
    """Run it, and write down what the experimenter knows: what was sent, and what the sensors said.

    ``own``: the log of a robot of one's own, whose commands are those that were sent.
    """
    driver = driver_of(excitation, robot)
    log = hardware.trial(driver, excitation.steps(robot))
    if isinstance(driver, Commands) and not own:
        # What reached the drives behind faulty wiring is not known to who sent the commands.
        log = replace(log, commands=np.array(driver.values[: len(log)]))
    log = replace(log, torques=None)
    return log, TrialRecord(index, excitation.told(robot), HARDWARE, driver, log)


def hypothesis(asked: Any, robot: Robot, seed: np.random.SeedSequence) -> Hypothesis:
    """The hidden change as asked for: none, ``random``, ``effect@target``, or a list of entries. Raises ConfigError."""
    if asked is None or asked == "none" or asked == []:
        return ()
    if asked == "random":
        return (draw(robot, np.random.default_rng(seed))[1],)
    if isinstance(asked, str):
        return tuple(_by_name(robot, part) for part in asked.split(";"))
    if isinstance(asked, Mapping):
        asked = [asked]
    if not isinstance(asked, (list, tuple)):
        raise ConfigError(
            f"hidden={asked}: give effect@target, random, or a list such as [{{effect: ..., target: ...}}]"
        )
    terms = tuple(from_dict(e) if isinstance(e, Mapping) else _by_name(robot, str(e)) for e in asked)
    check_written(robot, terms)
    return terms


def _by_name(robot: Robot, text: str) -> Term:
    name, at, target = text.strip().partition("@")
    targets = find(name).targets(robot)
    if at and not target and targets:
        raise EffectError(f"hidden={text}: where? it can act on: {listed(targets)}")
    if not targets:
        raise EffectError(f"{name} cannot act on {robot.name}: it has no place for it")
    chosen = candidate(robot, name, target or targets[0])
    return chosen.term([(u if u else low) * TYPICAL for u, low in zip(chosen.upper, chosen.lower, strict=True)])
