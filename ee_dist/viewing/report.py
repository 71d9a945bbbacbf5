"""A self-contained HTML report: words, tables and plots in one file that opens without a network."""

from __future__ import annotations

import html
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import plotly.graph_objects as go
from plotly.offline import get_plotlyjs

_CSS = """
:root { --ink: #1d2733; --soft: #5d6b7a; --line: #dfe5ec; --paper: #ffffff; --wash: #f4f6f9; --accent: #1769aa; }
* { box-sizing: border-box; }
body { margin: 0; background: var(--wash); color: var(--ink);
  font: 15px/1.55 "Inter", "Segoe UI", "Helvetica Neue", Arial, sans-serif; }
main { max-width: 1180px; margin: 0 auto; padding: 32px 24px 64px; }
h1 { font-size: 26px; margin: 0 0 4px; letter-spacing: -0.01em; }
h2 { font-size: 18px; margin: 0 0 4px; }
.sub { color: var(--soft); margin: 0 0 20px; }
section { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 20px 22px; margin: 0 0 18px; }
section p.caption { color: var(--soft); margin: 0 0 10px; }
.verdict { border-left: 5px solid var(--accent); }
.verdict.good { border-left-color: #2e8b57; }
.verdict.open { border-left-color: #c77700; }
.verdict p { margin: 0 0 8px; max-width: 120ch; }
.verdict p:first-of-type { font-size: 17px; }
.tiles { display: flex; flex-wrap: wrap; gap: 12px; margin: 0 0 18px; }
.tile { background: var(--paper); border: 1px solid var(--line); border-radius: 10px; padding: 12px 18px; min-width: 150px; }
.tile b { display: block; font-size: 22px; font-variant-numeric: tabular-nums; }
.tile span { color: var(--soft); font-size: 13px; }
table { border-collapse: collapse; width: 100%; font-size: 14px; }
th { text-align: left; color: var(--soft); font-weight: 600; border-bottom: 1px solid var(--line); padding: 6px 10px; }
td { border-bottom: 1px solid var(--line); padding: 6px 10px; font-variant-numeric: tabular-nums; vertical-align: top; }
td.n, th.n { text-align: right; white-space: nowrap; }
tr.lead td { background: #eef6fd; font-weight: 600; }
.wide { overflow-x: auto; }
footer { color: var(--soft); font-size: 13px; }
"""


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
    body = [f"<h1>{html.escape(page.title)}</h1><p class='sub'>{html.escape(page.subtitle)}</p>"]
    words = "".join(f"<p>{html.escape(w)}</p>" for w in page.words)
    body.append(f"<section class='verdict {page.tone}'>{words}</section>")
    if page.tiles:
        tiles = "".join(
            f"<div class='tile'><b>{html.escape(n)}</b><span>{html.escape(w)}</span></div>" for n, w in page.tiles
        )
        body.append(f"<div class='tiles'>{tiles}</div>")
    for k, section in enumerate(page.sections):
        parts = [f"<h2>{html.escape(section.heading)}</h2>"]
        if section.caption:
            parts.append(f"<p class='caption'>{html.escape(section.caption)}</p>")
        if section.figure is not None:
            parts.append(
                section.figure.to_html(
                    full_html=False,
                    include_plotlyjs=False,
                    div_id=f"plot{k}",
                    config={"displaylogo": False, "responsive": True, "displayModeBar": "hover"},
                )
            )
        if section.table is not None:
            parts.append(_table(section.table))
        body.append(f"<section>{''.join(parts)}</section>")
    body.append(f"<footer>{html.escape(page.foot)}</footer>")
    text = (
        "<!DOCTYPE html><html lang='en'><head><meta charset='utf-8'>"
        "<meta name='viewport' content='width=device-width, initial-scale=1'>"
        f"<link rel='icon' href='data:,'><title>{html.escape(page.title)}</title><style>{_CSS}</style>"
        f"<script>{get_plotlyjs()}</script></head><body><main>{''.join(body)}</main></body></html>"
    )
    path = Path(path)
    partial = path.with_name(path.name + ".part")
    partial.write_text(text, encoding="utf-8")
    partial.replace(path)
    return path


def _table(table: Table) -> str:
    def cell(kind: str, k: int, value: str) -> str:
        cls = " class='n'" if k in table.numeric else ""
        return f"<{kind}{cls}>{html.escape(value)}</{kind}>"

    head = "".join(cell("th", k, c) for k, c in enumerate(table.columns))
    rows = []
    for i, row in enumerate(table.rows):
        cls = " class='lead'" if i in table.lead else ""
        rows.append(f"<tr{cls}>{''.join(cell('td', k, v) for k, v in enumerate(row))}</tr>")
    return f"<div class='wide'><table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table></div>"
