"""What compare, explain and improve found, as plain data to draw: no problem, no engine, no way of comparing."""

from __future__ import annotations

from dataclasses import dataclass

from ee_dist.robots.model import Robot
from ee_dist.trials.log import SensorLog

BEST, TIED, EARNED, REFUSED = "best", "tied", "earned", "not earned"
"""What became of a candidate: the first, not to be told from it by these data, worth adding too, or not worth it."""


@dataclass(frozen=True, eq=False)
class Case:
    """One measured trial."""

    name: str
    measured: SensorLog


@dataclass(frozen=True, eq=False)
class Account:
    """What a model says of the trials: a log each, in their order. ``body`` is what is drawn; None: nothing is.

    The logs have the channels that were compared, under the names of the measured ones; joints and base pose where the
    body is to move. They may be shorter than what was measured.
    """

    label: str
    logs: tuple[SensorLog, ...]
    body: Robot | None = None


@dataclass(frozen=True)
class ChannelError:
    """The error of a channel in the unit of the finding, its root mean square in the channel's own, and where it is worst."""

    name: str
    unit: str
    error: float
    rmse: float
    worst_case: str = ""
    worst_from_s: float = 0.0
    worst_to_s: float = 0.0


@dataclass(frozen=True, eq=False)
class Candidate:
    """A missing effect that was judged: its gain on held-out data with its interval, as shares of what is there to gain."""

    label: str
    gain: float
    low: float
    high: float
    kind: str
    account: Account | None = None


@dataclass(frozen=True)
class Rung:
    """A model on the way from the first to the last: what was added, and its errors, lower is better."""

    label: str
    error_heldout: float
    error_fit: float | None = None
    held_out: str = ""
    """What was held out."""
    error_apart: float | None = None
    """On trials that were held out from all of it, where there are such."""


@dataclass(frozen=True, eq=False)
class Finding:
    """One result. ``verdict`` is a sentence; ``lines`` say below it how large the error is and how sure all of it; errors and
    ``floor`` are in ``unit``.

    ``rms_of``: what the root mean squares of the channels are of.
    ``model`` is the model as it was given, ``better`` that with what was found (improve, or the best candidate).
    """

    title: str
    verdict: str
    robot: Robot
    cases: tuple[Case, ...]
    model: Account
    lines: tuple[str, ...] = ()
    floor: float | None = None
    unit: str = "standard deviations"
    channels: tuple[ChannelError, ...] = ()
    rms_of: str = ""
    candidates: tuple[Candidate, ...] = ()
    ladder: tuple[Rung, ...] = ()
    better: Account | None = None
    next_command: str = ""
    lead: str = "Next"

    def __post_init__(self) -> None:
        accounts = [self.model, self.better, *(c.account for c in self.candidates)]
        for account in accounts:
            if account is not None and len(account.logs) != len(self.cases):
                raise ValueError(
                    f"finding: {account.label!r} says something of {len(account.logs)} trials; there are {len(self.cases)}"
                )

    @property
    def worst_first(self) -> tuple[ChannelError, ...]:
        return tuple(sorted(self.channels, key=lambda c: -c.error))
