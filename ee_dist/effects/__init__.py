"""The effect catalogue. Importing this package registers the effects that come with it."""

from ee_dist.effects import (  # noqa: F401
    body,
    calibration,
    controller_laws,
    drive,
    fixture,
    friction,
    genes,
    mistakes,
    sensing,
    transmission,
    wiring,
    world,
)
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis, Term, apply, effect, term
from ee_dist.effects.effect import Effect, EffectError, Parameter
from ee_dist.effects.laws import LawContext, drive_law
from ee_dist.effects.plugins import load_plugin, loaded_plugins

# isort: split
# Last: the order of registration is that of the catalogue, and of what is drawn from it.
from ee_dist.effects import stops  # noqa: F401

# isort: split
from ee_dist.effects import feed_forward  # noqa: F401

# isort: split
from ee_dist.effects import stamps  # noqa: F401

# isort: split
from ee_dist.effects import integral  # noqa: F401

# isort: split
from ee_dist.effects import duration  # noqa: F401

# isort: split
from ee_dist.effects import torque_readings  # noqa: F401

__all__ = [
    "CATALOGUE",
    "Effect",
    "EffectError",
    "Hypothesis",
    "LawContext",
    "Parameter",
    "Term",
    "apply",
    "drive_law",
    "effect",
    "load_plugin",
    "loaded_plugins",
    "term",
]
