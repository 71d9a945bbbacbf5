"""Tables in Markdown, printed as they are made and written at the end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path


class Page:
    """Collects text and tables; ``write`` puts them into a file, whole or not at all."""

    def __init__(self, path: Path, note: str) -> None:
        self.path = path
        self.lines: list[str] = [f"<!-- {note} -->"]

    def text(self, *lines: str) -> None:
        for line in lines:
            print(line, flush=True)
        self.lines += [*lines, ""]

    def table(self, title: str, head: Sequence[str], rows: Sequence[Sequence[object]]) -> None:
        cells = [[str(c) for c in row] for row in (head, *rows)]
        widths = [max(len(row[k]) for row in cells) for k in range(len(head))]
        lines = ["| " + " | ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)) + " |" for row in cells]
        lines.insert(1, "|" + "|".join("-" * (w + 2) for w in widths) + "|")
        self.text(f"**{title}**", "", *lines)

    def write(self) -> None:
        partial = self.path.with_suffix(".part")
        partial.write_text("\n".join(self.lines) + "\n", encoding="utf-8")
        partial.replace(self.path)
        print(f"wrote {self.path}")
