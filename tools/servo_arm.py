"""Is improve right about an arm whose equations are not its own? A desk arm of hobby servos, simulated apart from this project.

    python tools/servo_arm.py --seed 0 --out logs/servo_arm
    python tools/servo_arm.py --seed 0 --rate 30

The arm runs in plain MuJoCo at 2 kHz. Its servos have what such servos have: a position controller with a deadband that reads an
encoder in steps and off its axis, back-EMF, a sagging supply, late commands, friction that grows with the load and falls with
the speed (after Duclusaud et al. 2025), each joint with values of its own; and masses, centres, axes and zeros are off. Three
motions and two others are written as CSV, imported without a mapping, and `improve effect=auto` gets the three. Shown is
each step's error on the two that it never saw, beside three numbers shared by all joints (Coulomb friction, rotor inertia,
delay of commands) that a least-squares fit finds.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

os.environ.setdefault("OMP_NUM_THREADS", "1")
sys.path.insert(0, str(Path(__file__).resolve().parent))
sys.path.insert(0, str(Path(__file__).resolve().parent.parent))

import mujoco
import numpy as np
import yaml
from benchmarks.arm6 import DRIVE, LINKS, RATE_HZ, urdf
from rich.console import Console
from scipy.optimize import least_squares

from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.search import quiet
from ee_dist.effects.catalogue import Hypothesis, term
from ee_dist.robots.describe import read_body
from ee_dist.robots.starter import starter
from ee_dist.tasks.config import Config, EngineConfig, EvaluatorConfig
from ee_dist.tasks.measurements import load
from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.ways import AUTO, WAYS, way_of
from ee_dist.trials.log import Array

N = len(LINKS)
STEP_S, SECONDS = 0.0005, 8.0
ENCODER = 2 * np.pi / 4096
REACH = np.array([1.0, 0.5, 0.6, 0.8, 1.0, 0.8])
"""rad: how far each joint goes."""
SOLID = 2.5
"""How much heavier a part that is described as solid is than one that was printed."""
EXPORTED_NM = 10.0
"""Effort limit that a CAD program writes where nobody entered one, from which ``task=robot`` guesses a controller."""
FITTED, HELD = ("sines", "steps", "slow"), ("reaches", "sines")


class Arm:
    """One arm; all that is wrong with it is drawn from ``seed``. Every second one carries 0.12 kg more at its end."""

    def __init__(self, seed: int) -> None:
        rng = np.random.default_rng([77, seed])
        self.seed, self.model = seed, mujoco.MjModel.from_xml_string(self._xml(rng, seed % 2 == 1))

        def each(low: float, high: float) -> Array:
            return np.asarray(rng.uniform(low, high, N))

        self.kp, self.kd = DRIVE["kp"] * each(0.85, 1.1), each(0.05, 0.15)
        self.dry, self.viscous, self.by_load = each(0.05, 0.15), each(0.01, 0.06), each(0.1, 0.3)
        self.stribeck, self.stribeck_by_load, self.fading = each(0.02, 0.1), each(0.0, 0.1), each(0.05, 0.3)
        self.limit = DRIVE["torque_limit"] * each(0.8, 1.0)
        self.emf = self.limit / DRIVE["speed_limit"] * each(0.9, 1.2)
        self.deadband, self.zero, self.late = each(0.0015, 0.006), rng.normal(0, 0.02, N), each(0.004, 0.015)
        self.off_axis, self.phase = each(0.0, 0.004), each(0.0, 2 * np.pi)
        self.spring, self.rest = each(0.0, 0.05), each(-1.0, 1.0)
        self.sag = 0.15

    @staticmethod
    def _xml(rng: np.random.Generator, loaded: bool) -> str:
        xml = [
            '<mujoco><compiler autolimits="true" angle="radian"/>'
            f'<option timestep="{STEP_S}" integrator="implicitfast"><flag contact="disable"/></option><worldbody>'
        ]
        at = "0 0 0.05"
        for k, (name, mass, length, stated) in enumerate(LINKS):
            mass *= 1 + rng.uniform(-0.1, 0.3)
            axis = np.array([float(v) for v in stated.split()])
            axis += np.where(axis == 0, rng.normal(0, 0.015, 3), 0.0)
            middle = np.array([0, 0, length / 2] if k == 0 else [length / 2, 0, 0]) + rng.normal(0, 0.006, 3)
            inertia = mass * length**2 / 12 + 2e-5
            axis /= np.linalg.norm(axis)
            xml.append(
                f'<body name="{name}" pos="{at}"><joint type="hinge" axis="{_text(axis)}" range="-1.7 1.7" '
                f'armature="{DRIVE["rotor_inertia"] * (1 + rng.uniform(-0.4, 0.4)):g}" frictionloss="0.1"/>'
                f'<inertial pos="{_text(middle)}" mass="{mass:g}" diaginertia="{_text([inertia] * 3)}"/>'
            )
            at = f"0 0 {length:g}" if k == 0 else f"{length:g} 0 0"
        if loaded:
            xml.append(f'<body pos="{at}"><inertial pos="0.02 0 0" mass="0.12" diaginertia="1e-5 1e-5 1e-5"/></body>')
        return "".join([*xml, "</body>" * N, "</worldbody></mujoco>"])

    def log(self, times_s: Array, commands: Array) -> Array:
        """(T, N) encoder readings at ``times_s`` (T,), when ``commands`` (T, N) in rad are sent, each held until the next."""
        model, data = self.model, mujoco.MjData(self.model)
        rows, joints, used = np.round(times_s / STEP_S).astype(int), np.arange(N), 0.0
        sent = np.searchsorted(rows, np.arange(rows[-1] + 1), side="right") - 1
        now = set(rows.tolist())
        read = np.zeros_like(commands)
        data.qpos[:] = commands[0] - self.zero
        for k in range(rows[-1] + 1):
            late = sent[np.maximum(np.floor(k - self.late / STEP_S).astype(int), 0)]
            seen = data.qpos + self.zero + self.off_axis * np.sin(data.qpos + self.phase)
            seen = np.round(seen / ENCODER) * ENCODER
            if k in now:
                read[sent[k]] = seen
            gap = commands[late, joints] - seen
            gap = np.sign(gap) * np.maximum(np.abs(gap) - self.deadband, 0.0)
            pushed = np.clip(self.kp * gap, -self.limit, self.limit) * (1 - self.sag * used)
            motor = pushed - (self.emf + self.kd) * data.qvel
            used = float(np.abs(motor).sum() / self.limit.sum())
            fading = np.exp(-((np.abs(data.qvel) / self.fading) ** 1.5))
            load = np.abs(motor)
            model.dof_frictionloss[:] = (
                self.dry + self.by_load * load + fading * (self.stribeck + self.stribeck_by_load * load)
            )
            model.dof_damping[:] = self.viscous
            data.qfrc_applied[:] = motor - self.spring * (data.qpos - self.rest)
            mujoco.mj_step(model, data)
        return read


def _text(values: Sequence[float] | Array) -> str:
    return " ".join(f"{v:.9g}" for v in values)


def logged_s(rate_hz: float, rng: np.random.Generator) -> Array:
    """(T,) times at which a computer reads and sends: to the row at the model's rate, else a tenth of a step early or late."""
    t = np.arange(0, SECONDS, 1 / rate_hz)
    if rate_hz != RATE_HZ:
        t[1:] += np.clip(rng.normal(0, 0.1, len(t) - 1), -0.3, 0.3) / rate_hz
    return t


