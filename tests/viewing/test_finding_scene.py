"""Scenes of compare, explain and improve, read back, for a hinge, a slide, an arm and a walker."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from finding_samples import ROBOTS, finding
from rerun.chunk import RrdReader
from viewing_samples import chunks_of, contents_of, rows_of

from ee_dist.viewing.finding import Finding
from ee_dist.viewing.finding_scene import write_compare_rrd, write_explain_rrd, write_improve_rrd
from ee_dist.viewing.finding_text import bar, channel_table, ladder_table

WRITERS = (write_compare_rrd, write_explain_rrd, write_improve_rrd)
found = functools.cache(finding)


def text_of(path: Path) -> str:
    return rows_of(path, "texts/result", "TextDocument:text")[1][0][0]


@pytest.mark.parametrize("name", ROBOTS)
@pytest.mark.parametrize("write", WRITERS)
def test_the_first_text_tells_verdict_error_floor_and_what_to_do_next(
    name: str, write: Callable[[Finding, Path], None], tmp_path: Path
) -> None:
    f = found(name)
    write(f, tmp_path / "scene.rrd")
    text = text_of(tmp_path / "scene.rrd")
    assert f"**{f.verdict}**" in text
    assert all(line in text for line in f.lines) and len(f.lines) == 2
    assert f"Next: `{f.next_command}`" in text
    told = text + "\n".join(contents_of(tmp_path / "scene.rrd", blueprint=True))
    for wrong in ("nan", "cut short", "forward", "enerations"):
        assert wrong not in told, "a scene of measurements tells of no gait, no search and no missing number"
    assert ("foot" in told or "Feet" in told) is False


@pytest.mark.parametrize("name", ROBOTS)
def test_compare_has_its_channels_worst_first_and_plays_where_the_error_is_largest(name: str, tmp_path: Path) -> None:
    f = found(name)
    write_compare_rrd(replace(f, better=None), tmp_path / "scene.rrd")
    rows = [line.split(" | ") for line in text_of(tmp_path / "scene.rrd").splitlines() if "■" in line]
    ranked = [c for c in f.worst_first if c.error > 0]
    assert [r[3] for r in rows] == [c.name.replace("_", " ") for c in ranked]
    worst = ranked[0]
    k = [c.name for c in f.cases].index(worst.worst_case)
    start = 0.0 if k == 0 else float(f.cases[0].measured.times_s[-1]) + 1.0
    middle = start + (worst.worst_from_s + worst.worst_to_s) / 2
    (selected,) = selection(tmp_path / "scene.rrd")
    assert selected[0] <= middle <= selected[1]
    seconds = f.cases[k].measured.times_s
    assert start <= selected[0] and selected[1] <= start + float(seconds[-1] + seconds[1]) + 1e-6, (
        "not beyond the trial"
    )
    assert 1.0 <= selected[1] - selected[0] <= 2.01


def test_a_trial_has_the_name_of_its_log_in_the_scene(tmp_path: Path) -> None:
    f = found("servo_pendulum")
    cases = tuple(replace(c, name=f"slow_sines_{k}") for k, c in enumerate(f.cases))
    channels = tuple(replace(c, worst_case="slow_sines_0") for c in f.channels)
    write_compare_rrd(replace(f, cases=cases, channels=channels, better=None), tmp_path / "scene.rrd")
    assert "| slow_sines_0, " in text_of(tmp_path / "scene.rrd")


def selection(path: Path) -> list[tuple[float, float]]:
    """Stretches of time that play is to repeat, s."""
    found = []
    for chunk in chunks_of(path, blueprint=True):
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if "time_selection" in name:
                found += [(v[0]["min"] / 1e9, v[0]["max"] / 1e9) for v in batch.column(name).to_pylist() if v]
    return found


def test_lines_and_what_is_left_are_those_of_the_logs(tmp_path: Path) -> None:
    f = found("servo_pendulum")
    write_improve_rrd(f, tmp_path / "scene.rrd")
    assert f.better is not None
    for key, account in (("predicted", f.model), ("predicted_1", f.better)):
        times, values = rows_of(tmp_path / "scene.rrd", f"residuals/speed/{key}", "Scalars:scalars")
        rows = [min(len(c.measured), len(g)) for c, g in zip(f.cases, account.logs, strict=True)]
        rest = [
            np.append(c.measured.channel("speed")[:n] - g.channel("speed")[:n], np.nan)
            for c, g, n in zip(f.cases, account.logs, rows, strict=True)
        ]
        np.testing.assert_array_equal([v[0] for v in values], np.concatenate(rest))
        second = float(f.cases[0].measured.times_s[-1]) + 1.0
        np.testing.assert_allclose(times[rows[0] + 1], second, atol=1e-6)
    assert rows_of(tmp_path / "scene.rrd", "sensors/speed/predicted", "SeriesLines:names")[1] == [["the model"]]


def test_candidates_can_be_switched_between_and_the_chosen_stand_out(tmp_path: Path) -> None:
    f = found("arm")
    write_explain_rrd(f, tmp_path / "scene.rrd")
    layout = "\n".join(contents_of(tmp_path / "scene.rrd", blueprint=True))
    for tab in ("1. coulomb friction at turn", "2. load friction at turn", "The model"):
        assert tab in layout
    text = text_of(tmp_path / "scene.rrd")
    # What may be wider than the window stands last: the viewer cuts it there.
    first, third = (next(x for x in text.splitlines() if x.startswith(f"| {k} |")) for k in (1, 3))
    assert first.startswith("| 1 | 93 % |") and first.endswith("| **coulomb friction at turn (torque 0.31 N.m)** |")
    assert third.startswith("| 3 | 20 % |") and third.endswith("| viscous friction at turn (0.02 N.m.s/rad) |")
    for k, c in enumerate(c for c in f.candidates if c.account):
        _, values = rows_of(tmp_path / "scene.rrd", f"sensors/turn_angle/predicted_{k + 1}", "Scalars:scalars")
        assert c.account is not None
        np.testing.assert_array_equal(
            [v[0] for v in values][: len(c.account.logs[0])], c.account.logs[0].channel("turn_angle")
        )


def test_the_ladder_falls_to_the_floor(tmp_path: Path) -> None:
    f = found("linear_stage")
    write_improve_rrd(f, tmp_path / "scene.rrd")
    text = text_of(tmp_path / "scene.rrd")
    first = next(line for line in text.splitlines() if line.startswith("| 0 |"))
    last = next(line for line in text.splitlines() if line.startswith("| 1 |"))
    floor = next(line for line in text.splitlines() if "noise alone" in line and line.startswith("|"))
    assert "| from 0 | in the fit |" in text, "where the bars begin"
    assert first.count("■") > last.count("■") >= floor.count("■") >= 1
    on = [replace(r, held_out="other windows") for r in f.ladder]
    text = "\n".join(ladder_table(replace(f, ladder=tuple(on))))
    assert text.count("other windows") == 1 and text.endswith("Held out: other windows.")
    on.append(replace(on[1], held_out="motions"))
    text = "\n".join(ladder_table(replace(f, ladder=tuple(on))))
    assert "(held out: motions) |" in text and "Held out:" not in text
    assert channel_table(replace(f, rms_of="means over 0.02 s"))[-1] == "RMS: of means over 0.02 s."


def test_errors_that_are_all_zero_are_told_instead_of_drawn(tmp_path: Path) -> None:
    f = found("servo_pendulum")
    exact = replace(f, channels=tuple(replace(c, error=0.0, rmse=0.0) for c in f.channels), better=None)
    write_compare_rrd(exact, tmp_path / "zero.rrd")
    assert "All 2 channels agree exactly: every error is 0." in text_of(tmp_path / "zero.rrd")
    assert bar(0.0, 0.0) == "" == bar(0.0, 1.0)
    assert len(bar(1e-9, 1.0)) == 1


def test_a_slide_gets_a_carriage_that_moves_and_a_hinge_turns(tmp_path: Path) -> None:
    write_compare_rrd(found("linear_stage"), tmp_path / "stage.rrd")
    _, places = rows_of(tmp_path / "stage.rrd", "world/measured/carriage", "Transform3D:translation")
    assert np.ptp([p[0][0] for p in places]) > 0.005
    write_compare_rrd(found("servo_pendulum"), tmp_path / "pendulum.rrd")
    _, turns = rows_of(tmp_path / "pendulum.rrd", "world/predicted/arm", "Transform3D:quaternion")
    assert np.ptp([q[0][1] for q in turns]) > 0.02


def test_a_model_without_a_body_and_trials_without_rows_are_left_out(tmp_path: Path) -> None:
    f = found("servo_pendulum")
    first = replace(f.cases[0], measured=f.cases[0].measured.head(0))
    bare = replace(f, cases=(first, f.cases[1]), model=replace(f.model, body=None), better=None)
    write_compare_rrd(bare, tmp_path / "bare.rrd")
    assert not [c for c in chunks_of(tmp_path / "bare.rrd") if c.entity_path.startswith("/world/predicted")]
    assert (
        len(rows_of(tmp_path / "bare.rrd", "sensors/speed/measured", "Scalars:scalars")[1])
        == len(f.cases[1].measured) + 1
    )
    none = replace(f, cases=(), model=replace(f.model, logs=()), better=None, candidates=())
    write_improve_rrd(none, tmp_path / "none.rrd")
    assert "the model" in text_of(tmp_path / "none.rrd")


def test_an_account_must_tell_of_every_trial() -> None:
    f = found("servo_pendulum")
    with pytest.raises(ValueError, match="says something of 1 trials; there are 2"):
        replace(f, model=replace(f.model, logs=f.model.logs[:1]))


@pytest.mark.parametrize("write", WRITERS)
def test_equal_findings_give_equal_recordings_of_an_application_each(
    write: Callable[[Finding, Path], None], tmp_path: Path
) -> None:
    for name in ("a.rrd", "b.rrd"):
        write(found("servo_pendulum"), tmp_path / name)
    assert contents_of(tmp_path / "a.rrd") == contents_of(tmp_path / "b.rrd")
    assert contents_of(tmp_path / "a.rrd", blueprint=True) == contents_of(tmp_path / "b.rrd", blueprint=True)
    reader = RrdReader(tmp_path / "a.rrd")
    verb = write.__name__.split("_")[1]
    assert {s.application_id for s in (*reader.recordings(), *reader.blueprints())} == {f"ee_dist_{verb}"}
