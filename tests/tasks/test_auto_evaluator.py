"""Which evaluator a run gets that does not name one."""

from __future__ import annotations

import pytest

from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.tasks import wiring
from ee_dist.tasks.config import BudgetConfig, Config, EngineConfig, EvaluatorConfig, RayConfig

QUICK = BudgetConfig("quick", population=32, generations=6, crossovers=4, steps=300)


@pytest.mark.parametrize(("budget", "evaluator", "address", "expected"), [
    (QUICK, EvaluatorConfig(), None, "serial"),
    (BudgetConfig(), EvaluatorConfig(), None, "ray"),
    (QUICK, EvaluatorConfig(workers=2), None, "ray"),
    (QUICK, EvaluatorConfig(), "127.0.0.1:6379", "ray"),
    (QUICK, EvaluatorConfig("ray"), None, "ray"),
    (BudgetConfig(), EvaluatorConfig("serial"), None, "serial"),
])  # fmt: skip
def test_serial_for_a_small_budget_and_ray_where_it_pays_or_is_asked_for(
    monkeypatch, budget, evaluator, address, expected
):
    asked = []

    class Ray(SerialEvaluator):
        def __init__(self, make_engine, workers, chunk, address):
            asked.append((workers, address))
            super().__init__(make_engine())

    monkeypatch.setattr("ee_dist.tasks.wiring.RayApart", Ray)
    wiring.close_evaluators()
    wiring.evaluator_of(
        Config(engine=EngineConfig("mujoco"), budget=budget, evaluator=evaluator, ray=RayConfig(address))
    )
    wiring.close_evaluators()
    assert asked == ([(evaluator.workers, address)] if expected == "ray" else [])


def test_a_comparison_does_without_ray_unless_it_is_asked_for():
    for config, expected in (
        (Config(), "serial"),
        (Config(evaluator=EvaluatorConfig(workers=2)), "ray"),
        (Config(evaluator=EvaluatorConfig("ray")), "ray"),
        (Config(ray=RayConfig("127.0.0.1:6379")), "ray"),
    ):
        assert wiring.evaluator_name(wiring.for_few(config)) == expected


def test_a_second_engine_of_the_same_settings_leaves_the_first_at_work(monkeypatch):
    """explain plans a trial by the usual engine, and its report asks the problem's own once more."""
    wiring.close_evaluators()
    config = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
    first = wiring.evaluator_of(config, wiring.ONE_JOINT)
    ended = []
    monkeypatch.setattr(type(first), "close", lambda self: ended.append(self))
    second = wiring.evaluator_of(config)
    assert second is not first and not ended
    assert wiring.evaluator_of(config, wiring.ONE_JOINT) is first
    wiring.evaluator_of(Config(engine=EngineConfig("mujoco", 2), evaluator=EvaluatorConfig("serial")))
    assert set(map(id, ended)) == {id(first), id(second)}
    monkeypatch.undo()
    wiring.close_evaluators()
