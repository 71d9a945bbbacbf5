"""A page: whatever is put into it is text, and it asks nobody for anything."""

from __future__ import annotations

import re
from pathlib import Path

import plotly.graph_objects as go
import pytest

from ee_dist.viewing.browser import HeadlessBrowser
from ee_dist.viewing.report import Page, Section, Table, write_page

NASTY = "<script>alert('x')</script> & \"quoted\""


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    figure = go.Figure(go.Scatter(x=[0, 1], y=[1, 0], name=NASTY))
    table = Table(["effect", NASTY], [[NASTY, "1"], ["b", "2"]], numeric=(1,), lead=(0,))
    sections = [Section(NASTY, NASTY, figure, table), Section("Only words", "nothing to see")]
    whole = Page(
        NASTY, NASTY, NASTY, [NASTY, "second"], "good", [NASTY], NASTY, sections[0], [(NASTY, "tile")], sections,
        [(NASTY, "../other/report.html")], [(NASTY, NASTY)], NASTY,
    )  # fmt: skip
    return write_page(whole, tmp_path_factory.mktemp("page") / "report.html")


def outside_scripts(text: str) -> str:
    """A page without its scripts."""
    return re.sub(r"(?s)<script[^>]*>.*?</script>", "", text)


def test_what_is_put_in_is_text(page: Path) -> None:
    text = outside_scripts(page.read_text(encoding="utf-8"))
    assert "<script>alert" not in text
    assert text.count("&lt;script&gt;") >= 18, "title, heading, words, tile, caption, table and foot"
    assert '<tr class="lead">' in text and '<td class="n">1</td>' in text
    assert not page.with_name("report.html.part").exists()


def test_nothing_is_asked_of_the_outside(page: Path) -> None:
    text = outside_scripts(page.read_text(encoding="utf-8"))
    assert not re.findall(r"(?:src|href)=[\"']?(?!data:)[a-z]+:", text)


def test_the_bar_of_a_figure_has_no_button_that_sends_it_away(window: HeadlessBrowser, page: Path) -> None:
    window.look(page, 1280)
    buttons = window.evaluate("[...document.querySelectorAll('[data-title]')].map((b) => b.dataset.title)")
    assert buttons
    assert not [b for b in buttons if re.search("(?i)cloud|share|chart studio|edit|produced with|upload", b)], buttons
    assert not window.evaluate("document.querySelectorAll('.modebar-btn--logo').length")
