"""Effects between the controller and the motors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from ee_dist.effects.body import PAPER
from ee_dist.effects.catalogue import effect
from ee_dist.effects.effect import Parameter
from ee_dist.effects.targets import hidden_neurons, motor_pairs
from ee_dist.robots.model import Robot


@effect(
    "hidden_neuron_failing",
    family="wiring",
    targets=hidden_neurons,
    parameters=(Parameter("loss", "1", 0.0, 1.0, 0.0, "share of the neuron's value that is lost", 0.02),),
    physics="A neuron of the controller puts out less than it computes.",
    signature="All commands change at once, in proportion to that neuron's output weights.",
    reference=PAPER,
)
def hidden_neuron_failing(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    k = int(target.removeprefix("hidden_"))
    gain = list(robot.wiring.hidden_gain)
    gain[k] *= 1.0 - values["loss"]
    return replace(robot, wiring=replace(robot.wiring, hidden_gain=tuple(gain)))


@effect(
    "motors_tied",
    family="wiring",
    targets=motor_pairs,
    physics="Two motors obey the same output: the second follows the first's command.",
    signature="The commands of two joints are one signal, whatever was sent to the second.",
    reference=PAPER,
)
def motors_tied(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    first, second = (robot.motor_names.index(name) for name in target.split("+"))
    source = list(robot.wiring.source)
    source[second] = source[first]
    return replace(robot, wiring=replace(robot.wiring, source=tuple(source)))


@effect(
    "motors_swapped",
    family="wiring",
    targets=motor_pairs,
    physics="Two motor cables are in each other's sockets: each motor obeys the command meant for the other.",
    signature="Each of two joints does what was predicted for the other; all else follows from that.",
    reference=PAPER,
)
def motors_swapped(robot: Robot, target: str, values: Mapping[str, float]) -> Robot:
    first, second = (robot.motor_names.index(name) for name in target.split("+"))
    source = list(robot.wiring.source)
    source[first], source[second] = source[second], source[first]
    return replace(robot, wiring=replace(robot.wiring, source=tuple(source)))
