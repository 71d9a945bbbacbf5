"""A body that is driven step by step as hardware: the controller runs here, within limits, and nothing measured is lost."""

from __future__ import annotations

from typing import Any

import numpy as np

from ee_dist.basics.uncut import keeping
from ee_dist.engines.drivers import Controllers, command_scaling
from ee_dist.robots.model import Robot
from ee_dist.trials.hardware import Body, HardwareError, Limiter, Limits, Reading
from ee_dist.trials.log import Array, LogError, SensorLog

_REST = ("base_pose", "joints", "torques", "supply_v")
_TRAVEL = "travel_m"


class SteppedRobot:
    """Implements ``ee_dist.trials.hardware.Hardware``. ``robot`` names its channels and drives, and bounds its joints.

    ``aborted`` is the log of a trial that did not reach its end, whatever ended it; ``made`` that of the last one that did, for
    whoever was interrupted before it was handed over. Raises HardwareError for limits that the robot cannot keep.
    """

    def __init__(self, body: Body, robot: Robot, limits: Limits) -> None:
        self.body, self.robot, self.limits = body, robot, limits
        Limiter(robot, limits)  # What it refuses must be said before hours of search, not after.
        self.trials = 0
        self.aborted: SensorLog | None = None
        self.made: SensorLog | None = None

    def knock(self) -> None:
        """Raises HardwareError where nobody answers; bodies that cannot be asked are taken to be there."""
        knock = getattr(self.body, "knock", None)
        if knock is not None:
            knock()

    def skip(self) -> None:
        """A trial that was made before, by a run that is resumed now."""
        self.trials += 1

    def trial(self, driver: Any, steps: int) -> SensorLog:
        robot, limiter = self.robot, Limiter(self.robot, self.limits)
        controllers = Controllers([robot], [driver], [command_scaling(robot)], steps)
        sensors: list[Array] = []
        commands: list[Array] = []
        self.aborted = self.made = None

        def next_reading(step: int, reading: Reading) -> Reading:
            sensed = self._sensed(reading, step)
            sent = limiter(controllers.step(step, step * robot.time_step_s, sensed[None])[0])
            sensors.append(sensed)
            commands.append(sent)
            found = self.body.step(sent)
            self._check_torques(found, step)
            return found

        try:
            reading = self.body.begin(self.trials, steps, robot.time_step_s)
            for step in range(steps - 1):
                reading = next_reading(step, reading)
            with keeping:  # a signal between the body's last answer and its log would lose a whole trial
                self.made = self._log(sensors, commands, self._rest(next_reading(steps - 1, reading)))
                self.trials += 1
            return self.made
        except BaseException as error:
            # Whatever it was, Ctrl-C too: the body must not go on moving, and what was measured is kept.
            self.body.abort()
            if self.made is None and len(sensors) > 1:
                self.aborted = self._log(sensors, commands[: len(sensors)], {})
            if isinstance(error, (HardwareError, LogError)):
                at = f"trial {self.trials + 1}, step {len(sensors)} of {steps}"
                raise HardwareError(f"{at}: {error}", self.aborted) from None
            raise

    def _sensed(self, reading: Reading, step: int) -> Array:
        found = reading.sensors
        if found is None or found.shape != (len(self.robot.sensors),) or not np.isfinite(found).all():
            shape = None if found is None else found.shape
            raise HardwareError(f"it answered sensors of shape {shape}; expected {len(self.robot.sensors)} numbers")
        return found

    def _check_torques(self, reading: Reading, step: int) -> None:
        found = reading.torques
        if found is not None and not np.all(np.abs(found) <= self.limits.torque):
            worst = self.robot.drives[int(np.argmax(np.abs(found)))].joint
            raise HardwareError(
                f"{np.abs(found).max():.3g} N.m at {worst}, beyond the limit of {self.limits.torque:g} (hardware.torque)"
            )

    def _rest(self, reading: Reading) -> dict[str, Any]:
        if reading.rest is None:
            raise HardwareError("it did not say that the trial is over")
        name, found = "", {}
        try:
            for name in (*_REST, _TRAVEL):
                value = reading.rest.get(name)
                if value is not None:
                    found[name] = float(value) if name == _TRAVEL else np.asarray(value, dtype=float)
        except (TypeError, ValueError, OverflowError) as error:
            said = " ".join(str(error).split())[:200]
            raise HardwareError(f"at the end it answered {name} that cannot be read as numbers ({said})") from None
        return found

    def _log(self, sensors: list[Array], commands: list[Array], rest: dict[str, Any]) -> SensorLog:
        robot = self.robot
        return SensorLog(
            times_s=np.arange(len(sensors), dtype=np.float64) * robot.time_step_s,
            sensors=np.array(sensors, dtype=np.float64),
            commands=np.array(commands, dtype=np.float64),
            sensor_names=robot.sensor_names,
            sensor_units=tuple(s.unit for s in robot.sensors),
            motor_names=robot.motor_names,
            **rest,
        )
