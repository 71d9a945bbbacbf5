"""The same words for the same things in terminal, page and scene."""

from __future__ import annotations

from ee_dist.discrepancy.improve import Rung
from ee_dist.discrepancy.words import placed

MODEL = "model"
"""The model as it was given."""
IMPROVED = "improved model"
"""The model with what was found."""


def step_name(r: Rung) -> str:
    """A step of the ladder: what was added, or, of the first, the model itself."""
    return placed(r.name) if r.added or r.held_out != "nothing was fitted" else f"the {MODEL}"
