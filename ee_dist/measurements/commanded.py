"""Commands beside the positions of their joints: another unit, another sign, or a joint that does not move."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.measurements.mapping import Column, Mapping
from ee_dist.measurements.robot_channels import command_kind
from ee_dist.measurements.signals import AGAINST, apart, lead, lively, moves, relation
from ee_dist.measurements.standing import REST, reach_of, stands_still
from ee_dist.measurements.suspicious import command_suspicion
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array, SensorLog

FEWEST_ROWS = 10
FAR = 0.1
"""Share of a joint's range from which it is far from its command."""
FITS, BETTER = 0.7, 0.1
"""Correlation of what was commanded and measured from which one follows the other, and by how much more than as they stand."""
LATE_S, EARLY_S = 0.1, 0.01
"""From when torques come late or early: current controllers take milliseconds, and answer nothing that they were not told."""
FORESEEN_S, SLOW_S, CLEARER = 0.02, 0.5, 0.5
"""How far before its command a joint cannot move, and how long after it none in order does, by what share of what is lacking to a
correlation of one at most;"""
EXCHANGED, APART = 0.95, 0.4
"""correlation with what another joint is told from which it may be that one's, and by how much less with its own."""
THERE = 0.1
"""Of the distance to its own command, and of the range, that to another's at which a joint does what that one is told;"""
MANY = 3.0
"""Times what a drive can give from which a command is in another unit."""


def command_flaws(
    robot: Robot, mapping: Mapping, commands: Array, position_of: dict[str, Array], step_s: float
) -> Iterator[tuple[str, tuple[str, bool] | None]]:
    """(joint, what is suspicious of its commands and whether it is certain enough to stop), of joints that obey positions.
    ``commands`` (T, M) are NaN where drives are released."""
    led: dict[str, tuple[Array, Array]] = {}
    for k, drive in enumerate(robot.drives):
        obeyed = np.isfinite(commands[:, k])
        if drive.joint in position_of and obeyed.sum() > FEWEST_ROWS and command_kind(drive) == "position":
            led[drive.joint] = (commands[obeyed, k], position_of[drive.joint][obeyed])
    still = [j for j, (asked, seen) in led.items() if stands_still(asked, seen, reach_of(robot.joint(j)))]
    for joint, (asked, seen) in led.items():
        found = command_suspicion(joint, asked, seen, step_s)
        another_unit = found is not None and found[1]
        if not another_unit and np.ptp(seen) < REST * reach_of(robot.joint(joint)):
            found = None  # a joint that hardly moves says nothing of its commands
        follow = (other for other in led if other not in still and _alike(robot, mapping, joint, other))
        if joint in still and (not another_unit or any(follow)):
            unit = "rad" if robot.joint(joint).kind == "hinge" else "m"
            found = (f"{joint} does not move although it is commanded by {np.ptp(asked):.2g} {unit}", False)
        yield joint, found


def beside_their_commands(robot: Robot, commands: Array, position_of: dict[str, Array], step_s: float) -> Iterator[str]:
    """Lines on joints that obey positions, of which all move before they are told to, or long after; or of which one does what
    another is told. ``commands`` (T, M) are NaN where drives are released."""
    kinds = [command_kind(d) for d in robot.drives]
    led = [k for k, d in enumerate(robot.drives) if kinds[k] == "position" and d.joint in position_of]
    if not led or len(commands) <= FEWEST_ROWS or not np.isfinite(commands[:, led]).all():
        return
    asked, seen = commands[:, led], np.stack([position_of[robot.drives[k].joint] for k in led], axis=1)
    told_of_another = [*_where_another_is_told_to_be(robot, [robot.drives[k].joint for k in led], asked, seen)]
    yield from told_of_another
    both = lively(asked, seen)
    if not both or told_of_another:
        return
    asked, seen, names = asked[:, both], seen[:, both], [robot.drives[led[k]].joint for k in both]
    found, now = lead(asked, seen, step_s), abs(relation(asked, seen).correlation)
    clear = abs(found.correlation) > FITS and 1 - abs(found.correlation) < CLEARER * (1 - now)
    who = f"command of {names[0]}: the joint is" if len(names) == 1 else "commands: the joints are"
    told = f"(correlation {abs(found.correlation):.3g}; {now:.3g} as they stand)"
    if clear and found.lead_s < -max(FORESEEN_S, 2 * step_s):
        yield (
            f"{who} {-1e3 * found.lead_s:.0f} ms ahead {told}: are commands and positions exchanged, or their clocks different?"
        )
    elif clear and found.lead_s > SLOW_S and not found.repeats:
        yield f"{who} {1e3 * found.lead_s:.0f} ms behind {told}: were they logged by clocks that differ?"
    shift = round(found.lead_s / step_s) if clear else 0
    ahead, behind = asked[max(0, -shift) : len(asked) - max(0, shift)], seen[max(0, shift) : len(seen) - max(0, -shift)]
    fits = np.nan_to_num(np.corrcoef(ahead.T, behind.T)[: len(names), len(names) :])
    for j, name in enumerate(names):
        other = int(np.argmax(fits[:, j]))
        if -EXCHANGED < fits[j, j] < FITS and fits[other, j] > EXCHANGED and fits[other, j] - fits[j, j] > APART:
            yield (
                f"position of {name}: it does what {names[other]} is told (correlation {fits[other, j]:.3g}), not what it is "
                f"told itself ({fits[j, j]:.2g}): exchanged columns?"
            )


