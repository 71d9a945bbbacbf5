"""What was asked for beside what was measured, where no name of ours says which is which."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import Hints, Proposal
from ee_dist.robots.describe import load_robot

LATE = 6
"""Rows (60 ms) by which the positions follow what was asked for."""


def columns(noise: float = 3e-4) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """Times, and a plan with its rates beside positions and speeds (T, J) that follow it, with noise."""
    m = samples.motion()
    wave = lambda t: np.stack([0.4 * np.sin(1.7 * t) + 0.2 * np.sin(4.3 * t), 0.3 * np.cos(2.3 * t)], axis=1)  # noqa: E731
    t = m["t"]
    asked, seen = wave(t), wave(t - LATE * samples.STEP_S)
    rng = np.random.default_rng(3)
    return t, {
        "plan": asked, "rate": np.gradient(asked, t, axis=0), "seen": seen + rng.normal(scale=noise, size=seen.shape),
        "speed": np.gradient(seen, t, axis=0) + rng.normal(scale=0.01, size=seen.shape),
    }  # fmt: skip


def proposed(folder: Path, frame: pd.DataFrame, header: bool = True, **hints: object) -> Proposal:
    robot, _ = load_robot(samples.robot_file(folder))
    frame.to_csv(folder / "log.csv", index=False, header=header)
    return proposal_for([folder / "log.csv"], robot, Hints(**hints))  # type: ignore[arg-type]


def taken(proposal: Proposal, name: str) -> list[str]:
    return [str((c.entry or {}).get("column")) for c in proposal.choices if c.name.startswith(name)]


@pytest.mark.parametrize(("own", "other"), [("", "Cmptd"), ("Seen", "Wish")])
def test_speeds_beside_the_rates_of_a_plan_are_told_by_what_their_names_share(
    tmp_path: Path, own: str, other: str
) -> None:
    t, c = columns()
    frame = pd.DataFrame({"Time": t})
    for name, key in ((f"Position{own}", "seen"), (f"Velocity{other}", "rate"), (f"Velocity{own}", "speed"),
                      (f"Position{other}", "plan")):  # fmt: skip
        frame = frame.assign(**{f"{name}{k + 1}": c[key][:, k] for k in range(2)})
    found = proposed(tmp_path, frame)
    assert taken(found, "velocity") == [f"Velocity{own}1", f"Velocity{own}2"]
    assert any(f"Velocity{other}1" in c.why and "what was asked for" in c.why for c in found.choices)


def test_speeds_without_a_name_are_those_of_the_measured_positions(tmp_path: Path) -> None:
    t, c = columns()
    frame = pd.DataFrame(np.concatenate([t[:, None], c["plan"], c["rate"], c["seen"], c["speed"]], axis=1))
    found = proposed(tmp_path, frame, header=False, joints=samples.JOINTS)
    assert taken(found, "position") == ["6", "7"]
    assert taken(found, "velocity") == ["8", "9"]


def test_fewer_numbered_columns_than_joints_are_counted(tmp_path: Path) -> None:
    m = samples.motion()
    frame = pd.DataFrame({"t": m["t"], "q[0]": m["q"][:, 0], "q[1]": m["q"][:, 1]})
    _, found = logs.proposed(tmp_path, logs.written(tmp_path, frame), ("waist", "shoulder", "elbow"))
    (asked,) = found.questions
    assert "(3 joints; q[0] to q[1] are 2)" in asked and "fixed_joints: {JOINT: 0.0}" in asked


def test_joints_that_were_not_recorded_are_named_with_what_to_do(tmp_path: Path) -> None:
    m = samples.motion()
    frame = pd.DataFrame({"t": m["t"], "shoulder_position": m["q"][:, 0], "shoulder_effort": np.sin(m["t"])})
    (asked,) = proposed(tmp_path, frame).questions
    assert "the columns name shoulder alone; of elbow nothing was recorded" in asked
    assert "fixed_joints: {" in asked
    (turning,) = proposed(tmp_path, frame.assign(elbow_velocity=np.cos(3.0 * m["t"]))).questions
    assert "of elbow speeds were recorded" in turning and "fixed_joints" not in turning


@pytest.mark.parametrize("word", ["torq", "torque", "trq"])
def test_torques_are_known_by_whatever_they_are_short_for(tmp_path: Path, word: str) -> None:
    m = samples.motion()
    joints = {f"{j}_position": m["q"][:, k] for k, j in enumerate(samples.JOINTS)}
    torques = {f"{word}_{j}": np.sin((k + 1) * m["t"]) for k, j in enumerate(samples.JOINTS)}
    found = proposed(tmp_path, pd.DataFrame({"t": m["t"], **joints, **torques}))
    assert [c.entry["column"] for c in found.choices if c.group == "torques"] == list(torques)
