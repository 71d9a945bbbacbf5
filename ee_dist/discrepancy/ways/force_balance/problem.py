"""The problem of measured forces: what the drive gave, less what the measured motion needed and friction took.

For a robot on a fixed base whose joint positions and drive torques were measured. Nothing is simulated: positions are
low-passed and differentiated, the torque that this motion needs comes from inverse dynamics, friction and springs from
the drive path's own laws at each instant, and what is left over is the residual. It is linear in most parameters, never
chaotic, and takes milliseconds a model; what it cannot see are the controller (a delay, a gain) and the sensors, but for
when torques were read beside positions.

For one joint, and with the settings below, this is the published definition of the relative force error on EMPS (Janot,
Gautier, Brunot 2019; Gautier, Janot, Vandanjon 2013): regressor and force both decimated, signs taken before.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from ee_dist.basics.names import listed
from ee_dist.discrepancy.measured_trial import MeasuredTrial, at_one_pace, evenly_read
from ee_dist.discrepancy.problem import Layout, Problem, Series
from ee_dist.discrepancy.recorded import bridged
from ee_dist.discrepancy.ways.force_balance.balance import INSTANT_S, Balance, told_by
from ee_dist.discrepancy.ways.force_balance.cancel import CANCELLED, left_to_give
from ee_dist.discrepancy.ways.force_balance.floor import floor_of
from ee_dist.discrepancy.ways.force_balance.motion import Processing, judged_in
from ee_dist.discrepancy.ways.force_balance.noise import RESOLVED, prepared, resting, torque_steps, with_energy
from ee_dist.discrepancy.ways.force_balance.readings import at_readings
from ee_dist.discrepancy.ways.force_balance.ripple import Remains, describe, remains
from ee_dist.discrepancy.ways.force_balance.weight import weightless
from ee_dist.effects.catalogue import Hypothesis, apply, find, term
from ee_dist.engines.friction import LOADED as LOADS
from ee_dist.measurements.sampling import decimated
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

LOADED = 0.1
"""Share of a drive's torque that its load must be in some motion, for friction by load to be looked for."""
BY_LOAD = (*LOADS, "stribeck_load_speed")
"""Fields of a drive that are friction by load."""
OF_ALL_TRIALS = (
    "Each trial's error is a share of the force that was measured in all of these trials; by itself, or beside others, the same "
    "trial has another."
)
LEAST_NOISE = 0.002
"""Share of the force below which no difference counts, noise or not."""


