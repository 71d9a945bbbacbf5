"""One motion of the example arm, simulated, written under odd names and in odd units: what a proposed mapping must cope with."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Commands
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.measurements.proposal.model import Hints
from ee_dist.robots.describe import load_robot
from ee_dist.robots.model import Robot, Sensor
from ee_dist.trials.log import SensorLog

ARM = Path(__file__).parents[2] / "docs" / "examples" / "arm.yaml"
JOINTS = ("turn", "shoulder", "elbow")
SECONDS = 5.0
DEG = 180 / np.pi


@functools.cache
def robot() -> Robot:
    """The example arm with sensors of position, speed and torque at each joint, all exact."""
    arm, _ = load_robot(ARM)
    kinds = (("position", "rad"), ("velocity", "rad/s"), ("torque", "N.m"))
    return replace(arm, sensors=tuple(Sensor(f"{j}_{k}", k, j, u) for k, u in kinds for j in JOINTS))


@functools.cache
def truth() -> SensorLog:
    """The motion: sines of every joint, with some noise on what is measured."""
    arm = robot()
    t = np.arange(0, SECONDS, arm.time_step_s)
    rise = np.minimum(1.0, t / 0.5)
    sines = ((0.8, 2.1, 0.2, 5.3), (0.5, 1.6, 0.15, 4.1), (0.7, 2.7, 0.2, 6.1))
    commands = np.stack([rise * (a * np.sin(w * t) + b * np.sin(v * t)) for a, w, b, v in sines], axis=1)
    (log,) = MuJoCoEngine(threads=1).rollout([Rollout(arm, Commands(commands), len(t), seed=1)])
    noise = np.random.default_rng(3).standard_normal(log.sensors.shape) * np.repeat([2e-4, 5e-3, 5e-3], 3)
    return replace(log, sensors=log.sensors + noise)


def arrays() -> dict[str, np.ndarray]:
    """t (T,); q, w, tau, g (T, 3)."""
    log = truth()
    return {
        "t": log.times_s,
        "q": log.sensors[:, :3],
        "w": log.sensors[:, 3:6],
        "tau": log.sensors[:, 6:],
        "g": log.commands,
    }


Columns = dict[str, np.ndarray]


def spread(pattern: str, values: np.ndarray, names: Any = (1, 2, 3)) -> Columns:
    """``q{}`` and (T, 3) as q1, q2, q3."""
    return {pattern.format(n): values[:, k] for k, n in enumerate(names)}


def csv(columns: Columns, **how: Any) -> Callable[[Path], list[Path]]:
    def write(folder: Path) -> list[Path]:
        pd.DataFrame(columns).to_csv(folder / "log.csv", index=False, **how)
        return [folder / "log.csv"]

    return write


@dataclass(frozen=True)
class Case:
    """A file, what a person said beside it, and whether the proposal should be right by itself or has to ask."""

    name: str
    write: Callable[[Path], list[Path]]
    asks: bool = False
    hints: Hints = Hints()


def cases() -> list[Case]:
    m = arrays()
    t, q, w, tau, g = m["t"], m["q"], m["w"], m["tau"], m["g"]
    order = Hints(joints=JOINTS)
    named = ("Turn", "Shoulder", "Elbow")
    return [
        Case("names of joints", csv({"time": t} | spread("{}_position", q, JOINTS) | spread("{}_velocity", w, JOINTS)
             | spread("{}_effort", tau, JOINTS) | spread("{}_goal", g, JOINTS))),
        Case("numbers from 0, microseconds", csv({"t_us": 1e6 * t} | spread("q{}", q, range(3)) | spread("qd{}", w, range(3))
             | spread("q{}_cmd", g, range(3)) | spread("tau{}", tau, range(3)))),
        Case("degrees that nobody mentions", csv({"Time [ms]": 1e3 * t} | spread("{} Angle", DEG * q, named)
             | spread("{} Speed", DEG * w, named) | spread("{} Setpoint", DEG * g, named)
             | spread("{} Torque [Nm]", tau, named))),
        Case("German, with commas", csv({"Zeit_ms": 1e3 * t} | spread("Winkel_{}_°", DEG * q)
             | spread("Drehzahl_{}", w * 30 / np.pi)
             | spread("Soll_{}", DEG * g) | spread("Drehmoment_{}", tau), sep=";", decimal=",", encoding="latin-1")),
        Case("lists in cells", csv({"stamp": t} | {n: [json.dumps(r.tolist()) for r in v] for n, v in  # type: ignore[dict-item]
             (("jpos", q), ("jvel", w), ("jtau", tau), ("jcmd", g))})),
        Case("no header", csv({"a": t} | spread("q{}", q) | spread("w{}", w) | spread("g{}", g) | spread("tau{}", tau),
             header=False)),
        Case("mute names, joint after joint", csv({"ch0": t} | {f"ch{1 + 4 * j + k}": v[:, j] for j in range(3)
             for k, v in enumerate((g, q, w, tau))}), hints=order),
        Case("a servo's registers", csv({"timestamp": t} | spread("present_position_{}", DEG * q)
             | spread("present_velocity_{}", DEG * w) | spread("goal_position_{}", DEG * g) | spread("present_torque_{}", tau)
             | spread("present_temperature_{}", 30 + 0 * q))),
        Case("commands in radians, positions in degrees", csv({"t": t} | spread("meas{}", DEG * q) | spread("des{}", g)
             | spread("vel{}", DEG * w) | spread("trq{}", tau))),
        Case("millinewton metres, one against the rest", csv({"t": t} | spread("q{}", q) | spread("dq{}", w) | spread("ref{}", g)
             | spread("tau{}", 1e3 * tau * (1, -1, 1)))),
        Case("speeds of the other sign", csv({"t": t} | spread("pos{}", q) | spread("vel{}", -w) | spread("cmd{}", g)
             | spread("eff{}_torque", tau))),
        Case("nanoseconds since the epoch", csv({"stamp_ns": np.round(1.7e18 + 1e9 * t)} | spread("state_{}", q, JOINTS)
             | spread("rate_{}", w, JOINTS) | spread("action_{}", g, JOINTS) | spread("load_torque_{}", tau, JOINTS)), asks=True),
        Case("commands and positions swapped", csv({"t": t} | spread("q{}_cmd", q) | spread("q{}", g) | spread("tau{}", tau)),
             asks=True),
        Case("degrees under the name of radians", csv({"t": t} | spread("q{}_rad", DEG * q) | spread("cmd{}_rad", DEG * g)
             | spread("tau{}", tau)), asks=True),
        Case("seconds under the name of milliseconds", csv({"t_ms": t} | spread("q{}", q) | spread("cmd{}", g)
             | spread("tau{}", tau)), asks=True),
        Case("raw and filtered", csv({"t": t} | spread("q{}", q) | spread("q{}_filt", np.round(q, 2)) | spread("dq{}", w)
             | spread("dq{}_filt", np.round(w, 1)) | spread("q{}_des", g) | spread("tau{}_meas", tau))),
        Case("joints numbered against the chain", csv({"t": t} | spread("q{}", q, (3, 2, 1)) | spread("dq{}", w, (3, 2, 1))
             | spread("q{}_cmd", g, (3, 2, 1)) | spread("tau{}", tau, (3, 2, 1))), asks=True),
        Case("the same, with the order said", csv({"t": t} | spread("q{}", q, (3, 2, 1)) | spread("dq{}", w, (3, 2, 1))
             | spread("q{}_cmd", g, (3, 2, 1)) | spread("tau{}", tau, (3, 2, 1))), hints=Hints(joints=JOINTS[::-1])),
        Case("things beside", csv({"index": np.arange(len(t)), "time_s": t} | spread("q{}", q) | spread("qd{}", w)
             | spread("qdd{}", np.gradient(w, t, axis=0)) | spread("temp{}", 20 + 0 * q) | spread("err{}", g - q)
             | spread("q_ref{}", g) | spread("tau{}", tau))),
        Case("turns", csv({"t": t} | spread("pos{} (rev)", q / (2 * np.pi)) | spread("vel{} (rpm)", w * 30 / np.pi)
             | spread("target{} (rev)", g / (2 * np.pi)) | spread("torque{} (Nm)", tau))),
        Case("currents without a gain", csv({"t": t} | spread("q{}", q) | spread("dq{}", w) | spread("cmd{}", g)
             | spread("current{}", tau / 0.2)), asks=True),
        Case("currents with their gains", csv({"t": t} | spread("q{}", q) | spread("dq{}", w) | spread("cmd{}", g)
             | spread("current{}", tau / 0.2)), hints=Hints(gains=(0.2, 0.2, 0.2))),
        Case("no header, with the order said", csv({"a": t} | spread("q{}", q) | spread("w{}", w) | spread("g{}", g)
             | spread("tau{}", tau / 0.2), header=False), hints=Hints(joints=JOINTS, gains=(0.2, 0.2, 0.2))),
        Case("no header, position and speed of each joint in turn", csv({"a": t} | {f"{n}{j}": v[:, j] for j in range(3)
             for n, v in (("q", q), ("w", w))} | spread("g{}", g) | spread("tau{}", tau / 0.2), header=False),
             hints=Hints(joints=JOINTS, gains=(0.2, 0.2, 0.2))),
        Case("desired as d, with its speeds", csv({"t": t} | spread("q{}", q) | spread("qd{}", w) | spread("q{}_d", g)
             | spread("qd{}_d", np.gradient(g, t, axis=0)) | spread("tau{}", tau))),
        Case("a controller's own names", csv({"Timestamp (ms)": 1e3 * t} | spread("Axis {} actual position (°)", DEG * q)
             | spread("Axis {} actual velocity (°/s)", DEG * w) | spread("Axis {} target position (°)", DEG * g)
             | spread("Axis {} torque (Nm)", tau))),
        Case("no time", csv(spread("q{}", q) | spread("dq{}", w) | spread("cmd{}", g) | spread("tau{}", tau)), asks=True),
    ]  # fmt: skip
