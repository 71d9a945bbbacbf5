"""What is installed in this process, as far as it decides results."""

from __future__ import annotations

from importlib.metadata import PackageNotFoundError, version
from platform import python_version

PACKAGES = ("ee_dist", "pybullet", "mujoco", "numpy", "numba", "ray")
"""What decides the bits of a result, and so must be the same in every process."""


def installed() -> dict[str, str]:
    """Versions by name; ``-`` for what is not there."""
    found = {"python": python_version()}
    for name in PACKAGES:
        try:
            found[name] = version(name)
        except PackageNotFoundError:
            found[name] = "-"
    return found
