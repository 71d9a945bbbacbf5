"""The effect catalogue. Importing this package registers the effects that come with it."""

from ee_dist.effects import body, calibration, drive, sensing, wiring, world  # noqa: F401
from ee_dist.effects.catalogue import CATALOGUE, Effect, EffectError, Hypothesis, Parameter, Term, apply, term

__all__ = ["CATALOGUE", "Effect", "EffectError", "Hypothesis", "Parameter", "Term", "apply", "term"]
