"""Effects in the sensors."""

from __future__ import annotations

from collections.abc import Mapping

from ee_dist.effects.body import PAPER
from ee_dist.effects.catalogue import Parameter, effect
from ee_dist.effects.targets import sensors
from ee_dist.robots.model import Robot


@effect(
    "sensor_failing",
    family="sensing",
    targets=sensors,
    parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0, "share of the signal that is lost", 0.02),),
    physics="A sensor reports only a part of what it senses; at a loss of 1 it is dead.",
    signature="One channel is a scaled copy of the prediction; other channels change only through what the controller makes of it.",
    reference=PAPER,
)
def sensor_failing(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    sensor = next(s for s in robot.sensors if s.name == target)
    return robot.with_sensor(target, gain=sensor.gain * (1.0 - values["loss"]))
