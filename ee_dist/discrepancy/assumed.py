"""What a description of drives only assumed: the first suspect, and one that no single effect stands for.

A servo whose gains were guessed is off in its position gain, its damping and its friction at once, and any one of them alone
makes the prediction hardly better: a softer controller is also too slow, one with friction too stiff. So they are proposed
together, one number each for all joints of which they were assumed, from the best of a grid of starts.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from ee_dist.basics.names import counted, listed
from ee_dist.discrepancy.evidence.intervals import BOUND, at_bound
from ee_dist.discrepancy.evidence.judge import at_work
from ee_dist.discrepancy.evidence.rule import NEAR
from ee_dist.discrepancy.guesses import AHEAD, CARRIED, LATE, ROTORS, SOONER, TIMED, lag_of, stand_of, starts_of
from ee_dist.discrepancy.search.candidates import Candidate, Proposal, candidate, values_of
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import as_slow
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.effects.effect import EffectError
from ee_dist.effects.groups import name_of
from ee_dist.effects.targets import uneven_rotors
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import drive_of
from ee_dist.trials.log import Array

LIMIT = "torque_limit"
TOGETHER = ("position_gain", "speed_gain", LIMIT, "rotor_inertia", "coulomb_friction", "viscous_friction")
"""The limit is among them although files state one: it is often what a CAD program writes where nobody entered any."""
OF_ONE = ("position_gain", "speed_gain", *ROTORS)
"""What a controller that somebody guessed at is known by as a whole: how late a joint follows tells no more than their ratios."""
STARTS = 3
"""Of a grid of starts that many are fitted."""
LESS = 0.9
"""Share of what is above the noise otherwise that drives must leave less than, to be found with one number more."""
LEAST, MOST = -0.7, 1.0
"""Changes of mass, as shares, that parts may have all over a robot of which gains were assumed: torques have no scale then but
the masses, and all may grow together. With gains that are known they may go farther: a load on a light part is many times it."""
NOTHING = 1e-3
"""Share of what is left by which it rises at most without a number that does nothing."""
AGAIN = 8
"""How often more room is made for a guess that ended as far as it might go."""
LABEL = "assumed drives"
GUESSED = (
    "The description only guessed at what these drives do: their gains, limit, rotor and friction{more} were found together. "
    "Write them into it, or keep this model."
)
"""What is said of them in the place of an effect's physics."""
GUESS = "The description only guessed at what it changes: write the value found into it, or keep this model."
"""What is said of one number that puts right what was assumed."""


def assumed_text(robot: Robot) -> list[str]:
    """A line for people where a description only assumed what its controllers do."""
    count = len({j for j, f in robot.assumed if f != "command"})
    names = listed(dict.fromkeys(f for _, f in robot.assumed if f != "command"))
    drives = counted(count, "drive")
    return [f"The description only assumed {names} of {drives}: explain and improve look there first."] if count else []


def guessed_text(terms: Hypothesis) -> str:
    """``GUESSED`` of what was found."""
    said = {LATE: "how late commands come", TIMED: "how long they take to a goal"}
    also = [text for name, text in said.items() if any(t.effect == name for t in terms)]
    return GUESSED.format(more=f", and {' and '.join(also)}," if also else "")


class Fitted(NamedTuple):
    """Parts at their best values u, and the energy that they leave."""

    parts: tuple[Candidate, ...]
    u: Array
    energy: float


def assumed_drives(
    search: Search, pool: Iterable[Candidate], taken: Iterable[str] = ()
) -> tuple[Proposal, Array] | None:
    """Gains and friction of all drives whose position gain was assumed, with the weight that their controllers carry where it is
    much, and values u to fit them from; None where none was, where it is ``taken`` (names of candidates) already, or where the
    pool has not the gain and another of these effects."""
    robot, pool, taken = search.problem.robot, list(pool), {*taken}
    joints, names = robot.assumed_joints("kp"), {c.effect.name for c in pool}
    if not joints or TOGETHER[0] not in names:
        return None
    found = [c for name in TOGETHER if name in names for c in _at(robot, _by_factor(robot, name, joints), joints)]
    parts = tuple(as_slow(search.problem, c) for c in found)
    if len(parts) < 2 or {c.name for c in parts} & taken:
        return None
    noise = _noise(search)

    def offered(effect: str) -> tuple[Candidate, ...]:
        return tuple(c for c in (_at(robot, effect, joints) if effect in names else ()) if c.name not in taken)

    near = _fitted(search, joints, parts)
    if carried := tuple(c for c in pool if c.effect.name == CARRIED and c.name not in taken):
        other = _fitted(search, joints, (*parts, *carried))
        near = other if _leaves_less(other, near, noise) else near
    parts, best = near.parts, _farther(search, near)
    ahead = offered(AHEAD) if _sooner(robot, joints) else ()
    late = offered(LATE) if lag_of(robot, joints) else ()
    timed = offered(TIMED) if 0 < lag_of(robot, joints) < stand_of(search.problem, joints) else ()
    for more, within_bounds in ((ahead, True), (late, False), (timed, False)):
        # Where next to nothing but noise is left, no time is missing.
        if not more or (more is timed and best.energy <= NEAR**2 * noise):
            continue
        other = _farther(search, _fitted(search, joints, (*parts, *more)))
        # An end that a guess no longer comes to is a reason of its own.
        share = 1.0 if within_bounds and _ended(best) and not _ended(other) else LESS
        if _leaves_less(other, best, noise, share):
            parts, best = (*parts, *more), other
    model = Model(best.parts)
    keep = _at_work(search, best)
    return Proposal(tuple(model.parts[k] for k in keep), LABEL), np.concatenate([best.u[model.places[k]] for k in keep])


