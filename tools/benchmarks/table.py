"""The benchmark's table: rows with a value, a ratio and an aim, for people (rich) and for programs (JSON)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

FORMAT = 1


@dataclass(frozen=True)
class Row:
    """One line. ``ratio`` is to what ``of`` names; ``aim`` is what the ratio (or the value, without one) should be:
    "<= 1.3" or ">= 10"."""

    group: str
    name: str
    value: float | None
    unit: str
    ratio: float | None = None
    of: str = ""
    aim: str = ""
    note: str = ""

    @property
    def met(self) -> bool | None:
        """Whether the aim is met; None without one, or without a number."""
        number = self.value if self.ratio is None else self.ratio
        if not self.aim or number is None:
            return None
        sign, limit = self.aim.split()
        return number <= float(limit) if sign == "<=" else number >= float(limit)


def show(console: Console, rows: Sequence[Row], title: str) -> None:
    """Print the table."""
    table = Table(box=SIMPLE, pad_edge=False, title=title, title_justify="left", caption_justify="left")
    table.add_column("what", min_width=62)
    for name, side in (("value", "right"), ("", "left"), ("ratio", "right"), ("to", "left")):
        table.add_column(name, justify=side, no_wrap=True)  # type: ignore[arg-type]
    table.add_column("aim", justify="right")
    table.add_column("")
    group = ""
    for row in rows:
        if row.group != group:
            table.add_section()
            table.add_row(f"[bold]{row.group}[/bold]", "", "", "", "", "", "")
            group = row.group
        verdict = {True: "[green]met[/green]", False: "[red]missed[/red]", None: ""}[row.met]
        name = f"  {row.name}" + (f"\n  [dim]{row.note}[/dim]" if row.note else "")
        table.add_row(name, number(row.value), row.unit, number(row.ratio), row.of, row.aim, verdict)
    console.print(table)


def markdown(rows: Sequence[Row]) -> str:
    """The table as Markdown, a heading for each group."""
    lines: list[str] = []
    group = ""
    for row in rows:
        if row.group != group:
            lines += [
                "",
                f"**{row.group}**",
                "",
                "| what | value | ratio | to | aim | |",
                "|---|---:|---:|---|---:|---|",
            ]
            group = row.group
        verdict = {True: "met", False: "missed", None: ""}[row.met]
        value = f"{number(row.value)} {row.unit}".strip()
        ratio = "" if row.ratio is None else number(row.ratio)
        name = row.name + (f" ({row.note})" if row.note else "")
        lines.append(f"| {name} | {value} | {ratio} | {row.of} | {row.aim} | {verdict} |")
    return "\n".join(lines[1:])


def put_between(path: Path, mark: str, text: str) -> None:
    """Replace what stands between ``<!-- mark -->`` and ``<!-- end of mark -->`` in a document. Raises ValueError without."""
    begin, end = f"<!-- {mark} -->", f"<!-- end of {mark} -->"
    content = path.read_text(encoding="utf-8")
    if begin not in content or end not in content:
        raise ValueError(f"{path}: no {begin} ... {end}")
    before, rest = content.split(begin, 1)
    after = rest.split(end, 1)[1]
    path.write_text(f"{before}{begin}\n{text}\n{end}{after}", encoding="utf-8")


def number(value: float | None) -> str:
    """Three digits, thousands separated."""
    if value is None:
        return "-"
    if abs(value) >= 1000:
        return f"{value:,.0f}"
    return f"{value:.3g}" if abs(value) < 100 else f"{value:.0f}"


def as_json(rows: Sequence[Row], **rest: Any) -> dict[str, Any]:
    """What ``--json`` writes."""
    return {"format": FORMAT, "rows": [{**asdict(r), "met": r.met} for r in rows], **rest}
