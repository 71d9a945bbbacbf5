"""A self-contained HTML report: the finding, the picture that proves it, and the rest, in one file that opens offline."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import plotly.graph_objects as go
from markupsafe import Markup
from plotly.io import to_json

from ee_dist.basics.files import write_whole
from ee_dist.viewing.curves import Browser
from ee_dist.viewing.templates import FIGURE, rendered, script

LEAST_WIDE = 250
"""Pixels below which figures beside each other go below each other."""


@dataclass
class Table:
    """``numeric``: indices of columns set to the right. ``lead``: rows that stand out; ``pale``: rows that count less.
    ``whole``: shown in its full height, however long it is."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]
    numeric: Sequence[int] = ()
    lead: Sequence[int] = ()
    pale: Sequence[int] = ()
    whole: bool = False


@dataclass
class Section:
    """A heading, what it shows in a sentence, and figures (one, or several of a kind beside each other), a table or both.

    ``browser``: curves to pick from. ``legend``: (name, colour) where the figures show none of their own. ``folded``: shown
    only when it is asked for.
    """

    heading: str
    caption: str = ""
    figure: go.Figure | None = None
    table: Table | None = None
    figures: Sequence[go.Figure] = ()
    browser: Browser | None = None
    legend: Sequence[tuple[str, str]] = ()
    folded: bool = False

    @property
    def name(self) -> str:
        """Of a file."""
        return "_".join("".join(c if c.isalnum() else " " for c in self.heading.lower()).split()) or "table"


@dataclass
class Page:
    """``tone``: good, open or plain, the colour of the finding. ``first``: lines below the headline: how large the error is,
    how sure all of it; ``following``: the command to type next, after ``lead``; ``proof``: the one picture that shows it.
    ``tiles``: (number, what it is). ``links``: (name, relative path). ``terms``: (word, what it means)."""

    title: str
    subtitle: str
    headline: str
    words: Sequence[str] = ()
    tone: str = "plain"
    first: Sequence[str] = ()
    following: str = ""
    proof: Section | None = None
    tiles: Sequence[tuple[str, str]] = ()
    sections: list[Section] = field(default_factory=list)
    links: Sequence[tuple[str, str]] = ()
    terms: Sequence[tuple[str, str]] = ()
    foot: str = ""
    lead: str = "Next"


def write_page(page: Page, path: str | Path) -> Path:
    """Write the page; the plotting library travels inside (about 5 MB)."""
    shown = [(s, [_plot(f) for f in _figures(s)]) for s in page.sections]
    proof = None if page.proof is None else (page.proof, [_plot(f) for f in _figures(page.proof)])
    curves = [Markup(s.browser.to_json()) if s.browser else Markup() for s in page.sections]
    text = rendered(
        "report.html",
        page=page,
        proof=proof,
        sections=[(s, plots, c) for (s, plots), c in zip(shown, curves, strict=True)],
        config=Markup(json.dumps(FIGURE)),
        least=LEAST_WIDE,
        script=script("report.js"),
    )
    write_whole(Path(path), text)
    return Path(path)


def _figures(section: Section) -> list[go.Figure]:
    return [*([] if section.figure is None else [section.figure]), *section.figures]


def _plot(figure: go.Figure) -> dict[str, Any]:
    """What the page draws when it comes into sight, and the height that is kept free for it."""
    text = to_json(figure, validate=False) or ""
    return {"json": Markup(harmless(text)), "height": int(figure.layout.height or 400)}


def harmless(text: str) -> str:
    """JSON that cannot end the script element it stands in."""
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")
