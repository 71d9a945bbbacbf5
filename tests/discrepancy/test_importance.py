"""What each added effect is worth, and which names are told with a doubt."""

from __future__ import annotations

import math

import numpy as np
import pytest

from ee_dist.discrepancy.accounts.of_improve import doubt_text
from ee_dist.discrepancy.evidence.worth import Worth
from ee_dist.discrepancy.importance import shares
from ee_dist.discrepancy.ladder import Improvement, Rung
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.robots.quadruped import quadruped

HIP, KNEE = "hip_front_left", "knee_front_left"
SHARED = term("coulomb_friction", "all_joints", torque_nm=0.3)
LESS = term("coulomb_friction", HIP, torque_nm=-0.1)
OFFSET = term("zero_offset", KNEE, offset_rad=0.02)
GAIN = term("sensor_gain", "angle_hip_front_left", change=0.1)
TERMS = (GAIN, OFFSET, LESS, SHARED)


def linear(seed: int = 0) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Slopes (n, P), values (P,) and data (n,) of a linear problem."""
    rng = np.random.default_rng(seed)
    slopes = rng.normal(size=(200, 4)) @ rng.normal(size=(4, 4))
    y = slopes @ rng.normal(size=4) + 0.1 * rng.normal(size=200)
    return slopes, np.linalg.lstsq(slopes, y)[0], y


def worth(above: float, seed: int = 0) -> Worth:
    slopes, u, _ = linear(seed)
    return Worth(tuple(t.name for t in TERMS), tuple(slice(k, k + 1) for k in range(4)), u, slopes.T @ slopes, above)


def found(explained: float, values: dict[str, float], added: Hypothesis = TERMS) -> Improvement:
    """A model of effects whose slopes have nothing in common, so that a worth is the square of a value."""
    names = tuple(t.name for t in TERMS)
    u = np.sqrt([values.get(n, 0.0) for n in names])
    nothing = np.zeros(0)
    ladder = [Rung("", added, TERMS, 0.0, 0.0, nothing, "")]
    out = Improvement("", explained, ladder, TERMS, [], nothing, nothing, 1.0, "", [], "")
    out.worth = Worth(names, tuple(slice(k, k + 1) for k in range(4)), u, np.eye(4), 1.0)
    return out


@pytest.mark.parametrize("gone", [(0,), (3,), (1, 2), (0, 1, 2)])
@pytest.mark.parametrize("seed", [0, 1])
def test_what_is_worth_is_what_a_fit_without_it_leaves_more(gone: tuple[int, ...], seed: int) -> None:
    slopes, u, y = linear(seed)
    kept = [k for k in range(4) if k not in gone]
    without = np.linalg.lstsq(slopes[:, kept], y)[0]
    more = float(((y - slopes[:, kept] @ without) ** 2).sum() - ((y - slopes @ u) ** 2).sum())
    assert worth(1000.0 * more, seed).of([TERMS[k].name for k in gone]) == pytest.approx(0.001)


def test_two_that_do_the_same_are_worth_nothing_alone_and_all_together() -> None:
    same = np.array([[1.0, 1.0], [1.0, 1.0]])
    twins = Worth(("a", "b"), (slice(0, 1), slice(1, 2)), np.array([0.5, 0.5]), same, 1.0)
    assert twins.of(["a"]) == pytest.approx(0.0, abs=1e-12)
    assert twins.of(["a", "b"]) == pytest.approx(1.0)


def test_nothing_is_said_of_what_was_not_fitted_or_where_nothing_was_to_be_explained() -> None:
    assert math.isnan(worth(1.0).of(["rotor_inertia@arm"]))
    assert math.isnan(worth(0.0).of([OFFSET.name]))
    assert math.isnan(worth(math.inf).of([OFFSET.name]))


def test_what_most_depends_on_comes_first_and_what_joints_share_counts_with_its_spread() -> None:
    result = found(1.0, {SHARED.name: 0.3, LESS.name: 0.1, OFFSET.name: 0.5, GAIN.name: 0.02})
    told = shares(result, quadruped())
    assert [s.terms for s in told] == [(OFFSET,), (LESS,), (SHARED,), (GAIN,)]
    assert [s.worth for s in told] == pytest.approx([0.5, 0.4, 0.4, 0.02])
    assert not any(s.doubted for s in told)


def test_a_name_that_less_depends_on_than_is_left_is_doubted() -> None:
    values = {SHARED.name: 0.3, OFFSET.name: 0.5, GAIN.name: 0.02}
    doubted = [s for s in shares(found(0.95, values), quadruped()) if s.doubted]
    assert [s.terms for s in doubted] == [(GAIN,)]
    (line,) = doubt_text(doubted)
    assert line.startswith("Less depends on this than is left unexplained") and "sensor gain" in line
    assert doubt_text([s for s in shares(found(0.99, values), quadruped()) if s.doubted]) == []


def test_only_what_was_added_is_told() -> None:
    assert [s.terms for s in shares(found(0.5, {OFFSET.name: 0.4}, (OFFSET,)), quadruped())] == [(OFFSET,)]
