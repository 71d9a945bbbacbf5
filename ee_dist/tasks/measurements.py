"""What was measured, as trials, and the model they are to be compared with."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.basics.files import named, repeated
from ee_dist.basics.names import counted, listed, nearest
from ee_dist.basics.quoted import quoted
from ee_dist.discrepancy.lags import with_lags
from ee_dist.discrepancy.measured_trial import MeasuredTrial, setup_of
from ee_dist.discrepancy.ways.open_loop.scale import channel_scale
from ee_dist.discrepancy.ways.open_loop.unmodelled import Unmodelled, from_entries
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.effects.model_file import read_model
from ee_dist.measurements.commanded import disobeying
from ee_dist.measurements.jumps import jumping
from ee_dist.measurements.mapping import BETWEEN, ESTIMATED, HELD_IF, LINES
from ee_dist.measurements.need import held_beyond
from ee_dist.measurements.taking import taking
from ee_dist.recording.reader import read_run
from ee_dist.recording.records import HARDWARE, RunRecord
from ee_dist.robots.agree import agreed, changed_sources, differences
from ee_dist.robots.describe import BUILT_IN
from ee_dist.robots.model import Robot
from ee_dist.robots.reached import with_room
from ee_dist.robots.untrusted import json_of, yaml_of
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.trial_choice import TrialName, divided, entries
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import LogError, SensorLog

FEWEST_ROWS, FEWEST_OF_MANY = 60, 30
"""Readings of a joint that a trial must hold, and of all at once where there are several."""
SHOWN = 4
"""Differences between two robots that are told."""


@dataclass(frozen=True, eq=False)
class Measurements:
    """Trials of a robot. ``model`` is what the robot is believed to have; ``source`` how a model file names the robot."""

    robot: Robot
    trials: tuple[MeasuredTrial, ...]
    files: tuple[Path, ...]
    model: Hypothesis
    source: Any
    folder: Path
    unmodelled: Unmodelled | None = None
    """What the model is known to leave on an untouched robot (from calibration)."""
    gained: float = 0.0
    """Energy that the most promising effect took off there."""
    calibrated_by: str = ""
    """The way of comparing that the calibration was made with; empty without one."""
    remarks: tuple[str, ...] = ()
    """What a user should know of before reading any result: where model and log name different robots."""
    held_out: tuple[str, ...] = ()
    """Names of trials that are none of these: they were kept for the last word on a model."""
    read: tuple[tuple[Path, str], ...] = ()
    """Every recording that was read, what is held out too, with the seal of the truth beside it, if it has one."""

    @property
    def real(self) -> bool:
        """Whether no trial is of a simulation of ours: the robot is somebody's hardware, or was simulated elsewhere."""
        return all(t.real for t in self.trials)


