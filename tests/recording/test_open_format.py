"""What other programs see: the plain mcap package, Foxglove's frames, protobuf schemas."""

from __future__ import annotations

import shutil
import subprocess
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from google.protobuf import descriptor_pb2, timestamp_pb2
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from recording_samples import LOST_LEG, sample_log

from ee_dist.effects.catalogue import Term, apply
from ee_dist.engines.drivers import Network
from ee_dist.recording import schemas
from ee_dist.recording.records import HARDWARE, PREDICTION, RunRecord, TrialRecord
from ee_dist.recording.transforms import transform_messages
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.kinematics import part_poses
from ee_dist.robots.quadruped import quadruped


def decoded(path: Path, topic: str) -> list[Any]:
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [d.decoded_message for d in reader.iter_decoded_messages(topics=[topic])]


def test_the_plain_package_lists_every_trial_and_hypothesis(make_file: Callable[[], Path], run: RunRecord) -> None:
    path = make_file()
    trials = decoded(path, "/hardware/trial")
    assert [(t.index, t.name, t.rows) for t in trials] == [(0, "trial 0", 100), (1, "trial 1", 100)]
    assert list(trials[0].sensor_names) == list(run.robot.sensor_names)
    assert set(trials[0].motor_units) == {"rad"}
    assert [t.believed[0].effect for t in decoded(path, "/prediction/trial")] == ["part_lost", "part_lost"]
    rows = [r for r in decoded(path, "/hardware/rows") if r.trial_id == trials[1].id]
    assert np.array([r.sensors for r in rows]).tobytes() == run.trials[2].log.sensors.tobytes()
    hypotheses = decoded(path, "/diagnosis/hypothesis")
    assert [(h.pass_index, h.rank, h.error, h.final) for h in hypotheses] == [
        (0, 0, 0.125, True),
        (0, 1, 0.25, False),
        (1, 0, 0.125, True),
        (1, 1, 0.25, False),
    ]
    assert [h.text for h in hypotheses[:2]] == ["part_lost at upper_front_left", ""]
    assert [g.best for g in decoded(path, "/repair/generation")] == [1.25, 1.25]


def test_a_value_of_a_hypothesis_has_its_unit(tmp_path: Path) -> None:
    from ee_dist.effects import CATALOGUE

    effect, parameter = next((e, p) for e in CATALOGUE.values() for p in e.parameters if p.unit not in ("", "1"))
    believed = (Term(effect.name, "somewhere", ((parameter.name, 0.5), ("unknown", 1.0))), Term("unknown", ""))
    with RunWriter(tmp_path / "run.mcap", quadruped()) as writer:
        writer.trial(TrialRecord(0, "t", PREDICTION, Network(()), sample_log(0, rows=2), believed))
    terms = decoded(tmp_path / "run.mcap", "/prediction/trial")[0].believed
    assert [(v.name, v.unit) for v in terms[0].values] == [(parameter.name, parameter.unit), ("unknown", "")]


def test_status_tells_a_complete_run_without_our_reader(make_file: Callable[[], Path]) -> None:
    with make_file().open("rb") as file:
        reader = make_reader(file)
        records = [(m.name, m.metadata) for m in reader.iter_metadata()]
        header = reader.get_header()
    assert "true" in [entries["complete"] for name, entries in records if name == "status"]
    assert records[1][0] == "run" and {"seed": "0", "task": "recover"}.items() <= records[1][1].items()
    assert (header.profile, header.library) == ("ee_dist", "ee_dist recording 1"), "no version of a library"


# -- frames ------------------------------------------------------------------------------------------------------------


def frames(trial: TrialRecord) -> list[tuple[int, dict[str, Any]]]:
    found = transform_messages(trial, quadruped(), start_ns=2_500_000_000)
    return [(t, {f.child_frame_id: f for f in message.transforms}) for t, message in found]


def trial(source: str = HARDWARE, rows: int = 100, **log: Any) -> TrialRecord:
    return TrialRecord(0, "t", source, Network(()), replace(sample_log(4, rows), **log))


