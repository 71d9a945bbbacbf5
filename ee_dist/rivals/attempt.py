"""What came of one rival on one robot: every hardware trial, and what had been simulated when it was made."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

SHARES = (0.7, 0.9, 1.0)
"""Of the intact distance; what counts as function restored elsewhere is 0.9."""


@dataclass(frozen=True)
class Cost:
    """Rollouts asked for; of these those that differ; their robot-steps (a diagnosis looks at the first 60 of 1000)."""

    asked: int = 0
    simulated: int = 0
    steps: int = 0


@dataclass
class Attempt:
    """``trials_m``: distance of every hardware trial after the change; the first is the intact controller's. ``spent``: what
    was simulated after the change when each was made, in robot-steps. ``no_gait``: trials that went further than any before them,
    and what they did instead of walking; other trials are not looked at."""

    rival: str
    scenario: int
    seed: int
    intact_m: float
    before: Cost = Cost()
    after: Cost = Cost()
    trials_m: list[float] = field(default_factory=list)
    spent: list[Cost] = field(default_factory=list)
    no_gait: dict[int, list[str]] = field(default_factory=dict)
    believed: list[list[dict[str, Any]]] = field(default_factory=list)
    truth: list[dict[str, Any]] = field(default_factory=list)
    seconds: float = 0.0

    def curve(self) -> list[float]:
        """Best distance that was walked so far, as a share of the intact one, after each trial."""
        best, found = -math.inf, []
        for k, distance in enumerate(self.trials_m):
            if k not in self.no_gait and math.isfinite(distance):
                best = max(best, distance)
            found.append(best / self.intact_m if self.intact_m > 0 else math.nan)
        return found

    def share(self, trials: int) -> float:
        """Best share of the intact distance within so many trials after the change; nan without a walk."""
        curve = self.curve()[:trials]
        return curve[-1] if curve and math.isfinite(curve[-1]) else math.nan

    def reached(self, share: float, trials: int | None = None) -> int | None:
        """The number of the first trial, from 1, that walked this share of the intact distance; None where none did."""
        curve = self.curve()[:trials]
        return next((k + 1 for k, s in enumerate(curve) if s >= share), None)

    def spent_until(self, share: float, trials: int | None = None) -> Cost | None:
        """What was simulated after the change until then."""
        found = self.reached(share, trials)
        return None if found is None else self.spent[found - 1]

    def as_dict(self) -> dict[str, Any]:
        """Plain data; what was spent is told once for all trials that share it."""
        content = {k.name: getattr(self, k.name) for k in fields(self) if k.name not in ("before", "after", "spent")}
        runs: list[list[int]] = []
        for cost in self.spent:
            row = [cost.asked, cost.simulated, cost.steps]
            if runs and runs[-1][1:] == row:
                runs[-1][0] += 1
            else:
                runs.append([1, *row])
        return {
            **content,
            "no_gait": {str(k): v for k, v in self.no_gait.items()},
            "before": asdict(self.before),
            "after": asdict(self.after),
            "spent": runs,
        }


def attempt_of(content: Mapping[str, Any]) -> Attempt:
    """The attempt that ``as_dict`` wrote."""
    plain = {
        k: content[k] for k in ("rival", "scenario", "seed", "intact_m", "trials_m", "believed", "truth", "seconds")
    }
    return Attempt(
        **plain,
        before=Cost(**content["before"]),
        after=Cost(**content["after"]),
        spent=[Cost(*row) for count, *row in content["spent"] for _ in range(count)],
        no_gait={int(k): list(v) for k, v in content["no_gait"].items()},
    )
