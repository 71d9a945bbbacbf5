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
from ee_dist.effects.catalogue import (
    CATALOGUE,
    Effect,
    EffectError,
    Hypothesis,
    Parameter,
    Term,
    apply,
    effect,
    term,
)
from ee_dist.effects.laws import LawContext, drive_law
from ee_dist.effects.plugins import load_plugin, loaded_plugins

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
