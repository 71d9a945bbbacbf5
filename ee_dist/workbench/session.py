"""One session on the workbench: a log, a model, what was found, and the way back. It outlives the pages that show it.

All that changes it runs on one thread, one thing after the other (``do``); pages read it, which is safe, since what it
holds is immutable. Long verbs run in another process and come back here.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

from ee_dist.basics.files import fresh
from ee_dist.discrepancy.ladder import UNFITTED
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.discrepancy.words import placed
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.tasks.config import AUTO, Config, EvaluatorConfig
from ee_dist.tasks.errors import USER_ERRORS
from ee_dist.tasks.measurements import Measurements, load
from ee_dist.tasks.results.commands import command, setting
from ee_dist.tasks.ways import way_of
from ee_dist.workbench import commands, saved, verbs
from ee_dist.workbench.bench import Bench, Step, bench_of
from ee_dist.workbench.one_thread import OneThread
from ee_dist.workbench.results import Compared, Explained, Improved
from ee_dist.workbench.saved import Saved
from ee_dist.workbench.sight import Glance, Place, Seen, Sight
from ee_dist.workbench.verbs import Ended, Request
from ee_dist.workbench.worker import BUSY, BusyError, Progress, Worker

STEPS = "steps"
MODEL_FILE = "model.yaml"
MOST_UNDONE = 200


class NothingOpenError(ValueError):
    """There is no log on the bench."""


class Session(OneThread):
    """``busy`` is told in ``progress``. Topics that listeners hear: opened, model, seen, explained, progress, kept, notice."""

    def __init__(self, config: Config, by: str, folder: Path) -> None:
        super().__init__(folder, (*USER_ERRORS, BusyError, NothingOpenError))
        self.config, self.by = config, by
        # Here single simulations are wanted at once: no Ray, and no cache that grows with every move of a slider.
        self.live = replace(config, evaluator=EvaluatorConfig("serial", cache=False, recent=True))
        self.measured: Measurements | None = None
        self.sight: Sight | None = None
        self.seen: Seen | None = None
        self.bench = Bench()
        self.explained: Explained | None = None
        self.kept: Compared | None = None
        self.shown: Compared | None = None
        """The model that is looked at in 3-D, which need not be the one that was kept."""
        self.commands: tuple[str, ...] = ()
        self.worker = Worker(self._heard, self._ended)
        self._began: str | None = None
        self._past: list[Bench] = []
        self._gripped = False
        self._slid: tuple[int, frozenset[str]] | None = None
        self._files: dict[Hypothesis, Path | str | None] = {}

    def close(self) -> None:
        self.worker.close()
        super().close()

    # -- what is open --------------------------------------------------------------------------------------------------

    def load(self, measured: Any, model: str | None) -> Measurements:
        """Read and check the files, and put the model on the bench. Raises ConfigError, LogError, RecordingError."""
        config = replace(self.config, measured=measured, model=model)
        found = load(config)
        way_of(found, self.by)
        self.worker.cancel()
        self.measured, self._began = found, model
        self.sight, self.seen, self.explained, self.kept, self.shown = None, None, None, None, None
        self.bench, self._past = bench_of(found.robot, found.model), []
        self._gripped, self._slid = False, None
        self._files = {found.model: model}
        self.commands = ()
        self.tell("opened")
        return found

    def reopen(self, kept: Saved) -> None:
        """A session that ended, with its model, ladder and commands. Raises what ``load`` raises, and EffectError."""
        found = self.load(list(kept.measured), kept.model)
        self.bench, self.commands = kept.bench(found.robot), kept.commands

    def begin(self) -> None:
        """Compare the model as it is; what ``load`` began. Raises what the way of comparing raises."""
        measured = self._open()
        self.sight = Sight(replace(measured, model=self.bench.terms), self.live, way_of(measured, self.by))
        self.seen = self.sight.seen(self.bench.terms)
        if not self.bench.ladder:
            off = self.seen.found.error
            self.bench = self.bench.stepped(Step("the model as it was", off, off, UNFITTED))
            self._note("compare", self.bench.terms)
        self._save()
        self.tell("seen")

    def place(self) -> Place:
        """Where the error is worst."""
        return self._sight().worst(self._seen())

    def _open(self) -> Measurements:
        if self.measured is None:
            raise NothingOpenError("no log is open: drop one on the page")
        return self.measured

    def _sight(self) -> Sight:
        if self.sight is None:
            raise NothingOpenError("no log is open yet")
        return self.sight

    def _seen(self) -> Seen:
        if self.seen is None:
            raise NothingOpenError("no log is open yet")
        return self.seen

    # -- the model -----------------------------------------------------------------------------------------------------

    def change(self, to: Bench) -> None:
        """Another bench, which undo takes back, compared anew."""
        self._remember()
        self.bench = to
        self._gripped = False
        self.tell("model")
        self.settle()

    def add(self, name: str, values: Mapping[str, float] | None = None) -> None:
        """``effect@target`` onto the model, at neutral or with values. Raises EffectError."""
        self.change(self.bench.added(parse(self._open().robot, name), values))

    def switch(self, index: int, on: bool, name: str) -> None:
        """``name`` of the effect that is meant, here and below: one that is no longer there is let be."""
        if self.bench.has(index, name):
            self.change(self.bench.switched(index, on))

    def remove(self, index: int, name: str) -> None:
        if self.bench.has(index, name):
            self.change(self.bench.without(index))

    def slide(self, index: int, values: Mapping[str, float], place: Place, name: str) -> Glance | None:
        """A slider is moved, and the hand is still on it: what is to be drawn. Moves of one slider in a row, also by many
        strokes of a key, are undone as one step."""
        if not self.bench.has(index, name):
            return None
        bench = self.bench.valued(index, values)
        if self._slid != (index, frozenset(values)):
            self._remember()
        self._slid, self._gripped = (index, frozenset(values)), True
        self.bench = bench
        return self._sight().glance(self.bench.terms, place)

    @property
    def at_pauses(self) -> bool:
        """Whether the error over all trials is there soon enough to be looked at while a hand is still on a slider."""
        return self._sight().at_pauses

    def glance_whole(self) -> float:
        """The error over all trials, as the sight of the moment weighs it."""
        return self._sight().error(self.bench.terms)

    def release(self) -> None:
        """The hand is off the slider."""
        if self._gripped:
            self._gripped = False
            self.tell("model")
            self.settle()

    def undo(self) -> bool:
        """Back to the bench before the last change; False where there is none."""
        if not self._past:
            return False
        self.bench, self._gripped, self._slid = self._past.pop(), False, None
        self.tell("model")
        self.settle(step=False)
        return True

    @property
    def gripped(self) -> bool:
        """Whether a hand is on a slider: what it sets is not settled yet."""
        return self._gripped

    @property
    def undoable(self) -> int:
        return len(self._past)

    def settle(self, step: bool = True) -> None:
        """Compare the model as it stands now, weighed by itself, as task=compare will; keep it as a file."""
        terms = self.bench.terms
        if self.seen is None or self.seen.terms != terms:
            self.sight = self._sight().weighed(terms)
            self.seen = self.sight.seen(terms)
            if step:
                self.bench = self.bench.by_hand(self.seen.found.error)
                self._note("compare", terms)
        self._save()
        self.tell("seen")

    def _save(self) -> None:
        """Onto the disk, so that ``log=`` of this folder goes on with it."""
        measured = [str(f.resolve()) for f in self._open().files]
        entries = tuple(map(saved.saved_entry, self.bench.entries))
        began = None if self._began is None else str(Path(self._began).resolve())
        saved.write(
            self.folder,
            Saved(tuple(measured), began, self.by, self.config.engine.name, entries, self.bench.ladder, self.commands),
        )

    def _remember(self) -> None:
        self._slid = None
        self._past = [*self._past, self.bench][-MOST_UNDONE:]

    def file_of(self, terms: Hypothesis) -> Path | str | None:
        """The model file of these terms, written once; None for the robot as it is described."""
        if terms not in self._files:
            path = self.folder / STEPS / f"{len(self._files):03d}.yaml"
            commands.written(path, self._open(), terms, self._began, ["A step of a session on the workbench."])
            self._files[terms] = path
        return self._files[terms]

    def _asked(self, terms: Hypothesis) -> Config:
        return commands.asked(self.config, self._open(), self.file_of(terms))

    def _note(self, task: str, terms: Hypothesis, *more: str) -> None:
        line = commands.line(task, self._asked(terms), self.by if self.by != AUTO else AUTO, *more)
        if not self.commands or self.commands[-1] != line:
            self.commands = (*self.commands, line)

    # -- long verbs ----------------------------------------------------------------------------------------------------

    def start(self, verb: str, effect: str = "") -> None:
        """Begin a long verb on the model as it stands. Raises BusyError, EffectError."""
        measured = self._open()
        terms = self.bench.terms
        if effect:
            parse(measured.robot, effect)
            # Judged beside the model without it: on top of itself it would gain nothing.
            terms = tuple(t for t in terms if t.name != effect)
        config = self._asked(terms)
        folder = fresh(self.folder / verb)
        more = {verbs.ADD: (f"effect={effect}",), verbs.FIT: ("effect=none",), verbs.AUTO: ("effect=auto",)}
        self.worker.start(Request(verb, config, self.by, folder, effect, bool(terms)))
        task = "improve" if verb in more else verb
        if verb == verbs.ADD:
            self._note("explain", terms, f"task.only=[{effect}]")
        self._note(task, terms, *more.get(verb, ()))
        self._save()

    def cancel(self) -> None:
        self.worker.cancel()

    @property
    def progress(self) -> Progress | None:
        return self.worker.progress

    def keep(self) -> Path:
        """The model as a file of its own, which task=compare then looks at. Raises BusyError, OSError."""
        if self.worker.progress is not None:
            raise BusyError(BUSY)
        measured, terms = self._open(), self.bench.terms
        path = self.folder / MODEL_FILE
        notes = [f"{s.name}: error {s.error_fit:.4g}" for s in self.bench.ladder]
        commands.written(path, measured, terms, self._began, ["Kept on the workbench.", *notes])
        config = commands.asked(self.config, measured, path)
        self.worker.start(Request(verbs.COMPARE, config, self.by, fresh(self.folder / verbs.COMPARE)))
        self.commands = (*self.commands, commands.line("compare", config, self.by))
        self._save()
        return path

    def export(self, to: str) -> Path:
        """The model for other simulators, by task=export. Raises what it raises."""
        from ee_dist.tasks import export  # only here: what writes for other programs takes long to load

        config = replace(self._asked(self.bench.terms), to=to)
        if config.model is None:
            # A file of its own: what was kept stays what it is.
            path = self.folder / STEPS / "described.yaml"
            commands.written(path, self._open(), self.bench.terms, self._began)
            config = replace(config, model=str(path))
        folder = fresh(self.folder / f"export_{to}")
        with contextlib.redirect_stdout(io.StringIO()):
            export.run(config, export.Options(to=to), folder)
        self.commands = (*self.commands, command(["task=export", setting("model", str(config.model)), f"to={to}"]))
        self._save()
        self.tell("kept")
        return folder

    def _heard(self, progress: Progress) -> None:
        self.tell("progress")

    def _ended(self, request: Request, ended: Ended) -> None:
        self.do(self._after, request, ended)

    def _after(self, request: Request, ended: Ended) -> None:
        """On the session's thread: take in what a long verb found."""
        result = ended.result
        if self.notice == BUSY:
            self.notice = ""  # Said while this was under way; it is done now.
        if ended.failed:
            self.say(ended.failed)
        elif isinstance(result, Explained):
            self.explained = result
            self.tell("explained")
        elif isinstance(result, Compared):
            self.shown = result
            if request.config.model == str(self.folder / MODEL_FILE):
                self.kept = result
            self.tell("kept")
        elif isinstance(result, Improved):
            self._improved(result, request)
        self.tell("progress")

    def _improved(self, found: Improved, request: Request) -> None:
        robot = self._open().robot
        self._remember()
        self._gripped = False
        bench = self.bench.fitted(robot, found.terms, found.parameters).stepped(*found.steps)
        refused = found.steps[-1].refused if found.steps else ""
        self.bench = bench
        if refused:
            # It helps only where it was fitted: shown on the ladder, and off unless the user says otherwise.
            for k, entry in enumerate(bench.entries):
                if entry.name == request.effect:
                    self.bench = bench.switched(k, False)
            self.notice = f"Refused: {placed(request.effect)}: {refused}. It is on the bench, switched off."
            self.tell("notice")
        self._files.setdefault(found.terms, found.folder / MODEL_FILE)
        self.tell("model")
        self.settle(step=False)
