"""Several searches side by side: what they ask for while each of them waits is simulated in one call.

A step of a batch of five robots takes more than half as long as one of twenty, and a search from a good start asks for few at a
time. Each goes on by itself, in a greenlet, until it asks for something; one at a time does, in the same order always, so that
nothing depends on when. Results of rollouts do not depend on what they ran with: each finds what it would find alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextvars import ContextVar, copy_context
from typing import Any, TypeVar

from greenlet import getcurrent, greenlet

from ee_dist.evaluation.jobs import Job

T = TypeVar("T")
Evaluate = Callable[[Sequence[Job]], list[Any]]


_one_of_them: ContextVar[bool] = ContextVar("one of several searches", default=False)
"""Whether what goes on now is one."""


def side_by_side(searches: Sequence[Callable[[], T]]) -> list[T]:
    """What each of some functions returns. What one of them raises is raised here, and the others end where they are."""
    if len(searches) < 2:
        return [search() for search in searches]
    lanes = [greenlet(search) for search in searches]
    found: dict[int, T] = {}
    waiting: dict[int, tuple[Evaluate, Sequence[Job]]] = {}

    def go_on(k: int, *answer: list[Any]) -> None:
        said = lanes[k].switch(*answer)
        if lanes[k].dead:
            found[k] = said
        else:
            waiting[k] = said

    try:
        for k, lane in enumerate(lanes):
            # How NumPy treats numbers that are none belongs to the context too.
            context = copy_context()
            context.run(_one_of_them.set, True)
            lane.gr_context = context
            go_on(k)
        while waiting:
            asked = dict(waiting)
            waiting.clear()
            for k, answer in _answers(asked).items():
                go_on(k, answer)
    finally:
        for lane in lanes:
            if lane:
                lane.throw()
    return [found[k] for k in range(len(lanes))]


def ask(evaluate: Evaluate, jobs: Sequence[Job]) -> list[Any]:
    """The results of ``evaluate``: of all that is asked of it side by side, where this is a search among others."""
    if not _one_of_them.get():
        return evaluate(jobs)
    found: list[Any] = getcurrent().parent.switch((evaluate, jobs))
    return found


def _answers(asked: dict[int, tuple[Evaluate, Sequence[Job]]]) -> dict[int, list[Any]]:
    """By who asked, in that order: what several ask of one evaluator is one call."""
    answers: dict[int, list[Any]] = {}
    for evaluate in dict.fromkeys(e for e, _ in asked.values()):
        mine = {k: jobs for k, (e, jobs) in asked.items() if e == evaluate}
        results = iter(ask(evaluate, [job for jobs in mine.values() for job in jobs]))
        answers |= {k: [next(results) for _ in jobs] for k, jobs in mine.items()}
    return {k: answers[k] for k in asked}
