"""What improve has to say: what was added, how good the model is with it, and what is left."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from collections.abc import Set as AbstractSet

from ee_dist.basics.names import counted
from ee_dist.discrepancy.accounts.account import (
    BEYOND,
    CONTENT,
    MEND,
    STUCK,
    TWINS,
    Account,
    advised,
    apart_text,
    before_and_after,
    beside_floor,
    error_name,
    held_out_notes,
    left_text,
    listed_few,
    nothing_else,
    slower,
    tie_text,
    unexplained_rest,
    unsure_of,
    was_or_were,
)
from ee_dist.discrepancy.accounts.ranges import (
    beyond_a_guess,
    flag_texts,
    load_text,
    of_kind,
    ranges,
    rest_text,
    scale_text,
    weight_text,
)
from ee_dist.discrepancy.at_limit import limit_lines, unsaid
from ee_dist.discrepancy.calibrated_away import OddOne
from ee_dist.discrepancy.evidence.holdout import MOTIONS, in_turn
from ee_dist.discrepancy.evidence.intervals import ALL_OF_IT, ENDED, HARDLY, NEUTRAL, NOT_DETERMINED
from ee_dist.discrepancy.explain import NOTHING_MISSING
from ee_dist.discrepancy.finished import EXPLAINED
from ee_dist.discrepancy.importance import Share, added, shares
from ee_dist.discrepancy.ladder import Improvement, Rung, Twin
from ee_dist.discrepancy.last_word import TRIALS_APART, LastWord
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Proposal
from ee_dist.discrepancy.torque_scale import torques_compared
from ee_dist.discrepancy.uneven import worse_text, worse_trials
from ee_dist.discrepancy.weighed_up import ALL_ROWS
from ee_dist.discrepancy.words import by_effect, much, percent, phrase, placed, plain, without_values
from ee_dist.discrepancy.worse_steps import worse_step_lines
from ee_dist.effects.catalogue import CATALOGUE, Term
from ee_dist.effects.groups import members_of
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

NOTHING_BEYOND = "nothing is left that counts beyond what may be noise"
ON_ITS_OWN = (
    "Compare may tell another error and floor of this model on the same trials: it holds nothing out, and weighs by the model "
    "that it is given."
)
EACH = "each of "
NAMED = 3
"""Effects that a headline names."""


def has(names: AbstractSet[str], told: str, robot: Robot) -> bool:
    """Whether effects of these ``names`` are all that an explanation is made of: a rival that came into the model later, at each
    of the joints that it is shared by if need be."""
    effect, _, place = told.partition("@")
    if place.startswith(EACH):
        return any(name.startswith(f"{effect}@") for name in names)

    def there(name: str) -> bool:
        kind, _, where = name.partition("@")
        members = members_of(robot, where, CATALOGUE[kind].targets(robot)) if kind in CATALOGUE else ()
        return name in names or (bool(members) and {f"{kind}@{m}" for m in members} <= names)

    return all(map(there, told.split(" + ")))


def rivals(found: Improvement, rung: Rung, robot: Robot) -> list[tuple[Proposal, Array]]:
    """What could be in the place of all that a step added, and the values that suited then: what a further trial is planned to
    tell from it. Not what the model has in the end, nor what nobody asked about again once more had come."""
    names = {t.name for t in found.terms}
    steps = [r for r in found.ladder if r.added]
    if not rung.added or not {t.name for t in rung.added} <= names or (len(rung.added) > 1 and rung is not steps[-1]):
        return []
    return [(p, u) for p, u in rung.alternatives if not has(names, p.name, robot)]


def improve_account(
    problem: Problem, found: Improvement, planner: str = "", also: Sequence[str] = (), word: LastWord | None = None
) -> Account:
    """What was done, how good it is, and what is left; ``planner`` is said where what was added is tied, ``also`` is
    said first of what speaks for it. ``word``: how far the models are from trials that took no part."""
    robot, first, last = problem.robot, found.ladder[0], found.ladder[-1]
    steps = [r for r in found.ladder if r.added]
    lines = []
    if len(steps) > 1:
        order = "; ".join(without_values(text) for r in steps for text, _ in by_effect(r.added, robot))
        lines.append(f"Added, in this order: {order}.")
    # Which way a joint counts is mended in a file, not carried along in a model.
    wrong = [t for t in found.terms if CATALOGUE[t.effect].mistake]
    lines += [f"{plain(placed(t.name)).capitalize()}: {CATALOGUE[t.effect].physics}" for t in wrong]
    names = {t.name for t in found.terms}
    ties = {
        r.name: [n for n in r.tied_with if not has(names, n, robot)] for r in steps if names & {t.name for t in r.added}
    }
    # Of several effects that came as one nobody asked again, once more had come, what could be in their place.
    then = {r.name: ties.pop(r.name) for r in steps[:-1] if len(r.added) > 1 and ties.get(r.name)}
    lines += [tie_text(placed(name), others) for name, others in ties.items() if others]
    lines += [
        f"When {placed(name)} came in, these did as well: {', '.join(map(placed, o))}." for name, o in then.items()
    ]
    lines += [twin_text(t, found, robot) for t in found.twins]
    for t in found.twins:
        ties[t.name] = [*ties.get(t.name, []), t.term.name]
    told = names | {t.term.name for t in found.twins}
    gone = dict.fromkeys(d for r in steps for d in r.dropped if d not in told)
    kind = {d: d.partition("@")[0] for d in gone}
    elsewhere = [d for d in gone if kind[d] in {t.effect for t in found.terms}]
    if useless := [d for d in gone if d not in elsewhere]:
        later = "a later effect" if len(useless) == 1 else "later effects"
        lines.append(f"Dropped again: {_by_kind(useless)}, which {later} made useless.")
    if elsewhere:
        kinds = dict.fromkeys(plain(kind[d]) for d in elsewhere)
        lines.append(f"Shared at first, and of other joints or of each by itself since: {'; '.join(kinds)}.")
    # What may be nothing is no news, whatever depends on it together with others.
    parts = sorted(shares(found, robot), key=lambda s: (s.terms[0] not in wrong, may_be_nothing(found, s.terms)))
    lines += doubt_text([s for s in parts if s.doubted])
    vague = [d for r in found.ladder if not r.added for d in r.dropped]
    if vague:
        lines.append(f"Left out in the end, since these data do not tell them from neutral: {_by_kind(vague)}.")
    lines.append("The model: " + (phrase(found.terms, robot) or "the robot as described") + ".")
    lines.append(f"Stopped because {found.stopped}. Noise floor: {found.floor_source}.")
    lines += [ON_ITS_OWN] if len(found.ladder) > 1 else []
    lines += flag_texts(found.terms, found.parameters)
    lines += beyond_a_guess(robot, found.terms, found.parameters, no_farther=found.no_farther)
    lines += load_text(robot, found.terms) + weight_text(robot, found.terms)
    lines += [] if torques_compared(problem) else scale_text(robot, found.terms)
    lines += rest_text(found.terms, found.parameters)
    worse = worse_trials(problem, found)
    if worse:
        lines.append(worse_text(problem, worse, "motions that were held out" if word is None else in_turn(MOTIONS)))
    more_there = word is not None and word.more
    settled = found.verdict in (EXPLAINED, NOTHING_MISSING) and not more_there
    unsure = found.unsure if settled else []
    lines += beside_floor(last.error_heldout, found.noise_floor, not settled)
    if found.left:
        lines.append(left_text(found.left, bool(steps)))
    if word is not None:
        lines.append(apart_text(word))
    on, judged_on = ("", found.judged_on) if word is None else map(in_turn, (last.held_out, found.judged_on))
    error = before_and_after(problem, first.error_heldout, last.error_heldout, found.noise_floor, on)
    share = f"{percent(max(0.0, min(found.explained, 1.0)))} of the error above the noise is explained"
    if len(found.ladder) == 1:
        head = f"Nothing was added: {NOTHING_BEYOND if unsure else found.stopped}."
        error = f"{error_name(problem)}: model {problem.told(last.error_heldout)}, noise floor "
        error += f"{problem.told(found.noise_floor)}."
        tried = found.last.tried if found.last else 0
        sure = f"How sure: {counted(tried, 'explanation')} {was_or_were(tried)} tried, and none earns its place"
        sure += f"{unsure_of(unsure)}."
    else:
        what = _listed(found, parts) if parts else "nothing; the model's own values were fitted anew"
        head = f"Added: {what}."
        where = "" if found.left or settled else f" on {TRIALS_APART if more_there else judged_on}"
        nothing = BEYOND if unsure else nothing_else(found.explained)
        head += f" {nothing}" if settled else f" More than noise is left{where}: {share}."
        sure = f"How sure: {share}, judged on {judged_on}{unexplained_rest(found.explained, settled)}"
        one_each = [s.terms[0] for s in parts[:NAMED] if len(s.terms) == 1]
        sure += f"{ranges(found.terms, found.parameters, one_each, robot, len(added(found)) > 1)}{_told_from(ties)}"
        sure += f"{unsure_of(unsure)}."
    if found.all_rows is not None:
        before, after = map(problem.told, found.all_rows)
        error = f"{error} On {ALL_ROWS}: model {before}, improved model {after}."
    if word is not None:
        error = f"{error} {word.text}"
    advice = "" if len(found.ladder) > 1 else CONTENT if settled else STUCK
    advice = slower(unsure) if unsure else MEND if wrong else advice
    tied = bool(found.twins) or any(rivals(found, r, robot) for r in steps)
    doubts, notes = limit_lines([] if settled else unsaid(robot, found.at_limit, found.terms))
    warnings = (*doubts, *(odd_text(o, robot) for o in found.odd), *worse_step_lines(word, found.ladder))
    nothing = problem.says_nothing(found.terms) if len(found.ladder) > 1 else ""
    if nothing:
        # Nobody should read how much is explained without it.
        warnings = (*warnings, f"{nothing[0].upper()}{nothing[1:]}.")
        also = [line for line in also if nothing[1:] not in line]
    good = settled and not warnings and not unsure and not any(ties.values())
    more = (*(word.lines if word is not None else ()), *also, *notes, *lines, *held_out_notes(problem), *problem.notes)
    return Account(head, error, sure, more, good, advised(problem, advice), planner if tied else "", warnings)


def may_be_nothing(found: Improvement, terms: Sequence[Term]) -> bool:
    """Whether no value of some terms of the model is determined, told from neutral, and farther off than luck may tell one, nor
    than what is left unexplained may push one that ended at its bound; nor any that tells that they are there."""
    mine = [p for p in found.parameters if p.tells and found.terms[p.term] in terms]
    return bool(mine) and all(
        p.flag in (NEUTRAL, HARDLY)
        or p.flag.endswith(NOT_DETERMINED)
        or (p.flag.startswith(ENDED) and p.doubt == ALL_OF_IT)
        for p in mine
    )


def twin_text(twin: Twin, found: Improvement, robot: Robot) -> str:
    """What does as well as an effect of the model, and which values are others then."""
    told = {found.terms[p.term].name: (p.low, p.high) for p in reversed(found.parameters)}
    text = tie_text(placed(twin.name), [twin.term.name])
    others = tuple(t for t in twin.terms if t.name in told and not _within(told[t.name], t))
    return f"{text} With that in its place: {phrase((twin.term, *others), robot)}."


def _within(interval: tuple[float, float], term: Term) -> bool:
    low, high = interval
    return low <= term.values[0][1] <= high


def _many_times(ratio: float) -> str:
    return "more than 100 times" if ratio > 100 else f"{ratio:.0f} times"


def odd_text(odd: OddOne, robot: Robot) -> str:
    """What a calibration hides, if the robot that it was made on was not in order."""
    what = "joints" if odd.term.target == odd.joint else "sensors"
    return (
        f"Calibrated away at {plain(odd.term.target)}: {much(odd.term, robot)}, {_many_times(odd.times)} what its like {what} "
        "have: if this robot was not in order, this hides it."
    )


def _by_kind(names: Sequence[str]) -> str:
    """Effects by name, a kind of them at a few places or at so many: robots that are a little wrong everywhere have dozens."""
    at: dict[str, list[str]] = {}
    for effect, _, place in (name.partition("@") for name in names):
        at.setdefault(effect, []).append(place)
    return "; ".join(of_kind(effect, "", places) for effect, places in at.items())


def doubt_text(doubted: Sequence[Share]) -> list[str]:
    """What less depends on than is left unexplained, if there is such."""
    if not doubted:
        return []
    one = len(doubted) == 1
    return [
        f"Less depends on {'this' if one else 'each of these'} than is left unexplained, so that "
        f"{'it' if one else 'any of them'} may stand in for something else: {'; '.join(without_values(s.text) for s in doubted)}."
    ]


def _listed(found: Improvement, parts: Sequence[Share]) -> str:
    """The first few of what is told; what may stand in for something else, and what may be nothing, is counted, and named only
    where there is nothing else."""
    told = [s for s in parts if not may_be_nothing(found, s.terms)]
    sure = [s for s in told if not s.doubted]
    names = [s.text for s in sure or told or parts]
    some = "; ".join(names[:NAMED])
    more = [f"{len(names) - NAMED} more"] if len(names) > NAMED else []
    stands_in, nothing = len(told) - len(sure), len(parts) - len(told)
    more += [f"{stands_in} that may stand in for something else"] if sure and stands_in else []
    more += [f"{nothing} that may be nothing"] if told and nothing else []
    return f"{some}; and {', and '.join(more)}" if more else some


def _told_from(ties: Mapping[str, Sequence[str]]) -> str:
    """Whether others would have done as well."""
    others = sorted({t for names in ties.values() for t in names})
    if not others:
        return ""
    several = f"{len(others)} others ({listed_few(others)})"
    return f"; not told from {' or '.join(map(placed, others)) if len(others) <= TWINS else several}"
