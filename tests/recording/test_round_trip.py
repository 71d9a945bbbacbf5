"""What is read is what was written, in every bit."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from recording_samples import bits, sample_log, write

from ee_dist.effects.catalogue import Term
from ee_dist.engines.drivers import Commands, Network
from ee_dist.recording.errors import RecordingError
from ee_dist.recording.reader import read_logs, read_run
from ee_dist.recording.records import (
    HARDWARE,
    PREDICTION,
    GenerationRecord,
    HypothesisRecord,
    RunRecord,
    TrialRecord,
)
from ee_dist.recording.topics import PHASES, SOURCES
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.quadruped import quadruped
from ee_dist.trials.log import SensorLog

FLOATS = st.floats(allow_nan=True, allow_infinity=True)
TEXTS = st.text(st.characters(exclude_categories=["Cs"]), max_size=8)
WHOLE = st.integers(-(2**40), 2**40)
TERMS = st.lists(
    st.builds(Term, TEXTS, TEXTS, st.lists(st.tuples(TEXTS, FLOATS), max_size=3).map(tuple)), max_size=3
).map(tuple)


@st.composite
def logs(draw: st.DrawFn) -> SensorLog:
    rows, sensors, motors = draw(st.tuples(st.integers(0, 5), st.integers(0, 3), st.integers(0, 3)))

    def table(*shape: int) -> np.ndarray:
        return draw(arrays(np.float64, shape, elements=FLOATS))

    def perhaps(*shape: int) -> np.ndarray | None:
        return table(*shape) if draw(st.booleans()) else None

    def names(count: int) -> tuple[str, ...]:
        return tuple(draw(st.lists(TEXTS, min_size=count, max_size=count)))

    return SensorLog(
        times_s=table(rows),
        sensors=table(rows, sensors),
        commands=table(rows, motors),
        sensor_names=names(sensors),
        sensor_units=names(sensors),
        motor_names=names(motors),
        base_pose=perhaps(rows, 7),
        joints=perhaps(rows, motors),
        torques=perhaps(rows, motors),
        supply_v=perhaps(rows),
        travel_m=draw(FLOATS),
    )


NETWORKS = st.lists(FLOATS, max_size=5).map(lambda w: Network(tuple(w)))
COMMANDS = arrays(np.float64, st.tuples(st.integers(0, 3), st.integers(0, 3)), elements=FLOATS).map(Commands)
NAMES = st.lists(TEXTS, max_size=3).map(tuple)
TRIALS = st.builds(TrialRecord, WHOLE, TEXTS, st.sampled_from(SOURCES), NETWORKS | COMMANDS, logs(), TERMS, NAMES)
HYPOTHESES = st.builds(HypothesisRecord, WHOLE, WHOLE, WHOLE, TERMS, FLOATS, st.booleans())
GENERATIONS = st.builds(GenerationRecord, st.sampled_from(PHASES), WHOLE, WHOLE, FLOATS, FLOATS, WHOLE, WHOLE, WHOLE)


@settings(max_examples=60, deadline=None)
@given(st.lists(TRIALS, max_size=3), st.lists(HYPOTHESES, max_size=3), st.lists(GENERATIONS, max_size=3))
def test_any_records_come_back_in_every_bit(
    trials: list[TrialRecord], hypotheses: list[HypothesisRecord], generations: list[GenerationRecord]
) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        with RunWriter(path, quadruped()) as writer:
            for trial in trials:
                writer.trial(trial)
            writer.hypotheses(hypotheses)
            for generation in generations:
                writer.generation(generation)
        found = read_run(path)
    assert found.complete
    assert bits(tuple(found.trials)) == bits(tuple(trials))
    assert bits(tuple(found.hypotheses)) == bits(tuple(hypotheses))
    assert bits(tuple(found.generations)) == bits(tuple(generations))


@settings(max_examples=25, deadline=None)
@given(st.dictionaries(TEXTS, TEXTS, max_size=3), st.dictionaries(TEXTS, st.binary(max_size=20), max_size=3))
def test_metadata_and_attachments_come_back(metadata: dict[str, str], attachments: dict[str, bytes]) -> None:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "run.mcap"
        with RunWriter(path, quadruped(), metadata, attachments) as writer:
            writer.finish({"added": "last"})
        found = read_run(path)
    assert found.metadata == {**metadata, "added": "last"}
    assert found.attachments == attachments


@pytest.mark.parametrize("number", ["-0.0", "inf", "-inf", "nan", "5e-324", "0.1"])
def test_a_special_number_comes_back_in_every_place(tmp_path: Path, number: str) -> None:
    x = float(number)
    row = np.full((2, 1), x)
    log = SensorLog(
        row[:, 0].copy(), row, row, ("s",), ("",), ("m",), np.full((2, 7), x), row, row, row[:, 0].copy(), travel_m=x
    )
    terms = (Term("e", "t", (("p", x),)),)
    with RunWriter(tmp_path / "run.mcap", quadruped()) as writer:
        writer.trial(TrialRecord(0, "n", HARDWARE, Network((x,)), log, terms))
        writer.trial(TrialRecord(0, "c", PREDICTION, Commands(row), log))
        writer.hypothesis(HypothesisRecord(0, 0, 0, terms, x))
        writer.generation(GenerationRecord("repair", 0, 0, x, x, 0, 0, 0))
    found = read_run(tmp_path / "run.mcap")
    assert bits(found.trials[0]) == bits(TrialRecord(0, "n", HARDWARE, Network((x,)), log, terms))
    assert bits(found.trials[1]) == bits(TrialRecord(0, "c", PREDICTION, Commands(row), log))
    assert bits(found.hypotheses[0]) == bits(HypothesisRecord(0, 0, 0, terms, x))
    assert bits(found.generations[0]) == bits(GenerationRecord("repair", 0, 0, x, x, 0, 0, 0))


def test_a_whole_run_comes_back(tmp_path: Path, run: RunRecord) -> None:
    found = read_run(write(tmp_path / "run.mcap", run))
    assert found.complete
    assert found.robot == run.robot
    assert found.robot.digest == run.robot.digest
    assert found.metadata == {**run.metadata, "result_digest": "abc"}
    assert found.attachments == run.attachments
    assert bits(tuple(found.trials)) == bits(tuple(run.trials))
    assert found.hypotheses == run.hypotheses
    assert found.generations == run.generations


def test_a_long_trial_over_several_chunks_comes_back(tmp_path: Path) -> None:
    trial = TrialRecord(0, "long", HARDWARE, Network((0.5,)), sample_log(3, rows=6000))
    with RunWriter(tmp_path / "run.mcap", quadruped()) as writer:
        writer.trial(trial)
    assert bits(read_run(tmp_path / "run.mcap").trials[0]) == bits(trial)


def test_numbers_of_numpy_are_as_good_as_plain_ones(tmp_path: Path) -> None:
    one, half = np.int64(1), np.float64(0.5)
    with RunWriter(tmp_path / "run.mcap", quadruped()) as writer:
        writer.trial(TrialRecord(one, "t", HARDWARE, Network((half,)), sample_log(0, rows=3)))  # type: ignore[arg-type]
        terms = (Term("motor_weak", "hip_rear_left", (("loss", half),)),)
        writer.hypothesis(HypothesisRecord(one, one, one, terms, half, np.bool_(True)))  # type: ignore[arg-type]
        writer.generation(GenerationRecord("repair", one, one, half, half, one, one, one))  # type: ignore[arg-type]
    found = read_run(tmp_path / "run.mcap")
    assert found.trials[0].driver == Network((0.5,))
    assert found.hypotheses[0].final is True
    assert found.generations[0] == GenerationRecord("repair", 1, 1, 0.5, 0.5, 1, 1, 1)


def test_logs_are_the_hardware_trials_alone(tmp_path: Path, run: RunRecord) -> None:
    path = write(tmp_path / "run.mcap", run)
    assert bits(tuple(read_logs(path))) == bits(tuple(t for t in run.trials if t.source == HARDWARE))


def test_logs_of_a_file_without_hardware_are_refused(tmp_path: Path, run: RunRecord) -> None:
    path = tmp_path / "run.mcap"
    with RunWriter(path, run.robot) as writer:
        writer.trial(next(t for t in run.trials if t.source == PREDICTION))
    with pytest.raises(RecordingError, match="no whole hardware trial"):
        read_logs(path)
