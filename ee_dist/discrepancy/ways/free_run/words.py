"""How free runs tell their errors, and what they left out."""

from __future__ import annotations

from collections.abc import Sequence


def in_unit(value: float, unit: str) -> str:
    """A position error (rad or m) as people read it."""
    return f"{value:.3g} {unit}" if value >= 1 else f"{1e3 * value:.3g} {'mrad' if unit == 'rad' else 'mm'}"


def of_models(each: Sequence[str]) -> str:
    """What is told of one model, or of one and of another made from it."""
    return each[0] if len(each) == 1 else f"model {each[0]}, improved model {each[-1]}"


def how_begun(windows_s: float | None) -> str:
    if windows_s is None:
        return "Run through without starting anew"
    return f"Started anew from the measured state every {windows_s:g} s"


def taken_less(one_in: int, steps: int, step_s: float, whole_s: float) -> list[str]:
    """Lines on what a search takes less of, of records of ``whole_s``: one window in so many, or so many steps of ``step_s`` at
    a time."""
    lines = []
    if one_in > 1:
        lines.append(
            f"So that the search ends, one in {one_in} of the windows is simulated, of {whole_s:.0f} s in steps of "
            f"{1e3 * steps * step_s:g} ms; compare takes all of them."
        )
    if steps > 1:
        step_ms = 1e3 * step_s
        lines.append(
            f"So that the search ends, it goes in steps of {steps * step_ms:g} ms, by which the robot as described is "
            f"off by less than a tenth of the noise floor; compare goes in steps of {step_ms:g} ms."
        )
    return lines
