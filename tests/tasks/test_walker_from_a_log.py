"""A robot that stands on the floor, from its log to what is told of it: it begins as it was read, and where it falls over in the
simulation alone that is said, in all that is shown."""

from __future__ import annotations

import html
import json
from typing import Any

import numpy as np
import pandas as pd
import pytest

URDF = """<robot name="pole">
  <link name="base">
    <inertial><mass value="1"/><inertia ixx="0.09" iyy="0.09" izz="0.002" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><geometry><box size="0.1 0.1 1"/></geometry></collision>
  </link>
  <link name="arm">
    <inertial><origin xyz="0 0.3 0"/><mass value="0.6"/>
      <inertia ixx="0.01" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial>
  </link>
  <joint name="shoulder" type="revolute">
    <parent link="base"/><child link="arm"/><origin xyz="0 0 0.5"/><axis xyz="1 0 0"/>
    <limit lower="-2" upper="2" effort="20" velocity="10"/>
  </joint>
</robot>
"""
DESCRIPTION = """free_base: true
time_step_s: 0.005
drives:
  shoulder: {command: position, kp: 60, kd: 4, torque_limit: 20}
sensors:
  - {name: position, kind: position, target: shoulder}
  - {name: roll, kind: roll, target: base}
"""


@pytest.fixture
def log_of(cli, tmp_path):
    """Imports a log of the pole, whose arm hangs down, or stands out to the side from half a second on; the real one is clamped
    to the floor, tilted by a hundredth."""
    (tmp_path / "pole.urdf").write_text(URDF)
    (tmp_path / "pole.yaml").write_text(DESCRIPTION)
    rng = np.random.default_rng(0)

    def imported(out: bool) -> str:
        t = np.arange(0, 2, 0.005)
        sent = -1.5 + (1.4 * np.clip((t - 0.5) / 0.3, 0, 1) if out else 0.1 * np.sin(4 * t))
        read = np.interp(t - 0.03, t, sent) + 2e-4 * rng.standard_normal(len(t))
        roll = 0.01 + 2e-4 * rng.standard_normal(len(t))
        table = {"time_s": t, "shoulder_position_rad": read, "shoulder_command_rad": sent, "roll_rad": roll}
        pd.DataFrame(table).to_csv(tmp_path / "log.csv", index=False, float_format="%.6g")
        robot = ("robot=urdf", f"robot.urdf={tmp_path / 'pole.urdf'}", f"robot.drives={tmp_path / 'pole.yaml'}")
        done = cli("task=import", f"measured={tmp_path / 'log.csv'}", *robot)
        assert done.status == 0, done.err
        return f"measured={done.runs()[0] / 'measured.mcap'}"

    return imported


def compared(cli, log: str) -> tuple[str, str, dict[str, Any]]:
    done = cli("task=compare", log, "engine=mujoco", "evaluator=serial")
    assert done.status == 0, done.err
    folder = max(done.runs(), key=lambda f: f.stat().st_mtime)
    page = html.unescape((folder / "report.html").read_text(encoding="utf-8"))
    return " ".join(done.out.split()), page, json.loads((folder / "summary.json").read_text())


def test_a_model_that_falls_over_is_told_everywhere(cli, log_of) -> None:
    said, page, summary = compared(cli, log_of(out=True))
    told = "The simulated robot falls over where the real one stands: log at "
    assert told in said and told in page
    (line,) = [w for w in summary["remarks"] if w.startswith(told)]
    assert 0.5 < float(line.removeprefix(told).split(" s")[0]) < 2.0


def test_a_model_that_stands_begins_as_it_was_read(cli, log_of) -> None:
    said, page, summary = compared(cli, log_of(out=False))
    assert "falls over" not in said + page
    rms = next(w for w in summary["remarks"] if w.startswith("Root mean squares"))
    assert rms in page
    # With its arm straight out, where the description begins, it would be a radian off and tip.
    position, roll = (float(rms.split(f"{kind} ")[1].split(" mrad")[0]) for kind in ("position", "roll"))
    assert position < 60.0 and roll < 30.0
