"""A self-contained HTML report: words, tables and plots in one file that opens without a network."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import plotly.graph_objects as go

from ee_dist.basics.files import write_whole
from ee_dist.viewing.templates import plot, rendered


@dataclass
class Table:
    """``numeric``: indices of columns set to the right. ``lead``: rows that stand out."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    numeric: Sequence[int] = ()
    lead: Sequence[int] = ()


@dataclass
class Section:
    """A heading, what it shows in a sentence, and a plot, a table or both."""

    heading: str
    caption: str = ""
    figure: go.Figure | None = None
    table: Table | None = None


@dataclass
class Page:
    """``tone``: good, open or plain, the colour of the verdict. ``tiles``: (number, what it is)."""

    title: str
    subtitle: str
    words: Sequence[str]
    tone: str = "plain"
    tiles: Sequence[tuple[str, str]] = ()
    sections: list[Section] = field(default_factory=list)
    foot: str = ""


def write_page(page: Page, path: str | Path) -> Path:
    """Write the page; the plotting library travels inside (about 5 MB)."""
    figures = [plot(section.figure, f"plot{k}") for k, section in enumerate(page.sections)]
    text = rendered("report.html", page=page, sections=list(zip(page.sections, figures, strict=True)))
    write_whole(Path(path), text)
    return Path(path)
