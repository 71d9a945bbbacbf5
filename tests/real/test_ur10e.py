"""A UR10e without and with a payload (docs/real_data.md): as good as an expert with fewer numbers, and the load is found."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data" / "ur10e"
JOINTS = "shoulder_pan_joint,shoulder_lift_joint,elbow_joint,wrist_1_joint,wrist_2_joint,wrist_3_joint"
GAINS = "10.0,10.6956,8.4566,9.0029,9.48,10.1232"
LOAD_KG = 2.805
EXPERT = 24
"""Numbers of the expert's fit: rotor inertia, Coulomb and viscous friction and an offset of each joint."""

pytestmark = [pytest.mark.slow, pytest.mark.skipif(not DATA.is_dir(), reason="the recordings are not here")]


def task(out: Path, *arguments: str) -> dict[str, Any]:
    command = [sys.executable, "-m", "ee_dist", *arguments, "task.rerun=false", f"hydra.run.dir={out}"]
    if arguments[0] == "task=import":
        command.remove("task.rerun=false")
    done = subprocess.run(
        command, cwd=ROOT, capture_output=True, text=True, check=False, env=os.environ | {"PYTHONPATH": str(ROOT)}
    )
    assert done.returncode == 0, done.stderr
    return dict(json.loads((out / "summary.json").read_text(encoding="utf-8")))


def test_friction_is_found_and_then_the_load(tmp_path: Path) -> None:
    arm = f"robot.urdf={DATA / 'ur10e.urdf'}", "robot.drives=docs/examples/ur10e.yaml", "robot=urdf"
    for name in ("unloaded", "loaded"):
        source = f"measured={DATA / name}.csv"
        task(tmp_path / name, "task=import", source, *arm, f"task.joints=[{JOINTS}]", f"task.gains=[{GAINS}]")
    free, heavy = (f"measured={tmp_path / name / 'measured.mcap'}" for name in ("unloaded", "loaded"))

    ladder = task(tmp_path / "friction", "task=improve", "effect=auto", free)
    assert ladder["verdict"] == "better_not_explained", "a real arm is never a rigid body with plain friction"
    # The expert's fit leaves 10.3 % of windows that it did not see, of the rows that the authors kept: where all joints move.
    assert ladder["ladder"][-1]["error_heldout_natural"] <= 1.05 * 0.103
    assert len(ladder["parameters"]) < EXPERT
    assert {t["effect"] for t in ladder["model_terms"]} == {"coulomb_friction", "viscous_friction", "rotor_inertia"}

    found = task(tmp_path / "load", "task=explain", heavy, f"model={tmp_path / 'friction' / 'model.yaml'}")
    best = found["candidates"][0]
    assert (best["name"], best["tied_with"], best["earned"]) == ("payload@wrist_3_link", [], True)
    assert best["values"]["mass_kg"] == pytest.approx(LOAD_KG, rel=0.08)
    centre = np.array([best["values"][k] for k in ("x_m", "y_m", "z_m")])
    assert np.linalg.norm(centre - (0.027, 0.175, -0.161)) < 0.015, "where least squares have it"
    (mass,) = [p["interval"] for p in found["parameters"] if p["name"] == "mass_kg"]
    assert mass[0] < LOAD_KG < mass[1]

    again = task(tmp_path / "left", "task=explain", free, f"model={tmp_path / 'friction' / 'model.yaml'}")
    assert again["verdict"] == "unexplained", "without the load none is named"
