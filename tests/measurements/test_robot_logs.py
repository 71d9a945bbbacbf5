"""Logs as controllers of arms write them (RTDE): targets beside readings, speeds of both, a pose of the tool, a joint at rest."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import small_logs as logs
from measurement_files import JOINTS, motion


def log_of(folder: Path, degrees: bool = False) -> Path:
    """The first joint hardly moves."""
    m = motion()
    size = np.rad2deg(1.0) if degrees else 1.0
    still = np.array([0.02, 1.0])
    speeds = {k: np.gradient(m[k], m["t"], axis=0) for k in "qg"}
    table: dict[str, np.ndarray] = {"timestamp": m["t"] + 2100.0}
    for what, values in (
        ("target_q", m["g"]), ("target_qd", speeds["g"]), ("actual_q", m["q"]), ("actual_qd", speeds["q"])
    ):  # fmt: skip
        table |= {f"{what}_{k}": size * still[k] * values[:, k] for k in range(2)}
    table |= {f"actual_TCP_pose_{k}": 0.3 * m["q"][:, k % 2] + 0.1 * k for k in range(2)}
    return logs.written(folder, pd.DataFrame(table))


@pytest.mark.parametrize("degrees", [False, True])
def test_it_comes_in_by_itself(tmp_path: Path, degrees: bool) -> None:
    """Targets of the speeds are no commands, where the drives obey positions; a tool's pose is no joint; and one joint's small
    motion makes its unit no other than that of the rest."""
    m = motion()
    log, _ = logs.imported(tmp_path, log_of(tmp_path, degrees))
    scale = np.array([0.02, 1.0])
    assert log.commands == pytest.approx(m["g"] * scale, abs=1e-9)
    assert log.joints == pytest.approx(m["q"] * scale, abs=1e-9)
    for joint, k in zip(JOINTS, range(2), strict=True):
        speed = np.gradient(m["q"], m["t"], axis=0)[:, k] * scale[k]
        assert log.channel(f"velocity_{joint}") == pytest.approx(speed, abs=1e-9)


def test_a_time_that_is_too_coarse_is_named(tmp_path: Path) -> None:
    file = log_of(tmp_path)
    table = pd.read_csv(file)
    table["timestamp"] = np.floor(table["timestamp"] / 0.03) * 0.03
    _, proposal = logs.proposed(tmp_path, logs.written(tmp_path, table))
    assert "'timestamp': time stands still" in proposal.questions[0] and "rows more" in proposal.questions[0]
