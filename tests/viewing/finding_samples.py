"""Findings made of real rollouts: a robot whose first joint has dry friction that its model lacks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.robots.describe import robot_of
from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog
from ee_dist.viewing.finding import BEST, REFUSED, TIED, Account, Candidate, Case, ChannelError, Finding, Rung

ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.yaml"
ROBOTS = ("servo_pendulum", "linear_stage", "arm", "quadruped_lab")
SECONDS = 1.2
FRICTION, HALF = 0.1, 0.05
"""Dry friction as a share of the drive's limit: what is there, and what a poorer fit finds."""


def robot(name: str) -> Robot:
    return robot_of("urdf", None, str(ARM))[0] if name == "arm" else robot_of(name, None, None)[0]


def sticky(body: Robot, share: float) -> Robot:
    return body.map_drive(body.motor_names[0], lambda d: replace(d, coulomb=share * d.torque_limit))


def logs_of(bodies: list[Robot], periods_s: tuple[float, ...]) -> list[tuple[SensorLog, ...]]:
    """A log of each body for each period of a sine on all its joints."""
    body = bodies[0]
    rows = round(SECONDS / body.time_step_s)
    times = np.arange(rows) * body.time_step_s
    spans = np.array([0.2 * min(body.joint(m).upper - body.joint(m).lower, 1.0) for m in body.motor_names])
    drivers = [Commands(spans * np.sin(2 * np.pi * times / p)[:, None]) for p in periods_s]
    engine = PyBulletEngine()
    logs = engine.rollout([Rollout(b, d, rows, pose=True) for b in bodies for d in drivers])
    engine.close()
    return [tuple(logs[k * len(drivers) : (k + 1) * len(drivers)]) for k in range(len(bodies))]


def errors_of(cases: tuple[Case, ...], account: Account) -> tuple[ChannelError, ...]:
    """Root mean squares over all trials, counted in hundredths of the channel's own range, worst half second marked."""
    found = []
    for name, unit in zip(cases[0].measured.sensor_names, cases[0].measured.sensor_units, strict=True):
        rest = [c.measured.channel(name)[: len(g)] - g.channel(name) for c, g in zip(cases, account.logs, strict=True)]
        rmse = float(np.sqrt(np.mean(np.concatenate(rest) ** 2)))
        span = float(np.ptp(np.concatenate([c.measured.channel(name) for c in cases]))) or 1.0
        worst = int(np.argmax([np.abs(r).max() for r in rest]))
        at = float(cases[worst].measured.times_s[int(np.abs(rest[worst]).argmax())])
        found.append(
            ChannelError(name, unit, 100 * rmse / span, rmse, cases[worst].name, max(at - 0.25, 0.0), at + 0.25)
        )
    return tuple(found)


def finding(name: str) -> Finding:
    """A finding with everything: channels, three candidates, a ladder, and the model with what was found."""
    model = robot(name)
    bodies = [sticky(model, FRICTION), model, sticky(model, 0.95 * FRICTION), sticky(model, HALF)]
    measured, given, best, poor = logs_of(bodies, (0.6, 0.3))
    cases = tuple(
        Case(f"{k + 1}. {what} sine", log)
        for k, (what, log) in enumerate(zip(("slow", "quick"), measured, strict=True))
    )
    joint = model.motor_names[0].replace("_", " ")
    # The second prediction is shorter than what was measured.
    start = Account("the model", (given[0], given[1].head(len(given[1]) // 2)), model)
    better = Account(f"with coulomb friction at {joint}", best, bodies[2])
    named = replace(better, label=f"coulomb friction at {joint}")
    channels = errors_of(cases, start)
    largest = max(c.error for c in channels)
    return Finding(
        title=f"{name.replace('_', ' ')}: model against measurements",
        verdict=f"Missing: coulomb friction at {joint}. Nothing else is left.",
        robot=model,
        cases=cases,
        model=start,
        lines=(f"Error: model {largest:.3g} % of the range.", "How sure: very."),
        floor=0.1 * largest,
        channels=channels,
        candidates=(
            Candidate(f"coulomb friction at {joint} (torque 0.31 N.m)", 0.93, 0.9, 0.95, BEST, named),
            Candidate(
                f"load friction at {joint} (share 0.08)",
                0.91,
                0.85,
                0.94,
                TIED,
                Account(f"load friction at {joint}", poor, bodies[3]),
            ),
            Candidate(f"viscous friction at {joint} (0.02 N.m.s/rad)", 0.2, 0.05, 0.3, REFUSED),
        ),
        ladder=(
            Rung("the model", largest, 0.97 * largest),
            Rung(f"+ coulomb friction at {joint}", 0.11 * largest),
        ),
        better=better,
        next_command="python -m ee_dist task=improve measured='my logs' effect=auto",
    )
