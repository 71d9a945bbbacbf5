"""task=import: measurements of other formats become our recording, with a report of what was done and what looks wrong.

Without a mapping one is proposed, written down, and used where nothing was left open.
"""

from __future__ import annotations

import hashlib
import json
import math
import os
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from ee_dist.basics.files import named, real, repeated, write_whole
from ee_dist.basics.names import listed
from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.folders import recordings_in
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping import BETWEEN, ESTIMATED, Estimated, Mapping
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.pieces import in_pieces, pieces_asked
from ee_dist.measurements.proposal.kinds import proposal_of_kinds
from ee_dist.measurements.proposal.model import FIT, UNITS_TO_ASK, Hints, Proposal
from ee_dist.measurements.proposal.write import as_yaml, rows
from ee_dist.measurements.readers import FORMATS, kind_of
from ee_dist.measurements.report import Report, describe
from ee_dist.measurements.stated_gains import with_gains
from ee_dist.recording.records import TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.agree import SOURCES, sources_text
from ee_dist.robots.describe import BUILT_IN, load_robot, robot_of
from ee_dist.robots.listing import listings
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import Config, ConfigError, EngineConfig, one_of
from ee_dist.tasks.folder import check_file_name
from ee_dist.tasks.results.commands import asked, command
from ee_dist.tasks.summary import Stopwatch, write_summary
from ee_dist.tasks.terminal import terminal

MAPPING = "mapping.yaml"
MOST_ASKED = 5
"""Questions that the terminal shows; the mapping has all."""
_SETTING = re.compile(r"task\.\w+=")
"""A setting of the command line that answers a question."""


@dataclass
class Options:
    name: str = "import"
    mapping: str | None = None
    output: str = "measured.mcap"
    joints: Any = None
    gains: Any = None
    unit: str | None = None
    rate_hz: float | None = None
    pieces: Any = None


def run(config: Config, options: Options, out: Path) -> None:
    """Read every file of ``config.measured`` by the mapping and write ``out/measured.mcap``, report and summary.

    Without a mapping the proposed one is written to ``out/mapping.yaml`` and read back. Raises MeasurementError, RobotError,
    EffectError, ConfigError.
    """
    watch, console = Stopwatch(), terminal()
    check_file_name("task.output", options.output, "measured.mcap")
    hints, pieces = hints_of(options), pieces_asked(options.pieces)
    proposal = None
    if options.mapping:
        given = [k for k in ("joints", "gains", "unit", "rate_hz") if getattr(options, k) is not None]
        if given:
            raise ConfigError(f"task.{given[0]}= is for an import without a mapping; write it into {options.mapping}")
        mapping = read_mapping(options.mapping)
        robot, notes = robot_of_mapping(mapping, config)
        files, left = files_of(config.measured, mapping.reading.kind)
    else:
        files, left = files_of(config.measured)
        robot, notes = robot_of(config.robot.name, config.robot.urdf, config.robot.drives)
        if not robot.drives:
            raise ConfigError(
                f"{robot.name} has no drives: 'task=robot urdf={config.robot.urdf or 'FILE.urdf'}' writes a description "
                "with some to begin with; then robot=urdf robot.drives=FILE.yaml"
            )
        proposal, files = proposal_of_kinds(files, robot, replace(hints, written=written_orders(config)))
        mapping = written(proposal, config, files, out, console)
    robot, remarks = with_gains(robot, mapping)
    robot, finer = at_rate(robot, mapping)
    notes = (*notes, *left, *remarks, *finer)
    found = import_files(files, mapping, robot)
    reports = [report for _, report in found]
    records = in_pieces([record for record, _ in found], pieces)
    text = describe(reports)
    out.mkdir(parents=True, exist_ok=True)
    metadata = {"task": "import", "mapping": str(mapping.source), SOURCES: sources_of(mapping, config)}
    metadata[ESTIMATED] = json.dumps([name for name, c in mapping.sensors.items() if isinstance(c, Estimated)])
    # One controller leads all trials.
    if said := next((report.between for report in reports if report.between), ""):
        metadata[BETWEEN] = said
    with RunWriter(out / options.output, robot, metadata) as writer:
        for record in records:
            writer.trial(record)
    write_whole(out / "report.txt", text + "\n")
    rest = summary_of(reports, notes, options.output)
    rest["pieces"] = [] if pieces is None else [r.name for r in records]
    if proposal is not None:
        rest["mapping"] = MAPPING
        rest["proposed"] = [
            dict(zip(("channel", "column", "unit", "sure", "why"), r, strict=True)) for r in rows(proposal)
        ]
    write_summary(out, "import", config, options, watch, digest_of(records), rest)
    for line in (*(f"note: {n}" for n in notes), *text.splitlines()):
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    # What was told of rows and ranges is of the recordings as they came.
    apart = (
        ""
        if pieces is None
        else f", pieces of {len(found)} that are told whole above: {listed(r.name for r in records)}"
    )
    console.print(
        f"wrote {os.path.relpath(out / options.output)}: {len(records)} trial(s) of {robot.name}{apart}",
        highlight=False,
        soft_wrap=True,
    )
    console.print(f"Next: {following(config, out / options.output)}", highlight=False, markup=False, soft_wrap=True)


