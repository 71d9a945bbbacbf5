"""Trials by name: which are looked at, and which are held out from all of it."""

from __future__ import annotations

from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from ee_dist.discrepancy.last_word import LastWord
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.trial_choice import TrialName, divided

TRIALS = [
    TrialName(1, "monday", "slow"), TrialName(2, "monday", "fast"), TrialName(3, "tuesday", "slow"), TrialName(4, "tuesday", "7")
]  # fmt: skip


@pytest.mark.parametrize(
    ("only", "held", "kept", "apart"),
    [
        (None, None, [0, 1, 2, 3], []),
        ([], [], [0, 1, 2, 3], []),
        (["slow"], None, [0, 2], []),
        ("fast", None, [1], []),
        (None, "s*", [1, 3], [0, 2]),
        (None, ["tuesday"], [0, 1], [2, 3]),
        (["slow"], ["tuesday/*"], [0], [2, 3]),
        (None, ["tuesday/slow", 2], [0, 3], [1, 2]),
        ([7], None, [3], []),
        (["3"], ["monday"], [2], [0, 1]),
    ],
)
def test_names_files_patterns_and_numbers(only, held, kept, apart):
    assert divided(TRIALS, only, held) == (kept, apart)


@pytest.mark.parametrize(
    ("only", "held", "said"),
    [
        (["slw"], None, "trials=[slw]: no trial 'slw'; did you mean slow"),
        (None, ["noon"], "held_out=[noon]: no trial 'noon'; did you mean monday? there are 1. slow, 2. fast, 3. slow, 4. 7"),
        (None, [5], "held_out=[5]: no trial '5'"),
        (None, ["*"], "held_out=[*]: no trial is left to look at"),
        (["fast"], ["monday"], "no trial is left"),
        ({"a": 1}, None, "no trial"),
    ],
)  # fmt: skip
def test_what_names_none_is_told_with_what_there_is(only, held, said):
    with pytest.raises(ConfigError, match="no trial") as told:
        divided(TRIALS, only, held)
    assert said in str(told.value)


def test_a_name_that_looks_like_a_pattern_is_a_name():
    odd = [TrialName(1, "a", "run[1]"), TrialName(2, "a", "run1")]
    assert divided(odd, ["run[1]"], None) == ([0], [])


@given(st.lists(st.integers(1, 4)), st.lists(st.integers(1, 4)))
def test_no_trial_is_on_both_sides(only, held):
    try:
        kept, apart = divided(TRIALS, only, held)
    except ConfigError:
        asked = set(only) or {1, 2, 3, 7}
        assert {3 if n == 7 else n - 1 for n in asked} <= {n - 1 for n in held}
        return
    assert not set(kept) & set(apart) and kept
    assert set(apart) == {n - 1 for n in held}


@pytest.mark.parametrize(("after", "worse"), [(0.5, False), (1.0, False), (2.0, True)])
def test_a_model_that_is_worse_there_is_called_so(after, worse):
    problem = SimpleNamespace(trials=("jump",), numbers=(3,), told=lambda e: f"{e:g} mm")
    word = LastWord(problem, 1.0, after, 0.4, ((1.0, after),), (), True)  # type: ignore[arg-type]
    assert word.text.startswith(
        f"Held out from all of it (3. jump): model 1 mm, improved model {after:g} mm, noise floor 0.4 mm."
    )
    assert ("is the worse one" in word.text) is worse
