"""Effects in the sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from ee_dist.effects.body import PAPER
from ee_dist.effects.catalogue import effect
from ee_dist.effects.effect import Beside, Parameter
from ee_dist.effects.scales import Range, always, longest_delay
from ee_dist.effects.targets import continuous_sensors, sensor_groups, sensors, touch_sensors
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.grid import reading_step
from ee_dist.trials.log import Array
from ee_dist.trials.noise import channel_range

FEW_LEVELS = 3
"""Levels at which a sensor must rest for its steps to be looked for: of coarse ones a motion crosses few."""
FAULTS = "Isermann 2006, Fault-Diagnosis Systems, chapter 20"


def _sensor(robot: Robot, name: str) -> Sensor:
    return next(s for s in robot.sensors if s.name == name)


def _span(robot: Robot, name: str) -> float:
    """Full range of the channel in its own unit; 2 where its joint or drive knows no limit."""
    full = channel_range(robot, _sensor(robot, name))
    return full if 0 < full < math.inf else 2.0


@effect(
    "sensor_failing",
    family="sensing",
    targets=sensors,
    parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0, "share of the signal that is lost", 0.02),),
    physics="A sensor reports only a part of what it senses; at a loss of 1 it is dead.",
    signature="One channel is a scaled copy of the prediction; others change only through what the controller makes of it.",
    reference=PAPER,
)
def sensor_failing(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_sensor(target, gain=_sensor(robot, target).gain * (1.0 - values["loss"]))


@effect(
    "sensor_gain",
    family="sensing",
    targets=continuous_sensors,
    parameters=(Parameter("change", "1", -0.95, 10.0, 0.0, "change of the reading, as a share of it", 0.01),),
    physics="A sensor is scaled wrongly and reads too much. What reads too little is a failing sensor, so the range worth "
    "trying begins at zero.",
    signature="One channel is an enlarged copy of the prediction.",
    reference=FAULTS,
    ranges=always(change=(0.0, 1.0)),
)
def sensor_gain(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_sensor(target, gain=_sensor(robot, target).gain * (1.0 + values["change"]))


def _biases(robot: Robot, target: str) -> dict[str, Range]:
    most = 0.25 * _span(robot, target)
    return {"bias": (-most, most)}


@effect(
    "sensor_bias",
    family="sensing",
    targets=continuous_sensors,
    parameters=(Parameter("bias", "channel", -math.inf, math.inf, 0.0, "what the reading is too high by", 0.005),),
    physics="A sensor's zero is off: it reports a constant too much or too little.",
    signature="One channel is shifted by a constant, from the first row, while all others agree.",
    reference=FAULTS,
    ranges=_biases,
)
def sensor_bias(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_sensor(target, bias=_sensor(robot, target).bias + values["bias"])


def _noises(robot: Robot, target: str) -> dict[str, Range]:
    return {"deviation": (0.0, 0.25 * _span(robot, target))}


@effect(
    "sensor_noise",
    family="sensing",
    targets=sensors,
    parameters=(Parameter("deviation", "channel", 0.0, math.inf, 0.0, "standard deviation of the noise", 0.005),),
    physics="A sensor is noisier than its data sheet: each reading has an error of its own.",
    signature="One channel is rougher than before, without memory from row to row; averaged over time nothing is off.",
    reference=FAULTS,
    ranges=_noises,
)
def sensor_noise(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    # Independent errors add by their squares.
    return robot.with_sensor(target, noise=math.hypot(_sensor(robot, target).noise, values["deviation"]))


def _delays(robot: Robot, target: str) -> dict[str, Range]:
    return {"delay_s": (0.0, longest_delay(robot))}


@effect(
    "sensor_delay",
    family="sensing",
    targets=sensors,
    parameters=(Parameter("delay_s", "s", 0.0, 2.0, 0.0, "age of the reading when it is reported", 0.002),),
    physics="A reading is old when it arrives: filter, bus and driver hold it back.",
    signature="One channel is the prediction shifted in time, while the robot moves as predicted.",
    reference=FAULTS,
    ranges=_delays,
)
def sensor_delay(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_sensor(target, delay_s=_sensor(robot, target).delay_s + values["delay_s"])


@effect(
    "sensor_group_delay",
    family="sensing",
    targets=sensor_groups,
    parameters=(Parameter("delay_s", "s", 0.0, 2.0, 0.0, "age of the readings when they are reported", 0.002),),
    physics="All sensors of one kind come by one bus, through one filter: their readings are old by the same time.",
    signature="All channels of a kind are the prediction shifted by one time, while the robot moves as predicted.",
    reference=FAULTS,
    ranges=_delays,
    searchable=False,
)
def sensor_group_delay(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    for sensor in robot.sensors:
        if sensor.kind == target:
            robot = robot.with_sensor(sensor.name, delay_s=sensor.delay_s + values["delay_s"])
    return robot


def _quanta(robot: Robot, target: str) -> dict[str, Range]:
    return {"step": (0.0, 0.25 * _span(robot, target))}


def _steps_of(readings: Array) -> Mapping[str, float]:
    return {"step": step} if (step := reading_step(readings, FEW_LEVELS)) > 0 else {}


@effect(
    "sensor_quantisation",
    family="sensing",
    targets=continuous_sensors,
    parameters=(
        Parameter("step", "channel", 0.0, math.inf, 0.0, "distance between two readings that it can tell apart", 0.005),
    ),
    physics="A sensor has few steps: it reports the nearest of them.",
    signature="One channel moves in equal stairs; the residual is a saw tooth of half a step.",
    reference="Widrow and Kollar 2008, Quantization Noise",
    ranges=_quanta,
    seen_in=_steps_of,
)
def sensor_quantisation(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_sensor(target, quantum=max(_sensor(robot, target).quantum, values["step"]))


def _sticks(trials: Sequence[Beside]) -> Mapping[str, float]:
    """The moment from which on a share of the movement since then is missing, and that share, by least squares over every moment
    that there is: between two of them the value at which it would stick goes up and down, so that no slope leads there."""
    moments = max((t.times_s for t in trials), key=len, default=np.zeros(0))
    along, reach = np.zeros(len(moments)), np.zeros(len(moments))
    for t in trials:
        at = np.clip(np.searchsorted(t.times_s, moments, side="right") - 1, 0, None)
        gap, moved = t.measured - t.predicted, t.predicted - t.predicted.mean()

        def after(values: Array, at: Array = at) -> Array:
            total = np.cumsum(values)
            return np.asarray(total[-1] - total[at])

        here = moved[at]
        along += here * after(gap) - after(gap * moved)
        reach += after(moved**2) - 2 * here * after(moved) + here**2 * (len(moved) - 1 - at)
    if not np.any(reach > 0):
        return {}
    share = np.clip(np.divide(along, reach, out=np.zeros_like(along), where=reach > 0), 0.0, 1.0)
    gained = 2 * share * along - share**2 * reach
    best = int(gained.argmax())
    return {"share": float(share[best]), "from_s": float(moments[best])} if gained[best] > 0 else {}


@effect(
    "sensor_stuck",
    family="sensing",
    targets=sensors,
    parameters=(
        Parameter(
            "share", "1", 0.0, 1.0, 0.0, "share of its movement that it does not report; at 1 it is frozen", 0.02
        ),
        Parameter("from_s", "s", 0.0, math.inf, 0.0, "time from which on it sticks", 0.05, of_trial=True),
    ),
    physics="A sensor sticks at the value it had: wholly, or so that it follows only a part of the movement since then.",
    signature="One channel stays at a value that it once truly had, which need not be zero, while all others move on.",
    reference=FAULTS,
    ranges=always(from_s=(0.0, 5.0)),
    seen_beside=_sticks,
)
def sensor_stuck(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    if values["share"] == 0:
        return robot
    return robot.with_sensor(target, stuck=values["share"], stuck_from_s=values["from_s"])


@effect(
    "sensor_dropout",
    family="sensing",
    targets=sensors,
    parameters=(Parameter("share", "1", 0.0, 1.0, 0.0, "share of the readings that are lost", 0.02),),
    physics="Readings are lost on their way, at random; the last one that arrived is reported again.",
    signature="One channel repeats values row after row, and then jumps back to the prediction.",
    reference=FAULTS,
    ranges=always(share=(0.0, 0.98)),
)
def sensor_dropout(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    kept = (1.0 - _sensor(robot, target).dropout) * (1.0 - values["share"])
    return robot.with_sensor(target, dropout=1.0 - kept)


@effect(
    "missed_touch",
    family="sensing",
    targets=touch_sensors,
    parameters=(Parameter("missed_s", "s", 0.0, 10.0, 0.0, "time a touch must last before it is reported", 0.01),),
    physics="A worn touch sensor reports a touch only after it has been pressed for a while.",
    signature="Touches are reported late by a fixed time, lifts at once; short touches are missing.",
    reference=FAULTS,
    ranges=always(missed_s=(0.0, 0.3)),
)
def missed_touch(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    return robot.with_sensor(target, missed_touch=_sensor(robot, target).missed_touch + values["missed_s"])
