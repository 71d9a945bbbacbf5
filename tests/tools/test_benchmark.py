"""The benchmark's pieces on tiny sizes: they run, measure what they say, and write the keys that programs read."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.urdf import read_urdf
from ee_dist.tasks.wiring import EngineMaker

ENGINES = ("pybullet", "mujoco")


@pytest.fixture(scope="module")
def urdf(tmp_path_factory: pytest.TempPathFactory) -> Path:
    from benchmarks.peers import write_urdf

    path = tmp_path_factory.mktemp("peers") / "quadruped.urdf"
    write_urdf(quadruped(), path)
    return path


@pytest.mark.parametrize("name", ENGINES)
def test_replayed_torques_make_the_motion_of_the_rollout(name):
    from benchmarks.steps import StepSetting, recorded_torques, sample_rollouts

    engine = EngineMaker(name, 1)()
    rollouts = sample_rollouts(StepSetting(name, 9, 30))
    torques = recorded_torques(engine, rollouts)
    bodies = engine._place(rollouts)
    for values in torques[:-1]:
        bodies.step(values, None)
    reached = bodies.read(True, True, False).base_pose[:, 0]
    start = quadruped().start_position_m[0]
    bodies.close()
    assert np.allclose(reached - start, [log.travel_m for log in engine.rollout(rollouts)], rtol=0, atol=1e-12)
    engine.close()


@pytest.mark.parametrize("name", ENGINES)
def test_a_step_measurement_has_its_keys(name):
    from benchmarks.steps import StepSetting, measure_steps

    weights = tuple(float(w) for w in np.linspace(-1, 1, 68))
    found = measure_steps(StepSetting(name, 3, 10, repeat=2, controllers=(weights,)))
    assert {"bare_cpu_us", "bare_wall_us", "rollout_cpu_us", "rollout_wall_us", "ratio_cpu", "ratio_wall"} <= set(found)
    assert ("one_call_cpu_us" in found) == (name == "mujoco")
    assert all(math.isfinite(v) and v > 0 for v in found.values())


@pytest.mark.parametrize("name", ENGINES)
def test_a_profile_adds_up_and_leaves_the_loop_as_it_was(name):
    from benchmarks.profile import profile
    from benchmarks.steps import StepSetting

    from ee_dist.engines import loop

    before = loop.DrivePath.step
    found = profile(StepSetting(name, 3, 10))
    parts = {row: us for row, us in found.items() if row != "in all"}
    assert {"engine: torques sent, step", "reading joints and contacts", "network", "drives"} <= set(parts)
    assert sum(parts.values()) == pytest.approx(found["in all"])
    assert loop.DrivePath.step is before


def test_offspring_of_a_run_differ_in_few_weights():
    from benchmarks.steps import StepSetting, sample_rollouts

    parent = (0.5,) * 68
    children = sample_rollouts(StepSetting("pybullet", 20, 5, controllers=(parent,)))
    changed = [sum(a != b for a, b in zip(r.driver.weights, parent, strict=True)) for r in children]
    assert 0 < sum(changed) < 20 * 68 * 0.05


def test_the_robot_of_the_peers_is_ours(urdf):
    body = read_urdf(urdf)
    ours = quadruped()
    assert sum(p.mass_kg for p in body.parts) == pytest.approx(sum(p.mass_kg for p in ours.parts))
    assert {j.name for j in body.joints} == {j.name for j in ours.joints}


@pytest.mark.parametrize(
    ("program", "arguments", "count"),
    [("naive_program", ("--evaluations", "3"), 3), ("deap_program", ("--population", "4", "--generations", "1"), 6)],
)
def test_a_peer_runs_and_says_what_it_did(urdf, program, arguments, count):
    from benchmarks.peers import run_peer

    if program == "deap_program":
        pytest.importorskip("deap")
    found = run_peer(program, urdf, *arguments, "--steps", "5", "--processes", "2")
    assert found["evaluations"] <= count
    assert found["steps"] == found["evaluations"] * 5
    assert found["wall_s"] > 0
    assert found["cpu_s"] > 0


def test_a_peer_that_fails_says_why(urdf):
    from benchmarks.peers import run_peer

    with pytest.raises(RuntimeError, match="naive_program: "):
        run_peer("naive_program", urdf, "--evaluations", "many")


def test_the_command_writes_its_table(tmp_path):
    import benchmark

    path = tmp_path / "table.json"
    sizes = ["--robots", "2", "--steps", "5", "--repeat", "1", "--workers", "1"]
    arguments = ["--quick", *sizes, "--parts", "steps", "--json", str(path), "--figures", str(tmp_path)]
    assert benchmark.main(arguments) == 0
    content = json.loads(path.read_text(encoding="utf-8"))
    assert {"format", "rows", "notes", "machine", "runs", "bare", "peers", "costs"} <= set(content)
    assert {"group", "name", "value", "unit", "ratio", "of", "aim", "note", "met"} == set(content["rows"][0])
    assert {"cores", "load_1_min", "shared"} <= set(content["machine"])
    assert set(content["bare"]) == set(ENGINES)
    assert list(tmp_path.glob("speed_step.*"))


def run_of(engine: str, workers: int) -> dict[str, object]:
    return {
        "engine": engine,
        "budget": "quick",
        "workers": workers,
        "wall_s": 20.0 / workers,
        "cpu_s": 20.0,
        "memory_mb": 700.0,
        "first_progress_s": 4.0,
        "first_progress_cpu_s": 3.0,
        "asked": 100,
        "simulated": 40,
        "whole_steps": 1_000_000,
        "asked_steps": 400_000,
        "steps": 300_000,
        "digest": "d",
    }


def test_rows_compare_a_run_with_its_limit_and_its_peers():
    from benchmarks.assess import peer_rows, run_rows, speed_up_rows

    bare = {"bare_cpu_us": 40.0, "bare_wall_us": 40.0}
    runs = [run_of("pybullet", 1), run_of("pybullet", 2)]
    rows = {r.name: r for r in run_rows(runs[1], bare, cores=2)}
    assert rows["wall time against the limit"].ratio == pytest.approx(10.0 / 6.0)
    assert rows["processor time against the limit"].ratio == pytest.approx(20.0 / 12.0)
    assert rows["wall time against the limit"].met is False
    assert rows["saved by stopping at the header"].ratio == pytest.approx(0.6)
    assert rows["saved by the cache"].ratio == pytest.approx(0.1)
    assert {r.name: r.ratio for r in speed_up_rows(runs)}["whole run"] == pytest.approx(2.0)
    cost = {"evaluations": 10, "steps": 1000, "wall_s": 0.1, "cpu_s": 0.24}
    peer = {r.name: r for r in peer_rows("Naive program", cost, runs, shared=False)}
    found = peer["all evaluations, against our run on PyBullet"]
    assert (found.value, found.ratio) == (pytest.approx(100.0), pytest.approx(10.0))
    assert found.met
    busy = {r.name: r.met for r in peer_rows("Naive program", cost, runs, shared=True)}
    assert busy["all evaluations, against our run on PyBullet"] is None
    assert busy["the same, processor time"] is True


@pytest.mark.slow
def test_a_whole_run_is_watched(tmp_path):
    from benchmarks.whole_run import RunSetting, run_scenario

    found = run_scenario(
        RunSetting("mujoco", "quick", 1, "serial"), tmp_path / "run", Path(__file__).resolve().parents[2]
    )
    assert found["first_progress_s"] is not None
    assert found["first_progress_s"] < found["wall_s"]
    assert found["steps"] <= found["asked_steps"] <= found["whole_steps"]
    # The rest are the predictions that go into the recording, and what pruning asks for.
    assert sum(g["simulated"] for g in found["generations"]) <= found["simulated"]
    assert len(found["controllers"]) == 6
