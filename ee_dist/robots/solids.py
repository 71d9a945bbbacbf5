"""Mass properties of simple solids, about their centre, in their own axes."""

from __future__ import annotations

Inertia = tuple[float, float, float, float, float, float]


def box_inertia(mass_kg: float, half_x: float, half_y: float, half_z: float) -> Inertia:
    """(xx, yy, zz, xy, xz, yz) of a box with the given half extents (m)."""
    x, y, z = (2 * half_x) ** 2, (2 * half_y) ** 2, (2 * half_z) ** 2
    m = mass_kg / 12
    return (m * (y + z), m * (x + z), m * (x + y), 0.0, 0.0, 0.0)


def rod_inertia(mass_kg: float, length_m: float, radius_m: float, axis: str) -> Inertia:
    """(xx, yy, zz, xy, xz, yz) of a cylinder along ``axis`` ('x', 'y' or 'z')."""
    across = mass_kg * (3 * radius_m**2 + length_m**2) / 12
    along = mass_kg * radius_m**2 / 2
    xx, yy, zz = (along if axis == a else across for a in "xyz")
    return (xx, yy, zz, 0.0, 0.0, 0.0)
