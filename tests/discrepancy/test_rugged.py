"""Of a real robot that touches nothing, how rough its sensors of a kind are says nothing where most of them are so."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from way_samples import ARM, Sample, evaluator_for, measure, sines

from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.ways.open_loop.problem import OpenLoop
from ee_dist.effects.catalogue import term
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot, Sensor

WRIST = """<link name="hand"><inertial><origin xyz="0.03 0 0"/><mass value="0.1"/>
    <inertia ixx="0.0001" iyy="0.0002" izz="0.0002" ixy="0" ixz="0" iyz="0"/></inertial></link>
  <joint name="wrist" type="revolute"><parent link="lower"/><child link="hand"/><origin xyz="0.2 0 0"/>
    <axis xyz="0 1 0"/><limit lower="-2" upper="2" effort="4" velocity="8"/></joint>
</robot>"""
JOINTS = ("shoulder", "elbow", "wrist")
NOISE = 0.002


@cache
def arm() -> Robot:
    with TemporaryDirectory() as folder:
        file = Path(folder) / "arm.urdf"
        file.write_text(ARM.replace("</robot>", WRIST))
        drives = {
            j: {"kp": kp, "kd": kp / 30, "rotor_inertia": 0.004} for j, kp in zip(JOINTS, (25, 15, 8), strict=True)
        }
        robot = load_robot({"urdf": str(file), "free_base": False, "time_step_s": 0.004, "drives": drives})[0]
    kinds = (("position", "rad"), ("velocity", "rad/s"))
    return replace(robot, sensors=tuple(Sensor(f"{k}_{j}", k, j, unit) for k, unit in kinds for j in JOINTS))


def bursts(rough: int, hardware: bool = True) -> OpenLoop:
    """Logs in which the first ``rough`` sensors of speed jump by a tenth of a radian per second now and then."""
    trials: list[MeasuredTrial] = []
    rng = np.random.default_rng(1)
    for t in measure(Sample(arm(), sines(arm(), 0.6, 6.0), (), ()), ()):
        values = t.log.sensors + NOISE * rng.standard_normal(t.log.sensors.shape) * [0, 0, 0, 1, 1, 1]
        jumps = 0.1 * rng.standard_normal(values.shape) * (rng.random(values.shape) < 0.1)
        jumps[:, [c for c in range(6) if not 3 <= c < 3 + rough]] = 0.0
        trials.append(replace(t, hardware=hardware, log=replace(t.log, sensors=values + jumps)))
    return OpenLoop(trials, arm(), evaluator_for(arm()))


@pytest.mark.parametrize(("rough", "hardware", "said"), [(3, True, True), (1, True, False), (3, False, False)])
def test_only_what_most_of_a_real_robots_sensors_have_in_common_is_not_compared(
    rough: int, hardware: bool, said: bool
) -> None:
    p = bursts(rough, hardware)
    (residual,) = p.residuals([()])
    velocities = np.isin(p.channel_of, [3, 4, 5]) & ~p.layout.reading
    jumping = float((residual[velocities] ** 2).sum())
    assert (jumping == 0.0) == said
    # What is not compared has no floor that would make what is compared look small.
    assert (float(p.floor[velocities].sum()) == 0.0) == said
    assert any("nor how rough they are" in line for line in p.notes) == said
    names = {c.name for c in pool_of(p)}
    assert ("sensor_noise@velocity_shoulder" in names, "sensor_dropout@velocity_shoulder" in names) == (
        not said,
        not said,
    )
    assert {"sensor_noise@position_shoulder", "sensor_bias@velocity_shoulder"} <= names


def test_means_of_what_jumps_are_compared_as_before() -> None:
    p = bursts(3)
    base, biased = p.residuals([(), (term("sensor_bias", "velocity_elbow", bias=0.1),)])
    assert not np.array_equal(base[p.channel_of == 4], biased[p.channel_of == 4])
