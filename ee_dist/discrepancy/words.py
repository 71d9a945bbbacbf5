"""Effects, values and places in words."""

from __future__ import annotations

import math
import re

from ee_dist.effects.catalogue import CATALOGUE, EVERY, Hypothesis, Term
from ee_dist.effects.described import takes_more_than_described
from ee_dist.effects.groups import members_of
from ee_dist.robots.model import Robot

DIGITS, MOST_DIGITS = 3, 8
"""Of the ends of an interval."""
CHANGES, SIGNED = ("change", "along_x", "along_y", "along_z"), "+"
"""Shares of what is described that come on top of it: told with a sign."""
LOSS, MORE = "loss", -1.0
"""A share that is lost: from that much below nothing it is told as how many times as much there is."""
SHARED = " than joints share"
MANY = 3
"""Places of one effect from which their values are told as a range: each has its line in a table."""

NOTHING = 1e-12
"""A value of this size is none, in any unit: what is left of it is arithmetic."""
EXACT = 1e-9
"""What a share of all of it may lack by the arithmetic alone."""
LEAST_SHARE = 1e-5
"""A smaller share is told as none."""


def plain(name: str) -> str:
    return re.sub(r"\bcom\b", "centre of mass", name.replace("_", " ").replace("+", ", "))


def placed(name: str) -> str:
    """``coulomb friction at knee front left`` of a candidate's name."""
    return plain(name.replace(" + ", " and ").replace("@", " at "))


def without_unit(key: str, unit: str) -> str:
    """``torque_nm`` in N.m is ``torque``: the unit is told behind the value."""
    tail, parts = re.sub(r"[./^()]", "", unit.lower()), key.split("_")
    for k in range(1, len(parts)):
        if tail and "".join(parts[k:]) == tail:
            return "_".join(parts[:k])
    return key


def told(term: Term, robot: Robot | None = None) -> str:
    """``coulomb friction at knee front left (torque 0.3 N.m)``."""
    shown = amounts(term, robot)
    return named(term) + (f" ({shown})" if shown else "")


def amounts(term: Term, robot: Robot | None = None) -> str:
    """``torque 0.3 N.m``: how much of it, without what and where."""
    return ", ".join(_amount(term, k, v, robot) for k, v in term.values)


def _amount(term: Term, key: str, value: float, robot: Robot | None) -> str:
    if key == LOSS and value <= MORE:
        return f"{1.0 - value:.3g} times as much"
    return f"{quantity(term, key, robot)} {_value(term, key, value, robot)}".strip()


def much(term: Term, robot: Robot | None = None) -> str:
    """``zero offset 0.04 rad``: what, and how much of it, without the place."""
    return " ".join([plain(term.effect), ", ".join(_value(term, key, value, robot) for key, value in term.values)])


def _value(term: Term, key: str, value: float, robot: Robot | None) -> str:
    if value < 0 and EVERY[term.effect].parameter(key).on_top:
        return f"{-value:.3g}{_unit(term, key, robot)} less{_than(term, key, value, robot)}"
    if is_share(term.effect, key):
        return f"{100 * value + 0.0:{SIGNED if key in CHANGES else ''}.3g} %"
    return f"{0.0 if abs(value) < NOTHING else value:.3g}{_unit(term, key, robot)}"


def is_share(effect: str, key: str) -> bool:
    """Whether a value is a share of something, and told in percent: a number without a unit that does nothing at zero."""
    parameter = EVERY[effect].parameter(key)
    return parameter.unit == "1" and parameter.neutral == 0.0


def _than(term: Term, key: str, value: float, robot: Robot | None) -> str:
    if robot is None or term.target not in robot.motor_names:
        return " than described"
    parameter = EVERY[term.effect].parameter(key)
    beyond = takes_more_than_described(robot, term.target, parameter, value)
    return SHARED if beyond else " than described"


def is_less(terms: Hypothesis) -> bool:
    """Whether all of it is to be taken off what is described."""
    main = [(CATALOGUE[t.effect].parameters[:1], t.values[:1]) for t in terms]
    return all(p and v and p[0].on_top and v[0][1] < 0 for p, v in main)


def span(term: Term, key: str, low: float, high: float, robot: Robot | None, *, interval: bool = False) -> str:
    """From one value to another, with as many digits as they need to differ. An ``interval`` of one value that goes below what
    there is is told as it is: no joint shares anything with itself."""
    share = is_share(term.effect, key)
    unit, (a, b) = (" %", apart(100 * low, 100 * high)) if share else (_unit(term, key, robot), apart(low, high))
    if share:
        a, b = in_full(a), in_full(b)
    below = bool(EVERY[term.effect].parameter(key).on_top) and low < 0
    if below and not (interval and _than(term, key, low, robot) == SHARED):
        than = _than(term, key, low, robot)
        if high <= 0:
            return f"{b.removeprefix('-')} to {a.removeprefix('-')}{unit} less{than}"
        return f"{a.removeprefix('-')}{unit} less to {b}{unit} more{than}"
    return f"{a} to {b}{unit}"


def in_full(number: str) -> str:
    """A large number without its exponent: nobody reads ``-9.9e+03 %``."""
    return f"{float(number):.0f}" if "e+" in number else number