def following(config: Config, measured: Path) -> str:
    """The command that compares what was imported. Nothing was simulated so far, so that no engine has been chosen: the one that
    knows rotors and needs less time."""
    engine = EngineConfig(name="mujoco") if config.engine == EngineConfig() else config.engine
    return command(asked("compare", replace(config, measured=str(measured), engine=engine)))


def at_rate(robot: Robot, mapping: Mapping) -> tuple[Robot, tuple[str, ...]]:
    """The robot in steps of the rows that the mapping asks for, if they are finer than its own, and a line on it: a log and its
    model go in the same steps."""
    step_s = math.inf if mapping.rate_hz is None else 1.0 / mapping.rate_hz
    if step_s >= robot.time_step_s - 1e-9:
        return robot, ()
    line = (
        f"rate_hz: {mapping.rate_hz:g}: {robot.name} is stepped every {step_s:g} s, not every {robot.time_step_s:g} s"
    )
    return replace(robot, time_step_s=step_s), (line,)


def hints_of(options: Options) -> Hints:
    """What the user said beside the file. Raises ConfigError."""
    joints = None if options.joints is None else [str(j) for j in _listed(options.joints)]
    gains: list[float] | str | None = None
    if options.gains == FIT:
        gains = FIT
    elif options.gains is not None:
        gains = []
        for g in _listed(options.gains):
            if isinstance(g, bool) or not isinstance(g, (int, float)) or not math.isfinite(g) or g == 0:
                raise ConfigError(
                    f"task.gains: expected numbers in N.m per A, none of them 0, not {quoted(g)}; or task.gains={FIT}"
                )
            gains.append(float(g))
    if options.unit is not None:
        one_of("task.unit", options.unit, UNITS_TO_ASK)
    rate = options.rate_hz
    if rate is not None and not 0 < rate <= 1e6:
        raise ConfigError(f"task.rate_hz={rate}: expected rows a second, more than 0 and at most 1e6")
    return Hints(joints, gains, options.unit, rate)


def _listed(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (list, tuple)) else [value]


def written_orders(config: Config) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """The orders in which the files of the configured robot list its joints, which may be that of a log."""
    robot = config.robot
    return listings(*(f for f in (robot.name, robot.urdf, robot.drives) if f is not None))


