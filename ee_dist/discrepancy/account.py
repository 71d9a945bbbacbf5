"""What was found, in words: for the terminal, the report and whoever has to mend the robot."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.assumed import GUESSED, LABEL, assumed_text
from ee_dist.discrepancy.calibrated_away import OddOne
from ee_dist.discrepancy.compare import Comparison
from ee_dist.discrepancy.evidence.intervals import ParameterReport
from ee_dist.discrepancy.evidence.judge import LUCK, Judged
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, Explanation
from ee_dist.discrepancy.importance import Share, added, shares
from ee_dist.discrepancy.improve import EXPLAINED, SETTLED
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.plan import ENOUGH, PlannedTrial
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.uneven import worse_text, worse_trials
from ee_dist.discrepancy.words import (
    is_less,
    much,
    named,
    percent,
    phrase,
    placed,
    plain,
    quantity,
    span,
    told_all,
)
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term
from ee_dist.robots.model import Robot

NAMED = 3
"""Effects that a headline names."""
TWINS = 2
"""Others that a headline names beside the one that was found,"""
FEW = 4
"""and the line below it, where there are more."""
MOSTLY = 0.97
"""Share of what is above the noise from which nobody asks for the rest."""
CLOSE = 1.1
"""Times the noise floor up to which a model is nearly right."""
GRANTED = "What is above the floor is no more than chance, and what contacts and reversals leave that come a row early or late."
SPREAD = (
    "What is left stands out nowhere; all together it is more than noise, and below the resolution at which channels are "
    "compared."
)
NOTHING_STANDS_OUT = "Nothing else stands out."
NOTHING_ELSE = "Nothing else is left above the noise."
CONTENT = (
    "Next: nothing has to be done. The model explains these measurements; other motions may show what these do not."
)
PLAN = "What to record to tell them apart, within limits of yours:"
"""Before the command that finds it."""
STUCK = "Next: try other motions, or write the effect that is missing (docs/own_effect.md)."


@dataclass(frozen=True)
class Account:
    """``headline``: what was found, where, how much of it, and whether more is left. ``error``: of the models, beside the
    noise floor. ``sure``: how sure it is. ``advice``: what to do next, where a command does not say it. ``lines``: what speaks
    for it and what stays open. ``good``: whether the question is settled. ``planner``: the command that finds the trial which
    tells apart what is tied, where something is. ``warnings``: what may make all of it wrong."""

    headline: str
    error: str
    sure: str
    lines: tuple[str, ...]
    good: bool
    advice: str = ""
    planner: str = ""
    warnings: tuple[str, ...] = ()

    @property
    def first(self) -> list[str]:
        """What comes below the headline before anything else."""
        planned = f"{PLAN} {self.planner}" if self.planner else ""
        return [line for line in (*self.warnings, self.error, self.sure, self.advice, planned) if line]

    @property
    def words(self) -> list[str]:
        """All of it, the headline first."""
        return [self.headline, *self.first, *self.lines]


def compare_account(problem: Problem, found: Comparison, left: Sequence[Leftover]) -> Account:
    """What compare has to say; ``left``: where more than noise is."""
    ratio = found.error / found.noise_floor if found.noise_floor else float("inf")
    off = problem.told(found.error)
    lines = [f"Error: {found.definition}. Noise floor: {found.floor_source}.", *assumed_text(problem.robot)]
    lines += _beside(found.error, found.noise_floor, bool(left))
    parted = [f"{t} at {s:.2f} s" for t, s in found.parted_s.items() if s is not None]
    lines.append("Prediction and measurement part: " + ("; ".join(parted) or "nowhere") + ".")
    if left:
        lines.append(left_text(left, False))
    if ratio < CLOSE and not left:
        head = "The model agrees with the measurements: nothing is left above the noise."
    else:
        # The largest error, or, where the errors are all small, the place that noise explains least.
        place = left[0].channel if left and ratio < CLOSE else found.channels[0].name if found.channels else ""
        where = f", most of all at {plain(place)}" if place else ""
        how = "The model is nearly right, and more than noise is left" if ratio < CLOSE else "The model is off"
        least = problem.natural(found.noise_floor)
        times = _times(problem.natural(found.error) / least) if least else "far more than"
        head = f"{how}{where}: {problem.natural_name} {off}, {times} what noise alone would leave."
    floor = problem.told(found.noise_floor)
    error = f"{_error(problem)}: model {off}, noise floor {floor}."
    places = _count(len(found.channels) * len(problem.trials), "curve")
    of = f"{places} ({_count(len(found.channels), 'channel')} in {_count(len(problem.trials), 'trial')})"
    sure = (
        f"How sure: more than noise stands out in {_places(left)} of {of}"
        if left
        else f"How sure: none of {of} stands out"
    )
    sure += f"; the noise floor is {found.floor_source}."
    settled = ratio < CLOSE and not left
    return Account(head, error, sure, (*lines, *problem.notes), settled, _before(problem, CONTENT if settled else ""))


def _before(problem: Problem, advice: str) -> str:
    """The advice, and before it what is to be put right first."""
    return " ".join(t for t in (problem.doubts and f"Before this is believed: {problem.doubts}", advice) if t)


def _times(ratio: float) -> str:
    return f"{ratio:.3g} times" if abs(ratio - 1) >= 0.005 else "about"


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def _beside(error: float, floor: float, left: bool) -> list[str]:
    """An error that is less than noise would leave needs a word, and one that is more although nothing is ``left``."""
    if error < 0.97 * floor:
        return ["The error is below the floor: the noise was estimated too high, and the floor is an upper bound."]
    if error < floor:
        return ["The error is at the floor, within chance."]
    if error <= 1.03 * floor or left:
        return []
    return [GRANTED if error <= SETTLED * floor else SPREAD]


def explain_account(problem: Problem, found: Explanation, ahead: PlannedTrial | None, planner: str = "") -> Account:
    """The verdict, what it is, what speaks for it, what stays open, what to do next; ``planner`` is said where something is tied
    that another trial might tell apart."""
    robot, best = problem.robot, found.best
    lines = [f"Noise floor: {found.floor_source}. {_count(found.tried, 'explanation')} {_were(found.tried)} tried."]
    error = f"{_error(problem)}: model {problem.told(found.baseline_error)}"
    error += f", noise floor {problem.told(found.noise_floor)}."
    last, advice = found.baseline_error, ""
    if found.refitted_error != found.baseline_error:
        lines.append(f"Its own values fitted anew leave {problem.told(found.refitted_error)}.")
        last = found.refitted_error
    if found.as_it_was:
        lines.append(
            "Its own values stay as they were: with the effect on top that explains more than fitting them anew."
        )
    if found.verdict == NOTHING_MISSING:
        by_luck = all(c.why_not == LUCK for c in found.candidates)
        worth = "takes more off the residual than luck" if by_luck else "earns its place"
        head = f"Nothing is missing: no candidate {worth}, and no channel stands out."
        gains = "gains more than luck" if by_luck else "earns its place"
        sure = f"How sure: {_count(found.tried, 'explanation')} {_were(found.tried)} tried, and none {gains}."
        advice = CONTENT
    elif found.verdict == EFFECT and best is not None:
        entry, last = CATALOGUE[best.terms[0].effect], best.error_heldout
        # Those that were judged are the most promising: where all of them are tied there may be more.
        more = "at least " if len(best.tied_with) + 1 == len(found.candidates) < found.tried else ""
        less = is_less(best.terms)
        head = f"{'Too much' if less else 'Missing'}{_doubt(found)}: {told_all(best.terms, robot)}{_twins(best, more)}."
        nothing = NOTHING_ELSE if last <= SETTLED * found.noise_floor else NOTHING_STANDS_OUT
        head += " More than noise is left with it." if found.left else f" {nothing}"
        error = _errors(problem, found.baseline_error, best.error_heldout, found.noise_floor, best.held_out)
        sure = f"How sure: it takes off {confidence(best)}{_rest(best.explained, not found.left)}"
        sure += f"; {_rivals(found.tried, best.tied_with, more)}."
        guessed = best.proposal.label == LABEL
        lines.append(GUESSED if guessed else entry.physics)
        turned = " Here the other way round: the model has too much of it." if less else ""
        lines += [] if guessed else [f"Its mark in a residual: {entry.signature}{turned}"]
        if best.tied_with:
            lines.append(tie_text("it", best.tied_with))
    else:
        none = f"none of {_count(found.tried, 'explanation')} that {_were(found.tried)} tried earns its place"
        head = f"Unexplained: something is left, and {none}."
        if found.left:
            head = f"Unexplained: more than noise is left, most at {plain(found.left[0].channel)}, and {none}."
        places = _places(found.left)
        sure = f"How sure: more than noise stands out in {_count(places, 'curve')}; noise floor: {found.floor_source}."
        advice = STUCK
        lines += [
            f"Nearest, but not good enough: {told_all(c.terms, robot)}; {c.why_not}." for c in found.candidates[:1]
        ]
    lines += _beside(last, found.noise_floor, bool(found.left))
    if found.left:
        lines.append(left_text(found.left, found.verdict == EFFECT))
    if ahead is not None and ahead.separation < ENOUGH:
        advice = "No trial of the library would tell them apart either: on all of them they do the same."
    elif ahead is not None:
        e = ahead.excitation
        where = f", on the {e.fixture}" if robot.free_base else ""
        advice = (
            f"To tell them apart: {plain(e.kind)} for {e.seconds:g} s at amplitude {e.amplitude:g}, seed {e.seed}{where} "
            f"(predicted distance {ahead.separation:.0f} standard deviations)."
        )
    good = found.verdict == NOTHING_MISSING or (found.verdict == EFFECT and not found.left)
    tied = found.verdict == EFFECT and best is not None and best.tied_with
    alike = ahead is not None and ahead.separation < ENOUGH
    return Account(
        head,
        error,
        sure,
        (*lines, *problem.notes),
        good,
        _before(problem, advice),
        planner if tied and not alike else "",
    )


def _error(problem: Problem) -> str:
    """Its name; with its unit, where that is not told behind each number."""
    unit = f" ({problem.natural_unit})" if problem.natural_unit == "standard deviations" else ""
    return _capital(problem.natural_name) + unit


def _were(count: int) -> str:
    return "was" if count == 1 else "were"


def _errors(problem: Problem, before: float, after: float, floor: float, held_out: str) -> str:
    """The model, the improved one and noise in one line."""
    return (
        f"{_error(problem)}: model {problem.told(before)}, improved model {problem.told(after)} held out "
        f"({held_out}), noise floor {problem.told(floor)}."
    )


def _rest(explained: float, settled: bool) -> str:
    """A word on what is above the noise still, where nothing is said to be left."""
    return "; what it leaves of that stands out nowhere" if settled and explained < MOSTLY else ""


def _rivals(tried: int, tied: Sequence[str], more: str) -> str:
    if not tied:
        return f"of {_count(tried, 'explanation')} no other does as well"
    told_of = f" ({_few(tied)})" if len(tied) > TWINS else ""  # fewer are in the headline
    return f"of {_count(tried, 'explanation')} {more}{len(tied)} other{'s do' if len(tied) > 1 else ' does'} as well{told_of}"


def _few(names: Sequence[str]) -> str:
    """Candidates by name, as many as a line holds."""
    more = f" and {len(names) - FEW} more" if len(names) > FEW else ""
    return "; ".join(map(placed, names[:FEW])) + more


def _doubt(found: Explanation) -> str:
    return "" if not found.left else ", as one of several things"


def _twins(best: Judged, more: str) -> str:
    """What it may be instead: by name, where there are few."""
    others = best.tied_with
    if not others:
        return ""
    if len(others) > TWINS:
        return f", or one of {more}{len(others)} others that look the same here"
    return f", or {' or '.join(map(placed, others))}, which look{'s' if len(others) == 1 else ''} the same here"


def above(c: Judged) -> tuple[float, float]:
    """The interval of a candidate's gain as a share of what is above the noise."""
    scale = c.explained / c.gain if c.gain > 0 and np.isfinite(c.gain) else 1.0
    return c.interval[0] * scale, c.interval[1] * scale