def _where_another_is_told_to_be(robot: Robot, joints: Sequence[str], asked: Array, seen: Array) -> Iterator[str]:
    """A line on ``joints`` that move, and lie (T, J) all the time where another one is told to be, and not where they are told to
    themselves."""
    for j, name in enumerate(joints):
        off, reach = apart(asked, seen[:, j]), reach_of(robot.joint(name))
        other = int(np.argmin(off))
        if off[other] < THERE * min(off[j], reach) and np.ptp(seen[:, j]) > REST * reach:
            unit = "rad" if robot.joint(name).kind == "hinge" else "m"
            yield (
                f"position of {name}: it lies where {joints[other]} is told to be (to {off[other]:.2g} {unit}), and "
                f"{off[j]:.2g} {unit} from where it is told to be itself: exchanged columns?"
            )


def beyond_the_drive(robot: Robot, commands: Array) -> Iterator[str]:
    """A line on joints that are told torques of which their drives can give a part only: another unit, or volts. ``commands``
    (T, M) are NaN where drives are released."""
    for k, drive in enumerate(robot.drives):
        most = float(np.nanmax(np.abs(commands[:, k]))) if np.isfinite(commands[:, k]).any() else 0.0
        if command_kind(drive) == "torque" and most > MANY * drive.torque_limit > 0:
            unit = "N.m" if robot.joint(drive.joint).kind == "hinge" else "N"
            yield (
                f"command of {drive.joint}: reaches {most:.3g} {unit}, {most / drive.torque_limit:.2g} times what its drive can "
                f"give ({drive.torque_limit:.3g}): another unit, or volts, which need a scale ('scale:' at the column)?"
            )


def far_from_commands(robot: Robot, commands: Array, position_of: dict[str, Array]) -> Iterator[str]:
    """A line on joints that are said to obey positions, and stay farther from them than they move, and than a soft controller
    under load would: they obey something else. ``commands`` (T, M) are NaN where drives are released."""
    for k, drive in enumerate(robot.drives):
        obeyed = np.isfinite(commands[:, k])
        if drive.joint not in position_of or obeyed.sum() <= FEWEST_ROWS or command_kind(drive) != "position":
            continue
        seen, joint = position_of[drive.joint][obeyed], robot.joint(drive.joint)
        off, moved = float(np.median(np.abs(commands[obeyed, k] - seen))), float(np.ptp(seen))
        # Of a joint that turns without end a share of its reach is many turns.
        reach = min(reach_of(joint), math.pi) if joint.kind == "hinge" else reach_of(joint)
        beyond_a_load = drive.kp * off > MANY * drive.torque_limit
        if off > max(moved, FAR * reach) and moved > REST * reach and beyond_a_load:
            unit = "rad" if joint.kind == "hinge" else "m"
            yield (
                f"command of {drive.joint}: the joint lies {off:.3g} {unit} from it, more than the {moved:.3g} {unit} that it "
                "moves: is it led by speeds or torques ('command:' in its description), or is one of the two zeros another one?"
            )


def torques_beside_commands(robot: Robot, commands: Array, torques: Array, step_s: float) -> Iterator[str]:
    """A line on joints that are told torques, where those that were measured (T, M) run against them, come long after, or
    before."""
    for k, drive in enumerate(robot.drives):
        both = np.isfinite(commands[:, k]) & np.isfinite(torques[:, k])
        if (
            command_kind(drive) != "torque"
            or both.sum() <= FEWEST_ROWS
            or np.array_equal(commands[both, k], torques[both, k])
        ):
            continue
        asked, seen = commands[both, k : k + 1], torques[both, k : k + 1]
        if not (moves(asked) and moves(seen)):
            continue
        now, found = relation(asked, seen).correlation, lead(asked, seen, step_s)
        where = f"command of {drive.joint}: the torque that was measured"
        if now <= AGAINST and found.correlation <= AGAINST:
            yield f"{where} runs against it (correlation {now:.2f}): 'sign: -1' at one of the two?"
        elif found.repeats or found.correlation < FITS or found.correlation - now < BETTER:
            continue
        elif found.lead_s > LATE_S:
            yield (
                f"{where} follows {1e3 * found.lead_s:.0f} ms later (correlation {found.correlation:.2f}; {now:.2f} as they "
                "stand): were they logged by clocks that differ?"
            )
        elif found.lead_s < -max(EARLY_S, 2 * step_s):
            yield (
                f"{where} comes {-1e3 * found.lead_s:.0f} ms before it (correlation {found.correlation:.2f}): are the two "
                "columns exchanged, or their clocks different?"
            )


def disobeying(robot: Robot, logs: Sequence[tuple[str, SensorLog]]) -> list[str]:
    """A line on each joint that does not do what it was told in some of the named ``logs``: as in the first of these."""
    where: dict[str, tuple[str, list[str]]] = {}
    for name, log in logs:
        if len(log) < 2:
            continue
        position_of = {} if log.joints is None else dict(zip(robot.motor_names, log.joints.T, strict=True))
        lines = [*far_from_commands(robot, log.commands, position_of)]
        if log.torques is not None:
            lines += torques_beside_commands(robot, log.commands, log.torques, float(log.times_s[1] - log.times_s[0]))
        for line in lines:
            where.setdefault(line.partition(":")[0], (line, []))[1].append(name)
    return [f"During {listed(trials)}: {line}" for line, trials in where.values()]


def _alike(robot: Robot, mapping: Mapping, one: str, other: str) -> bool:
    """Whether the mapping says the same of the units of two joints, in positions and commands: where one follows its commands
    the other's are in no other unit."""
    said = []
    for joint in (one, other):
        sensor = next((s.name for s in robot.sensors if s.kind == "position" and s.target == joint), "")
        both = (mapping.sensors.get(sensor), mapping.commands.get(joint))
        said.append([(c.unit, c.scale) for c in both if isinstance(c, Column)])
    return said[0] == said[1] and len(said[0]) == 2
