"""The scene of trials without a search, for robots with and without feet, floor and base."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from finding_samples import ROBOTS, logs_of, robot
from viewing_samples import contents_of, rows_of

from ee_dist.engines.drivers import Commands
from ee_dist.recording.records import HARDWARE, RunRecord, TrialRecord
from ee_dist.viewing.rerun_scene import write_rrd


@pytest.mark.parametrize("name", ROBOTS)
def test_trials_of_any_robot_are_told_and_drawn(name: str, tmp_path: Path) -> None:
    body = robot(name)
    ((slow, quick),) = logs_of([body], (0.6, 0.3))
    run = RunRecord(body, {"task": "trial", "seal": "abc", "noise": "0.02"}, complete=True)
    run.trials += [
        TrialRecord(k, w, HARDWARE, Commands(g.commands), g)
        for k, (w, g) in enumerate((("slow", slow), ("quick", quick)))
    ]
    write_rrd(run, tmp_path / "trial.rrd")
    text = rows_of(tmp_path / "trial.rrd", "texts/result", "TextDocument:text")[1][0][0]
    assert f"| 1. slow | 1.2 | {len(slow)} | {len(slow.sensor_names)} |" in text
    assert "sealed: nothing here tells it" in text
    assert "Noise 2 % of each channel's range." in text
    layout = "\n".join(contents_of(tmp_path / "trial.rrd", blueprint=True))
    for wrong in ("nan", "cut short", "generation", "Orange"):
        assert wrong not in text + layout
    assert ("Green" in text) == any(s.kind == "touch" for s in body.sensors)
    channel = body.sensor_names[-1]
    _, values = rows_of(tmp_path / "trial.rrd", f"sensors/{channel}/measured", "Scalars:scalars")
    np.testing.assert_array_equal([v[0] for v in values][: len(slow)], slow.channel(channel))
    for kind in {s.kind for s in body.sensors}:
        assert kind.capitalize().replace("_", " ") in layout


def test_a_recording_that_was_cut_says_so_in_words_that_fit(tmp_path: Path) -> None:
    write_rrd(RunRecord(robot("linear_stage"), {"task": "trial"}), tmp_path / "cut.rrd")
    text = rows_of(tmp_path / "cut.rrd", "texts/result", "TextDocument:text")[1][0][0]
    assert "cut short: its program did not reach its end" in text
