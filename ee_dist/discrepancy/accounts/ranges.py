"""How sure fitted values are, in words: their intervals, what is wrong with some, and what an effect that nobody found may
have to do with them."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from ee_dist.basics.names import counted
from ee_dist.discrepancy.evidence.intervals import (
    ALL_OF_IT,
    BESIDE_GUESSES,
    BOUND,
    EITHER,
    HARDLY,
    TOGETHER,
    WIDER,
    ParameterReport,
    called,
)
from ee_dist.discrepancy.torque_scale import of_masses
from ee_dist.discrepancy.words import phrase, placed, plain, quantity, span
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term, apply
from ee_dist.robots.model import Robot
from ee_dist.robots.starter import moving_mass

WEIGHS = 1.3
"""Times heavier (lighter) than described from which all that moves is told to be so."""
HEAVIER = 0.1
"""Share of a part's mass that must be added to it for a load to be told."""
BEYOND = 1.5
"""How far beyond what is worth trying of a load it may be: a centre that is a little off puts a light one far away."""
LISTED = 3
"""Places that a line lists; of more the table of values tells."""


def ranges(
    terms: Hypothesis, parameters: Sequence[ParameterReport], named: Sequence[Term], robot: Robot, several: bool
) -> str:
    """The 95 % intervals of the values of ``named`` terms, of a model of these ``terms``; ``several``: more than one was found,
    and each is said of which. Of others only that there are more: a table has them."""
    told_of: dict[str, list[str]] = {t.name: [] for t in named}
    for p in parameters:
        term = terms[p.term]
        if term.name in told_of:
            range_ = span(term, p.name, p.low, p.high, robot, interval=True)
            sure = p.flag in ("", HARDLY, EITHER, TOGETHER, BESIDE_GUESSES) and np.isfinite(p.high - p.low)
            range_ += f", of which {EITHER}" if p.flag == EITHER else ""
            told_of[term.name].append(f"{quantity(term, p.name, robot)} {range_ if sure else p.flag or range_}".strip())
    out = [(f"{placed(name)}: " if several else "") + ", ".join(values) for name, values in told_of.items() if values]
    others = sum(terms[p.term].name not in told_of for p in parameters)
    more = f"; and {counted(others, 'more value')}, as the table of values has them" if others else ""
    return f"; {called(parameters)}: {'; '.join(out)}{more}" if out else ""


def rest_text(terms: Hypothesis, parameters: Sequence[ParameterReport]) -> list[str]:
    """What an effect that nobody found may have to do with the values, where more than noise is left."""
    doubted = [p for p in parameters if p.doubt]
    if not doubted:
        return []
    text = f"Intervals are {WIDER}: an effect that is not in the model may have gone into the values."
    # A value that is flagged is told already, and counted.
    every = [p for p in doubted if p.doubt == ALL_OF_IT]
    worst = [terms[p.term] for p in every if not p.flag]
    names = [placed(mine[0].name) if len(mine) == 1 else f"{plain(effect)} at {len(mine)} places"
             for effect in dict.fromkeys(t.effect for t in worst)
             if (mine := [*dict.fromkeys(t for t in worst if t.effect == effect)])]  # fmt: skip
    others = len(every) - len(worst)
    more = f"; and {counted(others, 'value')} flagged above" if others else ""
    return [text + (f" It could be all of: {'; '.join(names)}{more}." if names else "")]


def flag_texts(terms: Hypothesis, parameters: Sequence[ParameterReport]) -> list[str]:
    """What is wrong with values, a line for each kind of doubt: a robot that is a little wrong everywhere has dozens of them."""
    told: dict[str, dict[tuple[str, str], list[str]]] = {}
    for p in parameters:
        if p.flag:
            term = terms[p.term]
            told.setdefault(p.flag, {}).setdefault((term.effect, quantity(term, p.name)), []).append(term.target)
    return [
        "; ".join(of_kind(effect, what, places) for (effect, what), places in kinds.items()) + f": {flag}."
        for flag, kinds in told.items()
    ]


