"""Progress of a run in the terminal: which pass, how far, how good, how long still."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from ee_dist.recording.records import (
    DIAGNOSIS,
    HARDWARE,
    MAP,
    POLISHED,
    REPAIR,
    GenerationRecord,
    HypothesisRecord,
    TrialRecord,
)
from ee_dist.recovery.observer import Observer
from ee_dist.recovery.subject import Subject
from ee_dist.recovery.walking import WALKING
from ee_dist.viewing.story import told


@contextmanager
def starting(console: Console, what: str) -> Iterator[None]:
    """Say what happens before there is anything to count: live on a terminal, elsewhere as a line."""
    if console.is_terminal:
        with console.status(what):
            yield
    else:
        console.print(f"     0 s  {what}", style="dim", highlight=False)
        yield


class PassProgress(Observer):
    """A bar for the pass under way and one for the run; where there is no terminal, a line for each pass and trial.

    The run's bar counts robot-steps expected, ``weights`` of a pass of each phase, since a repair pass costs many times a
    diagnosis pass; that of POLISHED is what follows the generations of a diagnosis.
    """

    def __init__(
        self, console: Console, passes: dict[str, int], weights: dict[str, float], subject: Subject = WALKING
    ) -> None:
        self.console, self.subject = console, subject
        self.live = console.is_terminal
        self.weights = weights
        self.started = time.monotonic()
        self.done = 0.0
        self.total = sum(count * weights[phase] for phase, count in passes.items())
        self.total += passes.get(DIAGNOSIS, 0) * weights.get(POLISHED, 0.0)
        self.passes = passes
        self.bars = Progress(
            TextColumn("{task.description}", justify="left"),
            BarColumn(bar_width=28),
            MofNCompleteColumn(),
            TextColumn("{task.fields[best]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=console,
            transient=True,
            disable=not self.live,
        )
        self.run_bar = self.bars.add_task("whole run (%)", total=100, best="")
        self.pass_bar = self.bars.add_task("first generation: compiling, loading", total=1, best="")
        self.phase, self.index, self.generations = "", 0, 1
        self.evolved = float("nan")

    def __enter__(self) -> PassProgress:
        self.bars.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.bars.stop()

    def pass_started(self, phase: str, pass_index: int, generations: int) -> None:
        self.phase, self.index, self.generations = phase, pass_index, generations + 1
        name = f"{phase} {pass_index + 1} of {self.passes[phase]}" if phase != MAP else "map of the intact"
        self.bars.reset(self.pass_bar, total=self.generations, description=name, best="")
        if not self.live and not self.done:
            seconds = time.monotonic() - self.started
            self.console.print(f"{seconds:6.0f} s  {name}, {generations} generations", style="dim", highlight=False)

    def generation(self, record: GenerationRecord) -> None:
        self.done += self.weights[self.phase] / self.generations
        measured = record.phase in (REPAIR, MAP)
        good = f"best {self.subject.measure(record.best)}" if measured else f"error {record.best:.4f}"
        self.bars.update(self.pass_bar, advance=1, best=good)
        self.bars.update(self.run_bar, completed=round(100 * self.done / self.total))
        if record.generation < self.generations - 1:
            return
        if record.phase == REPAIR:
            self._say(f"{record.phase} pass {record.pass_index + 1}: {good}")
        elif record.phase == MAP:
            self._say(f"map of the intact {self.subject.noun}: {good}")
        else:
            # Not yet what the loop will believe: that is told when it is final.
            self.evolved = record.best
            self.bars.update(self.pass_bar, description=f"{record.phase} {record.pass_index + 1}: polishing")

    def hypotheses(self, records: Sequence[HypothesisRecord]) -> None:
        for r in records:
            if r.final:
                self.done += self.weights.get(POLISHED, 0.0)
                self._say(f"diagnosis pass {r.pass_index + 1}: error {r.error:.5f} (evolved: {self.evolved:.5f})")
                self.bars.console.print(
                    f"{'':10}believes: {told(r.terms)}", highlight=False, style="dim", soft_wrap=True
                )

    def trial(self, record: TrialRecord) -> None:
        if record.source == HARDWARE:
            self._say(f"hardware, {record.name}: {self.subject.measure(self.subject.value(record.log))}")

    def _say(self, text: str) -> None:
        seconds = time.monotonic() - self.started
        left = seconds * max(self.total - self.done, 0.0) / self.done if self.done else float("nan")
        self.bars.console.print(
            Text.assemble((f"{seconds:6.0f} s", "dim"), f"  {text}  ", (f"about {left:.0f} s left", "dim")),
            highlight=False,
        )
