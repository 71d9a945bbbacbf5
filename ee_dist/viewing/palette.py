"""The colours and words of every scene, in one place, so that a colour means the same thing in each view."""

from __future__ import annotations

Rgb = tuple[int, int, int]

MEASURED: Rgb = (86, 156, 230)
"""Blue: what the hardware did."""
PREDICTED: Rgb = (255, 167, 38)
"""Orange: what the model says; of a run, what it said before the trial."""
HINDSIGHT: Rgb = (178, 148, 255)
"""Violet: what another model says; of a run, that of the diagnosis after the trial."""
TOUCHING: Rgb = (105, 219, 124)
"""Green: a foot whose touch sensor reports contact."""
LIMB: Rgb = (158, 196, 238)
FOOT: Rgb = (72, 84, 104)
GROUND: Rgb = (125, 132, 145)
GRAVITY: Rgb = (218, 119, 242)
AIR: Rgb = (52, 56, 64)
SERIES: tuple[Rgb, ...] = (
    (86, 156, 230),
    (255, 167, 38),
    (105, 219, 124),
    (218, 119, 242),
    (255, 212, 59),
    (77, 208, 225),
    (240, 128, 128),
    (176, 190, 197),
)
"""For lists of things of one kind: motors, actions."""
PASSES: tuple[Rgb, ...] = ((196, 206, 214), (112, 126, 140))
"""For passes of the search, by turns: their order tells which is which, and blue, orange and violet mean something."""
ZERO_LINE: Rgb = (255, 255, 255)
"""White: where bars of both signs begin."""

MEASURED_NAME, PREDICTED_NAME, HINDSIGHT_NAME = "measured", "predicted", "predicted_after"
"""Places among the entities; the viewer draws lines in their order, and thin ones must lie upon the thick measured one."""
RESIDUALS: tuple[Rgb, ...] = ((236, 94, 94), *SERIES[2:])
"""For what is left when the prediction is taken off: neither blue nor orange."""


def pass_colour(index: int) -> Rgb:
    return PASSES[index % len(PASSES)]


def series_colour(index: int) -> Rgb:
    return SERIES[index % len(SERIES)]
