"""Solids of a part as rerun draws them."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr

from ee_dist.robots.pictured import Solid, turned
from ee_dist.viewing.palette import Rgb


def columns(solid: Solid, colour: Rgb | None, ghost: bool, rows: int) -> Any:
    """Rerun columns of a solid, repeated for a number of rows. A ghost is see-through with its edges drawn.

    A colour that changes (None here) comes by itself: a static one would hide every later one.
    """
    shape = solid.shape
    fill = rr.components.FillMode.TransparentFillMajorWireframe if ghost else rr.components.FillMode.Solid
    common: dict[str, Any] = {"fill_mode": [fill] * rows, "quaternions": [shape.rotation] * rows}
    if colour is not None:
        common["colors"] = [colour] * rows
    if ghost:
        common["radii" if shape.kind == "box" else "line_radii"] = [rr.components.Radius.ui_points(0.7)] * rows
    if shape.kind == "box":
        return rr.Boxes3D.columns(half_sizes=[shape.size] * rows, centers=[shape.position_m] * rows, **common)
    if shape.kind == "sphere":
        half = (shape.size[0],) * 3
        return rr.Ellipsoids3D.columns(half_sizes=[half] * rows, centers=[shape.position_m] * rows, **common)
    radius, length = shape.size
    common |= {"lengths": [length] * rows, "radii": [radius] * rows}
    if shape.kind == "cylinder":
        return rr.Cylinders3D.columns(centers=[shape.position_m] * rows, **common)
    # Rerun's capsule begins at its frame; ours has its frame in the middle.
    start = np.array(shape.position_m) + turned(shape.rotation, (0.0, 0.0, -length / 2))
    return rr.Capsules3D.columns(translations=[start] * rows, **common)


def colour_columns(solid: Solid, colours: list[Rgb]) -> Any:
    """Only the colour of a solid, one row each."""
    kinds: dict[str, Any] = {
        "box": rr.Boxes3D,
        "sphere": rr.Ellipsoids3D,
        "cylinder": rr.Cylinders3D,
        "capsule": rr.Capsules3D,
    }
    return kinds[solid.shape.kind].columns(colors=colours)
