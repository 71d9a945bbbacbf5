"""What the scenes of all runs of the loop share, whatever ran: models beside a trial, and the course of the search."""

from __future__ import annotations

import rerun as rr
import rerun.blueprint as rrb

from ee_dist.recording.records import DIAGNOSIS, HINDSIGHT, PREDICTION, REPAIR, RunRecord
from ee_dist.recovery.kinds import subject_of
from ee_dist.viewing import blueprint, palette, search_curves, story
from ee_dist.viewing.channels import Model
from ee_dist.viewing.text import document

ZERO = "texts/zero"
FITNESS = "search/distance"
SAID = {
    PREDICTION: Model(palette.PREDICTED_NAME, "expected before", palette.PREDICTED),
    HINDSIGHT: Model(palette.HINDSIGHT_NAME, "explained after", palette.HINDSIGHT),
}
"""The models of a run: that which a controller was chosen on, and that of the diagnosis after its trial."""


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
