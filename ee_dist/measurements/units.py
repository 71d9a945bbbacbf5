"""Units as people write them, and the factor to ours (m, kg, s, rad, N, V, A)."""

from __future__ import annotations

import math

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError, nearest

TURN = 2 * math.pi
TURNS_ON = 2 * TURN
"""rad: what a joint that turns on and on moves by, if nothing else is known."""
UNITS: dict[str, tuple[str, float]] = {
    "1": ("number", 1.0),
    "%": ("number", 0.01),
    "s": ("time", 1.0),
    "ms": ("time", 1e-3),
    "us": ("time", 1e-6),
    "µs": ("time", 1e-6),
    "μs": ("time", 1e-6),
    "ns": ("time", 1e-9),
    "min": ("time", 60.0),
    "rad": ("angle", 1.0),
    "mrad": ("angle", 1e-3),
    "deg": ("angle", TURN / 360),
    "turn": ("angle", TURN),
    "rad/s": ("angular speed", 1.0),
    "deg/s": ("angular speed", TURN / 360),
    "rev/min": ("angular speed", TURN / 60),
    "rpm": ("angular speed", TURN / 60),
    "m": ("length", 1.0),
    "cm": ("length", 1e-2),
    "mm": ("length", 1e-3),
    "um": ("length", 1e-6),
    "in": ("length", 0.0254),
    "m/s": ("speed", 1.0),
    "mm/s": ("speed", 1e-3),
    "N": ("force", 1.0),
    "mN": ("force", 1e-3),
    "kN": ("force", 1e3),
    "N.m": ("torque", 1.0),
    "mN.m": ("torque", 1e-3),
    "kgf.cm": ("torque", 0.0980665),
    "A": ("current", 1.0),
    "mA": ("current", 1e-3),
    "V": ("voltage", 1.0),
    "mV": ("voltage", 1e-3),
}


def factor(unit: str, expected: str, where: str) -> float:
    """What to multiply by to get from ``unit`` to ``expected``. Raises MeasurementError for a unit of something else."""
    if unit not in UNITS:
        raise MeasurementError(f"{where}: no unit {quoted(unit)}; {nearest(unit, UNITS)}")
    kind, size = UNITS[unit]
    wanted, base = UNITS[expected]
    if kind != wanted:
        if kind == "current" and wanted in ("torque", "force"):
            raise MeasurementError(
                f"{where}: a current is a {wanted} only through the motor's gain: write 'unit: {expected}, scale: GAIN' "
                f"with the {expected} of one {unit}"
            )
        fitting = ", ".join(u for u, (k, _) in UNITS.items() if k == wanted)
        raise MeasurementError(f"{where}: unit {quoted(unit)} is a unit of {kind}; expected one of {wanted}: {fitting}")
    return size / base
