"""Values of somebody's file in a message: recognisable, and never longer than anybody reads."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from ee_dist.basics.names import LISTED, did_you_mean, listed
from ee_dist.basics.quoted import LONGEST, quoted

PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=200) | st.binary(max_size=200),
    lambda inner: st.lists(inner, max_size=9) | st.dictionaries(st.text(max_size=90), inner, max_size=9),
    max_leaves=8,
)


@settings(max_examples=30, derandomize=True, deadline=None)
@given(PLAIN)
def test_one_short_line(value):
    text = quoted(value)
    assert len(text) <= LONGEST
    assert "\n" not in text


@pytest.mark.parametrize("value", ["knee_2", 3.5, None, ["a", 1], {"a": 1}, True])
def test_what_is_short_is_shown_as_it_is(value):
    assert quoted(value) == repr(value)


def test_what_is_long_keeps_its_ends():
    assert quoted("x" * 10**7 + "end").endswith("end'")
    assert quoted({"first": list(range(10**6))}).startswith("{'first': [0, 1, ")


def test_a_list_of_names_says_how_many_more_there_are():
    names = [f"joint_{k}" for k in range(5000)]
    text = listed(names)
    assert len(text) < LISTED + 20
    shown = text.split(" and ")[0].split(", ")
    assert text.endswith(f" and {5000 - len(shown)} more")
    assert listed([]) == "none"
    assert len(did_you_mean("elbow", names)) < LISTED + 40
    assert len(did_you_mean("j" * 10**6, ["j" * 10**6])) < LISTED + 40


def test_a_name_with_a_line_break_does_not_break_the_message():
    assert did_you_mean("wing", ["w\ning", "tail"]) == "did you mean w\\ning?"
    assert "\n" not in did_you_mean("zzz", ["w\ning", "tail"]) + listed(["w\ning"])