def load(config: Config) -> Measurements:
    """The trials in the files of ``config.measured`` that ``config.trials`` and ``config.held_out`` leave, and the model of
    ``config.model``. Raises ConfigError, LogError, RecordingError."""
    if config.model == "":
        raise ConfigError("model=: which model file? leave it out for the robot as it is described")
    files = files_of(config.measured)
    runs = [read_run(f) for f in files]
    made_of_others = {name for run in runs for name in _estimated(run)}
    runs = [_as_measured(run, made_of_others) for run in runs]
    robot = runs[0].robot
    trials: list[MeasuredTrial] = []
    names: list[TrialName] = []
    of_file: list[Path] = []
    short: list[tuple[str, SensorLog]] = []
    for file, run in zip(files, runs, strict=True):
        _same_robot(file, run, robot)
        found = [t for t in run.trials if t.source == HARDWARE]
        if not found:
            why = (
                "no whole hardware trial in it: it was cut or damaged"
                if not run.complete
                else "no hardware trial in it"
            )
            raise LogError(f"{file}: {why}; expected a log of task=trial or task=import")
        held = _held(file, run)
        for t in found:
            if not _enough(t.log):
                short.append((f"{file}, {t.name}", t.log))
                continue
            # What an import says about a trial (a gain, a payload) comes on top of how it was held.
            setup = (*(held[t.index] if t.index < len(held) else ()), *t.believed)
            log, hardware = checked(t.log, robot, f"{file}, {t.name}"), _hardware(run)
            between = run.metadata.get(BETWEEN, "")
            held_so = HELD_IF.get(between) if hardware else False
            trials.append(
                MeasuredTrial(
                    t.name,
                    log,
                    t.driver,
                    setup,
                    held_so,
                    hardware,
                    between == LINES,
                    not_recorded=frozenset(t.not_recorded),
                    number=len(trials) + 1,
                )
            )
            names.append(TrialName(len(trials), file.stem, t.name))
            of_file.append(file)
    if not trials:
        raise LogError(_too_short(*short[0]))
    read = tuple((file, run.metadata.get("seal", "")) for file, run in zip(files, runs, strict=True))
    kept, apart = divided(names, config.trials, config.held_out)
    trials, files = [trials[k] for k in kept], list(dict.fromkeys(of_file[k] for k in kept))
    held_out = tuple(f"{names[k].number}. {names[k].name}" for k in apart)
    remarks = [_incomplete(file, run) for file, run in zip(files, runs, strict=True) if not run.complete]
    remarks += [line for run in runs for line in changed_sources(run.metadata)]
    real = [t for t in trials if t.real]
    logs = [(t.name, t.log) for t in real]
    remarks += taking(robot, logs)
    remarks += held_beyond([apply(robot, t.setup) for t in real], logs)
    remarks += disobeying(robot, logs)
    remarks += jumping(robot, [(t.name, t.log) for t in trials])
    if short:
        others = listed(where.partition(", ")[2] for where, _ in short[1:])
        more = f"; as short: {others}" if others else ""
        remarks.append(f"Left out: {_too_short(*short[0])}{more}.")
    if config.model is None:
        robot = _with_room(robot, trials, remarks)
        # By name only where the name says all: a log may bring sensors of its own, or a body with other numbers.
        named = robot.name in BUILT_IN and not differences(BUILT_IN[robot.name](), robot)
        source = robot.name if named else robot
        lagged = with_lags(robot, trials)
        return Measurements(
            lagged,
            tuple(trials),
            tuple(files),
            (),
            source,
            Path.cwd(),
            remarks=tuple(remarks),
            held_out=held_out,
            read=read,
        )
    believed = read_model(config.model)
    robot, different = agreed(without_sensors(believed.robot, made_of_others), robot, f"model={config.model}")
    robot = _with_room(robot, trials, remarks)
    if different:
        remarks.append(f"The model's robot is used; it has otherwise than the log's: {'; '.join(different[:SHOWN])}")
    apply(robot, believed.terms)
    left, gained, by = _calibration(Path(config.model), robot)
    return Measurements(
        with_lags(robot, trials),
        tuple(trials),
        tuple(files),
        believed.terms,
        believed.source,
        believed.folder,
        left,
        gained,
        by,
        tuple(remarks),
        held_out,
        read,
    )


def of_held_out(config: Config) -> Config | None:
    """Settings that look at the trials that ``config.held_out`` names, alone; None where it names none."""
    return replace(config, trials=config.held_out, held_out=None) if entries(config.held_out) else None


def load_held_out(config: Config) -> Measurements | None:
    """Those trials; None where none are named. Raises as ``load`` does."""
    alone = of_held_out(config)
    return None if alone is None else load(alone)


def _incomplete(file: Path, run: RunRecord) -> str:
    """That something of a recording is missing, and what of it is used."""
    there = [t.name for t in run.trials if t.source == HARDWARE]
    made = len(json_of(run.metadata.get("trials", "[]")))
    of = f" of {made}" if made > len(there) else ""
    return (
        f"{file} is not complete: it was cut, damaged, or its run was stopped. Only what is whole in it is used: "
        f"{counted(len(there), 'trial')}{of} ({listed(there)})."
    )


