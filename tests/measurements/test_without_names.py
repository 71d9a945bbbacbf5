"""A log without a header: what was measured, what was planned, and the rates of both, told by what they do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import small_logs as logs

JOINTS = ("pan", "lift", "wrist")
T = np.arange(1200) * 0.01


def way(t: np.ndarray) -> np.ndarray:
    """Three joints on courses of several periods, (T, 3) rad."""
    return np.stack(
        [0.8 * np.sin((0.9 + 0.3 * k) * t + k) + 0.3 * np.sin((2.6 + 0.4 * k) * t) for k in range(3)], axis=1
    )


def rate(values: np.ndarray) -> np.ndarray:
    return np.gradient(values, T, axis=0)


def written(folder: Path, rpm: float) -> Path:
    """Time; positions in deg that were rounded finely, speeds that carry noise; the plan in rad, its rate and its accelerations.
    Joints follow the plan by one row."""
    rng = np.random.default_rng(0)
    plan, seen = way(T), way(T - 0.01)
    positions = np.round(np.degrees(seen) / 0.002) * 0.002
    speeds = rpm * rate(seen) + rng.normal(scale=0.002, size=seen.shape)
    table = np.concatenate([T[:, None], positions, speeds, plan, rate(plan), rate(rate(plan))], axis=1)
    np.savetxt(folder / "log.txt", table, fmt="%.6f")
    return folder / "log.txt"


@pytest.mark.parametrize(("rpm", "unit"), [(30 / np.pi, "rpm"), (1.0, "rad/s"), (180 / np.pi, "deg/s")])
def test_rates_are_no_positions_and_plans_no_measurements(tmp_path: Path, rpm: float, unit: str) -> None:
    _, proposal = logs.proposed(tmp_path, written(tmp_path, rpm), joints=JOINTS)
    found = {(c.group, c.name): (c.column, (c.entry or {}).get("unit")) for c in proposal.choices}
    for k, joint in enumerate(JOINTS):
        assert found["sensors", f"position_{joint}"] == (str(2 + k), "deg")
        assert found["sensors", f"velocity_{joint}"] == (str(5 + k), unit)
        assert found["commands", joint] == (str(8 + k), "rad")
    assert not proposal.questions
