"""How far a value may be off and say nothing: by noise, by what equally good models differ in, by what calibration left.

A contact that comes a row early moves all that follows. Neighbours of the believed model, which are as good as it is, show where
that is so: what they differ in counts for less (see predictability.py).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.recorded import medians_of, row_by_row
from ee_dist.discrepancy.ways.open_loop.prediction import Digest, Predictor
from ee_dist.discrepancy.ways.open_loop.scale import Scale
from ee_dist.discrepancy.ways.open_loop.texture import frozen, most_odd, repeating
from ee_dist.robots.model import Robot
from ee_dist.trials.log import Array

SOFT = 6.0
"""Residuals beyond this many standard deviations count by their logarithm;"""
FIRM = 60.0
"""those of a real robot that touches nothing beyond so many. It misses no contact, and differs from its model in every joint:
where nearly all that is compared is softened, what is right in few rows and far off in the others looks as good as what is
near in all."""
TINY = 0.25
"""Share of a channel's scale whose roughness is too small to count."""
_SOFT_FLOOR = {SOFT: 0.974, FIRM: 0.9997}
"""Mean square of soft * asinh(x / soft) for standard normal x."""
_ROUGH_FLOOR = 0.93
"""Mean square of the comparison of roughness, for white noise."""


def soften(values: Array, soft: float = SOFT) -> Array:
    """Nearly the identity up to ``soft``, logarithmic beyond."""
    return np.asarray(soft * np.arcsinh(values / soft))


@dataclass(frozen=True, eq=False)
class Weights:
    """Of each part of what is compared: ``deviation`` (blocks, S) of block means, in the units of the channels,
    ``grain_deviation`` (windows, S) of the log of roughness, ``begun`` (blocks, S) mean squares by which the noise of a start
    moves block means, ``known`` (2, S) mean squares that calibration left of both.

    ``undeclared`` (S,) is the variance of noise that no description declares; most sensors of the kinds in ``repeating``
    repeat readings more often than the model's, and of those in ``rugged`` it is not compared how rough they are either:
    ``smooth`` (S,) are the channels of which it is.
    """

    scale: Scale
    block: int
    window: int
    deviation: tuple[Array, ...]
    grain_deviation: tuple[Array, ...]
    begun: tuple[Array, ...]
    known: tuple[Array, ...]
    undeclared: Array
    repeating: frozenset[str]
    rugged: frozenset[str]
    smooth: Mask
    own: tuple[Array, ...]
    """Places of the channels that were recorded in each part: nothing is compared of others."""

    @property
    def tiny(self) -> Array:
        """(S,) roughness that is too small to count."""
        return _tiny(self.scale)

    def rough(self, predicted: Digest) -> Array:
        """(windows, S) of a prediction, with the noise that no description declares."""
        return _rough(predicted, self.undeclared, self.tiny)

    def floors(self, part: int, soft: float) -> tuple[list[Array], list[Array]]:
        """Mean squares of a part's values under a perfect model, and what of them is no noise: of means (blocks * S,), then of
        texture (windows * 2 * S,)."""
        # How far noise moves the log of roughness beside what is too small to count, as a share of what it does alone.
        noise = self.scale.noise**2
        noisy = (noise / (noise + self.tiny) * (1.0 + TINY**2)) ** 2
        pure = _by_luck(self.window)
        (means, texture), off, grain_off = self.known[part], self.deviation[part] ** 2, self.grain_deviation[part] ** 2
        left = means / off
        share = (noise / self.block + self.begun[part]) / off + left
        rough = _ROUGH_FLOOR * texture / grain_off
        grain = _ROUGH_FLOOR * noisy * pure / grain_off + rough
        grain, rough = grain * self.smooth, rough * self.smooth
        share, left, grain, rough = (values[:, self.own[part]] for values in (share, left, grain, rough))
        floor = [share.ravel() * _SOFT_FLOOR[soft], np.stack([grain, np.zeros_like(grain)], axis=1).ravel()]
        return floor, [left.ravel() * _SOFT_FLOOR[soft], np.stack([rough, np.zeros_like(rough)], axis=1).ravel()]