def _with_room(robot: Robot, trials: Sequence[MeasuredTrial], remarks: list[str]) -> Robot:
    """The robot without the stops that real trials pass, which goes into the ``remarks``."""
    robot, passed = with_room(robot, [t.log.sensors for t in trials if t.real])
    remarks += [
        f"{line}; the model's stop is moved there. Is the description's zero another one, or its stop elsewhere?"
        for line in passed
    ]
    return robot


def _as_measured(run: RunRecord, gone: Collection[str]) -> RunRecord:
    """The run without channels that nobody measured: speeds made of positions are no evidence beside these."""
    if not gone:
        return run
    trials = [replace(t, log=t.log.without(gone)) for t in run.trials]
    return replace(run, robot=without_sensors(run.robot, gone), trials=trials)


def _estimated(run: RunRecord) -> set[str]:
    found = json_of(run.metadata.get(ESTIMATED, "[]"))
    return {name for name in found if isinstance(name, str)} if isinstance(found, list) else set()


def without_sensors(robot: Robot, names: Collection[str]) -> Robot:
    """The robot without some sensors; itself where it has none of them."""
    left = tuple(s for s in robot.sensors if s.name not in names)
    return robot if len(left) == len(robot.sensors) else replace(robot, sensors=left)


def _hardware(run: RunRecord) -> bool:
    """Whether it is no simulation of ours, whose drives do not hold their commands."""
    return run.metadata.get("task") == "import" or (run.metadata.get("task") == "trial" and "seal" not in run.metadata)


def with_known_noise(measured: Measurements) -> Robot:
    """The robot of the measurements, its sensors as noisy as these say where it declares no noise."""
    robot = measured.robot
    noise = channel_scale(robot, measured.trials).noise
    return replace(robot, sensors=tuple(replace(s, noise=float(n)) for s, n in zip(robot.sensors, noise, strict=True)))


def _held(file: Path, run: RunRecord) -> list[Any]:
    """How the robot was held in each trial, where the log tells it. Raises LogError for what task=trial does not write."""
    try:
        return [setup_of(Excitation(**e)) for e in json_of(run.metadata.get("trials", "[]"))]
    except (TypeError, ValueError) as error:
        raise LogError(
            f"{file}: what it says of its trials is damaged ({str(error)[:80]}); make the trials again"
        ) from None


def files_of(measured: Any) -> list[Path]:
    """The recordings that ``measured`` names: one, several, all that match a pattern, or all in a folder. Raises ConfigError."""
    if not measured:
        raise ConfigError("measured=: which log? name an .mcap, several as [a.mcap,b.mcap], or the folder of a trial")
    found: list[Path] = []
    for path in named(measured):
        if path.is_dir():
            inside = sorted(path.glob("*.mcap"))
            if not inside:
                raise ConfigError(f"measured={path}: no .mcap in this folder; other formats come in with task=import")
            found += inside
        elif path.exists() and not path.is_file():
            raise ConfigError(f"measured={path}: not an ordinary file; name a recording (.mcap)")
        elif not path.is_file():
            folders = dict.fromkeys(p.parent.name for p in path.parent.glob("*/*.mcap") if not path.suffix)
            near = nearest(path.name, folders, cutoff=0.6)
            near = near or nearest(path.name, [p.name for p in path.parent.glob("*.mcap") if p.is_file()], cutoff=0.3)
            hint = f"; did you mean {' or '.join(near)}?" if near else ""
            raise ConfigError(f"measured={path}: no such file{hint}")
        elif path.suffix.lower() != ".mcap" and _of_others(path):
            raise ConfigError(f"measured={path}: not a recording; bring it in first: task=import measured={path}")
        else:
            found.append(path)
    if (twice := repeated(found)) is not None:
        # What is held out would be what was fitted.
        raise ConfigError(f"measured={twice}: the same log twice; name each once")
    return found


