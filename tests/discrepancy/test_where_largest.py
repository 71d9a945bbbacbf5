"""The picture of where the error is largest, and the table of channels, are of the same window."""

from __future__ import annotations

import numpy as np
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.compare import compare
from ee_dist.tasks.results import sections


def test_where_the_error_is_largest_is_where_the_table_of_channels_says() -> None:
    """By root mean squares: a long window has a larger sum of squares than a shorter one in which more is wrong."""
    sample = samples()["arm"]
    problem = problem_by("open_loop", measure(sample, ()), sample.robot)
    first = problem.channel_of == 0
    sizes = np.bincount(problem.segment_of[first])
    long, short = int(np.argmax(sizes)), int(np.argmin(sizes))
    residual = np.zeros(len(problem.segment_of))
    residual[first & (problem.segment_of == long)], residual[first & (problem.segment_of == short)] = 1.9, 2.0
    assert sizes[long] * 1.9**2 > sizes[short] * 2.0**2
    overlays = sections.curves(problem, residual, [("model", ())])
    shown = sections.proof_section(problem, overlays, residual, [("model", ())])
    (report,) = (c for c in compare(problem, residual).channels if c.name == problem.channels[0])
    where = f"in trial {report.worst_trial}, {report.worst_from_s:.1f} to {report.worst_to_s:.1f} s"
    assert shown is not None and shown.heading.endswith(where)
