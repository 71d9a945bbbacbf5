"""What all scenes of the loop share, whatever ran: trials with the models beside them, texts, the course of the search."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import rerun as rr
import rerun.blueprint as rrb

from ee_dist.recording.records import DIAGNOSIS, HINDSIGHT, PREDICTION, REPAIR, RunRecord, TrialRecord
from ee_dist.recovery.kinds import subject_of
from ee_dist.viewing import blueprint, palette, search_curves, story
from ee_dist.viewing.channels import Model, Shot
from ee_dist.viewing.stream import interval_s, log_digest, starts_of
from ee_dist.viewing.text import document

ZERO = "texts/zero"
FITNESS = "search/distance"
SAID = {
    PREDICTION: Model(palette.PREDICTED_NAME, "expected before", palette.PREDICTED),
    HINDSIGHT: Model(palette.HINDSIGHT_NAME, "explained after", palette.HINDSIGHT),
}
"""The models of a run: that which a controller was chosen on, and that of the diagnosis after its trial."""


@dataclass(frozen=True)
class Course:
    """Trials on the hardware, each with its start in the scene (s) and the models' trials beside it; ``said`` are all trials by
    source and index."""

    trials: list[TrialRecord]
    said: Mapping[tuple[str, int], TrialRecord]
    beside: list[list[TrialRecord]]
    starts: list[float]

    @property
    def models(self) -> list[Model]:
        return [SAID[s] for s in SAID if any((s, t.index) in self.said for t in self.trials)]

    @property
    def shots(self) -> list[Shot]:
        return [
            Shot(t.name, s, t.log, {SAID[m.source].key: m.log for m in own})
            for t, s, own in zip(self.trials, self.starts, self.beside, strict=True)
        ]

    @property
    def end_s(self) -> float:
        return self.starts[-1] + interval_s(self.trials[-1].log)


def course_of(run: RunRecord) -> Course:
    trials = [t for t in story.hardware_trials(run) if len(t.log)]
    said = {(t.source, t.index): t for t in run.trials if len(t.log)}
    beside = [[said[s, t.index] for s in SAID if (s, t.index) in said] for t in trials]
    starts = starts_of([(t.index, [t.log, *(m.log for m in own)]) for t, own in zip(trials, beside, strict=True)])
    return Course(trials, said, beside, starts)


def identity_of(run: RunRecord) -> list[str]:
    """What a recording of a run is told by."""
    return [run.robot.digest, repr(sorted(run.metadata.items())), *(log_digest(t.log) for t in run.trials)]


def send_texts(stream: rr.RecordingStream, run: RunRecord) -> None:
    for place, text in (("texts/result", story.result_text(run)), ("texts/details", story.details_text(run))):
        stream.log(place, document(text), static=True)


def layout(run: RunRecord, course: Course, left: rrb.Container | None) -> rrb.Blueprint:
    """What is to be seen of the trials to the ``left`` of texts and search, the trials' lane below; None: there are no trials."""
    text = rrb.Tabs(
        rrb.TextDocumentView(origin="/texts/result", name="Result"),
        rrb.TextDocumentView(origin="/texts/details", name="Details"),
        active_tab=0,
    )
    search = search_views(run)
    if left is None:
        return blueprint.framed(rrb.Horizontal(*search, text))
    right = rrb.Vertical(text, *search, row_shares=[18, 5, 5][: 1 + len(search)])
    whole = rrb.Horizontal(left, right, column_shares=[5, 3])
    return blueprint.framed(rrb.Vertical(whole, blueprint.chapters(course.end_s), row_shares=[10, 1]))


def send_search(stream: rr.RecordingStream, run: RunRecord) -> None:
    """Bars of each generation, or a line where there is nothing but zeros."""
    of = {phase: [g for g in run.generations if g.phase == phase] for phase in (REPAIR, DIAGNOSIS)}
    for phase, own in of.items():
        if own and not search_curves.anything(own):
            text = f"It was 0 in each of the {len(own)} generations of {phase}."
            stream.log(f"{ZERO}/{phase}", document(text), static=True)
    search_curves.send_curve(stream, FITNESS, of[REPAIR], "repair")
    search_curves.send_curve(stream, "search/error", of[DIAGNOSIS], "diagnosis", story.beliefs(run))


def search_views(run: RunRecord) -> list[rrb.View]:
    """The course of the search; only what has anything to show."""
    views: list[rrb.View] = []
    for phase, origin, name in (
        (REPAIR, f"/{FITNESS}", f"Repair: best {subject_of(run.robot).heading}, generation by generation"),
        (DIAGNOSIS, "/search/error", "Diagnosis: least error (violet: of what was believed)"),
    ):
        own = [g for g in run.generations if g.phase == phase]
        if search_curves.anything(own):
            views.append(blueprint.bars(origin, name))
        elif own:
            # Bars of nothing but zeros would be an empty panel.
            views.append(rrb.TextDocumentView(origin=f"{ZERO}/{phase}", name=name))
    return views
