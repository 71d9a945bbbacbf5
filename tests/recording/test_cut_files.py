"""Killed, broken, cut, damaged and foreign files: what is whole comes back, and nothing looks complete that is not."""

from __future__ import annotations

import os
import signal
import struct
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import zstandard
from mcap.data_stream import RecordBuilder
from mcap.reader import make_reader
from mcap.records import Chunk
from mcap.writer import Writer
from recording_samples import bits, record, sample_log, write

from ee_dist.engines.drivers import Network
from ee_dist.recording.contents import read_contents
from ee_dist.recording.errors import RecordingError
from ee_dist.recording.forms import FORMS
from ee_dist.recording.reader import read_logs, read_run
from ee_dist.recording.records import HARDWARE, RunRecord, TrialRecord
from ee_dist.recording.repair import repair
from ee_dist.recording.topics import PROFILE
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.model import Robot

KILLED = """
import sys, time
sys.path.insert(0, {tests!r})
from recording_samples import sample_run
from ee_dist.recording.writer import RunWriter
run = sample_run()
writer = RunWriter({path!r}, run.robot, run.metadata)
writer.trial(run.trials[0])
writer.hypothesis(run.hypotheses[0])
writer.trial(run.trials[1])
writer.hypothesis(run.hypotheses[1])
print("recorded", flush=True)
time.sleep(60)
"""


def test_a_killed_run_keeps_everything_up_to_its_last_trial(tmp_path: Path, run: RunRecord) -> None:
    path = tmp_path / "run.mcap"
    code = KILLED.format(tests=str(Path(__file__).parent), path=str(path))
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "recorded\n"
        process.send_signal(signal.SIGKILL)
    assert process.returncode == -signal.SIGKILL
    assert not path.exists()
    found = read_run(path.with_name("run.mcap.part"))
    assert not found.complete
    assert found.robot == run.robot
    assert found.metadata == run.metadata
    assert bits(tuple(found.trials)) == bits(tuple(run.trials[:2]))
    assert found.hypotheses == run.hypotheses[:1]


def test_an_exception_leaves_the_part_with_all_records_and_no_mark(tmp_path: Path, run: RunRecord) -> None:
    path = tmp_path / "run.mcap"

    def fail() -> None:
        with RunWriter(path, run.robot) as writer:
            record(writer, run)
            writer.hypothesis(run.hypotheses[0])
            raise ZeroDivisionError

    with pytest.raises(ZeroDivisionError):
        fail()
    assert not path.exists()
    found = read_run(path.with_name("run.mcap.part"))
    assert not found.complete
    assert bits(tuple(found.trials)) == bits(tuple(run.trials))
    assert found.hypotheses == [*run.hypotheses, run.hypotheses[0]]


def test_a_file_cut_anywhere_gives_its_whole_trials_and_never_looks_complete(
    make_file: Callable[[], Path], run: RunRecord
) -> None:
    whole = make_file().read_bytes()
    cut = make_file().with_name("cut.mcap")
    counts, errors = [], []
    for length in [*range(8, len(whole), len(whole) // 80), len(whole) - 8, len(whole) - 1]:
        cut.write_bytes(whole[:length])
        try:
            found = read_run(cut)
        except RecordingError as error:
            errors.append(str(error))
            counts.append(-1)
            continue
        assert not found.complete
        assert bits(tuple(found.trials)) == bits(tuple(run.trials[: len(found.trials)]))
        assert found.hypotheses == run.hypotheses[: len(found.hypotheses)]
        counts.append(len(found.trials))
    assert counts == sorted(counts)
    assert set(counts) == {-1, 0, 1, 2, 3, 4}
    assert all(str(cut) in e and "cut off" in e and "\n" not in e for e in errors)


def test_a_trial_of_which_rows_are_missing_is_left_out(tmp_path: Path, run: RunRecord) -> None:
    path = tmp_path / "run.mcap"
    with RunWriter(path, run.robot) as writer:
        writer.trial(run.trials[0])
        writer.trial(TrialRecord(1, "long", HARDWARE, Network(()), sample_log(0, rows=8000)))
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])
    contents = read_contents(path)
    assert sum(schema == "ee_dist.Row" for schema, _ in contents.messages) > 1000, "some of its rows are there"
    assert [t.name for t in read_run(path).trials] == ["trial 0"]