def apart(low: float, high: float) -> tuple[str, str]:
    """Two numbers with three digits, or with as many as they need to differ."""
    written = ((f"{low:.{digits}g}", f"{high:.{digits}g}") for digits in range(DIGITS, MOST_DIGITS))
    return next((pair for pair in written if pair[0] != pair[1]), (f"{low:.{DIGITS}g}", f"{high:.{DIGITS}g}"))


def quantity(term: Term, key: str, robot: Robot | None = None) -> str:
    """A parameter's name without its unit, which is told behind the value; nothing where it is called by its unit alone."""
    if key.startswith("per_"):
        return ""
    entry = EVERY[term.effect]
    own = entry.parameter(key).unit  # that of a hinge, which names carry on slides too
    other = entry.unit(key, robot, term.target) if robot is not None else own
    name = plain(without_unit(without_unit(key, other), own))
    return name.replace("torque", "force") if other == "N" else name


def _unit(term: Term, key: str, robot: Robot | None) -> str:
    entry = EVERY[term.effect]
    unit = entry.unit(key, robot, term.target) if robot is not None else entry.parameter(key).unit
    return f" {unit}" if unit not in ("", "1", "channel") else ""


def percent(share: float) -> str:
    """Never all of it where something is left, and never less than nothing where it rounds to nothing; a dash where there is no
    number."""
    if not math.isfinite(share):
        return "-"
    return f"{math.floor(1000 * share) / 10:.1f} %" if 0.99 < share < 1 - EXACT else f"{round(100 * share) + 0:d} %"


def percents(low: float, high: float) -> str:
    """An interval of shares: ``76 to 100 %``; one that is less than a per cent wide by more digits, or by the one value."""
    if not (math.isfinite(low) and math.isfinite(high)):
        return "-"
    first, last = percent_within(low, low, high), percent_within(high, low, high)
    return f"{first.removesuffix(' %')} to {last}" if first != last else last


def percent_within(share: float, low: float, high: float) -> str:
    """A share with as many digits as its interval is told by, which is to hold it."""
    if not all(map(math.isfinite, (share, low, high))) or percent(low) != percent(high):
        return percent(share)
    # Zero has no sign, and a thousandth of a per cent is none.
    share, low, high = (0.0 if abs(s) < LEAST_SHARE else s for s in (share, low, high))
    narrow = f"{100 * low:.3g}" != f"{100 * high:.3g}"
    return f"{100 * share:.3g} %" if narrow else percent(share)


def named(term: Term) -> str:
    """``coulomb friction at knee front left``."""
    return placed(term.name)


def told_all(terms: Hypothesis, robot: Robot | None = None) -> str:
    """Terms in one phrase; one effect at several places with its values side by side."""
    if len(terms) > 1 and len({t.effect for t in terms}) == 1 and all(t.values for t in terms):
        keys = [quantity(terms[0], key, robot) for key, _ in terms[0].values]
        of = f"{', '.join(keys)}: " if len(keys) > 1 else ""
        each = "; ".join(f"{plain(t.target)} {', '.join(_value(t, k, v, robot) for k, v in t.values)}" for t in terms)
        return f"{plain(terms[0].effect)}, each joint by itself ({of}{each})"
    return "; ".join(told(t, robot) for t in terms)


def by_effect(terms: Hypothesis, robot: Robot | None = None) -> list[tuple[str, Hypothesis]]:
    """Terms in phrases: what acts at one place or two or is shared, then in a phrase for each effect what is at many."""
    places = [t for t in terms if robot is None or not members_of(robot, t.target, CATALOGUE[t.effect].targets(robot))]
    own: dict[tuple[str, ...], list[Term]] = {}
    for t in places:
        own.setdefault(_alike(t, robot), []).append(t)
    few = [(told(t, robot), (t,)) for t in terms if t not in places or len(own[_alike(t, robot)]) < MANY]
    return few + [(_range_of(tuple(mine), robot), tuple(mine)) for mine in own.values() if len(mine) >= MANY]


def _alike(term: Term, robot: Robot | None) -> tuple[str, ...]:
    """What terms have in common whose values may stand in one range: the effect, and the units that it has at its place."""
    return (term.effect, *(_unit(term, key, robot) for key, _ in term.values))


def phrase(terms: Hypothesis, robot: Robot | None = None) -> str:
    """Terms in one sentence."""
    return "; ".join(text for text, _ in by_effect(terms, robot))


def without_values(text: str) -> str:
    """``coulomb friction at 3 joints`` of what ``by_effect`` says of it: where values are told elsewhere."""
    return text.partition(" (")[0]


def _range_of(terms: Hypothesis, robot: Robot | None) -> str:
    """``coulomb friction at 3 joints (torque 0.15 to 0.26 N.m)``."""
    joints = robot is not None and all(t.target in robot.motor_names for t in terms)
    where = "joints" if joints else "parts" if CATALOGUE[terms[0].effect].family == "body" else "places"
    shown = []
    for key, _ in terms[0].values:
        ordered = sorted(terms, key=lambda t: dict(t.values)[key])
        low, high = (dict(t.values)[key] for t in (ordered[0], ordered[-1]))
        shown.append(f"{quantity(terms[0], key, robot)} {span(ordered[0], key, low, high, robot)}".strip())
    values = f" ({', '.join(shown)})" if shown else ""
    return f"{plain(terms[0].effect)} at {len(terms)} {where}{values}"