def weigh(
    predictor: Predictor,
    data: Sequence[Digest],
    moving: Sequence[Array],
    scale: Scale,
    known: Sequence[Array],
    held: Sequence[Sequence[Robot]],
    bare: bool = False,
) -> Weights:
    """The weights of what was measured (``data``, and where it moved). ``held``: of each part, as they are held there, the model
    that is believed and as many others that are as good. ``bare``: a real robot that touches nothing: where most of its sensors
    of a kind jump, or repeat readings, neither says what is wrong with it."""
    robot, block, window, count = predictor.base, predictor.block, predictor.window, len(held[0])
    pairs = [(k, m) for k, models in enumerate(held) for m in models]
    found = predictor.digests(pairs)
    first = found[::count]
    recorded = [t.recorded(robot) for t in predictor.trials]
    repeats = repeating(robot, zip(data, first, moving, recorded, strict=True), window)
    undeclared, tiny = _rougher(robot, scale, data, first, recorded), _tiny(scale)
    begun = tuple(predictor.by_start(k, m) for k, m in pairs[::count])
    deviation, grain_deviation = [], []
    for k in range(len(held)):
        base, others = first[k], [d for d in found[k * count + 1 : (k + 1) * count] if d.finite]
        noise = scale.scale**2 / block + begun[k] + known[k][0]
        spread = np.zeros_like(base.means, dtype=float)
        grain = np.zeros_like(base.rough, dtype=float)
        if others and base.finite:
            spread = np.mean([(d.means.astype(float) - base.means) ** 2 for d in others], axis=0)
            usual = _rough(base, undeclared, tiny)
            grain = np.mean([np.log(_rough(d, undeclared, tiny) / usual) ** 2 for d in others], axis=0)
        deviation.append(np.sqrt(noise + _held_up(spread)))
        grain_deviation.append(np.sqrt(_by_luck(window) + known[k][1] + _held_up(grain)))
    compared = list(zip(data, first, moving, recorded, strict=True)) if bare else []
    rugged = _rugged(robot, compared, undeclared, tiny, window)
    smooth = np.array([x.kind not in rugged for x in robot.sensors])
    settled = (
        tuple(deviation),
        tuple(grain_deviation),
        begun,
        tuple(known),
        undeclared,
        repeats | rugged,
        rugged,
        smooth,
    )
    return Weights(scale, block, window, *settled, tuple(map(np.flatnonzero, recorded)))


def _rugged(
    robot: Robot, trials: Sequence[tuple[Digest, Digest, Mask, Mask]], undeclared: Array, tiny: Array, window: int
) -> frozenset[str]:
    """Kinds of sensors most of which are rougher than the model's, or repeat readings otherwise, from (measured, predicted, where
    repeats tell, which channels were recorded) of each trial."""
    squares = []
    for measured, predicted, tells, recorded in trials:
        if predicted.finite and len(predicted.rough):
            grain = grain_of(measured, _rough(predicted, undeclared, tiny), tiny) ** 2 / _by_luck(window)
            squares.append((grain + (frozen(measured, predicted, window) * tells) ** 2, recorded))
    return most_odd(robot, squares)


def _tiny(scale: Scale) -> Array:
    return (TINY * scale.least) ** 2


def grain_of(measured: Digest, rough: Array, tiny: Array) -> Array:
    """(windows, S) log of how many times rougher was measured than is predicted."""
    return np.asarray(np.log((measured.rough + tiny) / rough))


def _rough(predicted: Digest, undeclared: Array, tiny: Array) -> Array:
    return np.asarray(predicted.rough + undeclared + tiny)


def _by_luck(window: int) -> float:
    """Mean square that noise makes of a difference of the log of roughness over so many readings."""
    return 2 * 1.95 / window + 0.01


def _held_up(spread: Array) -> Array:
    """(T, C): mean squares that vary from row to row by luck, each at least the mean of its neighbours."""
    if not len(spread):
        return spread  # fewer readings than a window
    padded = np.pad(spread, ((1, 1), (0, 0)), mode="edge")
    return np.asarray(np.maximum(spread, (padded[:-2] + spread + padded[2:]) / 3.0))


def _rougher(
    robot: Robot, scale: Scale, data: Sequence[Digest], predicted: Sequence[Digest], recorded: Sequence[Array]
) -> Array:
    """(S,) variance of noise where none is declared: by how much channels are rougher than the model's, and no more than
    others of their kind, so that a sensor that is noisier than they are stands out."""
    kinds = np.array([s.kind for s in robot.sensors])
    if any(s.noise for s in robot.sensors) or not all(p.finite for p in predicted):
        return np.zeros(len(kinds))
    each = [d.rough.astype(float) - p.rough for d, p in zip(data, predicted, strict=True)]
    more, read, there = np.concatenate(each), row_by_row(each, recorded), np.any(recorded, axis=0)
    own = np.clip(medians_of(more, read), 0.0, scale.noise**2) if len(more) else np.zeros(len(kinds))
    alike = {kind: own[there & (kinds == kind)] for kind in kinds}
    usual = {kind: np.median(some) if len(some) > 2 else some.min(initial=np.inf) for kind, some in alike.items()}
    return np.minimum(own, [usual[kind] for kind in kinds])
