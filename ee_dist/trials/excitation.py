"""What to make a robot do so that its faults show: excitations as data, each commands or a controller once it knows it.

Amplitudes are shares of half a joint's range, so that an excitation fits any robot and stays within its limits. All
begin at the middle of the range and rise over the first half second: a robot at rest is not kicked.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from ee_dist.basics.names import nearest
from ee_dist.basics.quoted import quoted
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import command_span
from ee_dist.trials.log import Array, start_of

RISE_S = 0.5
LONGEST = 1_000_000
"""Rows of a trial."""
FIXTURES = ("floor", "stand")
KINDS = {
    "rest": "no motion: what the robot does under its own weight",
    "multisine": "all joints at once, each a sum of incommensurate slow sines: tells most in the shortest time",
    "slow_sines": "one joint after the other: what moves is what is tested",
    "steps": "held random poses: friction, play and drive errors at rest, and the rise between them",
    "fast_sines": "all joints, small and quick: inertia, delay, speed limits",
    "sway": "all joints together, slowly and a little, feet planted: how weight rests on the legs",
    "gait": "the network controller walks: contacts, wiring, sensors in the loop",
}


class ExcitationError(ValueError):
    """An excitation that does not exist or would be unsafe; the message says what would be right."""


@dataclass(frozen=True)
class Excitation:
    """``kind`` is one of KINDS; ``amplitude`` a share of half the range in (0, 1]; ``seed`` chooses phases and poses.

    ``fixture``: ``floor``, or ``stand``: body clamped, limbs free. On a stand nothing is chaotic, so that drives, sensors
    and wiring show to the noise; on the floor short trials tell more than long ones.
    """

    kind: str
    seconds: float = 6.0
    amplitude: float = 0.5
    seed: int = 0
    fixture: str = "floor"

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            near = nearest(self.kind, KINDS) or list(KINDS)
            raise ExcitationError(f"no excitation {quoted(self.kind)}; did you mean {' or '.join(near)}?")
        if not 0.0 < self.amplitude <= 1.0:
            raise ExcitationError(
                f"{self.kind}: amplitude {self.amplitude:g} must be a share of half the range, in (0, 1]"
            )
        if self.fixture not in FIXTURES:
            raise ExcitationError(f"{self.kind}: no fixture {quoted(self.fixture)}; there are: {', '.join(FIXTURES)}")
        if not 0 <= self.seed < 2**63:
            raise ExcitationError(f"{self.kind}: seed {self.seed} must be a whole number from 0 to 2^63 - 1")
        if not 0.1 <= self.seconds <= 600.0:
            raise ExcitationError(f"{self.kind}: {self.seconds:g} s must lie between 0.1 and 600 s")

    def as_dict(self) -> dict[str, Any]:
        return asdict(self)

    def __str__(self) -> str:
        return f"{self.kind} ({self.seconds:g} s, amplitude {self.amplitude:g}, seed {self.seed}, {self.fixture})"

    def told(self, robot: Robot) -> str:
        """What is done and on what; a robot that is bolted down has neither floor nor stand."""
        return f"{self.kind} {self.fixture}" if robot.free_base else self.kind

    def steps(self, robot: Robot) -> int:
        """Raises ExcitationError for more rows than a trial may have."""
        steps = max(2, round(self.seconds / robot.time_step_s))
        if steps > LONGEST:
            raise ExcitationError(
                f"{self.kind}: {self.seconds:g} s in steps of {robot.time_step_s:g} s are {steps} rows; at most {LONGEST}"
            )
        return steps

    def weights(self, robot: Robot) -> tuple[float, ...] | None:
        """Weights of the network controller that drives a gait; None for an excitation of planned commands."""
        return gait_weights(robot, self.amplitude, self.seed) if self.kind == "gait" else None

    def commands(self, robot: Robot) -> Array:
        """Planned commands (T, M) in the units of the drives, positions within the joints' limits. Not for a gait."""
        t = np.arange(self.steps(robot)) * robot.time_step_s
        limits = np.array([command_span(robot, d) for d in robot.drives])
        middle, half = limits.mean(axis=1), (limits[:, 1] - limits[:, 0]) / 2
        shape = _SHAPES[self.kind](t, len(middle), np.random.default_rng([self.seed, len(self.kind)]))
        rise = np.minimum(t / RISE_S, 1.0)[:, None]
        planned = middle + half * self.amplitude * np.clip(shape, -1.0, 1.0) * rise
        start = start_of(robot)
        held = (start != 0.0) & np.array([d.command == "position" for d in robot.drives])
        # From where it stands: a robot that starts elsewhere than in the middle of its range is not thrown there.
        return np.where(held, planned + (1.0 - rise) * (start - middle), planned)


