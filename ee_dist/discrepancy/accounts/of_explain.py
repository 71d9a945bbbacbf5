"""What explain has to say: the verdict, what it is, what speaks for it, what stays open, what to do next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.basics.names import counted, listed
from ee_dist.discrepancy.accounts.account import (
    BEYOND,
    CONTENT,
    MEND,
    NO_MOTION_TRIED,
    SEVERAL,
    THAT_NOISE,
    TWINS,
    Account,
    advised,
    apart_text,
    before_and_after,
    beside_floor,
    curves_of,
    error_name,
    held_out_notes,
    left_beside_noise,
    left_text,
    listed_few,
    nothing_else,
    slower,
    tie_text,
    unexplained_rest,
    unsure_of,
    was_or_were,
)
from ee_dist.discrepancy.accounts.ranges import beyond_a_guess, ranges
from ee_dist.discrepancy.assumed import GUESS, LABEL, guessed_text
from ee_dist.discrepancy.at_limit import limit_lines, unsaid
from ee_dist.discrepancy.confidence import COUNTED_WAY
from ee_dist.discrepancy.evidence.intervals import ALL_OF_IT, HARDLY, NEUTRAL, NOT_DETERMINED, ParameterReport
from ee_dist.discrepancy.evidence.judge import Judged, contains
from ee_dist.discrepancy.evidence.left import SETTLED, Leftover
from ee_dist.discrepancy.evidence.rule import LUCK
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, UNEXPLAINED, Explanation
from ee_dist.discrepancy.last_word import LastWord
from ee_dist.discrepancy.plan import ENOUGH, PlannedTrial
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import known
from ee_dist.discrepancy.words import amounts, is_less, named, percent_within, percents, phrase, placed, plain, told_all
from ee_dist.effects.catalogue import CATALOGUE, Term
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

NAMED = 3
"""Terms whose intervals are told in a sentence, and values of a model that moved."""
MOVED = 0.02
"""Share of its range by which one must have moved for that."""
WITHOUT = "Without what was found, "
"""Before what is told of the model that a search began from."""


def moved(found: Explanation, robot: Robot) -> str:
    """Which values of the model moved most when they were fitted to these measurements, for that may be what happened."""
    pairs = [
        (was, now) for was, now in zip(found.given, found.before, strict=False) if was.name == now.name and now.values
    ]

    def far(was: Term, now: Term) -> float:
        of = known(robot, was)
        return float(np.abs(of.shares(dict(now.values)) - of.shares(dict(was.values))).max())

    those = sorted((p for p in pairs if far(*p) > MOVED), key=lambda p: -far(*p))[:NAMED]
    told = [f"{named(now)} ({amounts(now, robot)}; {amounts(was, robot)} in the model)" for was, now in those]
    return f"; what moved most: {', '.join(told)}" if told else ""


def explain_account(
    problem: Problem,
    found: Explanation,
    ahead: PlannedTrial | None,
    planner: str = "",
    confidence: float | None = None,
    also: Sequence[str] = (),
    word: LastWord | None = None,
) -> Account:
    """The verdict, what it is, what speaks for it, what stays open, what to do next; ``planner`` is said where something is tied
    that another trial might tell apart, ``confidence`` is that of confidence.py, ``also`` is said first. ``word``: how far the
    models are from trials that took no part."""
    robot, best = problem.robot, found.best
    rest: Sequence[Leftover] = found.left
    lines = [f"Noise floor: {found.floor_source}. {_tried(found)}"]
    error = f"{error_name(problem)}: model {problem.told(found.baseline_error)}"
    error += f", noise floor {problem.told(found.noise_floor)}."
    last, advice = found.baseline_error, ""
    unsure = [] if found.left else found.unsure
    if found.refitted_error != found.baseline_error:
        lines.append(f"Its own values fitted anew leave {problem.told(found.refitted_error)}{moved(found, robot)}.")
        last = found.refitted_error
    if found.as_it_was:
        lines.append(
            "Its own values stay as they were: with the effect on top that explains more than fitting them anew."
        )
    if found.verdict == NOTHING_MISSING:
        by_luck = all(c.why_not == LUCK for c in found.candidates)
        worth = "takes more off the residual than luck" if by_luck else "earns its place"
        nothing = "Nothing is left beyond what may be noise" if unsure else "Nothing is missing"
        head = f"{nothing}: no candidate {worth}, and no channel stands out."
        gains = "gains more than luck" if by_luck else "earns its place"
        sure = f"How sure: {counted(found.tried, 'explanation')} {was_or_were(found.tried)} tried, and none {gains}"
        sure += f"{unsure_of(unsure)}."
        advice = slower(unsure) if unsure else CONTENT
    elif found.verdict == EFFECT and best is not None:
        entry, last = CATALOGUE[best.terms[0].effect], best.error_heldout
        # Those that were judged are the most promising: where all of them are tied there may be more.
        looked_at = [c for c in found.candidates if not contains(c, best)]
        more = "at least " if len(best.tied_with) + 1 == len(looked_at) < found.tried else ""
        less = is_less(best.terms)
        rest = left_beside_noise(found.left, best.terms, robot)
        guessed = best.proposal.label == LABEL
        begins = "Not what was assumed" if guessed else "Too much" if less else "Missing"
        head = f"{begins}{', among other things' if rest else ''}: "
        head += f"{_what(found, best, robot)}{_twins(best, more, bool(rest))}."
        nothing = BEYOND if unsure else nothing_else(best.explained, last <= SETTLED * found.noise_floor)
        head += " More than noise is left with it." if rest else f" {THAT_NOISE if found.left else nothing}"
        error = before_and_after(problem, found.baseline_error, best.error_heldout, found.noise_floor)
        sure = f"How sure: it explains {taken_off(best)}{unexplained_rest(best.explained, not found.left)}. "
        some = best.terms if len(best.terms) <= NAMED else ()  # of more the table tells
        values = ranges(found.after, found.parameters, some, robot, len(best.terms) > 1)
        others = [c for c in looked_at if c.earned and c.name not in best.tied_with]
        better = [c for c in others if float(c.held.sum()) < float(best.held.sum())]
        by_more = all(c.proposal.size > best.proposal.size for c in better)
        beside = [c.name for c in found.candidates if _told_better(problem, c, best)]
        rivals = _rivals(found.tried, best.tied_with, more, [c.name for c in better], by_more, beside)
        sure += f"{rivals}{unsure_of(unsure)}{values}."
        advice = slower(unsure) if unsure else MEND if entry.mistake else ""
        lines.append(f"{guessed_text(best.terms)}{_still(problem)}" if guessed else entry.physics)
        turned = " Here the other way round: the model has too much of it." if less else ""
        lines += [] if guessed else [f"Its mark in a residual: {entry.signature}{turned}"]
        lines += [GUESS] if best.proposal.guess and not guessed else []
        lines += beyond_a_guess(robot, found.after, found.parameters, alone=True)
        if best.tied_with:
            lines.append(tie_text("it", best.tied_with))
    else:
        none = f"none of {counted(found.tried, 'explanation')} that {was_or_were(found.tried)} tried earns its place"
        head = f"Unexplained: something is left, and {none}."
        if found.left:
            head = f"Unexplained: more than noise is left, most at {plain(found.left[0].channel)}, and {none}."
        places = curves_of(found.left)
        sure = (
            f"How sure: {counted(places, 'curve')} differ{'s' if places == 1 else ''} by more than noise; noise floor: "
        )
        sure += f"{found.floor_source}."
        advice = SEVERAL
        lines += [f"Nearest, but not good enough: {phrase(c.terms, robot)}; {c.why_not}." for c in found.candidates[:1]]
    lines += beside_floor(last, found.noise_floor, bool(found.left))
    if rest:
        lines.append(left_text(rest, found.verdict == EFFECT))
    if word is not None:
        lines.append(apart_text(word))
        error = f"{error} {word.text}"
        also = (*word.lines, *also)
    if ahead is not None and ahead.separation < ENOUGH:
        advice = NO_MOTION_TRIED
    elif ahead is not None:
        e = ahead.excitation
        where = f", on the {e.fixture}" if robot.free_base else ""
        advice = (
            f"To tell them apart, record: {plain(e.kind)} for {e.seconds:g} s at amplitude {e.amplitude:g}, seed "
            f"{e.seed}{where}. There they should differ by {ahead.separation:.0f} standard deviations."
        )
    sure = f"{sure} {_counted_right(confidence, problem.way)}."
    tied = bool(found.verdict == EFFECT and best is not None and best.tied_with)
    good = (found.verdict == NOTHING_MISSING or (found.verdict == EFFECT and not rest)) and not unsure and not tied
    more_there = word is not None and word.more
    good = good and not more_there
    # Where the model agrees its limits are those of the robot, whatever else was missing.
    off = bool(rest) or found.verdict == UNEXPLAINED or more_there
    at_limit = unsaid(robot, found.at_limit if off else [], best.terms if best else ())
    warnings, notes = limit_lines(at_limit, WITHOUT if best else "")
    return Account(
        head,
        error,
        sure,
        (*also, *notes, *lines, *held_out_notes(problem), *problem.notes),
        good,
        advised(problem, advice),
        planner if tied else "",
        warnings,
        more=found.verdict == EFFECT and bool(rest),
    )


def _tried(found: Explanation) -> str:
    """How many explanations, and why no more."""
    text, less = f"{counted(found.tried, 'explanation')} {was_or_were(found.tried)} tried", found.offered - found.tried
    if less <= 0:
        return f"{text}."
    there = f"{'is' if less == 1 else 'are'} in the model already, or " if found.before else ""
    return f"{text}; {counted(less, 'more candidate')} {there}would change what {'it' if there else 'the model'} has none of."


def _what(found: Explanation, best: Judged, robot: Robot) -> str:
    """The terms of the best explanation; of drives that were only assumed, those of whose values these data tell something."""
    reports = {t: [p for p in found.parameters if p.tells and found.after[p.term] == t] for t in best.terms}
    vague = [t for t, own in reports.items() if own and all(map(_untold, own))]
    told = tuple(t for t in best.terms if t not in vague)
    if best.proposal.label != LABEL:
        return told_all(best.terms, robot) + " (of which these data tell no value)" * (not told)
    if not vague:
        return told_all(told, robot)
    several = listed(dict.fromkeys(plain(t.effect) for t in vague))
    if not told:
        return f"{several} together, of which these data tell none by itself"
    return f"{told_all(told, robot)} (with {several}, of which these data tell none by itself)"


def _untold(report: ParameterReport) -> bool:
    return report.doubt == ALL_OF_IT or any(f in report.flag for f in (NEUTRAL, HARDLY, NOT_DETERMINED))


def _still(problem: Problem) -> str:
    """A word where most joints of which drives were assumed do not move: what all share is what the others show."""
    robot = problem.robot
    assumed = robot.assumed_joints("kp")
    moved = [
        j
        for j in assumed
        if any(_told_to_move(t.log.commands[:, robot.motor_names.index(j)]) for t in problem.measured)
    ]
    if 2 * len(moved) >= len(assumed):
        return ""
    one = len(moved) == 1
    return (
        f" Only {counted(len(moved), 'joint')} of {len(assumed)} {'is' if one else 'are'} commanded to move here: one number for "
        f"all is what {'this one shows' if one else 'these show'}, and what holds the others still."
    )


def _told_to_move(commands: Array) -> bool:
    """Whether commands (T,), NaN where a drive is released, are ever others."""
    known = commands[np.isfinite(commands)]
    return len(known) > 0 and float(np.ptp(known)) > 0


def _told_better(problem: Problem, c: Judged, best: Judged) -> bool:
    """Whether a candidate is the best and more, and the table of candidates has it with a lesser error."""
    less = c.error_heldout < best.error_heldout and problem.told(c.error_heldout) != problem.told(best.error_heldout)
    return less and c.earned and contains(c, best)


def _rivals(
    tried: int, tied: Sequence[str], more: str, better: Sequence[str], by_more: bool, beside: Sequence[str] = ()
) -> str:
    """``better``: what leaves less of what was held out, and does not go first for all that it says; ``by_more`` numbers.
    ``beside``: what is the best and more, and leaves less: no other explanation, and yet above it by its error."""
    of = f"Of {counted(tried, 'explanation')}"
    told_of = f" ({listed_few(tied)})" if len(tied) > TWINS else ""  # fewer are in the headline
    as_well = f"{more}{len(tied)} other{'s do' if len(tied) > 1 else ' does'} as well{told_of}"
    itself = f"itself with more beside it ({listed_few(beside)})"
    if better:
        do = "do" if len(better) > 1 else "does"
        how = "by more numbers where nothing was guessed" if by_more else "where nothing was guessed"
        said = f"{of} {len(better)} {do} better, {how} ({listed_few(better)})"
        said += f", and {as_well}" if tied else ""
    elif tied:
        said = f"{of} {as_well}"
    else:
        return f"{of} no other does as well{f' but {itself}' if beside else ''}"
    return f"{said}, and so does {itself}" if beside else said


def _counted_right(confidence: float | None, way: str) -> str:
    if confidence is None and way != COUNTED_WAY:
        return f"How often verdicts are right was counted for {COUNTED_WAY} alone, not for {way}"
    if confidence is None:
        return "Too few of the simulated cases that were counted looked like this one to say how often such a verdict is right"
    return f"In {100 * confidence:.0f} of 100 simulated cases that looked like this one, the verdict was right"


def _twins(best: Judged, more: str, left: bool) -> str:
    """What it may be instead: by name, where there are few. Where much is ``left`` they do as well, and do not look the same."""
    others = best.tied_with
    if not others:
        return ""
    alike = (
        f"{'do' if len(others) > 1 else 'does'} as well"
        if left
        else f"look{'' if len(others) > 1 else 's'} the same here"
    )
    if len(others) > TWINS:
        return f", or one of {more}{len(others)} others that {alike}"
    return f", or {' or '.join(map(placed, others))}, which {alike}"


def above(c: Judged) -> tuple[float, float]:
    """The interval of a candidate's gain as a share of what is above the noise, as ``explained`` is one."""
    scale = c.explained / c.gain if c.gain and np.isfinite(c.gain) else 1.0
    return c.interval[0] * scale, c.interval[1] * scale


def shown_gain(c: Judged) -> tuple[float, float, float]:
    """The gain of a candidate and the ends of its interval as they are told: no more than all of it."""
    low, high = above(c)
    return min(c.explained, 1.0), min(low, 1.0), min(high, 1.0)


def told_gain(c: Judged) -> tuple[str, str]:
    """Both in words: the gain by as many digits as its interval."""
    share, low, high = shown_gain(c)
    return percent_within(share, low, high), percents(low, high)


def taken_off(best: Judged) -> str:
    """What it takes off held-out data, as a share of what is not noise, with its interval."""
    share, interval = told_gain(best)
    return f"{share} of the error above the noise (95 % interval {interval}), judged on {best.held_out}"
