"""What was desired is no measurement, whatever it is called: it is named in pairs, it runs ahead, and it has no noise."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements import signals
from ee_dist.measurements.proposal.model import Proposal
from ee_dist.measurements.proposal.pairs import spelled_out
from ee_dist.measurements.proposal.words import POSITION, read_name

JOINTS = ("arm_1", "arm_2", "arm_3", "arm_4")
T = np.arange(600) / 100


def plan(t: np.ndarray) -> np.ndarray:
    """A rest, a smooth motion, a rest, (T, 4)."""
    s = np.clip((t - 0.5) / 4, 0, 1)[:, None]
    return np.array([0.5, 1.2, -0.9, 0.6]) * (10 * s**3 - 15 * s**4 + 6 * s**5)


def log(names: str, late_s: float = 0.12, stuck: bool = True, noisy: tuple[str, ...] = ("a",)) -> pd.DataFrame:
    """Positions and speeds that were desired (d) and that were (a) in columns by ``names``; the last joint is ``stuck``."""
    rng = np.random.default_rng(3)
    found = {"time": T}
    asked, seen = plan(T), plan(T - late_s)
    if stuck:
        seen[:, -1] = 0.004 * np.clip(plan(T)[:, -1] / 0.1, 0, 1)
    for what, values in (("d", asked), ("a", seen)):
        values = np.round(values + 2e-4 * (what in noisy) * rng.standard_normal(values.shape), 6)
        rate = np.gradient(plan(T if what == "d" else T - late_s), T, axis=0)
        if stuck and what == "a":
            rate[:, -1] = np.round(rng.standard_normal(len(T)) * 0.3) * 0.002
        for k in range(4):
            found[names.format(quantity="pos", what=what, number=k + 1)] = values[:, k]
            found[names.format(quantity="vel", what=what, number=k + 1)] = rate[:, k]
    return pd.DataFrame(found)


def columns(proposal: Proposal, group: str) -> list[str]:
    return [c.column for c in proposal.choices if c.group == group and not c.name.startswith("velocity")]


@pytest.mark.parametrize("names", ["{quantity}{what}{number}.txt", "{quantity}_{what}{number}"])
@pytest.mark.parametrize("late_s", [0.12, 0.0])
def test_a_letter_in_a_pair_tells_what_was_desired(tmp_path: Path, names: str, late_s: float) -> None:
    file = logs.written(tmp_path, log(names, late_s, noisy=()))
    _, proposal = logs.proposed(tmp_path, file, JOINTS)
    called = lambda q, w: [names.format(quantity=q, what=w, number=k) for k in range(1, 5)]  # noqa: E731
    assert not proposal.questions
    assert columns(proposal, "sensors") == called("pos", "a")
    assert columns(proposal, "commands") == called("pos", "d")
    speeds = [c.column for c in proposal.choices if c.name.startswith("velocity")]
    assert speeds[:3] == called("vel", "a")[:3]


WORDS = {"a": "alpha", "d": "beta"}


def mute(frame: pd.DataFrame) -> pd.DataFrame:
    """The same in columns whose names say nothing."""
    return frame.rename(columns=lambda n: n if n == "time" else f"{n[:3]}_{WORDS[n[3]]}{n[4:]}")


def test_what_has_no_noise_and_runs_ahead_is_the_plan(tmp_path: Path) -> None:
    file = logs.written(tmp_path, mute(log("{quantity}{what}{number}")))
    _, proposal = logs.proposed(tmp_path, file, JOINTS)
    assert columns(proposal, "sensors")[:4] == [f"pos_alpha{k}" for k in range(1, 5)]
    assert "noise" in next(c.why for c in proposal.choices if c.name == "position_arm_1")


@pytest.mark.parametrize(("late_s", "noisy"), [(0.12, ("d",)), (0.01, ())])
def test_what_cannot_be_told_apart_is_asked(tmp_path: Path, late_s: float, noisy: tuple[str, ...]) -> None:
    file = logs.written(tmp_path, mute(log("{quantity}{what}{number}", late_s, stuck=False, noisy=noisy)))
    _, proposal = logs.proposed(tmp_path, file, JOINTS)
    assert any(q.startswith("positions: ") and "alpha" in q and "beta" in q for q in proposal.questions)


def test_a_joint_that_hardly_moves_decides_nothing() -> None:
    asked, seen = plan(T), plan(T - 0.12)
    seen[:, 3] = 0.004 * np.clip(plan(T + 0.3)[:, 3] / 0.1, 0, 1)
    assert signals.lively(seen) == [0, 1, 2]
    ahead = signals.lead(asked, seen, 0.01)
    assert ahead.lead_s == pytest.approx(0.12) and ahead.correlation > 0.9999
    assert signals.lively(seen[:, 3:]) == [0], "alone it is all there is"


def test_of_seven_joints_of_which_two_are_driven_these_decide() -> None:
    wave, rng = plan(T)[:, 0], np.random.default_rng(0)
    held = 0.002 * np.ptp(wave) * rng.standard_normal((len(T), 5)).clip(-1, 1)
    seen = np.column_stack([held[:, 0], wave, held[:, 1], 0.7 * wave, held[:, 2:]])
    assert signals.lively(seen) == [1, 3]


def test_letters_in_pairs_only() -> None:
    assert spelled_out(["posd1", "posa1", "accd1", "time"]) == {"posd1": "pos desired 1", "posa1": "pos actual 1"}
    assert not spelled_out(["q", "qd", "qdd", "qa"])
    assert not spelled_out([f"pos_{x}" for x in "abcd"])
    assert not spelled_out(["posd1", "posa2"])


@pytest.mark.parametrize(
    ("name", "kind", "command"),
    [
        ("qdes1", POSITION, True),
        ("cmdpos_2", POSITION, True),
        ("posact3", POSITION, False),
        ("torque", "torque", None),
        ("jointacttorque_1", "torque", False),
        ("motorcurrent2", "current", None),
        ("jointstate", None, None),
    ],
)
def test_words_that_are_glued_together(name: str, kind: str, command: bool | None) -> None:
    assert (read_name(name).kind, read_name(name).command) == (kind, command)
