"""In how many simulated cases that looked like this one the verdict was right: nothing where nobody counted."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.confidence import FEWEST, MOST, RULE, Signs, confidence, foretold, misfit_of, signs_of
from ee_dist.discrepancy.examine import Effort
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, UNEXPLAINED, Explanation, explain
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.effects.catalogue import Hypothesis, term

QUICK = Effort(first=4, second=2, final=2, starts=1)
HIDDEN = term("coulomb_friction", "elbow", torque_nm=0.3)


def explained(hidden: Hypothesis, by: str = "open_loop") -> tuple[Problem, Explanation]:
    sample = samples()["arm"]
    problem = problem_by(by, measure(sample, hidden), sample.robot)
    pool = [parse(problem.robot, f"{e}@elbow") for e in ("coulomb_friction", "viscous_friction", "parallel_spring")]
    return problem, explain(problem, pool, (), effort=QUICK)


@pytest.fixture(scope="module")
def friction() -> tuple[Problem, Explanation]:
    return explained((HIDDEN,))


signs = st.builds(Signs, st.floats(0, MOST), st.floats(-1, MOST), st.sampled_from([0.0, 1.0]))


@given(signs, st.floats(0, 1))
def test_more_evidence_and_a_wider_lead_are_surer_and_a_rest_less(one: Signs, more: float) -> None:
    here = foretold(one)
    assert 0.0 < here < 1.0
    assert foretold(replace(one, evidence=one.evidence + more)) >= here
    assert foretold(replace(one, ahead=one.ahead + more)) >= here
    assert foretold(replace(one, rest=1.0)) < foretold(replace(one, rest=0.0))


def test_an_effect_that_is_plain_has_plain_signs(friction: tuple[Problem, Explanation]) -> None:
    _, found = friction
    seen = signs_of(found)
    assert found.verdict == EFFECT and seen is not None
    assert seen.evidence > 1.0 and seen.rest == 0.0 and misfit_of(found) < 1.2
    assert 0.9 < (confidence("open_loop", found) or 0.0) < 1.0


def test_a_rest_counts_against_it_and_so_does_a_tie(friction: tuple[Problem, Explanation]) -> None:
    _, found = friction
    plain = confidence("open_loop", found) or 0.0
    left = replace_examined(found, left=[object()])
    assert (confidence("open_loop", left) or 1.0) < plain


def replace_examined(found: Explanation, **changes: object) -> Explanation:
    return replace(found, examined=replace(found.examined, **changes))  # type: ignore[arg-type]


def test_the_interval_of_what_is_found_holds_the_truth(friction: tuple[Problem, Explanation]) -> None:
    problem, found = friction
    assert found.best is not None and found.best.name == HIDDEN.name
    (torque,) = found.parameters
    (told,) = found.best.terms[0].values
    assert (torque.name, torque.value) == (told[0], pytest.approx(told[1])), "of the value that is told"
    assert torque.low < dict(HIDDEN.values)[torque.name] < torque.high < 1.5 * torque.value
    assert "95 % intervals: torque" in explain_account(problem, found, None).sure
    assert explained(())[1].parameters == []


def test_nothing_is_said_of_what_nobody_counted(
    friction: tuple[Problem, Explanation], monkeypatch: pytest.MonkeyPatch
) -> None:
    problem, found = friction
    assert confidence("force_balance", found) is None
    strict = replace(RULE, misfit=0.5)
    assert confidence("open_loop", found, strict) is None, "no case fitted as badly"
    assert found.best is not None
    sure = explain_account(problem, found, None, "", None).sure
    assert "Too few of the simulated cases that were counted looked like this one" in sure
    monkeypatch.setattr(problem, "way", "force_balance")
    other = explain_account(problem, found, None).sure
    assert other.endswith("How often verdicts are right was counted for open_loop alone, not for force_balance.")


def test_other_verdicts_are_right_as_often_as_they_were() -> None:
    problem, found = explained(())
    assert found.verdict == NOTHING_MISSING and signs_of(found) is None
    cases, right = RULE.counted[NOTHING_MISSING]
    share = confidence("open_loop", found)
    assert share == pytest.approx(right / cases, abs=0.02)
    said = explain_account(problem, found, None, "", share).sure
    assert said.endswith(
        f"In {100 * (share or 0):.0f} of 100 simulated cases that looked like this one, the verdict was right."
    )
    few = replace(RULE, counted={UNEXPLAINED: (FEWEST - 1, FEWEST - 1)})
    assert confidence("open_loop", SimpleNamespace(verdict=UNEXPLAINED, best=None), few) is None  # type: ignore[arg-type]


def test_why_fewer_were_tried_than_were_there_is_said(friction: tuple[Problem, Explanation]) -> None:
    problem, found = friction
    assert found.offered == found.tried == 3
    assert any(line.endswith("3 explanations were tried.") for line in explain_account(problem, found, None).lines)
    for offered, before, said in (
        (5, (), "tried; 2 more candidates would change what the model has none of."),
        (4, (HIDDEN,), "tried; 1 more candidate is in the model already, or would change what it has none of."),
    ):
        fewer = replace(found, offered=offered, before=before)
        assert any(line.endswith(said) for line in explain_account(problem, fewer, None).lines)
