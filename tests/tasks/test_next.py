"""The command to type next does what was done with the same engine, way and effects of one's own, whatever is in its paths."""

from __future__ import annotations

import shlex

import pytest
from hydra.core.override_parser.overrides_parser import OverridesParser

from ee_dist.tasks.config import AUTO, Config, EngineConfig
from ee_dist.tasks.results.commands import asked, command, setting

NAMES = ("plain.mcap", "with a space/a#b.mcap", "ünï,code=[1].mcap", "Müller/trial", "bob's/it's\\'so\\")


def read(line: str) -> dict[str, object]:
    """What a shell and Hydra make of it."""
    words = shlex.split(line)
    assert words[:3] == ["python", "-m", "ee_dist"]
    return {o.key_or_group: o.value() for o in OverridesParser.create().parse_overrides(words[3:])}


@pytest.mark.parametrize("measured", [*NAMES, list(NAMES)])
def test_files_come_through_a_shell(measured):
    config = Config(measured=measured, model="a b.yaml", plugins=["my effects.py"], engine=EngineConfig("mujoco"))
    assert read(command(asked("explain", config, "free_run"))) == {
        "task": "explain", "measured": measured, "model": "a b.yaml", "task.by": "free_run", "engine": "mujoco",
        "plugins": ["my effects.py"],
    }  # fmt: skip


def test_what_every_run_has_is_left_out():
    assert asked("compare", Config(measured="a.mcap"), AUTO) == ["task=compare", "measured=a.mcap"]


def test_a_pair_of_joints_needs_no_quotes():
    words = [setting("effect", "motors_swapped@hip_front_left+knee_front_left")]
    assert command(words).endswith(" effect=motors_swapped@hip_front_left+knee_front_left")
    assert read(command(words)) == {"effect": "motors_swapped@hip_front_left+knee_front_left"}


@pytest.mark.parametrize(
    "name", ["+1", "123", "1e3", "-0.5", "1_000", "null", "True", "nan", "", "a@Gelenk_ü", "2024-05-01"]
)
def test_words_stay_words(name):
    assert read(command([setting("effect", name)])) == {"effect": name}


@pytest.mark.parametrize(
    ("asked_for", "word"),
    [([10, 11], "trials=[10,11]"), (["slow"], "trials=slow"), (["a b", 3], "trials=['a b','3']"), (None, ""), ([], "")],
)
def test_trials_are_asked_for_as_they_were(asked_for, word):
    words = asked("compare", Config(measured="a.mcap", trials=asked_for))
    assert [w for w in words if w.startswith("trials")] == ([word] if word else [])
    read(command(words))


@pytest.mark.parametrize("name", ["idf_pos_*", "a b", "it's", "$HOME", '"', "back\\slash", "!", "`ls`"])
def test_names_with_marks_come_through_a_shell(name):
    """And as few quotes as it takes: patterns none, words with a space one pair in another."""
    line = command([setting("held_out", [name, "c"])])
    assert read(line) == {"held_out": [name, "c"]}
    assert ("'\"'\"'" in line) == (name not in ("idf_pos_*", "a b"))
