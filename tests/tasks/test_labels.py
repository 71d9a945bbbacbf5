"""A trial is named with its number wherever it is named: repeats of a motion have one name."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from ee_dist.discrepancy.compare import trial_name
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.effects.catalogue import Term, term
from ee_dist.robots.quadruped import quadruped
from ee_dist.tasks import trial
from ee_dist.tasks.config import Config, EngineConfig, RobotConfig
from ee_dist.tasks.results import sections
from ee_dist.tasks.results.labels import excess_share, refused_heading
from ee_dist.tasks.results.tables import candidate_label
from ee_dist.viewing.curves import Overlay


def test_a_trial_is_told_from_its_repeat() -> None:
    several = SimpleNamespace(trials=("sway", "sway"), numbers=(1, 2))
    one, chosen = (SimpleNamespace(trials=("sway",), numbers=(number,)) for number in (1, 3))
    assert [trial_name(several, k) for k in range(2)] == ["1. sway", "2. sway"]  # type: ignore[arg-type]
    assert trial_name(one, 0) == "sway"  # type: ignore[arg-type]
    assert trial_name(chosen, 0) == "3. sway", "there are others in its log"  # type: ignore[arg-type]


def test_what_came_into_the_model_in_the_end_is_not_told_to_be_refused() -> None:
    dry, load = term("coulomb_friction", "servo", torque_nm=0.2), term("load_friction", "servo", share=0.1)
    tried = [SimpleNamespace(terms=(t,), earned=False, error_without=1.03) for t in (dry, load)]
    found = Improvement.__new__(Improvement)
    found.terms, found.last = (dry,), SimpleNamespace(judged=tried)  # type: ignore[assignment]
    assert found.refused == tried[1:]
    problem = SimpleNamespace(told=lambda e: f"{e:.3g}")
    for error, said in ((1.03, "Tried on top of it, and refused"), (1.01, "Tried on the way to it, and refused")):
        found.ladder = [SimpleNamespace(error_heldout=error)]  # type: ignore[list-item]
        assert refused_heading(problem, found) == said  # type: ignore[arg-type]


def test_shares_of_next_to_nothing_are_not_told() -> None:
    regimes = [SimpleNamespace(share=s) for s in (1.0, 0.0, 0.5)]
    for error, said in ((1.02, ["-", "-", "-"]), (3.0, ["100 %", "0 %", "50 %"])):
        found = SimpleNamespace(error=error, noise_floor=1.0)
        assert [excess_share(found, r) for r in regimes] == said  # type: ignore[arg-type]


@pytest.mark.parametrize(("noise", "said"), [(0.0004, "0.04 %"), (0.02, "2 %")])
def test_little_noise_is_not_none(noise: float, said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    config = Config(robot=RobotConfig(name="servo_pendulum"), engine=EngineConfig("mujoco"))
    trial.run(config, trial.Options(excitations=["multisine:seconds=0.5"], repeats=1, noise=noise), tmp_path)
    assert f"Noise: {said} of each channel's range." in capsys.readouterr().out


def test_values_of_many_places_are_told_one_by_one_only_where_they_were_earned() -> None:
    robot = quadruped()
    places = zip(robot.motor_names, (0.1, 0.2, 0.15), strict=False)
    terms = tuple(Term("coulomb_friction", name, (("torque_nm", value),)) for name, value in places)
    each, short = (candidate_label(SimpleNamespace(terms=terms, earned=e), robot) for e in (True, False))  # type: ignore[arg-type]
    assert "each joint by itself" in each and "0.15 N.m" in each
    assert short == "coulomb friction at 3 joints (torque 0.1 to 0.2 N.m)"


def test_what_only_makes_a_channel_rougher_is_shown_on_that_channel(monkeypatch: pytest.MonkeyPatch) -> None:
    """Readings gain nothing by it: what gains is compared besides them."""
    monkeypatch.setattr(sections, "span_of", lambda *_: (0.0, 1.0))
    times = np.linspace(0, 1, 50)
    overlays = [Overlay(c, "sway", "rad", times, times, times, times, 1.0) for c in ("a", "b")]
    problem = SimpleNamespace(
        channels=("a", "b"), segments=("sway@0.0s",), trials=("sway",), numbers=(1,), trial_of_segment=np.zeros(1, int),
        segment_of=np.zeros(4, int), channel_of=np.array([0, 1, 0, 1]), floor=np.ones(4),
        layout=SimpleNamespace(reading=np.array([True, True, False, False])),
    )  # fmt: skip
    before, after = np.array([1.0, 1.0, 1.0, 9.0]), np.ones(4)
    models = [("model", ()), ("improved model", ())]
    shown = sections.proof_section(problem, overlays, before, models, after)  # type: ignore[arg-type]
    assert shown is not None and "most: b, in trial" in shown.heading