def motion(kind: str, t: Array, rng: np.random.Generator) -> Array:
    """(T, N) commands in rad at times (T,)."""
    if kind == "sines":
        q = sum(
            np.sin(2 * np.pi * f * t[:, None] + rng.uniform(0, 2 * np.pi, N)) / (1 + 2 * f)
            for f in rng.uniform(0.1, 1.5, 5)
        )
        q = q * REACH * 0.5
    elif kind == "steps":
        lasts = rng.uniform(0.6, 1.4, N)
        levels = rng.uniform(-0.6, 0.6, (N, 50)) * REACH[:, None]
        q = np.stack([levels[k, (t / lasts[k]).astype(int)] for k in range(N)], axis=1)
    elif kind == "slow":
        q = REACH * 0.9 * np.sin(2 * np.pi * rng.uniform(0.1, 0.25, N) * t[:, None] + rng.uniform(0, 2 * np.pi, N))
    else:
        knots = rng.uniform(-1, 1, (int(SECONDS / 1.2) + 3, N)) * REACH
        leg, share = (t / 1.2).astype(int), (t / 1.2 % 1)[:, None]
        q = knots[leg] + (knots[leg + 1] - knots[leg]) * share**3 * (10 - 15 * share + 6 * share**2)
    begin = np.clip(t, 0, 1)[:, None]
    return np.clip(q * begin**2 * (3 - 2 * begin), -1.5, 1.5)


