"""The page of effects says what the effects say."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from ee_dist.effects import CATALOGUE

ROOT = Path(__file__).parents[2]


def test_the_page_is_up_to_date() -> None:
    spec = importlib.util.spec_from_file_location("catalogue_page", ROOT / "tools" / "catalogue.py")
    assert spec is not None
    assert spec.loader is not None
    tool = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(tool)
    assert (ROOT / "docs" / "effects.md").read_text() == tool.page(), "run: python tools/catalogue.py"
    assert all(f"**{name}**" in tool.page() for name in CATALOGUE)
