"""Two trials of a servo in files, for which a mapping is proposed, written, read back and used; and a mapping that is used."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
from kinds import OURS, Files, Sample

from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints
from ee_dist.measurements.proposal.write import as_yaml, rows
from ee_dist.robots.servo_pendulum import servo_pendulum

T = np.arange(0, 1.2, 0.01)
GAINS = (100, 400)
MAPPING = """robot: servo_pendulum
time: {column: t, unit: s}
sensors:
  position: {column: position, unit: deg, sign: -1, gaps: interpolate}
  speed: {speed_of: position}
commands:
  servo: {column: goal, unit: rad, scale: 1.5, lead_s: 0.01}
settings:
  - {effect: position_gain, target: servo, factor: {column: kp, scale: 0.01}}
  - {effect: payload, target: rod, mass_kg: 0.1}
"""


def _columns() -> dict[str, np.ndarray]:
    goal = 0.8 * np.sin(6.0 * T)
    return {"t": T, "position": 0.9 * np.interp(T - 0.05, T, goal), "goal": goal, "temp": np.full(len(T), 30.0)}


def _csv() -> Files:
    files = {}
    for k, gain in enumerate(GAINS):
        columns, text = _columns() | {"kp": np.full(len(T), gain)}, io.StringIO()
        np.savetxt(text, np.column_stack(list(columns.values())), "%.6g", ",", header=",".join(columns), comments="")
        files[f"run{k}.csv"] = text.getvalue().encode()
    return files


def _json() -> Files:
    names, values = list(_columns()), np.column_stack(list(_columns().values())).round(6).tolist()
    entries = [dict(zip(names, row, strict=True)) for row in values]
    return {
        f"run{k}.json": json.dumps({"kp": gain, "motor": "xl", "mass": 0.5 + k, "entries": entries}).encode()
        for k, gain in enumerate(GAINS)
    }


def proposed(path: Path) -> None:
    """All files beside it, and what is proposed for them; whatever their names hold, it can be read back."""
    files, robot = sorted(path.parent.glob(f"*{path.suffix}")), servo_pendulum()
    for some in (files, files[:1]):
        proposal = proposal_for(some, robot, Hints())
        rows(proposal)
        if any("\n" in text for text in (*proposal.questions, *proposal.notes)):
            raise AssertionError("not one line")
        mapping = path.with_name("proposed.yaml")
        mapping.write_text(as_yaml(proposal, "servo_pendulum", some[0].name))
        try:
            if not proposal.questions:
                try:
                    found = read_mapping(mapping)
                except OURS as error:
                    raise AssertionError(f"a proposal that cannot be read: {error}") from error
                import_files(some, found, robot)
        finally:
            mapping.unlink()


def mapped(path: Path) -> None:
    import_files([path.with_name("run0.csv")], read_mapping(path.with_name("map.yaml")), servo_pendulum())


def _mapped() -> Sample:
    files = {"map.yaml": MAPPING.encode(), "run0.csv": _csv()["run0.csv"]}
    return Sample(files, "map.yaml", (mapped,), ("map.yaml", "map.yaml", "run0.csv"))


PROPOSED: dict[str, Callable[[], Sample]] = {
    "proposal for CSV": lambda: Sample(_csv(), "run0.csv", (proposed,), tuple(_csv())),
    "proposal for JSON": lambda: Sample(_json(), "run0.json", (proposed,), tuple(_json())),
    "import by a mapping": _mapped,
}