def test_damage_in_the_middle_costs_what_it_hit_and_no_more(make_file: Callable[[], Path], run: RunRecord) -> None:
    path = make_file()
    whole = path.read_bytes()
    lost = []
    for place in range(len(whole) // 5, len(whole) * 4 // 5, len(whole) // 5):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 0xFF]) + whole[place + 1 :])
        found = read_run(path)
        assert not found.complete
        originals = [bits(t) for t in run.trials]
        kept = [originals.index(bits(t)) for t in found.trials]
        assert kept == sorted(kept)
        lost += [k for k in range(4) if k not in kept]
        assert len(kept) == 3
    assert len(set(lost)) > 1


def test_a_damaged_robot_is_an_error_in_one_line(make_file: Callable[[], Path]) -> None:
    path = make_file()
    path.write_bytes(path.read_bytes().replace(b'"mass_kg"', b'"mess_kg"'))
    with pytest.raises(RecordingError, match=r"attachment 'robot\.json' is damaged \(its checksum does not hold\)"):
        read_run(path)
    assert len(read_logs(path)) == 2


def test_a_robot_of_another_kind_is_an_error_in_one_line(
    make_file: Callable[[], Path], monkeypatch: pytest.MonkeyPatch
) -> None:
    for text in ('{"mess": 1}', "[" * 100_000, "nothing"):
        monkeypatch.setitem(FORMS, Robot, replace(FORMS[Robot], write=lambda _, text=text: text))
        with pytest.raises(RecordingError, match=r"robot\.json is not a robot of ours: [^\n]+$"):
            read_run(make_file())


def places(whole: bytes, count: int) -> list[int]:
    """Bits spread over the file, and one in 601 of its first and last kilobytes, where metadata and names stand."""
    bits_in_all = len(whole) * 8
    ends = [*range(0, 1024 * 8, 601), *range(bits_in_all - 4096 * 8, bits_in_all, 601)]
    return sorted({*(bits_in_all * k // count for k in range(count)), *(b for b in ends if 0 <= b < bits_in_all)})


def test_a_flipped_bit_alters_nothing_that_is_returned(make_file: Callable[[], Path], run: RunRecord) -> None:
    """Robot, settings and metadata are as they were, or the file is refused in one line, or says it is not complete."""
    path = make_file()
    whole = path.read_bytes()
    original = read_run(path)
    assert original.complete
    outcomes = {"incomplete": 0, "unharmed": 0}
    said: list[str] = []
    for place in places(whole, 90):
        flipped = bytearray(whole)
        flipped[place // 8] ^= 1 << place % 8
        path.write_bytes(bytes(flipped))
        try:
            found = read_run(path)
        except RecordingError as error:
            said.append(str(error))
            continue
        assert found.robot == original.robot
        assert found.attachments.items() <= original.attachments.items()
        assert found.metadata.items() <= original.metadata.items()
        kept = [bits(t) for t in original.trials]
        assert all(bits(t) in kept for t in found.trials)
        if found.complete:
            assert found.metadata == original.metadata and found.attachments == original.attachments
            assert bits(tuple(found.trials)) == bits(tuple(original.trials))
            assert found.hypotheses == original.hypotheses
        outcomes["unharmed" if found.complete else "incomplete"] += 1
    assert min(*outcomes.values(), len(said)) > 2, outcomes
    assert not [text for text in said if "\n" in text or not text.startswith(str(path))]


def test_damaged_metadata_are_refused_in_a_cut_file_too(make_file: Callable[[], Path]) -> None:
    path = make_file()
    path.write_bytes(path.read_bytes()[:-200].replace(b"recover", b"discover"[1:], 1))
    with pytest.raises(RecordingError, match=r"metadata record 'run' is damaged"):
        read_run(path)


def test_a_claimed_size_takes_no_memory(make_file: Callable[[], Path]) -> None:
    """A length of 2^60 in an attachment, and a chunk that would unpack to 2^40 bytes."""
    path = make_file()
    whole = path.read_bytes()
    start = whole.index(b"application/json") + len(b"application/json")
    path.write_bytes(whole[:start] + struct.pack("<Q", 2**60) + whole[start + 8 :])
    tracemalloc.start()
    with pytest.raises(RecordingError):
        read_run(path)
    chunk = Chunk(
        compression="zstd", data=zstandard.compress(bytes(1000)), message_start_time=0, message_end_time=0,
        uncompressed_crc=0, uncompressed_size=2**40,
    )  # fmt: skip
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile=PROFILE)
        writer.add_metadata("ee_dist", {"format": "1"})
        builder = RecordBuilder()
        chunk.write(builder)
        writer.finish()
        file.write(builder.end())
    with pytest.raises(RecordingError):
        read_run(path)
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 50e6


# -- repair ------------------------------------------------------------------------------------------------------------


def messages(path: Path) -> list[tuple[str, int, bytes]]:
    with path.open("rb") as file:
        return [(c.topic, m.log_time, m.data) for _, c, m in make_reader(file).iter_messages(log_time_order=False)]


def test_repair_makes_a_sound_file_of_a_cut_one(make_file: Callable[[], Path], run: RunRecord) -> None:
    path = make_file()
    original = messages(path)
    cut = path.with_name("broken.mcap.part")
    cut.write_bytes(path.read_bytes()[: path.stat().st_size * 4 // 5])
    before = cut.read_bytes()
    target = repair(cut)
    assert target.name == "broken.recovered.mcap"
    assert cut.read_bytes() == before
    found = read_run(target)
    assert not found.complete, "the run did not reach its end"
    assert found.metadata == {**run.metadata, "recovered": "true"}
    assert found.attachments == run.attachments
    assert bits(tuple(found.trials)) == bits(tuple(run.trials[: len(found.trials)]))
    assert len(found.trials) == 3
    recovered = messages(target)
    assert recovered == original[: len(recovered)], "same messages at the same times, in the same order"
    with target.open("rb") as file:
        summary = make_reader(file).get_summary()
    assert summary is not None
    assert summary.statistics is not None
    assert summary.statistics.message_count == len(recovered)


def test_repair_refuses_what_needs_none_and_its_own_source(make_file: Callable[[], Path]) -> None:
    path = make_file()
    whole = path.read_bytes()
    with pytest.raises(RecordingError, match="complete already"):
        repair(path)
    part = path.with_name("run.mcap.part")
    part.write_bytes(whole[:-100])
    with pytest.raises(RecordingError, match="must not write over"):
        repair(part, path)
    with pytest.raises(RecordingError, match="must not write over"):
        repair(part, part)
    assert path.read_bytes() == whole
    assert part.read_bytes() == whole[:-100]


# -- not ours ----------------------------------------------------------------------------------------------------------


def foreign(path: Path, profile: str, fmt: str | None = None) -> Path:
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile=profile)
        if fmt is not None:
            writer.add_metadata("ee_dist", {"format": fmt})
        writer.finish()
    return path


def refused(path: Path, *words: str) -> None:
    for read in (read_run, read_logs, repair):
        with pytest.raises(RecordingError) as caught:
            read(path)
        text = str(caught.value)
        assert "\n" not in text
        for word in (str(path), *words):
            assert word in text


def test_what_is_not_a_recording_is_refused_in_one_line(tmp_path: Path) -> None:
    (tmp_path / "empty.mcap").touch()
    (tmp_path / "text.mcap").write_text("t_s,angle\n0,1\n")
    (tmp_path / "short.mcap").write_bytes(b"\x89MC")
    (tmp_path / "magic.mcap").write_bytes(b"\x89MCAP0\r\n")
    (tmp_path / "noise.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(range(256)) * 10)
    refused(tmp_path / "missing.mcap", "no such file")
    refused(tmp_path / "empty.mcap", "empty", "expected a recording")
    refused(tmp_path / "text.mcap", "not an MCAP file", "expected a recording")
    refused(tmp_path / "short.mcap", "not an MCAP file")
    refused(tmp_path / "magic.mcap", "cut off before anything")
    refused(tmp_path / "noise.mcap")
    refused(tmp_path, "a folder")
    refused(foreign(tmp_path / "ros.mcap", "ros2"), "something else", "'ros2'", "expected profile 'ee_dist'")
    refused(foreign(tmp_path / "newer.mcap", PROFILE, "99"), "format 99", "reads formats 1 and 2")


def test_a_missing_file_points_to_its_unfinished_one(tmp_path: Path, run: RunRecord) -> None:
    os.rename(write(tmp_path / "run.mcap", run), tmp_path / "run.mcap.part")
    with pytest.raises(RecordingError, match=r"there is an unfinished recording run\.mcap\.part"):
        read_run(tmp_path / "run.mcap")