def _at_work(search: Search, found: Fitted) -> list[int]:
    """Numbers of the parts that do anything: what a controller is known by, and each other without which more is left. Nobody is
    told that no torque is missing, nor of a friction of next to nothing."""
    model = Model(found.parts)
    some = at_work(model, found.u, 1)
    asked = [k for k in some if model.parts[k].effect.name not in OF_ONE]
    points = np.repeat(found.u[None], len(asked), axis=0)
    for u, k in zip(points, asked, strict=True):
        u[model.places[k]] = 0.0
    rows = search.residuals([model.hypothesis(u) for u in points])
    idle = {k for k, r in zip(asked, rows, strict=True) if float(r @ r) <= (1.0 + NOTHING) * found.energy}
    return [k for k in some if k not in idle]


def _noise(search: Search) -> float:
    """Energy that noise alone leaves."""
    return float(search.problem.floor[search.everything].sum())


def _leaves_less(one: Fitted, other: Fitted, noise: float, share: float = LESS) -> bool:
    """Whether one leaves less than a share of what the other leaves above the noise."""
    return one.energy - noise < share * (other.energy - noise)


def guesses_at_end(parts: tuple[Candidate, ...], u: Array) -> frozenset[str]:
    """Names of the parts on what was guessed that are as far from it as they may go."""
    pairs = zip(parts, Model(parts).places, strict=True)
    return frozenset(c.name for c, at in pairs if c.guess and _ends(c, u[at]))


def with_more_room(search: Search, parts: tuple[Candidate, ...], u: Array) -> Fitted | None:
    """The parts with more room for guesses among them that ended at an end of theirs; None where none did, or nothing is won."""
    if not guesses_at_end(parts, u):
        return None
    (row,) = search.residuals([Model(parts).hypothesis(u)])
    near = Fitted(parts, u, float(row @ row))
    found = _farther(search, near)
    return None if found is near else found


def _farther(search: Search, found: Fitted) -> Fitted:
    """The same with more room where a guess ended as far from it as it may go: from what was found one may go as far again, as
    somebody would who wrote that into the description. Kept where it takes much off what is left."""
    noise = _noise(search)
    for _ in range(AGAIN):
        if found.energy <= NEAR**2 * noise or not _ended(found):
            break
        terms = Model(found.parts).hypothesis(found.u)
        robot = apply(search.problem.robot, terms)
        parts = tuple(_with_room(robot, c, term.values) for c, term in zip(found.parts, terms, strict=True))
        (fit,) = follow_valley(search, [(Model(parts), values_of(parts, terms))], search.everything)
        if fit.energy - noise >= LESS * (found.energy - noise):
            break
        found = Fitted(parts, fit.u, fit.energy)
    return found


def _ended(found: Fitted) -> bool:
    """Whether one of the parts did so."""
    return any(_ends(c, found.u[at]) for c, at in zip(found.parts, Model(found.parts).places, strict=True))


def _ends(c: Candidate, u: Array) -> bool:
    """Whether a guess is too small by as much as it may be: a factor on it, or what is on top of a rotor, went up as far as it
    may, or of a limit there is as much more."""
    grows = c.effect.main.neutral == 1.0 or c.effect.name in ROTORS
    to_end = u[0] < 0 and c.guess if c.effect.name == LIMIT else u[0] > 0 and grows
    return bool(to_end) and at_bound(c, 0, float(u[0])) == BOUND


