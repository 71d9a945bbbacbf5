"""One number for all joints, or one for each: what may be a little wrong everywhere, either way."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ee_dist.discrepancy.assumed import puts_right
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Candidate, candidate
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.pool import as_long
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.slopes import slopes_at
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

TWIN = 0.99
"""Correlation of two effects' marks from which the data cannot hold them apart, and the one later in the catalogue stays out."""


def singles(robot: Robot, pool: Iterable[Candidate]) -> list[Candidate]:
    """Those at a single place."""
    return [c for c in pool if not c.members(robot)]


def shared(robot: Robot, pool: Iterable[Candidate]) -> list[Candidate]:
    """Each kind of effect with one set of values for as many places as may share it, and at the others by themselves."""
    kinds: dict[str, list[Candidate]] = {}
    for c in pool:
        kinds.setdefault(c.effect.name, []).append(c)
    out: list[Candidate] = []
    for some in kinds.values():
        widest = max(some, key=lambda c: len(c.members(robot)))
        members = widest.members(robot)
        out += [widest, *(c for c in some if not c.members(robot) and c.target not in members)] if members else some
    return out


def apart(problem: Problem, current: Current, own: int) -> Current:
    """The model with each shared effect of this kind taken apart into its members that can show, with the values that they
    shared. One that puts assumed drives right stays: members differ from it by a little, and not from what was assumed."""
    robot = problem.robot
    parts: list[Candidate] = []
    values: list[Array] = []
    for k, (c, place) in enumerate(zip(current.parts, Model(current.parts).places, strict=True)):
        u = current.u[place]
        if k < own or not c.effect.everywhere or not c.members(robot) or puts_right(robot, c):
            parts.append(c)
            values.append(u)
            continue
        for target in c.members(robot):
            member = as_long(problem, candidate(robot, c.effect, target))
            there = {p.name for p in (*parts, *current.parts)}
            if member.name not in there and problem.shows(c.effect.name, target):
                parts.append(member)
                values.append(np.clip(member.shares(c.values(u)), member.lower, member.upper))
    return Current(tuple(parts), np.concatenate([*values, np.zeros(0)]))


def distinct(search: Search, base: Current, few: Iterable[Candidate]) -> list[Candidate]:
    """Those whose mark shows, and is not that of another."""
    few = list(few)
    model = Model((*base.parts, *few))
    start = np.concatenate([base.u, *(np.zeros(c.size) for c in few)])
    marks = slopes_at(search, model, start, 0.02)
    size = np.linalg.norm(marks, axis=0)
    shows = size > 1e-3 * max(float(size.max(initial=0.0)), 1e-12)
    marks = marks / np.maximum(size, 1e-12)
    places, kept = Model(model.parts).places, list(range(len(base.u)))
    found = []
    for c, place in zip(few, places[len(base.parts) :], strict=True):
        mine = range(place.start, place.stop)
        alike = np.abs(marks[:, kept].T @ marks[:, place]) if kept else np.zeros((1, c.size))
        if shows[place].all() and float(alike.max(initial=0.0)) < TWIN:
            found.append(c)
            kept += mine
    return found
