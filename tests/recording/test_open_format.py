"""What other programs see: the plain mcap package, Foxglove's frames, protobuf schemas."""

from __future__ import annotations

import json
import re
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


def test_what_was_not_measured_stays_at_its_start_and_a_part_that_is_nowhere_has_no_frame() -> None:
    robot = quadruped()
    body = frames(trial(base_pose=None))[-1][1]["hardware/body"].translation
    assert (body.x, body.y, body.z) == pytest.approx(robot.start_position_m, abs=1e-3)
    # Angle sensors tell how the hips stand where the joints were not recorded.
    hips = [f[1]["hardware/upper_rear_left"].rotation.z for f in frames(trial(joints=None, base_pose=None))]
    assert np.ptp(hips) > 0.01
    assert len(frames(trial(rows=1, motor_names=tuple("abcdefgh")))) == 1
    joints = np.zeros((1, 8))
    joints[0, 0] = np.nan
    missing = {"hardware/upper_front_left", "hardware/lower_front_left"}
    assert missing.isdisjoint(frames(trial(rows=1, joints=joints))[0][1])


def test_a_slow_log_is_shown_row_by_row() -> None:
    assert len(frames(trial(rows=10, times_s=np.arange(10.0)))) == 10


# -- solids ------------------------------------------------------------------------------------------------------------


def test_a_recording_opens_with_solids_in_the_frames_that_move(make_file: Callable[[], Path], run: RunRecord) -> None:
    path = make_file()
    for source, lost in (("hardware", ()), ("prediction", LOST_LEG)):
        scenes, moves = decoded(path, f"/{source}/scene"), decoded(path, f"/{source}/transforms")
        assert len(scenes) == 2, "one a trial"
        for scene in scenes:
            framed = {e.frame_id: e for e in scene.entities}
            assert set(framed) <= {t.child_frame_id for t in moves[0].transforms} | {
                t.child_frame_id for t in moves[-1].transforms
            }
            assert set(framed) == {
                f"{source}/{p.name}" for p in run.robot.parts if p.name not in apply(run.robot, lost).lost
            }
            assert all(e.frame_locked and e.lifetime.nanos == 990_000_000 for e in scene.entities)
    body = next(e for e in decoded(path, "/hardware/scene")[0].entities if e.id == "hardware/body")
    shape = run.robot.root.shapes[0]
    assert [body.cubes[0].size.x, body.cubes[0].size.y, body.cubes[0].size.z] == [2 * h for h in shape.size]
    assert body.cubes[0].color.a == 1.0
    leg = next(e for e in decoded(path, "/hardware/scene")[0].entities if e.id == "hardware/upper_rear_left")
    (rod,), balls = leg.cylinders, leg.spheres
    ends = np.array([[b.pose.position.x, b.pose.position.y, b.pose.position.z] for b in balls])
    assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(rod.size.z)
    assert (rod.bottom_scale, rod.top_scale) == (1.0, 1.0)
    assert all(b.size.x == rod.size.x for b in balls)


def test_the_layout_for_foxglove_asks_for_what_a_recording_has(make_file: Callable[[], Path]) -> None:
    layout = json.loads((Path(__file__).parents[2] / "docs" / "foxglove_layout.json").read_text())
    with make_file().open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        assert summary is not None
        topics = {c.topic for c in summary.channels.values()}
        shown = [d.decoded_message for d in reader.iter_decoded_messages() if d.schema.name.startswith("foxglove.")]
    moved = [t for m in shown for t in getattr(m, "transforms", ())]
    frames = {f for t in moved for f in (t.parent_frame_id, t.child_frame_id)}
    bodies = {e.frame_id for m in shown for e in getattr(m, "entities", ())}
    assert bodies and bodies <= frames, "what is drawn is drawn in frames that move"
    # Of a run with a diagnosis after its trials; the sample has none.
    topics |= {f"/hindsight/{what}" for what in ("rows", "scene", "transforms")}
    fields = {f.name for f in schemas.Row.DESCRIPTOR.fields} | {f.name for f in schemas.Generation.DESCRIPTOR.fields}
    panels = layout["configById"]
    asked = [t for p in panels.values() for t in p.get("topics", {})]
    asked += [p["topicPath"] for p in panels.values() if "topicPath" in p]
    views = [p for p in panels.values() if "followTf" in p]
    assert views
    assert {v["followTf"] for v in views} | {g["frameId"] for v in views for g in v["layers"].values()} <= frames
    paths = [line["value"] for p in panels.values() for line in p.get("paths", [])]
    assert asked
    assert paths
    assert set(asked) <= topics
    for path in paths:
        topic, _, field = path.partition(".")
        assert topic in topics
        assert field.split("[")[0] in fields
    assert set(re.findall(r'"(\w+!\w+)"', json.dumps(layout["layout"]))) == set(panels)


# -- schemas -----------------------------------------------------------------------------------------------------------

FOLDER = Path(schemas.__file__).parent


@pytest.mark.skipif(shutil.which("protoc") is None, reason="needs protoc")
@pytest.mark.parametrize("name", ["ee_dist.proto", "foxglove.proto"])
def test_our_reading_of_a_schema_is_that_of_protoc(name: str, tmp_path: Path) -> None:
    well_known = tmp_path / "google" / "protobuf"
    well_known.mkdir(parents=True)
    for message in ("Timestamp", "Duration"):
        (well_known / f"{message.lower()}.proto").write_text(
            f'syntax = "proto3"; package google.protobuf; message {message} {{ int64 seconds = 1; int32 nanos = 2; }}'
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


def test_solids_have_the_numbers_that_foxglove_gave_them() -> None:
    entity = {f.name: f.number for f in schemas.SceneEntity.DESCRIPTOR.fields}
    assert entity == {
        "timestamp": 1, "frame_id": 2, "id": 3, "lifetime": 4, "frame_locked": 5, "cubes": 8, "spheres": 9, "cylinders": 10,
    }  # fmt: skip
    assert schemas.SceneUpdate.DESCRIPTOR.fields_by_name["entities"].number == 2
    numbers = {name: {f.name: f.number for f in schemas.MESSAGES[f"foxglove.{name}"].DESCRIPTOR.fields}
               for name in ("Pose", "Color", "CubePrimitive", "SpherePrimitive", "CylinderPrimitive")}  # fmt: skip
    assert numbers["Pose"] == {"position": 1, "orientation": 2}
    assert numbers["Color"] == {"r": 1, "g": 2, "b": 3, "a": 4}
    assert numbers["CubePrimitive"] == numbers["SpherePrimitive"] == {"pose": 1, "size": 2, "color": 3}
    assert numbers["CylinderPrimitive"] == {"pose": 1, "size": 2, "bottom_scale": 3, "top_scale": 4, "color": 5}


@pytest.mark.parametrize(
    "line", ["enum Colour {", "message A {\n oneof b {", "message A {\n int7 b = ;", "double x = 1;"]
)
def test_a_construct_that_we_do_not_read_is_refused(line: str) -> None:
    with pytest.raises(ValueError, match=r"x\.proto, line \d: not understood"):
        schemas.parse_proto("x.proto", line)
