"""The proposal as YAML for the user to keep and change, and as rows of a table."""

from __future__ import annotations

import json
from typing import Any

from ee_dist.measurements.proposal.model import UNKNOWN, Choice, Proposal

GROUPS = ("time", "sensors", "commands", "torques", "supply", "enabled", "settings")
SINGLE = ("time", "supply", "enabled")


def as_yaml(proposal: Proposal, robot: Any, sources: str) -> str:
    """The mapping, each line with how sure it is and why. ``robot`` is what goes to its key."""
    lines = [
        f"# Proposed for {_plain(sources)}. What follows each channel says how sure it is, and why; change what is wrong."
    ]
    lines += [f"# note: {_plain(n)}" for n in proposal.notes]
    lines += [f"# open: {_plain(q)}" for q in proposal.questions]
    lines.append(f"robot: {_flow(robot)}")
    for key, value in proposal.head.items():
        lines.append(f"{key}: {_flow(value)}")
    for group in GROUPS:
        found = [c for c in proposal.choices if c.group == group and c.entry is not None]
        if group in SINGLE:
            for c in found:
                lines += [f"# {c.sure}: {_plain(c.why)}", f"{group}: {_flow(c.entry)}"]
            continue
        if group == "settings":
            lines += ["settings:"] * bool(found)
            for c in found:
                lines += [f"  # {c.sure}: {_plain(c.why)}", f"  - {_flow(c.entry)}"]
            continue
        if found or group == "sensors":
            lines.append(f"{group}:" if found else f"{group}: {{}}")
        said = None
        for c in found:
            if said != (c.sure, c.why):
                said = (c.sure, c.why)
                lines.append(f"  # {c.sure}: {_plain(c.why)}")
            lines.append(f"  {_flow(c.name)}: {_flow(c.entry)}")
    return "\n".join(lines) + "\n"


def _flow(value: Any) -> str:
    """A value on one line, as JSON, which is YAML; plain words stay plain."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{_flow(k)}: {_flow(v)}" for k, v in value.items()) + "}"
    if (
        isinstance(value, str)
        and value.replace("_", "").isalnum()
        and not value[0].isdigit()
        and value.lower() not in _WORDS
    ):
        return value
    if isinstance(value, float):
        return repr(value)
    return _shown(json.dumps(value, ensure_ascii=False, default=str))


def _plain(text: str) -> str:
    """A text behind a number sign: what would end the line, or is no sign that YAML knows, is not in it as it is."""
    return _shown(" ".join(text.split()))


def _shown(text: str) -> str:
    return "".join(c if c.isprintable() else f"\\u{ord(c):04x}" if ord(c) < 2**16 else f"\\U{ord(c):08x}" for c in text)


_WORDS = frozenset(["true", "false", "yes", "no", "on", "off", "null", "y", "n", "nan", "inf"])


def rows(proposal: Proposal) -> list[tuple[str, str, str, str, str]]:
    """(channels, columns, units, how sure, why): channels that have one reason are one row."""
    found: dict[tuple[str, str, str], list[Choice]] = {}
    for c in proposal.choices:
        found.setdefault((c.group, c.sure, c.why), []).append(c)
    out = []
    for (group, sure, why), several in found.items():
        names = ", ".join(c.name for c in several)
        named = {
            "sensors": names,
            "commands": f"command of {names}",
            "torques": f"torque of {names}",
            "settings": names,
        }
        channel = named.get(group, group)
        units = dict.fromkeys(_unit(c) for c in several)
        out.append((channel, ", ".join(dict.fromkeys(c.column for c in several)), ", ".join(units), sure, why))
    return out


def _unit(c: Choice) -> str:
    entry = c.entry or {}
    if c.sure == UNKNOWN and "unit" not in entry:
        return "?"
    sign = "-" if entry.get("sign") == -1 else ""
    scale = f"{entry['scale']:.4g} " if "scale" in entry else ""
    return f"{sign}{scale}{entry.get('unit', '')}"
