"""What all views of a scene have in common."""

from __future__ import annotations

from rerun.blueprint import Corner2D

from ee_dist.viewing import blueprint


def test_a_legend_does_not_hide_what_a_curve_comes_to() -> None:
    """Errors grow with time: the end of the worst curve is at the right."""
    view = blueprint.plot("/sensors/a", "a", blueprint.fixed_axis(0.0, 1.0))
    (corner,) = view.properties["PlotLegend"].corner.as_arrow_array().to_pylist()
    assert corner == Corner2D.LeftTop.value
