"""Writes docs/effects.md from the effect catalogue: python tools/catalogue.py [--check]."""

from __future__ import annotations

import math
import sys
from pathlib import Path

from ee_dist.effects import CATALOGUE, Effect
from ee_dist.effects.effect import FAMILIES, Parameter
from ee_dist.robots.linear_stage import linear_stage
from ee_dist.robots.model import Robot
from ee_dist.robots.quadruped import quadruped
from ee_dist.robots.servo_pendulum import servo_pendulum

PAGE = Path(__file__).parent.parent / "docs" / "effects.md"
FAMILY = {
    "body": "what the robot is made of and what is still there",
    "world": "the surroundings",
    "drive": "motor, controller, friction and transmission of a joint",
    "sensing": "what a channel reports",
    "wiring": "between controller and motors",
}
DESCRIBED = "-described"
INTRO = """# The effect catalogue

Written by `python tools/catalogue.py` from the effects themselves; edit those, not this page.

An effect is a named, bounded change to a robot. A model is a robot with a list of them; "add the effect" is one more line:

    - {effect: coulomb_friction, target: knee_front_left, torque_nm: 0.4}

What several joints share is one effect with one target, `all_joints` or their names with + between. A trial hides it so:

    python -m ee_dist task=trial engine=mujoco 'hidden=[{effect: zero_offset, target: all_joints, offset_rad: 0.03}]'

At its neutral value an effect leaves every result bit for bit as it was. On a slide read m for rad and N for N.m. A value
outside the limits is refused; `-described` is all that the description has of it, and what several joints share in the model: no
more can be taken off, and nothing where there is none. Within the limits `explain` and `improve` look in a range that suits the
robot and the target, of which the tables give examples: for the quadruped (its first target) and, where that has none, for
another robot.
Effects marked * are settings and calibrations: they can be used and fitted, but `explain` does not propose them by itself.
An effect of your own is [one short file](own_effect.md).
"""


def page() -> str:
    """The page, ending in a newline."""
    lines = [INTRO]
    for family in FAMILIES:
        members = [e for e in CATALOGUE.values() if e.family == family]
        lines += [f"## {family}: {FAMILY[family]}", ""]
        lines += [
            "| effect | acts on | parameter | unit | neutral | limits | range, for example |",
            "|---|---|---|---|---|---|---|",
        ]
        for effect in members:
            lines += _rows(effect)
        lines.append("")
        for effect in members:
            lines += [_paragraph(effect), ""]
    return "\n".join(lines).rstrip() + "\n"


def _example(effect: Effect) -> tuple[Robot, str]:
    for robot in (quadruped(), servo_pendulum(), linear_stage()):
        if targets := effect.targets(robot):
            return robot, targets[0]
    raise SystemExit(f"{effect.name} acts on none of the robots here")


def _rows(effect: Effect) -> list[str]:
    robot, target = _example(effect)
    name = f"**{effect.name}**" + ("" if effect.searchable else " *")
    where = f"`{target}`" if target else "the robot"
    if not effect.parameters:
        return [f"| {name} | {where} | | | | | |"]
    ranges = effect.bounds(robot, target)
    rows = []
    for k, p in enumerate(effect.parameters):
        low, high = ranges[p.name]
        head = f"| {name} | {where} " if k == 0 else "| | "
        at = "" if robot.name == "quadruped" else f" ({robot.name})"
        unit = "" if p.unit == "1" else p.unit
        rows.append(f"{head}| {p.name} | {unit} | {p.neutral:g} | {_limits(p)} | {low:.3g} to {high:.3g}{at} |")
    return rows


def _limits(p: Parameter) -> str:
    if p.on_top:
        # Of what is in the description there cannot be less than none, whatever the parameter itself allows.
        return f"{DESCRIBED} to {p.upper:g}" if math.isfinite(p.upper) else f"from {DESCRIBED}"
    if math.isinf(p.lower) and math.isinf(p.upper):
        return "none"
    if math.isinf(p.upper):
        return f"from {p.lower:g}"
    return f"{p.lower:g} to {p.upper:g}"


def _paragraph(effect: Effect) -> str:
    meanings = "; ".join(f"`{p.name}`: {p.meaning}" for p in effect.parameters)
    text = f"**{effect.name}.** {effect.physics} *In a residual:* {effect.signature}"
    text += f" *Parameters:* {meanings}." if meanings else ""
    return text + (f" *See* {effect.reference}." if effect.reference else "")


def main(arguments: list[str]) -> int:
    if arguments == ["--check"]:
        fresh = PAGE.is_file() and PAGE.read_text() == page()
        print("docs/effects.md is up to date" if fresh else "docs/effects.md is old: run python tools/catalogue.py")
        return 0 if fresh else 1
    if arguments:
        print(__doc__)
        return 2
    PAGE.write_text(page())
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