def _of_others(path: Path) -> bool:
    from ee_dist.measurements.readers import FORMATS  # slow to load, and only this mistake needs it

    return path.suffix.lower() in FORMATS


def checked(log: SensorLog, robot: Robot, where: str) -> SensorLog:
    """The log with its channels in the robot's order. Raises LogError in one line for what cannot be compared."""
    if not _enough(log):
        raise LogError(_too_short(where, log))
    _names(where, "joint", log.motor_names, robot.motor_names)
    _names(where, "channel", log.sensor_names, robot.sensor_names)
    order = [log.sensor_names.index(n) for n in robot.sensor_names]
    for k, sensor in zip(order, robot.sensors, strict=True):
        if log.sensor_units[k] != sensor.unit:
            raise LogError(
                f"{where}: {sensor.name} is in {quoted(log.sensor_units[k])}, the model has it "
                f"in {quoted(sensor.unit)}; convert it"
            )
        bad = ~np.isfinite(log.sensors[:, k])
        if bad.any():
            row = int(np.argmax(bad))
            raise LogError(
                f"{where}: {sensor.name} is not a number in {int(bad.sum())} rows, first at {log.times_s[row]:g} s"
            )
    if np.isinf(log.commands).any():
        raise LogError(f"{where}: commands hold values that are not numbers")
    step = np.diff(log.times_s)
    if abs(float(np.median(step)) - robot.time_step_s) > 1e-6 or float(np.ptp(step)) > 1e-6:
        raise LogError(
            f"{where}: rows are {np.median(step):g} s apart, the model steps {robot.time_step_s:g} s; resample the log"
        )
    motors = [log.motor_names.index(n) for n in robot.motor_names]
    return replace(
        log,
        sensors=np.array(log.sensors[:, order]),
        sensor_names=robot.sensor_names,
        sensor_units=tuple(s.unit for s in robot.sensors),
        commands=np.array(log.commands[:, motors]),
        motor_names=robot.motor_names,
    )


def _fewest(log: SensorLog) -> int:
    """Readings that a log must hold: fewer where each is of many joints."""
    return max(FEWEST_OF_MANY, -(-FEWEST_ROWS // max(1, len(log.motor_names))))


def _enough(log: SensorLog) -> bool:
    return len(log.readings) >= _fewest(log)


def _too_short(where: str, log: SensorLog) -> str:
    what = "rows" if log.filled is None else "readings"
    return f"{where}: {len(log.readings)} {what}; at least {_fewest(log)} are needed"


def _names(where: str, what: str, have: Sequence[str], want: Sequence[str]) -> None:
    missing = [n for n in want if n not in have]
    if missing:
        near = nearest(missing[0], have, cutoff=0.5)
        hint = f"; is it {' or '.join(near)}?" if near else f"; the log has: {', '.join(have[:8])}"
        raise LogError(f"{where}: no {what} {quoted(missing[0])}{hint}")


def _same_robot(file: Path, run: RunRecord, robot: Robot) -> None:
    if run.robot.motor_names != robot.motor_names or run.robot.sensor_names != robot.sensor_names:
        raise LogError(f"{file}: a log of another robot ({run.robot.name}) than the first ({robot.name})")


def _calibration(path: Path, robot: Robot) -> tuple[Unmodelled | None, float, str]:
    """What task=improve task.calibrate=true wrote beside the model file. Raises ConfigError for another kind of file."""
    beside = path.with_suffix(".calibration.yaml")
    if not beside.is_file():
        return None, 0.0, ""
    try:
        content = yaml_of(beside)
        left = from_entries(content["unmodelled"], robot.sensor_names)
        return left, float(content["gained"]), str(content.get("way", "open_loop"))
    except (KeyError, TypeError, ValueError, AttributeError):
        raise ConfigError(
            f"{beside}: not a calibration; write it with task=improve task.calibrate=true on an untouched robot"
        ) from None
