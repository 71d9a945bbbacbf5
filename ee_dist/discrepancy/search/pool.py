"""What a problem is searched for: every effect that can show in its way of comparing."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, candidate, candidates
from ee_dist.effects.groups import JOIN
from ee_dist.robots.instruments import measures_torques
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import drive_of, top_speed

SPARE, MOST_SLOWED = 1.2, 10.0
"""How much more friction than would have stopped a joint at the highest speed that it had, and times what is worth trying
else;"""
SCALE_OF_MASS = "part_mass@all_parts"
STILL_RAD = 1e-3
"""How far (rad, m) a command goes up to which its joint is only held."""
SELDOM, MOVES, BEYOND_STOPS = 0.01, 0.1, 1.2
"""Share of its readings at either end that may be glitches, share of its joint's way from which a sensor moves, and times that
way that a joint may go: stops are soft."""
OFTEN = 0.99
"""share of the readings below that highest speed: the rest may be noise."""


def pool_of(problem: Problem, without: Sequence[str] = (), only: Sequence[str] = ()) -> list[Candidate]:
    """Candidates at all places and groups, less those left out. Raises EffectError for names that do not exist."""
    found = candidates(problem.robot, without, only or None, problem.families)
    told = (c for c in found if c.size or problem.switches or c.effect.mistake)
    able = (c for c in told if problem.shows(c.effect.name, c.target))
    named = {name.partition("@")[0] for name in only}
    seen = (c if c.effect.seen_at is None else _seen_at(problem, c, c.effect.name in named) for c in able)
    moved = (_alive(problem, c) for c in seen if c is not None)
    judged = (as_long(problem, c) for c in (_judged(problem, c) for c in moved if c is not None) if c is not None)
    # Several groups may be one where joints that nothing is known of are left out.
    out = {c.name: _hinted(problem, as_slow(problem, c)) for c in judged}
    if SCALE_OF_MASS.partition("@")[0] not in named and no_scale(problem.robot, out):
        out.pop(SCALE_OF_MASS, None)
    return list(out.values())


def no_scale(robot: Robot, names: Collection[str]) -> bool:
    """Whether nothing says how large torques are but the masses: motion alone is compared, gains and rotors of all drives were
    assumed, and gains and friction are among the ``names`` of what is looked for. One factor on all of these is then the same as
    one on all masses, of which the description is the better witness."""
    driven = {d.joint for d in robot.drives if d.command != "none"}
    guessed = driven <= {*robot.assumed_joints("kp")} & {*robot.assumed_joints("rotor_inertia")}
    looked_for = {name.partition("@")[0] for name in names}
    return (
        bool(driven) and guessed and not measures_torques(robot) and {"position_gain", "coulomb_friction"} <= looked_for
    )


def held_still(problem: Problem) -> frozenset[str]:
    """Joints whose command stays where it is in all of the trials: what a soft controller lets them sag by, a torque does too."""
    found = set()
    for k, name in enumerate(problem.robot.motor_names):
        told = [t.log.commands[:, k] for t in problem.measured if t.log.commands.shape[1] > k]
        spans = [float(np.ptp(c[np.isfinite(c)])) for c in told if np.isfinite(c).any()]
        if spans and max(spans) <= STILL_RAD:
            found.add(name)
    return frozenset(found)


def _alive(problem: Problem, c: Candidate) -> Candidate | None:
    """Failing position sensors with no more lost of their signal than leaves room for what they read, between the stops of their
    joints; None where that is nothing. Beside a model that runs away a dead sensor would explain any reading, also one that
    moves."""
    if c.effect.name != "sensor_failing":
        return c
    shown = max(_shown(problem, name) for name in c.members(problem.robot) or (c.target,))
    if not shown > MOVES:
        return c
    return replace(c, bounds=((0.0, 1.0 - shown),)) if shown < 1.0 else None


def _shown(problem: Problem, sensor: str) -> float:
    """Share of the way of its joint that a position sensor read; 0 of another sensor, and where nothing ends that way."""
    robot = problem.robot
    at = robot.sensor_names.index(sensor)
    if robot.sensors[at].kind != "position":
        return 0.0
    low, high = robot.joint(robot.sensors[at].target).ends
    read = np.concatenate([t.log.sensors[t.log.readings, at] for t in _with(problem, sensor)] or [np.zeros(1)])
    return float(np.ptp(np.quantile(read, [SELDOM, 1 - SELDOM]))) / (BEYOND_STOPS * (high - low))


def _with(problem: Problem, *sensors: str) -> list[MeasuredTrial]:
    """The trials in which these were recorded."""
    return [t for t in problem.measured if t.not_recorded.isdisjoint(sensors)]


def as_long(problem: Problem, c: Candidate) -> Candidate:
    """The candidate with times since a trial began up to the end of the longest trial: what happens then, happens at any time."""
    if not any(p.of_trial for p in c.effect.parameters):
        return c
    longest = max((float(t.log.times_s[-1] - t.log.times_s[0]) for t in problem.measured), default=0.0)
    bounds = tuple(
        (low, max(high, longest)) if p.of_trial else (low, high)
        for p, (low, high) in zip(c.effect.parameters, c.bounds, strict=True)
    )
    return replace(c, bounds=bounds)


def as_slow(problem: Problem, c: Candidate) -> Candidate:
    """Viscous friction up to what would take all of a drive's torque at a speed that its joint had, of drives whose gains were
    only assumed: their files carry speeds that nobody meant, and a motor that slows down as back-EMF does would be beyond what
    is worth trying. A motor's own speed is believed."""
    robot = problem.robot
    joints = c.members(robot) or (c.target,)
    if c.effect.name != "viscous_friction" or not {*joints} <= {*robot.assumed_joints("kp")}:
        return c
    had, slower = _fastest(problem), [1.0]
    for j in joints:
        if had.get(j) and not math.isfinite(drive_of(robot, j).speed_limit):
            slower.append(min(SPARE * top_speed(robot.joint(j)) / had[j], MOST_SLOWED))
    return replace(c, bounds=tuple((low, high * max(slower)) for low, high in c.bounds))


