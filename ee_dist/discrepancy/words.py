"""What was found, in words: for the terminal, the report and whoever has to mend the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ee_dist.discrepancy.compare import Comparison
from ee_dist.discrepancy.evidence.intervals import ParameterReport
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, Explanation
from ee_dist.discrepancy.improve import BETTER, EXPLAINED, Improvement
from ee_dist.discrepancy.plan import ENOUGH, PlannedTrial
from ee_dist.discrepancy.problem import Problem
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term
from ee_dist.robots.model import Robot


@dataclass(frozen=True)
class Account:
    """``headline``: the finding in one sentence, with how sure it is. ``lines``: what speaks for it and what stays open.
    ``good``: whether the question is settled."""

    headline: str
    lines: tuple[str, ...]
    good: bool


def plain(name: str) -> str:
    return name.replace("_", " ").replace("+", ", ")


def placed(name: str) -> str:
    """``coulomb friction at knee front left`` of a candidate's name."""
    return plain(name.replace(" + ", " and ").replace("@", " at "))


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
    return named(term) + (f" ({', '.join(shown)})" if shown else "")


def named(term: Term) -> str:
    """``coulomb friction at knee front left``."""
    return placed(term.name)


def told_all(terms: Hypothesis, robot: Robot | None = None) -> str:
    """Terms in one phrase; one effect at several places with its values side by side."""
    effects = {t.effect for t in terms}
    if len(terms) > 1 and len(effects) == 1 and all(len(t.values) == 1 for t in terms):
        key = terms[0].values[0][0]
        unit = CATALOGUE[terms[0].effect].unit(key, robot, terms[0].target) if robot is not None else ""
        each = ", ".join(f"{plain(t.target)} {t.values[0][1]:.3g}" for t in terms)
        return f"{plain(terms[0].effect)}, each joint by itself ({each}{f' {unit}' if unit not in ('', '1') else ''})"
    return "; ".join(told(t, robot) for t in terms)


def compare_account(problem: Problem, found: Comparison) -> Account:
    """What compare has to say."""
    ratio = found.error / found.noise_floor if found.noise_floor else float("inf")
    off, floor = problem.told(found.error), problem.told(found.noise_floor)
    lines = [f"Error: {found.definition}. Noise floor: {found.floor_source}."]
    if found.error < found.noise_floor:
        lines.append("The error is below the floor: the noise was estimated too high, and the floor is an upper bound.")
    parted = [f"{t} at {s:.2f} s" for t, s in found.parted_s.items() if s is not None]
    lines.append("Prediction and measurement part: " + ("; ".join(parted) or "nowhere") + ".")
    if ratio < 1.1:
        head = f"The model agrees with the measurements: {problem.natural_name} {off}, noise alone would leave {floor}."
    else:
        worst = f", most of all at {plain(found.channels[0].name)}" if found.channels else ""
        head = (
            f"The model is off{worst}: {problem.natural_name} {off}, {ratio:.3g} times what noise alone would leave "
            f"({floor})."
        )
    return Account(head, tuple(lines), ratio < 1.1)


def explain_account(problem: Problem, found: Explanation, ahead: PlannedTrial | None) -> Account:
    """The verdict, what it is, what speaks for it, what stays open, what to do next."""
    robot, best = problem.robot, found.best
    lines = [
        f"The model is off by {problem.told(found.baseline_error)} ({problem.natural_name}); noise alone would leave "
        f"{problem.told(found.noise_floor)} ({found.floor_source}). {found.tried} explanations were tried."
    ]
    if found.refitted_error != found.baseline_error:
        lines.append(f"Its own values fitted anew leave {problem.told(found.refitted_error)}.")
    if found.verdict == NOTHING_MISSING:
        head = "Nothing is missing: no candidate takes more off the residual than luck, and no channel stands out."
    elif found.verdict == EFFECT and best is not None:
        entry = CATALOGUE[best.terms[0].effect]
        head = f"Missing{_doubt(found)}: {told_all(best.terms, robot)}{_twins(best)}."
        head += " Nothing else is left above the noise." if not found.left else " More than noise is left with it."
        lines.append(entry.physics)
        lines.append(f"What speaks for it: {confidence(best)}. Its mark in a residual: {entry.signature}")
        if best.tied_with:
            lines.append(tie_text("it", best.tied_with))
    else:
        head = "Unexplained: something is left, and no effect of the catalogue earns its place."
        lines += [
            f"Nearest, but not good enough: {told_all(c.terms, robot)}; {c.why_not}." for c in found.candidates[:1]
        ]
    if found.left:
        lines.append(left_text(found.left, found.verdict == EFFECT))
    if ahead is not None and ahead.separation < ENOUGH:
        lines.append("No trial of the library would separate them either: on all of them they do the same.")
    elif ahead is not None:
        e = ahead.excitation
        lines.append(
            f"The trial that would separate them best: {e.kind} for {e.seconds:g} s at amplitude {e.amplitude:g}, seed {e.seed}, "
            f"on the {e.fixture} (predicted distance {ahead.separation:.0f} standard deviations)."
        )
    good = found.verdict == NOTHING_MISSING or (found.verdict == EFFECT and not found.left)
    return Account(head, tuple(lines), good)


