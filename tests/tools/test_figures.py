"""Every picture that the documentation shows is made by a tool, and shown by a page."""

from __future__ import annotations

from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PICTURES = sorted(p.name for p in (ROOT / "docs" / "figures").glob("*.png"))
TOOLS = "\n".join(p.read_text() for p in (ROOT / "tools").rglob("*.py"))
PAGES = "\n".join(p.read_text() for p in [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")])


@pytest.mark.parametrize("name", PICTURES)
def test_a_tool_makes_it_and_a_page_shows_it(name: str) -> None:
    made = name
    if name.startswith("workbench_"):
        view = name.removeprefix("workbench_").removesuffix(".png")
        made = "workbench_at_{width}.png" if view.startswith("at_") else f'"{view}"'
    assert made in TOOLS and f"figures/{name}" in PAGES
