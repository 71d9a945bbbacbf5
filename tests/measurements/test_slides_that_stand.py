"""Joints that turn beside joints that slide: each has a unit of its own, and one that stands still shows none."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest

from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.robots.describe import load_robot

FINGER = (
    '<joint name="elbow" type="revolute">',
    '<joint name="elbow" type="prismatic">',
)


def proposed(folder: Path, finger: np.ndarray, unit: str | None = None, size: float = 1.0) -> Proposal:
    path = samples.robot_file(folder)
    text = (folder / "chain.urdf").read_text()
    head, tail = text.split(FINGER[0])
    tail = tail.replace('lower="-1.7" upper="1.7"', 'lower="0.0" upper="0.04"', 1)
    assert "0.04" in tail
    (folder / "chain.urdf").write_text(head + FINGER[1] + tail)
    m = samples.motion()
    columns = {"t": m["t"]}
    for word, k in (("position", "q"), ("command", "g")):
        columns |= {f"shoulder_{word}": size * m[k][:, 0], f"elbow_{word}": finger}
    pd.DataFrame(columns).to_csv(folder / "log.csv", index=False)
    return proposal_for([folder / "log.csv"], load_robot(path)[0], Hints(unit=unit))


def units(found: Proposal) -> list[str]:
    return [str((c.entry or {}).get("unit")) for c in found.choices if c.group == "sensors" and "position" in c.name]


@pytest.mark.parametrize("unit", [None, "rad"])
def test_a_slide_that_stands_still_is_in_metres_as_the_others_are_in_rad(tmp_path: Path, unit: str | None) -> None:
    found = proposed(tmp_path, np.full(len(samples.motion()["t"]), 0.024), unit)
    assert not found.questions, found.questions
    assert units(found) == ["rad", "m"]


def test_beside_degrees_it_is_asked_for(tmp_path: Path) -> None:
    found = proposed(tmp_path, np.full(len(samples.motion()["t"]), 0.024), size=180 / np.pi)
    assert any("unit" in q or "position" in q for q in found.questions)
    assert "None" not in units(found)


def test_where_it_is_beyond_its_reach_in_metres_it_is_asked_for(tmp_path: Path) -> None:
    found = proposed(tmp_path, np.full(len(samples.motion()["t"]), 24.0))
    assert found.questions or units(found)[1] == "mm"
