"""Numbers that files state about their trials: a gain that differs becomes a setting, anything else is at least told."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from ee_dist.measurements.importer import import_files
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import LIKELY, Hints, Proposal
from ee_dist.measurements.proposal.write import as_yaml, rows
from ee_dist.robots.servo_pendulum import servo_pendulum

ROBOT = servo_pendulum()
T = np.arange(0, 4, 0.01)
COMMAND = 0.8 * np.sin(2.0 * T) * np.minimum(T, 1.0)
POSITION = 0.9 * np.interp(T - 0.05, T, COMMAND)


def as_json(folder: Path, name: str, **header: object) -> Path:
    rows = [
        {"t": float(t), "position": float(p), "goal": float(c)} for t, p, c in zip(T, POSITION, COMMAND, strict=True)
    ]
    path = folder / f"{name}.json"
    path.write_text(json.dumps({**header, "entries": rows}))
    return path


def as_csv(folder: Path, name: str, **constant: float) -> Path:
    path = folder / f"{name}.csv"
    columns = {"t": T, "position": POSITION, "goal": COMMAND, **{k: np.full(len(T), v) for k, v in constant.items()}}
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="")
    return path


def proposed(*files: Path) -> Proposal:
    return proposal_for(files, ROBOT, Hints())


def settings(proposal: Proposal) -> list[dict[str, object]]:
    return [c.entry or {} for c in proposal.choices if c.group == "settings"]


@pytest.mark.parametrize("kp", [(100, 400, 400), (400.0, 100.0, 400.0)])
def test_a_gain_in_the_header_that_differs_is_a_setting_of_each_trial(tmp_path: Path, kp: tuple[float, ...]) -> None:
    files = [as_json(tmp_path, f"run{k}", kp=gain, motor="xl") for k, gain in enumerate(kp)]
    found = proposed(*files)
    (entry,) = settings(found)
    assert entry["effect"] == "position_gain" and entry["target"] == "servo"
    (choice,) = (c for c in found.choices if c.group == "settings")
    assert choice.sure == LIKELY and "differs between trials (100, 400)" in choice.why and "at 400" in choice.why
    assert ("position_gain at servo", "kp") in [r[:2] for r in rows(found)]
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text(as_yaml(found, "servo_pendulum", "runs"))
    held = [record.believed for record, _ in import_files(files, read_mapping(mapping), ROBOT)]
    assert [dict(terms[0].values)["factor"] for terms in held] == pytest.approx([g / 400 for g in kp])


def test_a_column_that_stands_still_and_is_called_a_gain_is_one_too(tmp_path: Path) -> None:
    found = proposed(as_csv(tmp_path, "a", kp_servo=8.0, temp=30.0), as_csv(tmp_path, "b", kp_servo=16.0, temp=31.0))
    (entry,) = settings(found)
    assert entry["factor"] == {"column": "kp_servo", "scale": 1 / 8}
    assert any("not used: temp" in n for n in found.notes) and not any("kp_servo" in n for n in found.notes)


@pytest.mark.parametrize(
    ("names", "said"),
    [
        (({"kp": 5}, {"kp": 5}), "kp is 5 in all trials: the description's gain is taken for it"),
        (({"mass": 0.5}, {"mass": 0.7}), "not used: mass (0.5, 0.7)"),
        (({"kp": 0}, {"kp": 5}), "not used: kp (0, 5)"),
        (({"kp_knee": 4}, {"kp_knee": 5}), "not used: kp_knee (4, 5)"),
    ],
)
def test_what_is_no_setting_is_told(tmp_path: Path, names: tuple[dict[str, float], ...], said: str) -> None:
    found = proposed(*(as_json(tmp_path, f"run{k}", **header) for k, header in enumerate(names)))
    assert not settings(found)
    assert any(said in n for n in found.notes), found.notes


def test_what_is_the_same_in_all_or_no_number_is_not_told(tmp_path: Path) -> None:
    found = proposed(*(as_json(tmp_path, f"run{k}", mass=0.5, by=f"me{k}", ok=bool(k)) for k in range(2)))
    assert not settings(found) and not found.notes
