"""What a model leaves in the units of the channels: plain root mean squares, beside an error in standard deviations."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from ee_dist.discrepancy.problem import Series
from ee_dist.robots.model import Sensor
from ee_dist.trials.log import Array

FARTHER, NEARER = 1.05, 0.98
"""Times a root mean square from which a model is called farther off, and below which it is nearer by what counts."""

InUnits = Mapping[tuple[str, str], float]
"""Root mean squares by kind of sensor and unit."""


def in_units(series: Iterable[Series], sensors: Sequence[Sensor]) -> InUnits:
    """Of all rows of all channels but touch, which is there or not."""
    squares: dict[tuple[str, str], list[Array]] = {}
    for s in series:
        kind = _called(sensors[s.channel])
        if kind != "touch":
            squares.setdefault((kind, s.unit), []).append((s.measured - s.predicted) ** 2)
    return {of: float(np.sqrt(np.mean(np.concatenate(rows)))) for of, rows in squares.items()}


def _called(sensor: Sensor) -> str:
    """Its kind, in the word that its name has for it."""
    return "speed" if sensor.kind == "velocity" and "speed" in sensor.name.lower() else sensor.kind


def told_in_units(each: Sequence[InUnits]) -> list[str]:
    """``position 25.1 mrad -> 12 mrad`` of one model after another, by kind of sensor."""
    return [_told(of, [found[of] for found in each]) for of in each[0]]


def farther_off(was: InUnits, now: InUnits, fell: bool) -> str:
    """A warning for people where a second model is farther off in any of these, or hardly nearer in all; empty: neither.
    ``fell``: whether it is better by its error, and so may be taken for nearer."""
    worse = [of for of in was if now[of] > FARTHER * was[of]]
    if not worse and (not fell or any(now[of] < NEARER * was[of] for of in was)):
        return ""  # nobody was told of anything better that these do not show
    told = "; ".join(_told(of, [was[of], now[of]]) for of in worse or was)
    head = f"{'Farther off' if worse else 'Hardly nearer'} than before in plain numbers"
    if not fell:
        return f"{head}, and the error did not fall: {told}. Look at the curves before you believe the model"
    return (
        f"{head}, though the error fell: {told}. The error counts in standard deviations of what equally good models do, and "
        "next to nothing where these part: look at the curves before you believe the model"
    )


def _told(of: tuple[str, str], values: Sequence[float]) -> str:
    kind, unit = of
    return f"{kind.replace('_', ' ')} {' -> '.join(_in_unit(v, unit) for v in values)}"


def _in_unit(value: float, unit: str) -> str:
    small = {"rad": "mrad", "m": "mm"}.get(unit)
    if small is not None and value < 1:
        return f"{1e3 * value:.3g} {small}"
    return f"{value:.3g}" + ("" if unit == "1" else f" {unit}")
