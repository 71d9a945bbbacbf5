"""The long verbs as the command line has them, run one after the other in a process of their own beside the page.

A process and not a thread: the page stays alive whatever a search does, and to cancel is to end it at once.
"""

from __future__ import annotations

import contextlib
import io
import os
import signal
from collections.abc import Callable
from dataclasses import dataclass, replace
from multiprocessing.connection import Connection
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ee_dist.effects.plugins import load_plugin
from ee_dist.tasks.config import Config
from ee_dist.workbench.results import Compared, Explained, Improved

if TYPE_CHECKING:
    from ee_dist.discrepancy.search.search import Progress

EXPLAIN, ADD, FIT, AUTO, COMPARE = "explain", "add", "fit", "auto", "compare"


@dataclass(frozen=True)
class Request:
    """One verb on what ``config`` names (``measured``, ``model``). ``effect``: what to add; ``own``: whether the model has
    terms already, which are fitted anew first."""

    verb: str
    config: Config
    by: str
    folder: Path
    effect: str = ""
    own: bool = False


@dataclass(frozen=True)
class Told:
    """Progress: what is being done, the share of it that is done, and the error of the best on the way."""

    what: str
    share: float
    error: float | None = None


@dataclass(frozen=True)
class Ended:
    """The result of a verb; or ``failed``, in one line."""

    result: Any = None
    failed: str = ""


def serve(pipe: Connection) -> None:
    """Answer requests until the pipe is closed."""
    # Ctrl-C in the terminal reaches this process too: the page decides what ends when.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    os.environ.setdefault("RUST_LOG", "off")
    # Loaded while nobody waits.
    from ee_dist.tasks import explain, improve  # noqa: F401
    from ee_dist.tasks.errors import USER_ERRORS, defect

    while True:
        try:
            request = pipe.recv()
        except (EOFError, OSError):
            return
        told = _teller(pipe)
        try:
            with contextlib.redirect_stdout(io.StringIO()):
                ended = Ended(done(request, told))
        except USER_ERRORS as error:
            ended = Ended(failed=" ".join(str(error).split()))
        except Exception as error:
            ended = Ended(failed=defect(error, request.folder))
        try:
            pipe.send(ended)
        except OSError:
            return


def _teller(pipe: Connection) -> Progress:
    last: list[Any] = ["", -1.0]

    def told(what: str, share: float, error: float | None = None) -> None:
        # Some stages report a thousand times a second: nobody sees more than one in a hundred.
        if what != last[0] or share >= 1.0 or abs(share - last[1]) >= 0.01:
            last[:] = [what, share]
            pipe.send(Told(what, share, error))

    return told


def done(request: Request, told: Progress) -> Any:
    """Run the verb; its files are in the folder afterwards. Raises what the task raises."""
    for path in request.config.plugins:
        load_plugin(path)
    return _VERBS[request.verb](request, told)


def _explain(request: Request, told: Progress) -> Explained:
    from ee_dist.tasks import explain
    from ee_dist.workbench import findings

    problem, found, account = explain.run(
        request.config, explain.Options(by=request.by, rerun=False), request.folder, told
    )
    return findings.of_explanation(problem, found, account, request.folder)


def _add(request: Request, told: Progress) -> Improved:
    """Judged alone on held-out data first, then added and fitted whatever the judgement is: the page shows both."""
    from ee_dist.discrepancy.search.search import within
    from ee_dist.tasks import explain, improve
    from ee_dist.workbench import findings

    alone = explain.Options(by=request.by, only=[request.effect], rerun=False)
    folder = request.folder
    _, judged, _ = explain.run(request.config, alone, folder / "judged", within("judging", told))
    asked = replace(request.config, effect=request.effect)
    _, found, account = improve.run(asked, improve.Options(by=request.by, rerun=False), folder, told)
    return findings.of_improvement(found, account, folder, len(found.ladder) - 1, findings.refusal(judged.candidates))


def _fit(request: Request, told: Progress) -> Improved:
    from ee_dist.tasks import improve
    from ee_dist.workbench import findings

    asked = replace(request.config, effect="none")
    _, found, account = improve.run(asked, improve.Options(by=request.by, rerun=False), request.folder, told)
    return findings.of_improvement(found, account, request.folder)


def _auto(request: Request, told: Progress) -> Improved:
    from ee_dist.tasks import improve
    from ee_dist.workbench import findings

    asked = replace(request.config, effect="auto")
    _, found, account = improve.run(asked, improve.Options(by=request.by, rerun=False), request.folder, told)
    return findings.of_improvement(found, account, request.folder, 2 if request.own else 1)


def _compare(request: Request, told: Progress) -> Compared:
    from ee_dist.tasks import compare
    from ee_dist.viewing.stream import RUN_TIME, starts_of

    told("comparing", 0.0)
    problem, found, account = compare.run(request.config, compare.Options(by=request.by), request.folder)
    # On the clock of the recording, less the time of each trial's first row: what the charts call a time, plus this.
    begins = starts_of([(k, [m.log]) for k, m in enumerate(problem.measured)])
    starts = tuple(b - float(m.log.times_s[0]) for b, m in zip(begins, problem.measured, strict=True))
    told_error = problem.told(found.error)
    return Compared(found.error, found.noise_floor, told_error, account.headline, request.folder, starts, RUN_TIME)


_VERBS: dict[str, Callable[[Request, Progress], Any]] = {
    EXPLAIN: _explain,
    ADD: _add,
    FIT: _fit,
    AUTO: _auto,
    COMPARE: _compare,
}