class ForceBalance(Problem):
    """A balance of forces. Channels are the drives whose torques are known and whose joints slide, the ``judged``.

    A residual value is a force left over, in units of the noise of the measured force; ``natural`` makes a relative force
    error of it. Segments are blocks of time.
    """

    way = "force_balance"
    families = frozenset({"body", "drive", "world"})
    switches = False
    natural_name = "relative force error"
    natural_unit = "1"

    def __init__(self, trials: Sequence[MeasuredTrial], robot: Robot, processing: Processing | None = None) -> None:
        # Nothing is simulated, so that no time step but that of the readings is wanted.
        own = [evenly_read(t.log) for t in trials]
        logs, pace_s = at_one_pace(own)
        thinned = any(a is not b for a, b in zip(own, logs, strict=True))
        as_read, trials = trials, [replace(t, log=log) for t, log in zip(trials, logs, strict=True)]
        self.gaps = bridged(as_read, "compared as if they had been read: cut the records there")
        # Nor does a step of a simulation limit what a drive may have: how light a rotor its controller leaves steady.
        robot = replace(robot, time_step_s=INSTANT_S)
        self.robot, self.measured = robot, tuple(trials)
        self.models = [t.models(robot, [()])[0] for t in trials]
        self.asked = processing or Processing.for_rate(pace_s)
        ready = prepared(trials, self.models, self.asked, torque_steps(as_read, self.models))
        self.processing, self.motions, self.size, self.motion_noise = (
            ready.processing,
            ready.motions,
            ready.size,
            ready.noise,
        )
        self.coarse = ready.coarse
        """Places of the channels whose forces are no more than a few steps of their readings."""
        self.judged = ready.judged
        """(J,): the drives whose torques are known in every trial, and whose joint slides in one."""
        self.unjudged = tuple(name for k, name in enumerate(robot.motor_names) if k not in self.judged)
        known = set(judged_in(trials, robot))
        self.held = tuple(name for k, name in enumerate(robot.motor_names) if k in known.difference(self.judged))
        """Those of the others whose torques are known."""
        self.balances = [Balance(m, self.processing.keep_every, len(self.motions)) for m in self.motions]
        forces = [decimated(m.of_judged(m.torque), self.processing.keep_every) for m in self.motions]
        self.let_through = ready.noise.first
        """(J,): variance of the force that noise of the positions makes, with the base model."""
        told = floor_of(trials, self.models, ready, self.balances)
        shares = np.maximum(told.most, LEAST_NOISE**2)
        # One share for all drives, so that the sum of squares is the relative error of all of them; a drive's own floor tells
        # how much less or more than that its noise is.
        self.noise_share = float(np.sqrt(np.mean(shares)))
        self.own_noise = np.sqrt(shares) / self.noise_share
        """(J,): standard deviation of a drive's noise in units of that share."""
        self.sure_noise = np.sqrt(np.maximum(told.sure, LEAST_NOISE**2)) / self.noise_share
        """(J,): the same of what is noise beyond doubt; the rest may be a force that changes quickly."""
        self.scale = self.size * self.noise_share
        self.shared_by_trials = OF_ALL_TRIALS if len(trials) > 1 else ""
        self._lay_out(forces)
        p, smooth = self.processing, self.processing.filter_for(pace_s)
        self.error_definition = (
            "root mean square of the force left over, as a share of that of the measured force (for programs: in standard "
            f"deviations of its noise, {100 * self.noise_share:.3g} % of that); positions and forces through a {smooth}, central "
            f"differences, decimated by {p.keep_every}"
            + (f", all trials at the {1 / pace_s:.4g} Hz of the one that was read the most seldom" if thinned else "")
        )

    def natural(self, error: float) -> float:
        """Root mean square of the force left over, as a share of that of the measured force."""
        return error * self.noise_share

    def told(self, error: float) -> str:
        return f"{100 * self.natural(error):.3g} %"

    def raw(self, residual: Array) -> Array:
        return np.asarray(residual * self.scale[self.channel_of])

    def _lay_out(self, forces: Sequence[Array]) -> None:
        names: list[str] = []
        seg, time, of_trial = [], [], []
        self.slices: list[slice] = []
        self.times_s: list[Array] = []
        names_of_motors = tuple(self.robot.motor_names[j] for j in self.judged)
        at, motors = 0, len(self.judged)
        for k, (trial, force) in enumerate(zip(self.measured, forces, strict=True)):
            rows = len(force)
            blocks = min(self.processing.blocks, max(1, rows // 20))
            block = np.minimum(np.arange(rows) * blocks // rows, blocks - 1)
            dt = float(np.median(np.diff(trial.log.times_s))) * self.processing.keep_every
            start = self.processing.drop_rows * dt / self.processing.keep_every
            self.times_s.append(start + np.arange(rows) * dt)
            first = len(names)
            names += [f"{trial.name}@{start + float(np.argmax(block == b)) * dt:.1f}s" for b in range(blocks)]
            of_trial += [k] * blocks
            seg.append(np.repeat(first + block, motors))
            time.append(np.repeat(self.times_s[-1], motors))
            self.slices.append(slice(at, at + rows * motors))
            at += rows * motors
        kinds = {j.name: j.kind for j in self.robot.joints}
        self.layout = Layout(
            segments=tuple(names),
            trial_of_segment=np.array(of_trial),
            segment_of=np.concatenate(seg).astype(np.int64),
            channel_of=np.tile(np.arange(motors), at // motors),
            time_s=np.concatenate(time),
            reading=np.ones(at, dtype=bool),
            floor=np.tile(self.own_noise**2, at // motors),
            known=np.zeros(at),
            channels=names_of_motors,
            units=tuple("N" if kinds[m] == "slide" else "N.m" for m in names_of_motors),
            joint_of_channel=self.judged,
        )

    def residuals(self, hypotheses: Sequence[Hypothesis], trials: Sequence[int] | None = None) -> Array:
        """(H, n), as the contract says. Raises EffectError for a hypothesis that does not fit the robot."""
        chosen = range(len(self.measured)) if trials is None else trials
        out = np.zeros((len(hypotheses), len(self.segment_of)))
        own = self.scale * self.own_noise
        for k in chosen:
            for row, model in enumerate(self.measured[k].models(self.robot, hypotheses)):
                kept = self.balances[k](model)
                if kept is None:
                    out[row, self.slices[k]] = np.inf
                    continue
                left = resting(kept[0] / own, kept[1] / own, self.balances[k].rest) * self.own_noise
                less = (self.let_through - self.motion_noise.variance(model)) / self.scale**2
                out[row, self.slices[k]] = with_energy(left, less).ravel()
        return out

    def series(self, hypothesis: Hypothesis) -> list[Series]:
        """The measured force, and the one that the model accounts for."""
        left = self.raw(self.residuals([hypothesis])[0])
        out = []
        for k, motion in enumerate(self.motions):
            (model,) = self.measured[k].models(self.robot, [hypothesis])
            force = decimated(motion.of_judged(motion.torque), self.processing.keep_every)
            # What is left stands at the rows of the motion, and a curve of torques at those in which they were read.
            late_s = motion.readings.late_s(model)[list(self.judged)]
            rest = at_readings(left[self.slices[k]].reshape(force.shape), self.times_s[k], late_s)
            for c, unit in enumerate(self.layout.units):
                out.append(Series(k, c, unit, self.times_s[k], force[:, c], (force - rest)[:, c]))
        return out

    def remains(self, hypothesis: Hypothesis, channel: int = 0) -> Remains:
        """When, in which direction and over which position the hypothesis leaves something at one drive, over all trials."""
        return self._remains(self.raw(self.residuals([hypothesis])[0]), channel)

    def _remains(self, forces: Array, channel: int) -> Remains:
        """The same of the forces (n,) that are left."""
        joint = self.judged[channel]
        x, v, a = (
            np.concatenate([decimated(series[:, joint], self.processing.keep_every) for series in of_all])
            for of_all in zip(*((m.position, m.speed, m.acceleration) for m in self.motions), strict=True)
        )
        trial = np.repeat(np.arange(len(self.times_s)), [len(t) for t in self.times_s])
        return remains(self.channels[channel], forces[self.channel_of == channel], x, v, a, trial)

    def remarks(self, hypothesis: Hypothesis) -> list[str]:
        lines: list[str] = []
        forces = self.raw(self.residuals([hypothesis])[0])
        for k, unit in enumerate(self.layout.units):
            found = describe(self._remains(forces, k), unit, "m" if unit == "N" else "rad")
            # Of a joint that sticks, speeds and directions say nothing.
            lines += found[:1] if self.channels[k] in self.stuck else found
        return lines

    @cached_property
    def stuck(self) -> tuple[str, ...]:
        """Judged drives whose joint does not slide in any trial: all of them, or none."""
        never = np.all([m.of_judged(m.rest).all(axis=0) for m in self.motions], axis=0)
        return tuple(name for name, still in zip(self.channels, never, strict=True) if still)

    def shows(self, effect: str, target: str) -> bool:
        """A controller's gain, a delay or play in a gear would be proposed for nothing, and named beside what is found; so would
        whatever changes nothing but at joints whose torques are not known, and friction by load where there is none."""
        limits = find(effect).bounds(self.robot, target)
        corners = [{name: float(ends[end]) for name, ends in limits.items()} for end in (0, 1)]
        changed = [apply(self.robot, (term(effect, target, **values),)) for values in corners]
        return any(self._tells(robot) for robot in changed)

    def _tells(self, robot: Robot) -> bool:
        """Whether anything is told from the robot as it is described."""
        as_it_is, own = told_by(self.robot, self.judged), self.robot.drives
        if told_by(robot, self.judged) == as_it_is:
            return False
        drives = tuple(
            replace(d, **{n: getattr(o, n) for n in BY_LOAD}) for d, o in zip(robot.drives, own, strict=True)
        )
        if told_by(replace(robot, drives=drives), self.judged) != as_it_is:
            return True
        return any(d != o and d.joint in self._loaded for d, o in zip(robot.drives, own, strict=True))

    @cached_property
    def _loaded(self) -> frozenset[str]:
        """Joints through whose gears goes what tells friction by load: of a motor that gives ten times as much, it is a share
        of the motor's own torque, and stands in for any friction, or a rotor, that is larger by one factor."""
        needed = np.zeros(len(self.judged))
        for model, motion in zip(self.models, self.motions, strict=True):
            load = motion.of_judged(motion.needed(model)[1])
            needed = np.maximum(needed, np.sqrt(np.mean((load / self.size) ** 2, axis=0)))
        return frozenset(name for name, share in zip(self.channels, needed, strict=True) if share >= LOADED)

    @cached_property
    def doubts(self) -> str:
        return weightless(self.models, self.balances, self.size, self.channels)

    @cached_property
    def left_to_give(self) -> float:
        """Share of what gravity and inertia need that the drives had to give; little where the two cancel."""
        return left_to_give(self.models, self.motions, self.size)

    @property
    def notes(self) -> list[str]:
        lines = [*self.gaps]
        unknown = tuple(name for name in self.unjudged if name not in self.held)
        if unknown:
            they_move = "it moves" if len(unknown) == 1 else "they move"
            lines.append(
                f"Torques are compared at {len(self.judged)} of {len(self.robot.drives)} joints: {listed(self.channels)}. At "
                f"{listed(unknown)} they are not known: how {they_move} counts at the others, and what drives or rubs "
                "there is not judged."
            )
        if still := self.held or self.stuck:
            one = len(still) == 1
            lines.append(
                f"{listed(still)} hardly {'moves' if one else 'move'} in any trial: what friction takes there may be anything up "
                "to its limit"
                + (
                    f", so that {'its' if one else 'their'} torque is not judged."
                    if self.held
                    else ", and no more of it can be told."
                )
            )
        if self.coarse:
            names, one = [self.channels[k] for k in self.coarse], len(self.coarse) == 1
            steps = listed(f"{self.size[k] / RESOLVED:.2g} {self.layout.units[k]}" for k in self.coarse)
            lines.append(
                f"{listed(names)}: {'its torque is' if one else 'their torques are'} a few steps of the readings ({steps}). "
                f"What is off there counts beside {RESOLVED:g} steps: a share of so little would outweigh all other joints."
            )
        if self.left_to_give < CANCELLED:
            lines.append(
                f"Gravity and inertia cancel in these motions but for {100 * self.left_to_give:.0f} %: a tenth off in one of "
                f"them looks like {5 / self.left_to_give:.0f} % of the force. Where commands were recorded, task.by=free_run "
                "tells more."
            )
        if self.processing.keep_every > self.asked.keep_every:
            step_s = float(np.median(np.diff(self.measured[0].log.times_s)))
            lines.append(
                f"The positions are so noisy that they were smoothed more than usual: motion and forces above "
                f"{0.5 / (self.processing.keep_every * step_s):.2g} Hz are not compared."
            )
        return lines

    @property
    def sure(self) -> Array:
        return np.tile(self.sure_noise**2, len(self.floor) // len(self.channels))

    def noise_floor(self) -> tuple[float, str]:
        source = "estimated: second differences of the force"
        worst = int(np.argmax(self.own_noise / self.sure_noise))
        most, least = (100 * self.natural(float(n[worst])) for n in (self.own_noise, self.sure_noise))
        if most > least:
            source += (
                f", an upper bound: of {most:.2g} % at {self.channels[worst]} only {least:.2g} % are noise beyond doubt"
            )
        return 1.0, source