def _fastest(problem: Problem) -> dict[str, float]:
    """The highest speed of each joint of which positions were read, but for a few readings, rad/s (m/s)."""
    found: dict[str, float] = {}
    for k, s in enumerate(problem.robot.sensors):
        if s.kind != "position":
            continue
        for log in (t.log for t in _with(problem, s.name)):
            read = log.readings
            if len(read) < 3:
                continue
            speed = np.abs(np.gradient(log.sensors[read, k], log.times_s[read]))
            found[s.target] = max(found.get(s.target, 0.0), float(np.quantile(speed, OFTEN)))
    return found


def _judged(problem: Problem, c: Candidate) -> Candidate | None:
    """The candidate at those joints of its group at which something is compared; None where fewer than two are left: unlike
    motors elsewhere would bound its values, and its verdict would be of joints that nobody measured."""
    members = c.members(problem.robot)
    judged = tuple(m for m in members if m not in problem.unjudged)
    if judged == members:
        return c
    if len(judged) < 2:
        return None
    return replace(candidate(problem.robot, c.effect, JOIN.join(judged)), guess=c.guess)


def _seen_at(problem: Problem, c: Candidate, named: bool) -> Candidate | None:
    """The candidate with what commands and positions of its joint show of its values; None where they show nothing, unless it was
    asked for by name."""
    robot = problem.robot
    k, told, at = robot.motor_names.index(c.target), [], []
    positions = [s.name for s in robot.sensors if s.kind == "position" and s.target == c.target]
    for log in (t.log for t in _with(problem, *positions)):
        if log.joints is None or len(log) < 2:
            continue
        late = round(robot.joint(c.target).lag_s / float(log.times_s[1] - log.times_s[0]))
        told.append(log.commands[: len(log) - late, k])
        at.append(log.joints[late:, k])
    both = np.concatenate(told or [np.zeros(0)]), np.concatenate(at or [np.zeros(0)])
    known = np.isfinite(both[0]) & np.isfinite(both[1])
    values = c.effect.shown_at(robot, c.target, both[0][known], both[1][known])
    if values and c.has(values):
        return replace(c, hint=tuple(c.shares(values).tolist()))
    return c if named else None


def _hinted(problem: Problem, c: Candidate) -> Candidate:
    """The candidate with what readings of its own sensor show of its values, where that is within what is worth trying."""
    if c.effect.seen_in is None or c.target not in problem.robot.sensor_names:
        return c
    at = problem.robot.sensor_names.index(c.target)
    read = [log.sensors[log.readings, at] for log in (t.log for t in _with(problem, c.target))]
    values = c.effect.shown_in(np.concatenate(read)) if read else {}
    if not values or not c.has(values):
        return c
    return replace(c, hint=tuple(c.shares(values).tolist()))
