"""What a balance of forces leaves over: when, in which direction, whether it repeats with position and at what wavelength.

A friction that is missing shows by speed and direction; a part that is not straight (a screw, a gear, magnets) shows as a
ripple over position that every pass repeats; what a filter could not follow sits at reversals and where the motion is
jerky.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from ee_dist.discrepancy.problem import Index, Mask
from ee_dist.trials.log import Array

SLOW_SHARE, CALM_SHARE = 0.15, 0.1
"""Of a trial's largest speed and a record's largest acceleration: below the first it reverses, below the second it cruises."""
STILL = 0.01
"""Of the largest speed of a record: a trial that stays below it stands still."""
BINS = 120


@dataclass(frozen=True)
class Regime:
    """A part of the time: its share of it, its share of the residual's energy, root mean square and mean (N or N.m)."""

    name: str
    time_share: float
    energy_share: float
    rms: float
    mean: float


@dataclass(frozen=True)
class Ripple:
    """The residual over position in one direction: ``repeats`` is the share of its variance that every pass shows again,
    over ``passes``; ``wavelength`` (m or rad) the one that explains most, ``share`` how much of the variance."""

    direction: str
    passes: int
    repeats: float
    wavelength: float
    share: float


@dataclass(frozen=True)
class Remains:
    motor: str
    trials: int
    rms: float
    largest: float
    regimes: tuple[Regime, ...]
    ripples: tuple[Ripple, ...]


def remains(motor: str, left: Array, x: Array, v: Array, a: Array, trial: Index | None = None) -> Remains:
    """What is left over at a drive: forces (T,) with position, speed and acceleration at the same instants; ``trial`` (T,) is
    which trial a row is of, without it all are of one."""
    trial = np.zeros(len(left), dtype=np.int64) if trial is None else trial
    # A trial that is slow all along turns round no more often than a quick one; one that stands still has no pace.
    which = np.unique(trial, return_inverse=True)[1]
    pace = np.zeros(int(which.max(initial=0)) + 1)
    np.maximum.at(pace, which, np.abs(v))
    slow = np.abs(v) < SLOW_SHARE * np.maximum(pace, STILL * pace.max())[which]
    calm = np.abs(a) < CALM_SHARE * np.abs(a).max()
    groups = (
        ("near a reversal", slow),
        ("speeding up or slowing down", ~slow & ~calm),
        ("cruising up", ~slow & calm & (v > 0)),
        ("cruising down", ~slow & calm & (v < 0)),
    )
    regimes = tuple(_regime(name, left, m) for name, m in groups if m.any())
    ripples = tuple(
        r for name, m in (("up", v > 0), ("down", v < 0)) if (r := _ripple(name, x, left, m & ~slow, trial))
    )
    return Remains(motor, len(np.unique(trial)), _rms(left), float(np.abs(left).max()), regimes, ripples)


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _regime(name: str, left: Array, mask: Mask) -> Regime:
    share = float(np.sum(left[mask] ** 2) / max(float(np.sum(left**2)), 1e-300))
    return Regime(name, float(mask.mean()), share, _rms(left[mask]), float(left[mask].mean()))


def _ripple(name: str, x: Array, left: Array, mask: Mask, trial: Index) -> Ripple | None:
    at = np.flatnonzero(mask)
    if len(at) < 100:
        return None
    span = float(np.ptp(x[at]))
    ends = np.flatnonzero((np.diff(at) > 3) | (np.diff(trial[at]) != 0)) + 1
    passes = [p for p in np.split(at, ends) if np.ptp(x[p]) > 0.2 * span]
    where = np.linspace(x[at].min(), x[at].max(), BINS)
    profiles = np.array([_profile(where, x[p], left[p]) for p in passes]) if passes else np.zeros((0, BINS))
    wavelengths = np.geomspace(span / 150, span / 2, 400)
    shares = [_explained(x[at], left[at], w) for w in wavelengths]
    best = int(np.argmax(shares))
    return Ripple(name, len(passes), _repeats(profiles), float(wavelengths[best]), float(shares[best]))


def _profile(where: Array, x: Array, left: Array) -> Array:
    order = np.argsort(x)
    return np.interp(where, x[order], left[order], left=np.nan, right=np.nan)


def _repeats(profiles: Array) -> float:
    """Share of the variance of the profiles (passes, bins) that is in their mean, over bins that several passes cover; NaN where
    none are."""
    covered = np.isfinite(profiles).sum(axis=0) >= 2
    if not covered.any():
        return float("nan")
    some = profiles[:, covered]
    # Bins that many passes cover weigh more below than above.
    return min(1.0, float(np.nanmean(np.nanmean(some, axis=0) ** 2) / max(float(np.nanmean(some**2)), 1e-300)))


def _explained(x: Array, left: Array, wavelength: float) -> float:
    """Share of the variance that a sine of this wavelength over position takes."""
    angle = 2 * np.pi * x / wavelength
    basis = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    z = left - left.mean()
    fit = np.linalg.lstsq(basis, z, rcond=None)[0]
    return float(1 - np.sum((z - basis @ fit) ** 2) / max(float(np.sum(z**2)), 1e-300))


def describe(found: Remains, unit: str, length: str) -> Sequence[str]:
    """The account in words, a line each."""
    several = f", over {found.trials} trials" if found.trials > 1 else ""
    # As many digits for both: rounded coarser, a maximum may look less than its root mean square.
    lines = [f"{found.motor}: {found.rms:.3g} {unit} root mean square, {found.largest:.3g} {unit} at most{several}"]
    lines += [
        f"  {r.name}: {_percent(r.time_share)} of the time, {_percent(r.energy_share)} of the residual's energy, "
        f"{r.rms:.3g} {unit} (mean {r.mean:+.3g} {unit})"
        for r in found.regimes
    ]
    lines += [
        f"  going {r.direction}: {_again(r)}; a ripple of {r.wavelength:.3g} {length} takes {_percent(r.share)}"
        for r in found.ripples
    ]
    return lines


def _again(r: Ripple) -> str:
    if math.isnan(r.repeats):
        return "no two passes are over the same positions"
    return f"{_percent(r.repeats)} of it repeats on each of {r.passes} passes"


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %"
