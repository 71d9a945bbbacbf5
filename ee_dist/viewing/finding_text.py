"""A finding in words and tables: the first thing to read in a scene. Markdown. A viewer cuts rows that are wider than its window:
names, which may be, stand behind the numbers."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.discrepancy.words import percent_within, percents
from ee_dist.viewing.finding import BEST, TIED, Candidate, Finding

COMMAND = "python -m ee_dist"
"""A line may end with a command to type."""
BAR = 5
"""Characters of the longest bar."""


def bar(value: float, largest: float, width: int = BAR) -> str:
    """A bar of squares that fits a table; empty for nothing, one square for very little."""
    if not largest > 0 or not value > 0:
        return ""
    return "■" * max(round(width * min(value / largest, 1.0)), 1)


def plain(name: str) -> str:
    """A channel's name in words. Trials keep theirs, by which they are held out."""
    return name.replace("_", " ")


def _unit(found: Finding) -> str:
    """Behind a heading, where it is short: a table has to fit beside the plots."""
    return f" ({found.unit})" if len(found.unit) < 6 else ""


def headline(found: Finding) -> list[str]:
    """Verdict, how large the error is and how sure all of it, and what to do next."""
    lines = [f"### {found.title}", "", f"**{found.verdict}**", ""]
    for line in found.lines:
        before, command, rest = line.partition(COMMAND)
        lines += [f"{before}`{command}{rest}`" if command else line, ""]
    return [*lines, f"{found.lead}: `{found.next_command}`", ""] if found.next_command else lines


def colours(found: Finding) -> list[str]:
    """Which colour is what."""
    said = ["**Blue**: measured.", f"**Orange**: {found.model.label}."]
    if found.better is not None and not found.candidates:
        said.append(f"**Violet**: {found.better.label}.")
    elif any(c.account is not None for c in found.candidates):
        said.append("**Violet**: the candidate of the tab.")
    return [" ".join(said), ""]


def channel_table(found: Finding) -> list[str]:
    """Channels by error, worst first, with bars."""
    ranked = found.worst_first
    if not ranked:
        return []
    if not any(c.error for c in ranked):
        return [f"All {len(ranked)} channels agree exactly: every error is 0."]
    largest = max(c.error for c in ranked)
    lines = [f"| error{_unit(found)} | from 0 | RMS | channel | worst |", "|---|---|---|---|---|"]
    for c in ranked:
        unit = "" if c.unit in ("", "1") else f" {c.unit}"
        where = f"{c.worst_case}, {c.worst_from_s:.1f} s" if c.worst_case else ""
        lines.append(f"| {c.error:.3g} | {bar(c.error, largest)} | {c.rmse:.3g}{unit} | {plain(c.name)} | {where} |")
    return [*lines, "", f"RMS: of {found.rms_of}."] if found.rms_of else lines


def candidate_table(candidates: Sequence[Candidate]) -> list[str]:
    """Candidates in their order, with bars of what they gain; those that were chosen stand out."""
    if not candidates:
        return ["No candidate was judged."]
    largest = max(c.gain for c in candidates)
    lines = ["| # | gain | from 0 | 95 % interval | | missing effect |", "|---|---|---|---|---|---|"]
    for k, c in enumerate(candidates):
        name = f"**{c.label}**" if c.kind in (BEST, TIED) else c.label
        gain, told = percent_within(c.gain, c.low, c.high), percents(c.low, c.high)
        lines.append(f"| {k + 1} | {gain} | {bar(c.gain, largest)} | {told} | {c.kind} | {name} |")
    return lines


def ladder_table(found: Finding) -> list[str]:
    """The models from the first to the last with their held-out errors, and the floor below them."""
    if not found.ladder:
        return []
    largest = max(r.error_heldout for r in found.ladder)
    # The model as it was given was fitted to nothing; of one kind of data that was held out a line says which.
    cuts = list(dict.fromkeys(r.held_out for r in found.ladder[1:]))
    apart = any(r.error_apart is not None for r in found.ladder)
    all_of_it, rule, none = (" held out from all of it |", "---|", " |") if apart else ("", "", "")
    lines = [
        f"| # | error held out{' in turn' if apart else ''}{_unit(found)} | from 0 | in the fit |{all_of_it} model |",
        f"|---|---|---|---|{rule}---|",
    ]
    for k, rung in enumerate(found.ladder):
        fit = "" if rung.error_fit is None else f"{rung.error_fit:.3g}"
        on = f" (held out: {rung.held_out})" if len(cuts) > 1 and rung.held_out else ""
        own = f" {rung.error_apart:.3g} |" if rung.error_apart is not None else none
        lines.append(
            f"| {k} | {rung.error_heldout:.3g} | {bar(rung.error_heldout, largest)} | {fit} |{own} {rung.label}{on} |"
        )
    if found.floor is not None:
        lines.append(f"| | {found.floor:.3g} | {bar(found.floor, largest)} | |{none} *noise alone* |")
    return [*lines, "", f"Held out: {cuts[0]}."] if len(cuts) == 1 and cuts[0] else lines