def _doubt(found: Explanation) -> str:
    return "" if not found.left else ", as one of several things"


def _twins(best: Judged) -> str:
    """What it may be instead: by name, where there are few."""
    others = best.tied_with
    if not others:
        return ""
    if len(others) > 2:
        return f", or one of {len(others)} others that look the same here"
    return f", or {' or '.join(map(placed, others))}, which look{'s' if len(others) == 1 else ''} the same here"


def confidence(best: Judged) -> str:
    low, high = best.interval
    return (
        f"on {best.held_out} it takes {best.gain:.0%} off the squared residual (95 % interval {max(low, -9.99):.0%} to "
        f"{min(high, 1.0):.0%}), {max(0.0, min(best.explained, 1.0)):.0%} of what is above the noise"
    )


def improve_account(problem: Problem, found: Improvement) -> Account:
    """What was done, how good it is, and what is left."""
    robot, first, last = problem.robot, found.ladder[0], found.ladder[-1]
    steps = [r for r in found.ladder if r.added]
    lines = []
    floor = problem.told(found.noise_floor)
    if not steps:
        head = f"Nothing was added: {found.stopped}."
        lines.append(f"{_capital(problem.natural_name)} {problem.told(last.error_heldout)}, noise floor {floor}.")
    else:
        many = "effect" if len(steps) == 1 else "effects"
        how = {
            EXPLAINED: "and nothing is left above the noise",
            BETTER: f"better, and not explained: {found.explained:.0%} of what is above the noise is accounted for",
        }.get(found.verdict, "")
        head = (
            f"{len(steps)} {many} added; {problem.natural_name} on {last.held_out} {problem.told(first.error_heldout)} -> "
            f"{problem.told(last.error_heldout)} (noise floor {floor}), {how}."
        )
        lines.append("Added, in this order: " + "; ".join(told_all(r.added, robot) for r in steps) + ".")
        lines += [tie_text(placed(r.name), r.tied_with) for r in steps if r.tied_with]
        lines += [f"Dropped again: {placed(d)}, which a later effect made useless." for r in steps for d in r.dropped]
    lines.append("The model: " + ("; ".join(told(t, robot) for t in found.terms) or "the robot as described") + ".")
    lines.append(f"Stopped because {found.stopped}.")
    lines += [flag_text(found.terms, p) for p in found.parameters if p.flag]
    lines.append(left_text(found.left, True) if found.left else "Nothing is left above the noise.")
    return Account(head, tuple(lines), not found.left)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def flag_text(terms: Hypothesis, p: ParameterReport) -> str:
    return f"{named(terms[p.term])}, {plain(p.name)}: {p.flag}."


def tie_text(what: str, others: Sequence[str]) -> str:
    return f"These measurements cannot tell {what} from: {', '.join(map(placed, others))}."


def left_text(left: Sequence[Leftover], after: bool) -> str:
    head = "Even with it, more than noise is left in" if after else "It sits in"
    count = len({(g.trial, g.channel) for g in left})
    return f"{head} {count} channel{'s' if count > 1 else ''}; worst: {'; '.join(map(str, left[:3]))}."
