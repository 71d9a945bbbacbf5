"""What was found, in words: for the terminal, the report and whoever has to mend the robot."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, Explanation
from ee_dist.discrepancy.judge import Judged
from ee_dist.discrepancy.misfit import Leftover
from ee_dist.discrepancy.separate import ENOUGH, Proposal
from ee_dist.effects.catalogue import CATALOGUE, Term
from ee_dist.robots.model import Robot


def plain(name: str) -> str:
    return name.replace("_", " ")


def placed(name: str) -> str:
    """``coulomb friction at knee front left`` of a candidate's name."""
    return plain(name.replace("@", " at "))


def without_unit(key: str, unit: str) -> str:
    """``torque_nm`` in N.m is ``torque``: the unit is told behind the value."""
    tail, parts = unit.lower().replace(".", "").replace("/", "").replace("^", ""), key.split("_")
    for k in range(1, len(parts)):
        if tail and "".join(parts[k:]) == tail:
            return "_".join(parts[:k])
    return key


def told(term: Term, robot: Robot | None = None) -> str:
    """``coulomb friction at knee front left (torque 0.3 N.m)``."""
    entry = CATALOGUE[term.effect]
    shown = []
    for key, value in term.values:
        unit = entry.unit(key, robot, term.target) if robot is not None else entry.parameter(key).unit
        shown.append(
            f"{plain(without_unit(key, unit))} {value:.3g}" + (f" {unit}" if unit not in ("", "1", "channel") else "")
        )
    where = f" at {plain(term.target)}" if term.target else ""
    return f"{plain(term.effect)}{where}" + (f" ({', '.join(shown)})" if shown else "")


def confidence(best: Judged) -> str:
    low, high = best.interval
    return (
        f"on data it was not fitted to it takes {best.gain:.0%} off the squared residual "
        f"(95 % interval {max(low, -9.99):.0%} to {high:.0%})"
    )


def tie_text(what: str, others: Sequence[str]) -> str:
    return f"These measurements cannot tell {what} from: {', '.join(map(placed, others))}."


def explanation_text(found: Explanation, robot: Robot, next_trial: Proposal | None) -> list[str]:
    """Paragraphs: the verdict, what it is, what speaks for it, what stays open, what to do next."""
    lines = [
        f"The model is off by {found.baseline_error:.2f} standard deviations of the noise; noise alone would leave "
        f"{found.noise_floor:.2f} ({found.floor_source}). {found.tried} explanations were tried."
    ]
    best = found.best
    if found.verdict == NOTHING_MISSING:
        lines.append(
            "Nothing is missing: no candidate takes more off the residual than luck, and no channel stands out."
        )
    elif found.verdict == EFFECT and best is not None:
        term = best.hypothesis[-1]
        entry = CATALOGUE[term.effect]
        lines.append(f"Missing: {told(term, robot)}. {entry.physics}")
        lines.append(f"What speaks for it: {confidence(best)}. Its mark in a residual: {entry.signature}")
        if best.tied_with:
            lines.append(tie_text("it", best.tied_with))
    else:
        lines.append("Unexplained: something is left that no effect of the catalogue earns its place by.")
        lines += [
            f"Nearest, but not good enough: {told(c.hypothesis[-1], robot)}; {c.why_not}." for c in found.candidates[:1]
        ]
    if found.left:
        lines.append(left_text(found.left, found.verdict == EFFECT))
    elif found.verdict == EFFECT:
        lines.append("With it, nothing is left above the noise.")
    if next_trial is not None and next_trial.separation < ENOUGH:
        lines.append("No trial of the library would separate them either: on all of them they do the same.")
    elif next_trial is not None:
        e = next_trial.excitation
        lines.append(
            f"The trial that would separate them best: {e.kind} for {e.seconds:g} s at amplitude {e.amplitude:g}, seed {e.seed}, "
            f"on the {e.fixture} "
            f"(predicted distance {next_trial.separation:.0f} standard deviations)."
        )
    return lines


def left_text(left: Sequence[Leftover], after: bool) -> str:
    head = "Even with it, more than noise is left in" if after else "It sits in"
    return f"{head} {len(left)} channel{'s' if len(left) > 1 else ''}; worst: {'; '.join(map(str, left[:3]))}."
