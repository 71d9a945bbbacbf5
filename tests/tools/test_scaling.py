"""The scaling model: what must hold of it whatever the costs, and (slow) what it predicts against what was measured."""

from __future__ import annotations

import json

import pytest

COSTS = {
    "per_batch_step_s": 5e-5,
    "per_robot_step_s": 3e-5,
    "set_up_s": 2e-4,
    "call_s": 1e-3,
    "per_call_s": 2e-4,
    "per_sent_s": 5e-5,
    "per_asked_s": 1e-4,
    "per_generation_s": 2e-3,
    "start_s": 5.0,
}
TRACE = [{"asked": 200, "simulated": 200, "steps": 1000}, *[{"asked": 100, "simulated": 50, "steps": 1000}] * 20]


@pytest.fixture
def model():
    from benchmarks.scaling_model import Costs, generations

    return generations(TRACE), Costs.of(COSTS)


@pytest.mark.parametrize("workers", [1, 2, 7, 100, 10000])
def test_the_parts_add_up_to_the_wall_time(model, workers):
    from benchmarks.scaling_model import simulate

    found = simulate(*model, workers)
    assert sum(found.parts.values()) == pytest.approx(found.wall_s)
    assert 0 < found.busy <= 1


def test_more_cores_help_until_each_worker_has_one_robot(model):
    from benchmarks.scaling_model import limit_s, simulate

    walls = [simulate(*model, n).wall_s for n in (1, 2, 4, 8, 16, 50, 200, 1000, 10000)]
    assert walls == sorted(walls, reverse=True)
    assert walls[-1] == walls[-2] == limit_s(*model)
    assert walls[0] / walls[1] > 1.5


def test_one_worker_does_all_the_work_one_after_the_other(model):
    from benchmarks.scaling_model import simulate

    trace, costs = model
    found = simulate(trace, costs, 1)
    least = costs.start_s + sum(g.simulated * g.steps for g in trace) * costs.per_robot_step_s
    assert found.wall_s > least
    assert found.parts["waiting"] < 0.05 * found.wall_s


def test_a_study_runs_side_by_side_where_that_is_faster(model):
    from benchmarks.scaling_model import simulate, study

    trace, costs = model
    alone = simulate(trace, costs, 1).wall_s
    assert study(trace, costs, 1, 10) == (pytest.approx(10 * alone), 1)
    assert study(trace, costs, 10, 10) == (pytest.approx(alone), 10)
    assert study(trace, costs, 5000, 10)[0] < alone


def test_the_command_writes_its_curves(tmp_path):
    import scaling

    source, out = tmp_path / "benchmark.json", tmp_path / "curves.json"
    run = {"engine": "pybullet", "workers": 2, "wall_s": 100.0, "generations": TRACE}
    source.write_text(json.dumps({"runs": [run], "costs": {"pybullet": COSTS, "mujoco": COSTS}}), encoding="utf-8")
    assert scaling.main(["--json", str(source), "--out", str(out)]) == 0
    content = json.loads(out.read_text(encoding="utf-8"))
    assert set(content["curves"]) == {"pybullet", "mujoco"}
    row = content["curves"]["pybullet"][0]
    assert {"cores", "run_s", "start_s", "search_s", "work_s", "waiting_s", "busy", "study_s", "side_by_side"} == set(
        row
    )


@pytest.mark.slow
def test_two_workers_and_two_nodes_come_close_to_the_prediction():
    from benchmarks.costs import measure_costs
    from benchmarks.scaling_check import CheckSetting, check
    from benchmarks.scaling_model import Costs

    costs = Costs.of({**measure_costs("pybullet", quick=False), "start_s": 0.0})
    found = check(CheckSetting("pybullet", population=48, generations=2, steps=300, repeat=2), costs)
    assert found["nodes"] == 2
    assert found["same_result"]
    # On a machine that others use, two workers get what two processes get that share nothing.
    most = min(found["speed_up_predicted"], found["speed_up_possible"])
    assert 0.5 * most < found["speed_up_measured"] < 2.0 * most
