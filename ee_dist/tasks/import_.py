"""task=import: measurements of other formats become our recording, with a report of what was done and what looks wrong."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping import Mapping, read_mapping
from ee_dist.measurements.readers import FORMATS, kind_of
from ee_dist.measurements.report import Report, describe
from ee_dist.recording.records import TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.describe import load_robot, robot_of
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.summary import Stopwatch, write_summary


@dataclass
class Options:
    name: str = "import"
    mapping: str | None = None
    output: str = "measured.mcap"


def run(config: Config, options: Options, out: Path) -> None:
    """Read every file of ``config.measured`` by the mapping and write ``out/measured.mcap``, report and summary.

    Raises MeasurementError, RobotError, EffectError, ConfigError.
    """
    watch = Stopwatch()
    if not options.mapping:
        raise ConfigError(
            "task.mapping=: which column is which channel? name a YAML file; see docs/bring_your_robot.md"
        )
    if Path(options.output).name != options.output or not options.output.endswith(".mcap"):
        raise ConfigError(
            f"task.output={options.output}: expected the name of a file that ends in .mcap, such as measured.mcap"
        )
    mapping = read_mapping(options.mapping)
    robot, notes = robot_of_mapping(mapping, config)
    found = import_files(files_of(config.measured, mapping.reading.kind), mapping, robot)
    reports = [report for _, report in found]
    text = describe(reports)
    out.mkdir(parents=True, exist_ok=True)
    with RunWriter(out / options.output, robot, {"task": "import", "mapping": str(mapping.source)}) as writer:
        for record, _ in found:
            writer.trial(record)
    (out / "report.txt").write_text(text + "\n", encoding="utf-8")
    rest = summary_of(reports, notes, options.output)
    write_summary(out, "import", config, options, watch, digest_of([r for r, _ in found]), rest)
    console = Console()
    for line in (*(f"note: {n}" for n in notes), *text.splitlines()):
        console.print(line, highlight=False, markup=False, soft_wrap=True)
    console.print(
        f"wrote {out / options.output}: {len(found)} trial(s) of {robot.name}", highlight=False, soft_wrap=True
    )


def robot_of_mapping(mapping: Mapping, config: Config) -> tuple[Robot, tuple[str, ...]]:
    """The robot that the mapping names, or else the configured one. Raises RobotError."""
    if mapping.robot is not None:
        return load_robot(mapping.robot, mapping.folder)
    return robot_of(config.robot.name, config.robot.urdf, config.robot.drives)


def files_of(measured: Any, kind: str | None = None) -> list[Path]:
    """The files that ``measured`` names: one, several, or all of a readable format in a folder, by name.

    Raises MeasurementError where there are none.
    """
    if not measured:
        raise MeasurementError("measured=: which file? name one, several as [a.csv,b.csv], or a folder")
    names = measured if isinstance(measured, (list, tuple)) else [measured]
    files: list[Path] = []
    for name in names:
        path = Path(str(name))
        if path.is_dir() and kind_of(path) is None:
            inside = sorted(f for f in path.iterdir() if kind_of(f) is not None and kind in (None, kind_of(f)))
            if not inside:
                wanted = [s for s, k in FORMATS.items() if kind in (None, k)]
                raise MeasurementError(f"{path}: no file to import in this folder; expected {', '.join(wanted)}")
            files += inside
        else:
            files.append(path)
    return files


def digest_of(records: list[TrialRecord]) -> str:
    """Digest of all that was imported."""
    total = hashlib.sha256()
    for r in records:
        total.update(repr((r.index, r.name, r.believed, r.log.sensor_names, r.log.motor_names)).encode())
        for values in (r.log.times_s, r.log.sensors, r.log.commands, r.log.joints, r.log.torques, r.log.supply_v):
            if values is not None:
                total.update(np.ascontiguousarray(values).tobytes())
    return total.hexdigest()


def summary_of(reports: list[Report], notes: tuple[str, ...], output: str) -> dict[str, Any]:
    return {"recording": output, "notes": list(notes), "trials": [r.as_dict() for r in reports]}