def beyond_a_guess(
    robot: Robot,
    terms: Hypothesis,
    parameters: Sequence[ParameterReport],
    alone: bool = False,
    no_farther: Collection[str] = (),
) -> list[str]:
    """A line for each factor on something that a description only guessed, which ended where it may not go farther: from a
    better guess it may. ``alone``: nothing else that was guessed was put right with it, which may be off as far.
    ``no_farther``: names of those that were given more room, which took next to nothing off."""
    found = []
    for p in parameters:
        t = terms[p.term]
        if not (p.flag.startswith(BOUND) and p.name == "factor" and _guessed(robot, t)):
            continue
        if alone:
            how = "what else was guessed of these drives may be off with it, and improve puts it right together."
        elif t.name in no_farther:
            how = "with more room it took less than a tenth off what is left, so that these data hardly say how much farther."
        else:
            how = f"multiply what the description assumes by {p.value:.3g}, and begin anew from there."
        found.append(f"{placed(t.name).capitalize()} ended where it may not go farther from a guess: {how}")
    return found


def weight_text(robot: Robot, terms: Hypothesis) -> list[str]:
    """A line where a model has all that moves much lighter or heavier than it is described: a scale would tell."""
    was, now = moving_mass(robot), moving_mass(apply(robot, terms))
    if not was > 0 or 1 / WEIGHS < now / was < WEIGHS:
        return []
    return [
        f"All that moves weighs {now:.3g} kg in this model, and {was:.3g} kg as it is described: a scale would tell, and of what "
        "only moves together the data may tell no more than sums and ratios."
    ]


def as_loads(robot: Robot, terms: Hypothesis) -> list[Term]:
    """The loads that parts carry in other words: the payload at each part of which the model has a larger mass and another
    centre, where such a load may be. Of what is felt at the joints the two ways of saying it differ by inertias alone."""
    payload, now, found = CATALOGUE["payload"], apply(robot, terms), []
    for part in dict.fromkeys(t.target for t in terms if t.effect == "com_shifted"):
        was, is_ = robot.part(part), now.part(part)
        more = is_.mass_kg - was.mass_kg
        if not more > HEAVIER * was.mass_kg or part not in payload.targets(robot):
            continue
        at = [(is_.mass_kg * b - was.mass_kg * a) / more for a, b in zip(was.com_m, is_.com_m, strict=True)]
        load = Term("payload", part, tuple(zip((p.name for p in payload.parameters), (more, *at), strict=True)))
        worth = payload.bounds(robot, part)
        if all(BEYOND * worth[n][0] <= value <= BEYOND * worth[n][1] for n, value in load.values):
            found.append(load)
    return found


def load_text(robot: Robot, terms: Hypothesis) -> list[str]:
    """A line for each load that the model says in other words."""
    return [
        f"Mass and centre of {plain(t.target)} together are what a load there would make of them: {phrase((t,), robot)}."
        for t in as_loads(robot, terms)
    ]


def scale_text(robot: Robot, terms: Hypothesis) -> list[str]:
    """A line where only the masses say how large all torques are."""
    if not of_masses(robot, terms):
        return []
    return [
        "Only motion was measured, so that all torques may be larger or smaller by one factor, with all masses and rotors: their "
        "values and intervals hold for the masses of this model. Weigh the parts, or measure one torque."
    ]


def _guessed(robot: Robot, term: Term) -> bool:
    return CATALOGUE[term.effect].guesses_at(robot, term.target)


def of_kind(effect: str, what: str, places: Sequence[str]) -> str:
    """``zero offset at hip and knee, offset``; of a few places which, of more how many."""
    at = f"{len(places)} places" if len(places) > LISTED else _and([plain(place) for place in places])
    return f"{plain(effect)}{f' at {at}' if any(places) else ''}{f', {what}' if what else ''}"


def _and(words: Sequence[str]) -> str:
    *most, last = words
    return f"{', '.join(most)} and {last}" if most else last
