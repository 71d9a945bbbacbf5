"""Explain: one click, what is being tried, then the ranking, with what speaks for each and its mark in the residual."""

from __future__ import annotations

from nicegui import ui

from ee_dist.discrepancy.words import placed
from ee_dist.workbench import charts, verbs
from ee_dist.workbench.pages.curves import Curves
from ee_dist.workbench.pages.plot import Plot
from ee_dist.workbench.pages.view import View, heading, of, quiet
from ee_dist.workbench.results import REFUSED, Ranked
from ee_dist.workbench.worker import STARTING

WORDS = {"best": "Best", "tied": "Tied with the best", "earned": "Earned its place", "not": "Refused"}
STAGES = {"screening": "screened", "scanning": "scanned over their range", "fitting": "fitted and judged"}


class ExplainView(View):
    name, icon = "Explain", "search"
    topics = frozenset({"explained", "progress", "seen", "place", "look"})

    def build(self) -> None:
        self.chosen = 0
        with ui.element("section").classes("card"):
            with ui.row().classes("items-center"):
                ui.button("What is missing?", icon="search", on_click=lambda: self.page.begin(verbs.EXPLAIN)).props(
                    "no-caps"
                ).mark("explain-start")
                quiet("Every effect of the catalogue at every place, judged on data that it was not fitted to.")
            self.stages = quiet().mark("stages")
            self.headline = ui.label("").style("font-weight:600").mark("finding")
            self.lines = ui.column().classes("gap-0")
        with ui.element("div").classes("two") as self.found:
            with ui.element("section").classes("card"):
                heading("Ranked, with 95 % intervals")
                self.ranking = Plot()
                self.list = ui.column().classes("w-full gap-0")
            with ui.element("section").classes("card stays"):
                heading("Its mark in the residual")
                self.mark_note = quiet()
                self.curves = Curves(self.page)
        self.found.set_visibility(False)

    async def draw(self, topics: set[str]) -> None:
        session, found = self.session, self.session.explained
        progress = session.progress
        if progress is not None and progress.request.verb == verbs.EXPLAIN:
            done = [f"{STAGES.get(w, w)} ({s:.0f} s)" for w, s in progress.stages if w != STARTING]
            self.stages.set_text(f"Now {progress.what}. Done: {', '.join(done) or 'nothing yet'}.")
        elif "progress" in topics:
            self.stages.set_text("")
        self.found.set_visibility(found is not None and bool(found.candidates))
        if found is None:
            self.headline.set_text("")
            self.lines.clear()
            return
        if "explained" in topics:
            self.chosen = 0
            self.headline.set_text(found.headline)
            self.lines.clear()
            with self.lines:
                for line in found.lines:
                    quiet(line)
            self.list.clear()
            with self.list:
                for k, c in enumerate(found.candidates):
                    self._candidate(k, c)
            if found.candidates:
                self.ranking.draw(
                    charts.ranking(
                        [placed(c.name) for c in found.candidates],
                        [c.explained for c in found.candidates],
                        [c.interval for c in found.candidates],
                        [c.kind for c in found.candidates],
                    )
                )
        if found.candidates and topics & {"explained", "place", "look", "chosen"}:
            await self._mark(found.candidates[min(self.chosen, len(found.candidates) - 1)])

    def _candidate(self, k: int, c: Ranked) -> None:
        refused = c.kind == REFUSED
        with ui.element("div").classes("entry w-full" + (" refused" if refused else "")):
            ui.label(f"{k + 1}. {c.words}").style("font-weight:600")
            why = f": {c.why_not}" if refused else ""
            quiet(f"{WORDS[c.kind]}{why}. {c.sure[:1].upper()}{c.sure[1:]}.")
            quiet(c.physics)
            with ui.row().classes("gap-2"):
                ui.button("Its mark", on_click=lambda: self._choose(k)).props("dense flat no-caps")
                ui.button("Add", on_click=lambda: self._add(c)).props("dense outline no-caps").mark(f"add-{k}")
                if len(c.terms) == 1:
                    ui.button("Add and fit", on_click=lambda: self._fit(c)).props("dense outline no-caps").mark(
                        f"addfit-{k}"
                    )

    async def _choose(self, k: int) -> None:
        self.chosen = k
        await self.draw({"chosen"})

    async def _mark(self, c: Ranked) -> None:
        session, place, found = self.session, self.page.place, self.session.explained
        sight = session.sight
        if sight is None or place is None or found is None:
            return
        before = await of(session.do(sight.series, found.before, place))
        after = await of(session.do(sight.series, c.model, place))
        if before is None or after is None or len(before.predicted) != len(after.predicted):
            return
        self.mark_note.set_text(f"{placed(c.name)}: {c.signature}")
        self.curves.draw(before, ("what it would account for", after.predicted - before.predicted), after.predicted)

    async def _add(self, c: Ranked) -> None:
        await self.page.act(self._adding, c)
        self.page.show("Add")

    def _adding(self, c: Ranked) -> None:
        for t in c.terms:
            self.session.add(t.name, dict(t.values))

    async def _fit(self, c: Ranked) -> None:
        self.page.show("Watch")
        await self.page.begin(verbs.ADD, c.terms[0].name)
