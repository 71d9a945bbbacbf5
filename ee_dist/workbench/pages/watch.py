"""Watch: the error falls, fitted and held out apart; what helps only where it was fitted is refused, in sight."""

from __future__ import annotations

from dataclasses import replace

from nicegui import ui

from ee_dist.discrepancy.problem import Problem
from ee_dist.tasks.results.labels import axis_of, drawn
from ee_dist.workbench import charts
from ee_dist.workbench.bench import Step
from ee_dist.workbench.pages.plot import Plot
from ee_dist.workbench.pages.view import View, heading, quiet


class WatchView(View):
    name, icon = "Watch", "trending_down"
    topics = frozenset({"model", "seen", "progress"})

    def build(self) -> None:
        with ui.element("section").classes("card"):
            heading("The ladder of errors")
            quiet(
                "Squares: on data that the values were not fitted to. Circles: where they were fitted. A hand that watches "
                "the error has seen all the data, so what it sets (diamonds) has no held-out error: judge and fit it to get one."
            )
            self.plot = Plot()
            self.steps = ui.column().classes("w-full gap-0").mark("ladder")

    async def draw(self, topics: set[str]) -> None:
        session = self.session
        if session.sight is None or session.seen is None:
            return
        ladder, problem = session.bench.ladder, session.sight.problem
        told, floor = problem.told, drawn(problem, session.seen.found.noise_floor)
        shown = [replace(s, error_fit=drawn(problem, s.error_fit), error_heldout=_drawn(problem, s)) for s in ladder]
        self.plot.draw(charts.ladder(shown, floor, axis_of(problem)))
        self.steps.clear()
        with self.steps:
            for s in ladder:
                with ui.element("div").classes("entry w-full" + (" refused" if s.refused else "")):
                    held = (
                        "nothing was held out"
                        if s.error_heldout is None
                        else f"held out {told(s.error_heldout)} ({s.held_out})"
                    )
                    ui.label(f"{s.name}: fitted {told(s.error_fit)}, {held}")
                    if s.refused:
                        ui.label(f"Refused: {s.refused}.").style("font-weight:600")


def _drawn(problem: Problem, step: Step) -> float | None:
    return None if step.error_heldout is None else drawn(problem, step.error_heldout)
