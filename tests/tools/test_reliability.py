"""The rule behind the confidence: found again from cases made by one, and caught where it says too much."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.discrepancy.confidence import Rule, Signs, foretold
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, UNEXPLAINED

TRUE = Rule(-1.0, Signs(1.0, 0.5, -1.5), 5.0, {})


@pytest.fixture(scope="module")
def cases():
    rng = np.random.default_rng(0)
    out = []
    for k in range(1500):
        signs = {"evidence": rng.uniform(0, 3), "ahead": rng.uniform(-1, 3), "rest": float(rng.random() < 0.4)}
        right = bool(rng.random() < foretold(Signs(**signs), TRUE))
        out.append({"verdict": EFFECT, "signs": signs, "misfit": rng.uniform(1, 5), "right": right, "kind": "clean",
                    "robot": "arm", "noise": 0.01, "trials": 1 + k % 2})  # fmt: skip
    return out


def test_the_rule_that_made_the_cases_is_found(cases):
    from benchmarks.reliability import fitted

    rule = fitted(cases)
    assert rule.constant == pytest.approx(TRUE.constant, abs=0.4)
    assert rule.weights.evidence == pytest.approx(1.0, abs=0.2)
    assert rule.weights.ahead == pytest.approx(0.5, abs=0.2)
    assert rule.weights.rest == pytest.approx(-1.5, abs=0.4)
    assert rule.misfit == pytest.approx(5.0, abs=0.1)


def test_cases_left_out_are_foretold_and_a_rule_that_says_too_much_is_caught(cases):
    from benchmarks.reliability import crossed, off

    said = np.array(crossed(cases), dtype=float)
    right = np.array([c["right"] for c in cases], dtype=float)
    assert off(said, right) < 0.04
    assert off(np.minimum(said + 0.15, 1.0), right) > 0.08


def test_nothing_is_said_where_too_few_were_counted(cases):
    from benchmarks.reliability import fitted, told

    more = [{**cases[0], "verdict": NOTHING_MISSING, "signs": None, "right": k > 1} for k in range(30)]
    rule = fitted([*cases, *more])
    assert rule.counted == {NOTHING_MISSING: (30, 28), UNEXPLAINED: (0, 0)}
    assert told(more[0], rule) == pytest.approx(29 / 32)
    assert told({**more[0], "verdict": UNEXPLAINED}, rule) is None
    assert told({**cases[0], "misfit": 99.0}, rule) is None


def test_the_report_has_a_diagram_and_a_grid(cases, capsys):
    from benchmarks.reliability import report

    report(cases[:300], cases[300:500])
    said = capsys.readouterr().out
    assert "expected calibration error" in said and "by trials" in said and "were right" in said