def test_frames_are_the_parts_where_kinematics_puts_them() -> None:
    record = trial()
    log = record.log
    assert log.base_pose is not None
    assert log.joints is not None
    expected = part_poses(quadruped(), log.base_pose, log.joints)
    found = frames(record)
    assert [t for t, _ in found] == [2_500_000_000 + k * 40_000_000 for k in range(25)], "25 Hz from a log of 100 Hz"
    for k, (time, parts) in enumerate(found):
        assert set(parts) == {f"hardware/{name}" for name in expected}
        for name, pose in expected.items():
            frame = parts[f"hardware/{name}"]
            assert frame.parent_frame_id == "floor"
            assert frame.timestamp.seconds * 10**9 + frame.timestamp.nanos == time
            shift, turn = frame.translation, frame.rotation
            numbers = [shift.x, shift.y, shift.z, turn.x, turn.y, turn.z, turn.w]
            np.testing.assert_allclose(numbers, pose[4 * k], rtol=1e-6, atol=1e-6)


def test_a_prediction_is_drawn_without_the_part_that_it_believes_lost() -> None:
    whole = frames(trial(PREDICTION))[0][1]
    broken = frames(replace(trial(PREDICTION), believed=LOST_LEG))[0][1]
    assert set(whole) - set(broken) == {"prediction/upper_front_left", "prediction/lower_front_left"}
    assert apply(quadruped(), LOST_LEG).lost == ("upper_front_left", "lower_front_left")


def test_an_unknown_effect_does_not_stop_the_picture() -> None:
    record = replace(trial(PREDICTION), believed=(Term("of_a_plugin", "somewhere"),))
    assert len(frames(record)[0][1]) == 9


def test_no_picture_without_poses_and_none_of_a_part_that_is_nowhere() -> None:
    assert frames(trial(base_pose=None)) == []
    assert frames(trial(joints=None)) == []
    assert frames(trial(rows=1, motor_names=tuple("abcdefgh"))) == []
    joints = np.zeros((1, 8))
    joints[0, 0] = np.nan
    missing = {"hardware/upper_front_left", "hardware/lower_front_left"}
    assert missing.isdisjoint(frames(trial(rows=1, joints=joints))[0][1])


def test_a_slow_log_is_shown_row_by_row() -> None:
    assert len(frames(trial(rows=10, times_s=np.arange(10.0)))) == 10


# -- schemas -----------------------------------------------------------------------------------------------------------

FOLDER = Path(schemas.__file__).parent


@pytest.mark.skipif(shutil.which("protoc") is None, reason="needs protoc")
@pytest.mark.parametrize("name", ["ee_dist.proto", "foxglove.proto"])
def test_our_reading_of_a_schema_is_that_of_protoc(name: str, tmp_path: Path) -> None:
    well_known = tmp_path / "google" / "protobuf" / "timestamp.proto"
    well_known.parent.mkdir(parents=True)
    well_known.write_text(
        'syntax = "proto3"; package google.protobuf; message Timestamp { int64 seconds = 1; int32 nanos = 2; }'
    )
    output = tmp_path / "out"
    command = ["protoc", f"-I{FOLDER}", f"-I{tmp_path}", f"--descriptor_set_out={output}", name]
    subprocess.run(command, check=True)
    (expected,) = descriptor_pb2.FileDescriptorSet.FromString(output.read_bytes()).file
    assert schemas.parse_proto(name, (FOLDER / name).read_text(encoding="utf-8")) == expected


def test_frames_have_the_numbers_that_foxglove_gave_them() -> None:
    fields = schemas.FrameTransform.DESCRIPTOR.fields_by_name
    assert {n: f.number for n, f in fields.items()} == {
        "timestamp": 1,
        "parent_frame_id": 2,
        "child_frame_id": 3,
        "translation": 4,
        "rotation": 5,
    }
    assert fields["timestamp"].message_type.full_name == timestamp_pb2.Timestamp.DESCRIPTOR.full_name
    assert fields["translation"].message_type.full_name == "foxglove.Vector3"
    assert fields["rotation"].message_type.full_name == "foxglove.Quaternion"


@pytest.mark.parametrize(
    "line", ["enum Colour {", "message A {\n oneof b {", "message A {\n int7 b = ;", "double x = 1;"]
)
def test_a_construct_that_we_do_not_read_is_refused(line: str) -> None:
    with pytest.raises(ValueError, match=r"x\.proto, line \d: not understood"):
        schemas.parse_proto("x.proto", line)