def _with_room(robot: Robot, c: Candidate, values: Sequence[tuple[str, float]]) -> Candidate:
    """The candidate with what is worth trying beside its values too, on a robot that has them."""
    found = []
    beside = c.effect.bounds(robot, c.target)
    for p, own, (name, value) in zip(c.effect.parameters, c.bounds, values, strict=True):
        low, high = beside[name]
        if p.neutral == 1.0:
            low, high = low * value, high * value
        elif c.effect.name == LIMIT:
            low, high = (1.0 - (1.0 - value) * (1.0 - loss) for loss in (low, high))
        elif p.on_top:
            low, high = low + value, high + value
        else:
            low, high = own
        found.append((max(p.lower, min(own[0], low)), min(p.upper, max(own[1], high))))
    return replace(c, bounds=tuple(found))


def _fitted(search: Search, joints: Sequence[str], parts: tuple[Candidate, ...]) -> Fitted:
    """The parts, fitted from the best of a grid of starts."""
    model = Model(parts)
    starts = starts_of(search.problem, joints, model)
    energies = [
        float(r @ r) if np.isfinite(r).all() else np.inf
        for r in search.residuals([model.hypothesis(u) for u in starts])
    ]
    best = [starts[k] for k in np.argsort(energies, kind="stable")[:STARTS]]
    fits = follow_valley(search, [(model, u) for u in best], search.everything)
    fit = min(fits, key=lambda f: f.energy)
    return Fitted(parts, fit.u, fit.energy)


def of_one_guess(model: Model) -> set[int]:
    """Numbers of the parts that stay or go together: a controller that was guessed is not put right by its gain beside damping
    that is as guessed, however little these data tell the two apart. There is nothing right in a guess to be near to."""
    found = {k for k, c in enumerate(model.parts) if c.guess and c.effect.name in OF_ONE}
    return found if len(found) > 1 else set()


def puts_right(robot: Robot, c: Candidate) -> bool:
    """Whether it is one of these effects, at joints whose gains were assumed; or one value for all of whatever was assumed."""
    at = {*(c.members(robot) or (c.target,))}
    assumed = {*robot.assumed_joints("kp")}
    if c.effect.name in (LATE, AHEAD, TIMED):
        return at == assumed
    return c.effect.guesses_at(robot, c.target) or (c.effect.name in TOGETHER and at <= assumed)


def beside(robot: Robot, parts: Sequence[Candidate], terms: Hypothesis, others: Sequence[Candidate]) -> list[Candidate]:
    """What else may be a little wrong, with ranges beside the numbers that assumed drives share in a model of these ``parts``
    and ``terms``: a joint differs from these as from any that are known. As it is where nothing was assumed, or where it does not
    matter: in a balance of measured torques no gain stands in for a mass."""
    if not robot.assumed_joints("kp") or TOGETHER[0] not in {c.effect.name for c in (*parts, *others)}:
        return list(others)
    right = tuple(t for c, t in zip(parts, terms, strict=True) if puts_right(robot, c))
    around = replace(apply(robot, right), assumed=()) if right else robot
    return [candidate(around, c.effect, c.target) if puts_right(robot, c) else _bounded(c) for c in others]


def _bounded(c: Candidate) -> Candidate:
    if c.effect.family != "body" or c.effect.main.unit != "1":
        return c
    return replace(c, bounds=tuple((max(low, LEAST), min(high, MOST)) for low, high in c.bounds))


def guess_of(robot: Robot, effect: str, field: str) -> list[Candidate]:
    """The one number of an effect for all drives of which that field was assumed; none where it was of none."""
    joints = robot.assumed_joints(field)
    return _at(robot, _by_factor(robot, effect, joints), joints) if joints else []


def _by_factor(robot: Robot, effect: str, joints: Sequence[str]) -> str:
    """The effect, or, of rotors that were guessed from the size of each motor, the one that they share: by that guess."""
    guessed = uneven_rotors(robot) if effect == "rotor_inertia" else ()
    return "rotor_factor" if {*joints} <= {*guessed} else effect


def _at(robot: Robot, effect: str, joints: Sequence[str]) -> list[Candidate]:
    """The effect at these joints with one set of values, under the name of their group if they have one."""
    try:
        return [candidate(robot, effect, name_of(robot, tuple(joints)))]
    except EffectError:
        return []


def _sooner(robot: Robot, joints: Sequence[str]) -> bool:
    """Whether most of the joints were seen to follow much sooner than the damping that was guessed at lets them."""
    guessed = float(np.median([d.kd / d.kp if d.kp > 0 else 0.0 for d in (drive_of(robot, j) for j in joints)]))
    return lag_of(robot, joints) < SOONER * guessed