def write(out: Path, seed: int, described: str, rate_hz: float = RATE_HZ) -> dict[str, list[str]]:
    """The user's files: a URDF, what it cannot say, and five logs."""
    out.mkdir(parents=True, exist_ok=True)
    heavier = SOLID if described == "solid" else 1.0
    guessed = described == "guessed"
    body = out / "arm.urdf"
    body.write_text(urdf(heavier, EXPORTED_NM if guessed else DRIVE["torque_limit"]), encoding="utf-8")
    joints = [f"joint_{k + 1}" for k in range(N)]
    sensors = [{"name": f"{j}_position", "kind": "position", "target": j} for j in joints]
    more = {"coulomb": 0.4, "viscous": 0.3, "rotor_inertia": 2 * DRIVE["rotor_inertia"]} if described == "rough" else {}
    entry = {"urdf": body.name, "has_floor": False, "drives": dict.fromkeys(joints, DRIVE | more)}
    if guessed:
        entry = yaml.safe_load(starter(read_body("urdf", body), "urdf", body.name, body.name).text)
    (out / "arm.yaml").write_text(yaml.safe_dump(entry | {"sensors": sensors}), encoding="utf-8")
    arm = Arm(seed)
    files: dict[str, list[str]] = {"fitted": [], "held": []}
    head = ",".join(["time_s", *(f"{j}_command_rad" for j in joints), *(f"{j}_position_rad" for j in joints)])
    for k, (use, kind) in enumerate([*(("fitted", m) for m in FITTED), *(("held", m) for m in HELD)]):
        t = logged_s(rate_hz, np.random.default_rng([6, seed, k]))
        commands = motion(kind, t, np.random.default_rng([5, seed, k]))
        path = out / f"{use}_{k}_{kind}.csv"
        table = np.column_stack([t, commands, arm.log(t, commands)])
        np.savetxt(path, table, delimiter=",", header=head, comments="", fmt="%.6f")
        files[use].append(str(path))
    return files


def problem(out: Path, use: str, files: Sequence[str], by: str) -> Problem:
    """The logs imported as a user would, by the way that the program chooses."""
    where = out / use
    settings = [
        "task=import",
        "robot=urdf",
        f"robot.drives={out / 'arm.yaml'}",
        f"measured=[{','.join(files)}]",
        f"hydra.run.dir={where}",
        "overwrite=true",
    ]
    subprocess.run([sys.executable, "-m", "ee_dist", *settings], check=True, stdout=subprocess.DEVNULL)
    config = Config(engine=EngineConfig("mujoco", 1), evaluator=EvaluatorConfig("serial"))
    config = replace(config, measured=str(where / "measured.mcap"))
    measured = load(config)
    return way_of(measured, by).make(measured, config)


def mrad(compared: Problem, terms: Hypothesis) -> float:
    raw = compared.raw(compared.residuals([terms])[0])
    return 1000 * float(np.sqrt(np.nanmean(raw**2)))


def by_hand(compared: Problem) -> Hypothesis:
    """Three numbers that all joints share, by least squares; two gains more where the description only guessed at them."""
    drive = compared.robot.drives[0]
    gains = ("position_gain", "speed_gain") if compared.robot.assumed else ()

    def terms(x: Array) -> Hypothesis:
        friction, rotor, late = np.abs(x[:3]) - (drive.coulomb, 0.9 * drive.rotor_inertia * (drive.coulomb > 0), 0.0)
        return (
            term("coulomb_friction", "all_joints", torque_nm=float(friction)),
            term("rotor_inertia", "all_joints", added_kg_m2=float(rotor)),
            term("command_delay", "all_joints", delay_s=float(late)),
            *(term(g, "all_joints", factor=float(np.exp(v))) for g, v in zip(gains, x[3:], strict=True)),
        )

    start, scale = [0.2, 0.005, 0.01] + [-1.0] * len(gains), [0.1, 0.01, 0.01] + [0.5] * len(gains)
    found = least_squares(lambda x: compared.residuals([terms(x)])[0], start, diff_step=0.05, x_scale=scale)
    return terms(found.x)


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument(
        "--described",
        choices=("nearly", "rough", "solid", "guessed"),
        default="nearly",
        help="guessed: by task=robot from the URDF alone; rough: with much too much friction, and rotors twice as heavy; "
        "solid: with parts 2.5 times as heavy",
    )
    parser.add_argument(
        "--rate", type=float, default=RATE_HZ, help="Hz of the log; other than 100: uneven, as LeRobot's 30"
    )
    parser.add_argument("--by", default=AUTO, choices=(AUTO, *WAYS), help="way of comparing that the search goes by")
    parser.add_argument("--out", type=Path, default=Path("logs/servo_arm"))
    args = parser.parse_args()
    out = args.out.resolve()
    files = write(out, args.seed, args.described, args.rate)
    seen, unseen = (problem(out, use, files[use], args.by) for use in ("fitted", "held"))
    shared = by_hand(seen)
    began = time.process_time()
    with SearchProgress(Console(), quiet) as progress:
        found = improve(seen.searched, pool_of(seen), progress=progress)
    print(f"\n{'':58s}  values  fitted  never seen (mrad)")
    rows = [(r.name, r.terms) for r in found.ladder]
    rows += [("improve, in the end", found.terms), (f"{len(shared)} shared numbers by least squares", shared)]
    for name, terms in rows:
        values = sum(len(t.values) for t in terms)
        print(f"{name:58.58s}  {values:6d}  {mrad(seen, terms):6.1f}  {mrad(unseen, terms):6.1f}")
    print(f"{found.verdict}: {found.stopped}; {time.process_time() - began:.0f} s of one core")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