def parse(text: str) -> Excitation:
    """An excitation as typed: ``multisine`` or ``steps:seconds=4,amplitude=0.3,seed=1``. Raises ExcitationError."""
    kind, _, rest = text.partition(":")
    values: dict[str, Any] = {}
    for item in filter(None, rest.split(",")):
        key, _, value = item.partition("=")
        if key not in ("seconds", "amplitude", "seed", "fixture"):
            raise ExcitationError(f"{text}: no setting {quoted(key)}; there are: seconds, amplitude, seed, fixture")
        if key in values:
            raise ExcitationError(f"{text}: {key} stands twice; say it once")
        try:
            values[key] = value if key == "fixture" else int(value) if key == "seed" else float(value)
        except ValueError:
            raise ExcitationError(f"{text}: {key} must be a number, not {quoted(value)}") from None
    return Excitation(kind, **values)


def _rest(t: Array, motors: int, rng: np.random.Generator) -> Array:
    return np.zeros((len(t), motors))


def _multisine(t: Array, motors: int, rng: np.random.Generator) -> Array:
    total = np.zeros((len(t), motors))
    for base, share in ((0.23, 0.5), (0.61, 0.3), (1.37, 0.2)):
        f = base * rng.uniform(0.85, 1.15, motors)
        total += share * np.sin(2 * math.pi * f * t[:, None] + rng.uniform(0, 2 * math.pi, motors))
    return total


def _sway(t: Array, motors: int, rng: np.random.Generator) -> Array:
    f = rng.uniform(0.25, 0.6, motors)
    return np.sin(2 * math.pi * f * t[:, None] + rng.uniform(0, 2 * math.pi, motors))


def _fast_sines(t: Array, motors: int, rng: np.random.Generator) -> Array:
    f = rng.uniform(1.5, 3.0, motors)
    return np.sin(2 * math.pi * f * t[:, None] + rng.uniform(0, 2 * math.pi, motors))


def _slow_sines(t: Array, motors: int, rng: np.random.Generator) -> Array:
    total = np.zeros((len(t), motors))
    order = rng.permutation(motors)
    each = (t[-1] + (t[1] - t[0])) / motors
    for place, motor in enumerate(order):
        mine = (t >= place * each) & (t < (place + 1) * each)
        total[mine, motor] = np.sin(2 * math.pi * (t[mine] - place * each) / each)
    return total


def _steps(t: Array, motors: int, rng: np.random.Generator) -> Array:
    held = rng.uniform(0.5, 0.9)
    poses = rng.uniform(-1.0, 1.0, (int(t[-1] / held) + 2, motors))
    return poses[(t / held).astype(int)]


_SHAPES = {
    "rest": _rest,
    "multisine": _multisine,
    "fast_sines": _fast_sines,
    "sway": _sway,
    "slow_sines": _slow_sines,
    "steps": _steps,
}


def gait_weights(robot: Robot, amplitude: float, seed: int) -> tuple[float, ...]:
    """Weights of a network whose first two hidden neurons turn as an oscillator of about 1 Hz; the third, and a little of
    all, listens to the sensors. Motors follow the oscillator with seeded phases, so that legs lift and swing in turn."""
    rng = np.random.default_rng([seed, 77])
    s, m = len(robot.sensors), len(robot.drives)
    h = len(robot.wiring.hidden_gain) or 3
    turn = 2 * math.pi * 1.0 * robot.time_step_s
    incoming = np.zeros((h, s + 1))
    incoming[:, :s] = rng.normal(0.0, 0.004, (h, s))
    incoming[0, s] = 0.02
    recurrent = np.zeros((h, h))
    if h >= 2:
        recurrent[:2, :2] = 1.03 * np.array([[math.cos(turn), -math.sin(turn)], [math.sin(turn), math.cos(turn)]])
    if h >= 3:
        recurrent[2, 2] = 0.95
        incoming[2, :s] = rng.normal(0.0, 0.02, s)
    output = np.zeros((m, h + 1))
    phase = rng.uniform(0, 2 * math.pi, m)
    if h >= 2:
        output[:, 0], output[:, 1] = amplitude * np.cos(phase), amplitude * np.sin(phase)
    if h >= 3:
        output[:, 2] = 0.6 * amplitude * rng.choice([-1.0, 1.0], m)
    return tuple(float(w) for w in np.concatenate([incoming.ravel(), recurrent.ravel(), output.ravel()]))


STANDARD = (
    Excitation("multisine", 4.2, 0.8, 1, "stand"),
    Excitation("steps", 3.6, 0.9, 2, "stand"),
    Excitation("gait", 1.8, 0.7, 3, "stand"),
    Excitation("sway", 4.2, 0.1, 1),
    Excitation("sway", 3.0, 0.14, 8),
    Excitation("multisine", 1.8, 0.25, 4),
    Excitation("gait", 1.8, 0.2, 7),
)
"""What ``task=trial`` runs unless told otherwise."""