def confidence(best: Judged) -> str:
    """What it takes off held-out data, as a share of what is not noise, with its interval."""
    low, high = above(best)
    return (
        f"{percent(max(0.0, min(best.explained, 1.0)))} of what is above the noise (95 % interval {percent(max(low, -9.99))} "
        f"to {percent(min(high, 1.0))}), judged on {best.held_out}"
    )


def improve_account(problem: Problem, found: Improvement, planner: str = "") -> Account:
    """What was done, how good it is, and what is left; ``planner`` is said where what was added is tied."""
    robot, first, last = problem.robot, found.ladder[0], found.ladder[-1]
    steps = [r for r in found.ladder if r.added]
    lines = []
    if len(steps) > 1:
        lines.append("Added, in this order: " + "; ".join(phrase(r.added, robot) for r in steps) + ".")
    names = {t.name for t in found.terms}
    ties = {r.name: [n for n in r.tied_with if n not in names] for r in steps if names & {t.name for t in r.added}}
    lines += [tie_text(placed(name), others) for name, others in ties.items() if others]
    gone = dict.fromkeys(d for r in steps for d in r.dropped if d not in names)
    lines += [f"Dropped again: {placed(d)}, which a later effect made useless." for d in gone]
    parts = shares(found, robot)
    lines += doubt_text([s for s in parts if s.doubted])
    vague = [placed(d) for r in found.ladder if not r.added for d in r.dropped]
    if vague:
        lines.append(f"Left out in the end, since these data do not tell them from neutral: {'; '.join(vague)}.")
    lines.append("The model: " + (phrase(found.terms, robot) or "the robot as described") + ".")
    lines.append(f"Stopped because {found.stopped}. Noise floor: {found.floor_source}.")
    lines += [flag_text(found.terms, p) for p in found.parameters if p.flag]
    worse = worse_trials(problem, found)
    if worse:
        lines.append(worse_text(problem, worse))
    settled = found.verdict in (EXPLAINED, NOTHING_MISSING)
    lines += _beside(last.error_heldout, found.noise_floor, not settled)
    if found.left:
        lines.append(left_text(found.left, bool(steps)))
    error = _errors(problem, first.error_heldout, last.error_heldout, found.noise_floor, last.held_out)
    share = f"{percent(max(0.0, min(found.explained, 1.0)))} of what is above the noise is accounted for"
    if len(found.ladder) == 1:
        head = f"Nothing was added: {found.stopped}."
        error = f"{_error(problem)}: model {problem.told(last.error_heldout)}, noise floor "
        error += f"{problem.told(found.noise_floor)}."
        tried = found.last.tried if found.last else 0
        sure = f"How sure: {_count(tried, 'explanation')} {_were(tried)} tried, and none earns its place."
    else:
        what = _listed([s.text for s in parts]) if parts else "nothing; the model's own values were fitted anew"
        head = f"Added: {what}."
        where = "" if found.left or settled else f" on {last.held_out}"
        head += f" {NOTHING_ELSE}" if settled else f" More than noise is left{where}: {share}."
        sure = f"How sure: {share}, judged on {last.held_out}{_rest(found.explained, settled)}"
        sure += f"{_ranges(found, [s.terms[0] for s in parts[:NAMED] if len(s.terms) == 1], robot)}{_told_from(ties)}."
    advice = "" if len(found.ladder) > 1 else CONTENT if settled else STUCK
    tied = any(r.alternatives and len(r.added) == 1 and r.added[0].name in names for r in steps)
    warnings = tuple(odd_text(o, robot) for o in found.odd)
    good = settled and not warnings
    more = (*lines, *problem.notes)
    return Account(head, error, sure, more, good, _before(problem, advice), planner if tied else "", warnings)


