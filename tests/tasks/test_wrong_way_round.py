"""A log of a robot that its description has the wrong way round, from a CSV to a mended model, on the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import yaml

from ee_dist.discrepancy.accounts.account import MEND
from ee_dist.effects.catalogue import apply, term
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.recording.reader import read_run
from ee_dist.robots.describe import load_robot

ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.yaml"
JOINTS = ("turn", "shoulder", "elbow")
QUICK = ("engine=mujoco", "evaluator=serial", "task.rerun=false")
SUSPECTS = (
    "task.only=[axis_reversed,base_turned,joints_swapped,part_mass,weight_carried,parallel_spring,coulomb_friction]"
)


def keep_log(folder: Path, wrong: str, flaw: str = "") -> None:
    """Two motions of an arm that differs from its description by ``wrong``, if by anything, as a logger keeps them: the bus of
    its servos lost three rows of the first. A ``flaw`` of the record: "jump" puts an angle a whole turn on, "late" is a logger
    that stood still at four places and counted its rows, "coarse" a torque read in steps as large as it is, "seldom" sensors
    of which every fourth row says something new."""
    robot, _ = load_robot(ARM)
    name, _, target = wrong.partition("@")
    true = apply(robot, (term(name, target),)) if wrong else robot
    t, rng = np.arange(0, 4, robot.time_step_s), np.random.default_rng(1)
    for run in (1, 2):
        rise = np.minimum(1.0, t / 0.5) ** 2
        sent = np.stack([rise * 0.5 * np.sin((1.7 + 0.6 * j + 0.4 * run) * t + j) for j in range(3)], axis=1)
        (log,) = MuJoCoEngine().rollout([Rollout(true, Commands(sent), len(t))])
        read = log.sensors + rng.standard_normal(log.sensors.shape) * ([5e-4] * 3 + [0.02] * 3)
        table = pd.DataFrame({"t": t} | {f"q_{j}": read[:, k] for k, j in enumerate(JOINTS)})
        for k, j in enumerate(JOINTS):
            table[f"tau_{j}"], table[f"goal_{j}"] = read[:, 3 + k], sent[:, k]
        if flaw == "jump":
            table.loc[400:, "q_turn"] += 2 * np.pi
        if flaw == "seldom":
            read_once = [c for c in table if c[0] in "qt" and c != "t"]
            table[read_once] = table[read_once].iloc[np.arange(len(t)) // 4 * 4].to_numpy()
        if flaw == "coarse":
            step = 0.5 * float(np.sqrt(np.mean(table["tau_turn"] ** 2)))
            table["tau_turn"] = step * np.round(table["tau_turn"] / step)
        if run == 1:
            table.loc[[200, 201, 500], [f"q_{j}" for j in JOINTS]] = -np.pi
        if flaw == "late":
            table = table.drop([k + i for k in (130, 300, 420, 610) for i in range(12)]).reset_index(drop=True)
            table["t"] = t[: len(table)]
        table.to_csv(folder / f"run{run}.csv", index=False, float_format="%.8g")
    mapping = {
        "robot": str(ARM),
        "time": {"column": "t", "unit": "s"},
        "sensors": {f"{j}_angle": {"column": f"q_{j}", "unit": "rad"} for j in JOINTS}
        | {f"{j}_torque": {"column": f"tau_{j}", "unit": "N.m"} for j in JOINTS},
        "commands": {j: {"column": f"goal_{j}", "unit": "rad"} for j in JOINTS},
        "torques": {j: {"column": f"tau_{j}", "unit": "N.m"} for j in JOINTS},
    }
    (folder / "mapping.yaml").write_text(yaml.safe_dump(mapping))


def run(cli, *arguments):
    outcome = cli(*arguments)
    assert outcome.status == 0, outcome.err
    return outcome.runs()[0], outcome.summary(), " ".join(outcome.out.split())


def imported(cli, folder: Path) -> tuple[str, str]:
    found, _, said = run(cli, "task=import", f"measured={folder}", f"task.mapping={folder / 'mapping.yaml'}")
    return f"measured={found / 'measured.mcap'}", said


@pytest.mark.parametrize("by", ["open_loop", "force_balance"])
def test_a_reversed_elbow_is_told_first_with_where_to_mend_it(cli, tmp_path, by):
    keep_log(tmp_path, "axis_reversed@elbow")
    log, said = imported(cli, tmp_path)
    assert "3 of 800 rows were not read and are left out" in said
    _, compared, _ = run(cli, "task=compare", log, f"task.by={by}", *QUICK)
    _, explained, said = run(cli, "task=explain", log, f"task.by={by}", SUSPECTS, *QUICK)
    assert explained["candidates"][0]["name"] == "axis_reversed@elbow", explained["headline"]
    assert " ".join(MEND.split()) in said and "task=improve" not in said, (
        "no command that goes on with what is to be mended"
    )
    folder, summary, said = run(cli, "task=improve", "effect=auto", log, f"task.by={by}", SUSPECTS, *QUICK)
    assert summary["ladder"][1]["name"] == "axis_reversed@elbow", summary["headline"]
    assert summary["ladder"][-1]["error_heldout"] < 0.3 * compared["error"]
    assert summary["headline"].startswith("Added: axis reversed at elbow") and " ".join(MEND.split()) in said
    mended = f"model={folder / 'model.yaml'}"
    _, again, _ = run(cli, "task=compare", log, mended, f"task.by={by}", *QUICK)
    assert again["error"] < 0.3 * compared["error"]


@pytest.mark.parametrize(("wrong", "flaw", "told"), [
    ("base_turned@x_up", "", "Is it described upright?"),
    ("axis_reversed@elbow", "jump", "Whole turns are jumped by"),
    ("", "late", "Rows seem to be lost: at 8 places, in run1 at 0.6"),
    ("", "coarse", "turn: its torque is a few steps of the readings"),
])  # fmt: skip
def test_what_makes_all_else_wrong_is_told_with_the_verdict(cli, tmp_path, wrong, flaw, told):
    keep_log(tmp_path, wrong, flaw)
    log, _ = imported(cli, tmp_path)
    _, summary, said = run(cli, "task=compare", log, "task.by=force_balance", *QUICK)
    first = summary["words"] if flaw == "coarse" else summary["words"][1:5]
    assert told in said and any(told in line for line in first), summary["words"]


def test_rows_that_repeat_the_last_reading_are_no_readings(cli, tmp_path):
    keep_log(tmp_path, "", "seldom")
    log, said = imported(cli, tmp_path)
    assert "the sensors were read every 20 ms" in said and "200 of 800 rows are readings of the sensors" in said
    second = read_run(Path(log.removeprefix("measured="))).trials[1].log
    assert np.array_equal(second.readings, np.arange(0, 800, 4))
    between = np.diff(second.sensors[:797, :3], axis=0)
    assert (between != 0).all(), "joints stand still between readings"
    _, summary, _ = run(cli, "task=compare", log, "task.by=force_balance", *QUICK)
    assert summary["error"] < 2.0 * summary["noise_floor"]
