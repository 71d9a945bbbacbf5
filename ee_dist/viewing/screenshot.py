"""Pictures of a recording without a screen, and what its views complain about."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from ee_dist.viewing.headless import HeadlessViewer, check_recording
from ee_dist.viewing.stream import RUN_TIME

SIZE = (1600, 1000)


@dataclass(frozen=True)
class Picture:
    """A PNG of the viewer at ``time_s``, and the warnings and errors of its views ("view: severity: summary")."""

    time_s: float
    png: bytes
    reports: tuple[str, ...]
    views: tuple[str, ...]
    """Names of the views that the blueprint has."""


def take_pictures(
    rrd_path: str | Path,
    times_s: Sequence[float],
    *,
    timeline: str = RUN_TIME,
    size: tuple[int, int] = SIZE,
    view: str | None = None,
) -> list[Picture]:
    """One picture for each time, by one viewer; of one ``view`` by its name, or else of the whole window.

    Raises ViewerError, where no viewer or no graphics driver is installed or the recording cannot be shown.
    """
    check_recording(rrd_path)
    with HeadlessViewer(size) as viewer:
        viewer.open(rrd_path)
        viewer.hide_menu()
        pictures = []
        for time_s in times_s:
            viewer.go_to(timeline, time_s)
            png = viewer.settled_picture(view)
            views = viewer.state.views
            reports = tuple(f"{v.name}: {r.severity}: {r.summary}" for v in views for r in v.reports)
            pictures.append(Picture(time_s, png, reports, tuple(v.name for v in views)))
        return pictures


def take_picture(rrd_path: str | Path, time_s: float, *, view: str | None = None) -> Picture:
    """One picture of the whole window at a time of the run."""
    return take_pictures(rrd_path, [time_s], view=view)[0]