def written(proposal: Proposal, config: Config, files: list[Path], out: Path, console: Console) -> Mapping:
    """Show the proposal, write it, read it back. Raises MeasurementError for what is left open, in one line."""
    table = Table(title="Proposed mapping", title_justify="left", box=SIMPLE)
    for head in ("channel", "column", "unit", "how sure", "why"):
        table.add_column(head, overflow="fold")
    for row in rows(proposal):
        table.add_row(*row)
    # A pipe has no width of its own.
    terminal(width=None if console.is_terminal else 140).print(table, highlight=False, markup=False)
    for note in proposal.notes:
        console.print(f"note: {note}", highlight=False, markup=False, soft_wrap=True)
    out.mkdir(parents=True, exist_ok=True)
    names = files[0].name if len(files) == 1 else f"{files[0].name} and {len(files) - 1} more"
    path = out / MAPPING
    write_whole(path, as_yaml(proposal, robot_source(config), names))
    shown = os.path.relpath(path)
    console.print(f"wrote {shown}", highlight=False, markup=False, soft_wrap=True)
    if proposal.questions:
        first, *others = proposal.questions
        for question in others[: MOST_ASKED - 1]:
            console.print(f"to be said, too: {question}", highlight=False, markup=False, soft_wrap=True)
        beyond = len(others) - (MOST_ASKED - 1)
        unseen = f", {beyond} of them in {shown} alone" if beyond > 0 else ""
        more = f" (and {len(others)} more, above{unseen})" if others else ""
        # What a description is to say first makes another proposal.
        then = "then the same again" if "fixed_joints" in first else f"then again with task.mapping={shown}"
        raise MeasurementError(
            f"{names}: what the file cannot say{more}: {first} (the rest is in {shown})"
            if _SETTING.search(first)
            else f"{names}: what the file cannot say{more}: {first}; {then}"
        )
    return read_mapping(path)


def robot_source(config: Config) -> Any:
    """The configured robot as a mapping names it, from wherever that stands."""
    robot = config.robot
    if robot.name in BUILT_IN:
        return robot.name
    named = [f for f in (robot.urdf, robot.drives) if f is not None] or [robot.name]
    # Where a description and its URDF are named apart, the settings of the command line go on saying which belong together.
    return str(real(named[0])) if len(named) == 1 else None


def robot_of_mapping(mapping: Mapping, config: Config) -> tuple[Robot, tuple[str, ...]]:
    """The robot that the mapping names, or else the configured one. Raises RobotError."""
    if mapping.robot is not None:
        return load_robot(mapping.robot, mapping.folder)
    return robot_of(config.robot.name, config.robot.urdf, config.robot.drives)


def sources_of(mapping: Mapping, config: Config) -> str:
    """Digests of the files that the robot was read from, as the recording keeps them: a later change is then noticed."""
    if mapping.robot is not None:
        return sources_text(mapping.robot, mapping.folder)
    robot = config.robot
    named = {} if robot.urdf is None else {robot.name: robot.urdf}
    return sources_text(named, more=robot.drives or robot.name)


def files_of(measured: Any, kind: str | None = None) -> tuple[list[Path], list[str]]:
    """The files that ``measured`` names: one, several, all that match a pattern, or all of a readable format in a folder, by
    name. And notes.

    Raises MeasurementError where there are none.
    """
    if not measured:
        raise MeasurementError("measured=: which file? name one, several as [a.csv,b.csv], or a folder")
    files: list[Path] = []
    notes: list[str] = []
    for path in named(measured):
        if path.is_dir() and kind_of(path) is None:
            inside, remarks = recordings_in(path, kind)
            if not inside:
                wanted = [s for s, k in FORMATS.items() if kind in (None, k)]
                raise MeasurementError(f"{path}: no file to import in this folder; expected {', '.join(wanted)}")
            files += inside
            notes += remarks
        else:
            files.append(path)
    if (twice := repeated(files)) is not None:
        raise MeasurementError(f"measured={twice}: the same file twice; name each once")
    return files, notes


def digest_of(records: list[TrialRecord]) -> str:
    """Digest of all that was imported."""
    total = hashlib.sha256()
    for r in records:
        total.update(repr((r.index, r.name, r.believed, r.log.sensor_names, r.log.motor_names)).encode())
        if r.not_recorded:
            total.update(repr(r.not_recorded).encode())
        log = r.log
        for values in (
            log.times_s, log.sensors, log.commands, log.joints, log.torques, log.supply_v, log.external, log.filled,
        ):  # fmt: skip
            if values is not None:
                total.update(np.ascontiguousarray(values).tobytes())
    return total.hexdigest()


def summary_of(reports: list[Report], notes: tuple[str, ...], output: str) -> dict[str, Any]:
    return {"recording": output, "notes": list(notes), "trials": [r.as_dict() for r in reports]}
