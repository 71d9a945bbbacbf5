"""The page of effects says what the effects say."""

from __future__ import annotations

import importlib.util
from dataclasses import replace
from pathlib import Path

import pytest

from ee_dist.effects import CATALOGUE
from ee_dist.effects.catalogue import find, term
from ee_dist.effects.described import check_written
from ee_dist.effects.effect import EffectError
from ee_dist.robots.servo_pendulum import servo_pendulum

ROOT = Path(__file__).parents[2]


def page() -> str:
    spec = importlib.util.spec_from_file_location("catalogue_page", ROOT / "tools" / "catalogue.py")
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    return str(tool.page())


def test_the_page_is_up_to_date() -> None:
    assert (ROOT / "docs" / "effects.md").read_text() == page(), "run: python tools/catalogue.py"
    assert all(f"**{name}**" in page() for name in CATALOGUE)


def test_what_can_only_be_taken_off_what_is_described_has_no_other_lower_limit() -> None:
    """What the page allows a model file may say."""
    rows = {line.split("**")[1]: line for line in page().splitlines() if line.startswith("| **")}
    assert "| 0 | -described to 2 |" in rows["command_delay"] and "| from -described |" in rows["viscous_friction"]
    late = servo_pendulum().map_drive("servo", lambda d: replace(d, delay_s=0.01))
    check_written(late, (term("command_delay", "servo", delay_s=-0.01),))
    for robot, least in ((late, "-0.01"), (servo_pendulum(), "0")):
        with pytest.raises(EffectError, match=f"cannot be taken off, so that delay_s is {least} or more"):
            check_written(robot, (term("command_delay", "servo", delay_s=-0.02),))
        assert find("command_delay").bounds(robot, "servo")["delay_s"][0] == float(least)
