"""Writes the table of docs/export.md, what becomes of each effect, from the code: python tools/export_table.py [--check]."""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

from ee_dist.effects import CATALOGUE, term
from ee_dist.export.plan import fates
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped_lab import quadruped_lab

PAGE = Path(__file__).parent.parent / "docs" / "export.md"
BEGIN, END = "<!-- table: python tools/export_table.py -->\n", "<!-- end of the table -->"
FORMATS = ("mjcf", "urdf", "python")


def table() -> str:
    """A row for each effect, at its first target, a third of the way to the end of its range."""
    free = quadruped_lab()
    bolted = replace(free, free_base=False)
    lines = ["| effect | MJCF | URDF | Python alone |", "|---|---|---|---|"]
    for name, effect in CATALOGUE.items():
        robot: Robot = free if effect.targets(free) else bolted
        target, values = effect.targets(robot)[0], effect.neutral_values()
        for key, (low, high) in effect.bounds(robot, target).items():
            values[key] += 0.3 * ((high if high > values[key] else low) - values[key])
        found = [fates(robot, (term(name, target, **values),), to)[0] for to in FORMATS]
        lines.append(f"| {name} | " + " | ".join(f.how for f in found) + " |")
    return "\n".join(lines) + "\n"


def page() -> str:
    """The page with its table renewed."""
    text = PAGE.read_text()
    return text[: text.index(BEGIN) + len(BEGIN)] + "\n" + table() + "\n" + text[text.index(END) :]


def main(arguments: list[str]) -> int:
    if arguments == ["--check"]:
        return 0 if PAGE.read_text() == page() else 1
    PAGE.write_text(page())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
