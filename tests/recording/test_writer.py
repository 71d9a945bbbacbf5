"""How a recording comes about: names, promises, times, and errors that say what to do."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest
from mcap.reader import make_reader
from recording_samples import record, sample_log, write

from ee_dist.engines.drivers import ClosedLoop, Network
from ee_dist.recording.errors import RecordingError
from ee_dist.recording.reader import read_run
from ee_dist.recording.records import HARDWARE, RunRecord, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.quadruped import quadruped


def test_identical_records_give_identical_bytes(tmp_path: Path, run: RunRecord) -> None:
    first, second = write(tmp_path / "a.mcap", run), write(tmp_path / "b.mcap", run)
    run.hypotheses[0] = replace(run.hypotheses[0], error=0.5)
    other = write(tmp_path / "c.mcap", run)
    assert first.read_bytes() == second.read_bytes()
    assert first.read_bytes() != other.read_bytes()


def test_the_name_without_part_appears_at_finish_only(tmp_path: Path, run: RunRecord) -> None:
    path = tmp_path / "deep" / "folder" / "run.mcap"
    writer = RunWriter(path, run.robot)
    record(writer, run)
    assert not path.exists()
    assert writer.part.name == "run.mcap.part"
    writer.finish()
    assert [p.name for p in path.parent.iterdir()] == ["run.mcap"]
    assert read_run(path).complete


def test_a_recording_can_be_read_from_its_start_and_after_every_flush(tmp_path: Path, run: RunRecord) -> None:
    writer = RunWriter(tmp_path / "run.mcap", run.robot, run.metadata, run.attachments)
    found = read_run(writer.part)
    assert (found.robot, found.metadata, found.attachments) == (run.robot, run.metadata, run.attachments)
    writer.hypotheses(run.hypotheses)
    writer.flush()
    found = read_run(writer.part)
    assert found.hypotheses == run.hypotheses
    assert not found.complete
    writer.abandon()


def test_a_block_that_ends_well_is_complete(tmp_path: Path) -> None:
    with RunWriter(tmp_path / "run.mcap", quadruped()):
        pass
    assert read_run(tmp_path / "run.mcap").complete


def test_trials_stand_one_after_another_and_a_prediction_with_its_trial(tmp_path: Path, run: RunRecord) -> None:
    spans: dict[str, list[int]] = {}
    with write(tmp_path / "run.mcap", run).open("rb") as file:
        for _, channel, message in make_reader(file).iter_messages(log_time_order=False):
            spans.setdefault(channel.topic, []).append(message.log_time)
    second = 1_000_000_000
    row = second // 100
    # 100 rows of 10 ms, then two generations of 10 ms and a gap of a second.
    first, next_ = 0, 99 * row + 2 * row + second
    expected = [*range(first, first + 100 * row, row), *range(next_, next_ + 100 * row, row)]
    assert spans["/hardware/rows"] == expected
    assert spans["/prediction/rows"] == expected
    assert spans["/hardware/trial"] == spans["/prediction/trial"] == [first, next_]
    assert spans["/diagnosis/generation"][0] == 100 * row
    assert spans["/repair/generation"][0] == 101 * row


def test_times_of_day_in_a_measured_log_do_not_move_the_clock(tmp_path: Path) -> None:
    log = sample_log(0, rows=10)
    measured = replace(log, times_s=log.times_s + 2.0**30)
    with RunWriter(tmp_path / "run.mcap", quadruped()) as writer:
        writer.trial(TrialRecord(0, "measured", HARDWARE, Network(()), measured))
    with (tmp_path / "run.mcap").open("rb") as file:
        statistics = make_reader(file).get_summary().statistics  # type: ignore[union-attr]
    assert statistics is not None
    assert statistics.message_start_time == 0
    assert abs(statistics.message_end_time - 90_000_000) < 1000


def test_a_trial_of_a_thousand_rows_stays_small(tmp_path: Path) -> None:
    with RunWriter(tmp_path / "run.mcap", quadruped()) as writer:
        writer.trial(TrialRecord(0, "t", HARDWARE, Network(()), sample_log(0, rows=1000)))
    # 40 numbers of pure noise in 8 bytes each, and at most half as much again for everything else.
    assert (tmp_path / "run.mcap").stat().st_size < 1.5 * 1000 * 40 * 8


# -- errors ------------------------------------------------------------------------------------------------------------


def one_line(caught: pytest.ExceptionInfo[RecordingError], *words: str) -> None:
    text = str(caught.value)
    assert "\n" not in text
    for word in words:
        assert word in text


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("not a folder")
    with pytest.raises(RecordingError) as caught:
        RunWriter(tmp_path / "file" / "run.mcap", quadruped())
    one_line(caught, str(tmp_path / "file"), "no recording can be written there", "name a writable folder")


def test_a_full_disk_is_one_error_and_the_block_does_not_hide_it(tmp_path: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("this system has no /dev/full")
    (tmp_path / "run.mcap.part").symlink_to("/dev/full")
    with pytest.raises(RecordingError) as caught, RunWriter(tmp_path / "run.mcap", quadruped()):
        raise AssertionError("the start of the file was not written through")
    one_line(caught, "run.mcap.part", "cannot be written", "No space left")
    assert not (tmp_path / "run.mcap").exists()


def test_a_disk_that_fills_up_keeps_what_was_there(
    tmp_path: Path, run: RunRecord, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(handle: int) -> None:
        raise OSError(28, "No space left on device")

    writer = RunWriter(tmp_path / "run.mcap", run.robot)
    writer.trial(run.trials[0])
    monkeypatch.setattr("ee_dist.recording.writer.os.fsync", full)
    with pytest.raises(RecordingError, match="No space left"):
        writer.trial(run.trials[1])
    monkeypatch.undo()
    with pytest.raises(RecordingError, match="closed"):
        writer.finish()
    assert not (tmp_path / "run.mcap").exists()
    found = read_run(writer.part)
    assert not found.complete
    assert found.trials[0].name == run.trials[0].name


def test_a_closed_recording_takes_nothing_more(tmp_path: Path, run: RunRecord) -> None:
    with RunWriter(tmp_path / "run.mcap", run.robot) as writer:
        writer.finish()
        before = (tmp_path / "run.mcap").read_bytes()
        for call in (
            lambda: writer.trial(run.trials[0]),
            lambda: writer.hypotheses(run.hypotheses),
            lambda: writer.generation(run.generations[0]),
            writer.flush,
            writer.finish,
        ):
            with pytest.raises(RecordingError) as caught:
                call()
            one_line(caught, "closed")
    assert (tmp_path / "run.mcap").read_bytes() == before


def test_records_that_have_no_place_are_refused_and_the_rest_is_kept(tmp_path: Path, run: RunRecord) -> None:
    def zero() -> None:
        return None

    with RunWriter(tmp_path / "run.mcap", run.robot) as writer:
        with pytest.raises(RecordingError, match="no source 'dream'; there are: hardware, prediction"):
            writer.trial(replace(run.trials[0], source="dream"))
        with pytest.raises(RecordingError, match="ClosedLoop cannot be recorded"):
            writer.trial(replace(run.trials[0], driver=ClosedLoop("mine", zero)))  # type: ignore[arg-type]
        with pytest.raises(RecordingError, match="no phase 'dream'; there are: repair, diagnosis, map"):
            writer.generation(replace(run.generations[0], phase="dream"))
        with pytest.raises(RecordingError, match="metadata: 'seed' is 0; expected text"):
            writer.finish({"seed": 0})  # type: ignore[dict-item]
        writer.trial(run.trials[0])
    found = read_run(tmp_path / "run.mcap")
    assert found.complete
    assert len(found.trials) == 1


def test_the_name_of_the_robot_file_is_taken(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match=r"robot\.json is taken"):
        RunWriter(tmp_path / "run.mcap", quadruped(), {}, {"robot.json": b"{}"})
    assert list(tmp_path.iterdir()) == []
