"""The model on the workbench: terms with their values, each on or off, and the ladder of errors they have led to.

Immutable: every change gives a new bench, so that undo is the one before.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from ee_dist.discrepancy.evidence.intervals import ParameterReport
from ee_dist.discrepancy.search.candidates import Candidate, known
from ee_dist.discrepancy.words import placed, quantity
from ee_dist.effects.catalogue import Hypothesis, Term
from ee_dist.robots.model import Robot

MODEL, HAND, FIT = "model file", "by hand", "fitted"
"""Where the values of a term come from."""


@dataclass(frozen=True)
class Entry:
    """A term, with the range of each value that its slider has. ``intervals``: 95 %, by parameter, after a fit."""

    candidate: Candidate
    term: Term
    on: bool = True
    origin: str = HAND
    intervals: tuple[tuple[str, float, float], ...] = ()
    flags: tuple[str, ...] = ()
    """What a fit said of its values: not determined, at a bound."""

    @property
    def name(self) -> str:
        return self.term.name


@dataclass(frozen=True)
class Step:
    """A rung of the ladder. ``error_heldout`` is None where nothing was held out: a hand that watches the error has seen all
    the data. ``refused``: why the effect did not earn its place; empty where it did."""

    name: str
    error_fit: float
    error_heldout: float | None
    held_out: str = ""
    refused: str = ""


@dataclass(frozen=True)
class Bench:
    """``entries`` in the order in which they act; ``ladder`` from the model as it was."""

    entries: tuple[Entry, ...] = ()
    ladder: tuple[Step, ...] = ()

    @property
    def terms(self) -> Hypothesis:
        """What is switched on."""
        return tuple(e.term for e in self.entries if e.on)

    @property
    def names(self) -> frozenset[str]:
        return frozenset(e.name for e in self.entries)

    def has(self, index: int, name: str) -> bool:
        """Whether an effect is still where a page had it: another page, or a click before, may have removed one."""
        return index < len(self.entries) and self.entries[index].name == name

    def value(self, index: int, name: str, parameter: str) -> float | None:
        """Of an effect that is still where a page had it."""
        return dict(self.entries[index].term.values)[parameter] if self.has(index, name) else None

    def added(self, candidate: Candidate, values: Mapping[str, float] | None = None) -> Bench:
        """With one more effect, at the values given or at neutral, where it does nothing yet. The same effect at the same
        place is not added twice: its values are set, and it is switched on."""
        for k, entry in enumerate(self.entries):
            if entry.name == candidate.name:
                again = self.switched(k, True)
                return again if values is None else again.valued(k, values)
        neutral = candidate.effect.neutral_values()
        chosen = {**neutral, **(values or {})}
        term = Term(candidate.effect.name, candidate.target, tuple((p, float(chosen[p])) for p in neutral))
        return replace(self, entries=(*self.entries, Entry(candidate, term)))

    def valued(self, index: int, values: Mapping[str, float]) -> Bench:
        """With other values of one term. Raises ValueError for a parameter it does not have or a value beyond its bounds."""
        entry = self.entries[index]
        bounds = dict(zip((p.name for p in entry.candidate.effect.parameters), entry.candidate.bounds, strict=True))
        for name, value in values.items():
            low, high = bounds.get(name, (1.0, 0.0))
            slack = 1e-9 * max(abs(low), abs(high), 1e-9)
            if not low - slack <= value <= high + slack:
                raise ValueError(f"{entry.name}: {name} = {value:g} lies outside [{low:g}, {high:g}]")
        mixed = tuple((n, float(values.get(n, v))) for n, v in entry.term.values)
        term = Term(entry.term.effect, entry.term.target, mixed)
        return self._with(index, replace(entry, term=term, origin=HAND, intervals=(), flags=()))

    def switched(self, index: int, on: bool) -> Bench:
        return self._with(index, replace(self.entries[index], on=on))

    def without(self, index: int) -> Bench:
        return replace(self, entries=self.entries[:index] + self.entries[index + 1 :])

    def fitted(self, robot: Robot, terms: Hypothesis, reports: Sequence[ParameterReport]) -> Bench:
        """With the values that a fit found for the terms that are on. Terms that the fit left out go, new ones come last."""
        found = {t.name: (k, t) for k, t in enumerate(terms)}
        mine: list[Entry] = []
        for entry in self.entries:
            if entry.name in found:
                mine.append(_reported(robot, replace(entry, on=True), *found.pop(entry.name), reports))
            elif not entry.on:
                mine.append(entry)
        for k, t in found.values():
            mine.append(_reported(robot, Entry(known(robot, t), t), k, t, reports))
        return replace(self, entries=tuple(mine))

    def stepped(self, *steps: Step) -> Bench:
        return replace(self, ladder=(*self.ladder, *steps))

    def by_hand(self, error: float) -> Bench:
        """The ladder with what a hand did: one rung for the same set of effects, however long their sliders are moved."""
        on = " and ".join(placed(e.name) for e in self.entries if e.on) or "nothing"
        step = Step(f"by hand: {on}", error, None)
        if self.ladder and self.ladder[-1].name == step.name:
            return replace(self, ladder=(*self.ladder[:-1], step))
        return self.stepped(step)

    def _with(self, index: int, entry: Entry) -> Bench:
        return replace(self, entries=(*self.entries[:index], entry, *self.entries[index + 1 :]))


def bench_of(robot: Robot, terms: Hypothesis) -> Bench:
    """What a model file has, all on."""
    return Bench(tuple(Entry(known(robot, t), t, origin=MODEL) for t in terms))


def _reported(robot: Robot, entry: Entry, index: int, term: Term, reports: Sequence[ParameterReport]) -> Entry:
    own = [r for r in reports if r.term == index]
    return replace(
        entry,
        term=term,
        origin=FIT,
        intervals=tuple((r.name, r.low, r.high) for r in own),
        flags=tuple(f"{quantity(term, r.name, robot)}: {r.note}" for r in own if r.note),
    )
