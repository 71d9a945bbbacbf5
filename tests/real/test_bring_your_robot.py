"""docs/bring_your_robot.md from end to end: a URDF, a CSV with a hidden fault, and the commands of the page."""

from __future__ import annotations

import contextlib
import io
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT / "tests" / "tasks"))

from schemas import validated  # noqa: E402

from ee_dist.__main__ import main  # noqa: E402

FAULT = "coulomb_friction@elbow:torque_nm=0.35"
QUICK = ("engine=mujoco", "evaluator=serial", "task.rerun=false")


def run(*arguments: str) -> None:
    """A program in a process of its own, as a reader of the page starts it."""
    done = subprocess.run(
        [sys.executable, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=False,
        env=os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT)},
    )
    assert done.returncode == 0, done.stderr


def job(*arguments: str) -> tuple[int, str]:
    """The same program without a new process, which takes longer to load than most commands to run: status and complaint."""
    said, before = io.StringIO(), sys.argv
    sys.argv = ["ee_dist", *arguments]
    with contextlib.chdir(ROOT), contextlib.redirect_stdout(io.StringIO()), contextlib.redirect_stderr(said):
        try:
            status = main()
        except SystemExit as stop:
            status = int(stop.code or 0)
        finally:
            sys.argv = before
    return status, said.getvalue()


def task(out: Path, *arguments: str) -> dict[str, Any]:
    status, said = job(*arguments, f"hydra.run.dir={out}")
    assert status == 0, said
    return validated(out / "summary.json")


@pytest.fixture(scope="module")
def imported(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("arm")
    run("tools/make_arm_csv.py", "--out", str(folder / "csv"), "--fault", FAULT)
    mapping = "task.mapping=docs/examples/arm_csv.yaml"
    out = folder / "import"
    run("-m", "ee_dist", "task=import", f"measured={folder / 'csv'}", mapping, f"hydra.run.dir={out}")
    found = validated(out / "summary.json")
    assert [t["trial"] for t in found["trials"]] == ["run1", "run2"]
    assert all(t["resampled"] and not t["suspicious"] for t in found["trials"])
    return folder


def test_import_compare_and_improve_with_a_named_effect(imported: Path) -> None:
    log = f"measured={imported / 'import' / 'measured.mcap'}"
    before = task(imported / "compare", "task=compare", log, *QUICK)
    assert before["channels"][0]["name"] == "elbow_angle"
    assert before["error"] > 1.5
    better = task(imported / "improve", "task=improve", "effect=coulomb_friction@elbow", log, *QUICK)
    assert better["ladder"][-1]["error_heldout"] < 0.6 * better["ladder"][0]["error_heldout"]
    assert better["model_terms"][0]["values"]["torque_nm"] == pytest.approx(0.35, rel=0.1)
    model = f"model={imported / 'improve' / 'model.yaml'}"
    after = task(imported / "again", "task=compare", log, model, *QUICK)
    assert after["error"] < 0.6 * before["error"]


@pytest.mark.slow
def test_explain_and_improve_find_the_fault_by_themselves(imported: Path) -> None:
    log = f"measured={imported / 'import' / 'measured.mcap'}"
    found = task(imported / "explain", "task=explain", log, *QUICK)
    assert found["candidates"][0]["name"] == "coulomb_friction@elbow"
    better = task(imported / "auto", "task=improve", "effect=auto", log, *QUICK)
    assert better["ladder"][1]["effect"] == "coulomb_friction"
    assert better["ladder"][1]["target"] == "elbow"


def test_mistakes_are_one_line(imported: Path, tmp_path: Path) -> None:
    broken = tmp_path / "run.csv"
    lines = (imported / "csv" / "run1.csv").read_text().splitlines()
    broken.write_text("\n".join([lines[0].replace("q2_deg", "q2"), *lines[1:]]))
    mapping = "task.mapping=docs/examples/arm_csv.yaml"
    status, said = job("task=import", f"measured={broken}", mapping, f"hydra.run.dir={tmp_path / 'a'}")
    assert status == 2
    assert "no column 'q2_deg'; did you mean" in said
    assert len(said.strip().splitlines()) == 1
    assert not list((tmp_path / "a").glob("*.mcap*"))
