"""A measured trial: what drove the robot, and the sensor log that came back."""

from __future__ import annotations

from dataclasses import dataclass

from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.engines.drivers import Commands, Driver, Network
from ee_dist.robots.model import Robot
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.log import SensorLog


@dataclass(frozen=True, eq=False)
class MeasuredTrial:
    """``driver`` is what the experimenter sent; None where only the log's own commands are known.

    Trials of one ``name`` are repeats of one another: the noise floor is measured from them. ``setup`` is what is known
    to be special about the trial (a gain, a payload); it is applied to the model as well as any hypothesis.
    """

    name: str
    log: SensorLog
    driver: Driver | None = None
    setup: Hypothesis = ()


def driver_of(excitation: Excitation, robot: Robot) -> Commands | Network:
    """What makes the robot do it."""
    weights = excitation.weights(robot)
    return Commands(excitation.commands(robot)) if weights is None else Network(weights)


def setup_of(excitation: Excitation) -> Hypothesis:
    """How the robot is held."""
    return (term("on_stand"),) if excitation.fixture == "stand" else ()