def _many_times(ratio: float) -> str:
    return "more than 100 times" if ratio > 100 else f"{ratio:.0f} times"


def odd_text(odd: OddOne, robot: Robot) -> str:
    """What a calibration hides, if the robot that it was made on was not in order."""
    what = "joints" if odd.term.target == odd.joint else "sensors"
    return (
        f"Calibrated away at {plain(odd.term.target)}: {much(odd.term, robot)}, {_many_times(odd.times)} what its like {what} "
        "have: if this robot was not in order, this hides it."
    )


def doubt_text(doubted: Sequence[Share]) -> list[str]:
    """What less depends on than is left unexplained, if there is such."""
    if not doubted:
        return []
    one = len(doubted) == 1
    return [
        f"Less depends on {'this' if one else 'each of these'} than is left unexplained, so that "
        f"{'it' if one else 'any of them'} may stand in for something else: {'; '.join(s.text for s in doubted)}."
    ]


def _listed(names: Sequence[str]) -> str:
    more = f"; and {len(names) - NAMED} more" if len(names) > NAMED else ""
    return "; ".join(names[:NAMED]) + more


def _ranges(found: Improvement, named_: Sequence[Term], robot: Robot) -> str:
    """The 95 % intervals of the values that a headline names."""
    told_of: dict[str, list[str]] = {t.name: [] for t in named_}
    for p in found.parameters:
        term = found.terms[p.term]
        if term.name in told_of:
            range_ = span(term, p.name, p.low, p.high, robot)
            sure = not p.flag and np.isfinite(p.high - p.low)
            told_of[term.name].append(f"{quantity(term, p.name, robot)} {range_ if sure else p.flag or range_}".strip())
    out = [
        (f"{placed(name)}: " if len(added(found)) > 1 else "") + ", ".join(values)
        for name, values in told_of.items()
        if values
    ]
    return f"; 95 % intervals: {'; '.join(out)}" if out else ""


def _told_from(ties: Mapping[str, Sequence[str]]) -> str:
    """Whether others would have done as well."""
    others = sorted({t for names in ties.values() for t in names})
    if not others:
        return ""
    several = f"{len(others)} others ({_few(others)})"
    return f"; not told from {' or '.join(map(placed, others)) if len(others) <= TWINS else several}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def flag_text(terms: Hypothesis, p: ParameterReport) -> str:
    return f"{named(terms[p.term])}, {quantity(terms[p.term], p.name)}: {p.flag}."


def tie_text(what: str, others: Sequence[str]) -> str:
    return f"These measurements cannot tell {what} from: {', '.join(map(placed, others))}."


def left_text(left: Sequence[Leftover], after: bool) -> str:
    head = "Even with it, more than noise is left in" if after else "It sits in"
    return f"{head} {_count(_places(left), 'curve')}; worst: {'; '.join(plain(str(g)) for g in left[:3])}."


def _places(left: Sequence[Leftover]) -> int:
    """Channels of trials: one may stand out for two reasons."""
    return len({(g.trial, g.channel) for g in left})
