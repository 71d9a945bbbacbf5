"""The scene of a run, read back: what it shows is what the run says."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from rerun.chunk import RrdReader
from viewing_samples import LOST_FOOT, LOST_LEG, NAMES, STEPS, contents_of, rows_of, sample_run

from ee_dist.discrepancy import words
from ee_dist.effects import apply
from ee_dist.effects.catalogue import Term, term
from ee_dist.engines.loop import gravity_vector
from ee_dist.recording.clock import RunClock
from ee_dist.recording.reader import read_run
from ee_dist.recording.records import HARDWARE, HINDSIGHT, PREDICTION, RunRecord, TrialRecord
from ee_dist.recording.writer import RunWriter
from ee_dist.robots.kinematics import part_poses
from ee_dist.viewing import story
from ee_dist.viewing.palette import FOOT, PASSES, TOUCHING
from ee_dist.viewing.rerun_scene import APPLICATION, write_rrd
from ee_dist.viewing.world import BESIDE_M, LOOK_AHEAD_M

PERIOD_S = (STEPS - 1) * 0.01 + 1.0
"""From the begin of one trial to the next: its last row, and a second."""


def trial(run: RunRecord, index: int, source: str) -> TrialRecord:
    return next(t for t in run.trials if t.index == index and t.source == source)


@pytest.mark.parametrize("source", [HARDWARE, PREDICTION])
@pytest.mark.parametrize("channel", ["touch_rear_left", "angle_front_right"])
def test_sensor_values_and_times_are_those_of_the_logs(run: RunRecord, rrd: Path, source: str, channel: str) -> None:
    name = {"hardware": "measured", "prediction": "predicted"}[source]
    times, values = rows_of(rrd, f"sensors/{channel}/{name}", "Scalars:scalars")
    flat = np.array([v[0] for v in values])
    for k in range(len(NAMES)):
        log = trial(run, k, source).log
        rows = slice(k * (STEPS + 1), (k + 1) * (STEPS + 1))
        np.testing.assert_array_equal(flat[rows][:-1], log.channel(channel))
        np.testing.assert_allclose(times[rows][:-1], k * PERIOD_S + log.times_s, atol=1e-9)
        assert np.isnan(flat[rows][-1]), "a line must end with its trial"
    assert len(flat) == len(NAMES) * (STEPS + 1)


def test_hindsight_is_kept_apart_from_the_forecast(run: RunRecord, rrd: Path) -> None:
    """One trial has both: what was expected before it and what the diagnosis after it makes of it."""
    _, values = rows_of(rrd, "sensors/angle_rear_left/predicted_after", "Scalars:scalars")
    log = trial(run, 1, HINDSIGHT).log
    np.testing.assert_array_equal([v[0] for v in values][:-1], log.channel("angle_rear_left"))
    assert not np.array_equal(log.channel("angle_rear_left"), trial(run, 1, PREDICTION).log.channel("angle_rear_left"))
    _, labels = rows_of(rrd, "sensors/angle_rear_left/predicted_after", "SeriesLines:names")
    assert labels == [["explained after"]]
    assert rows_of(rrd, "sensors/angle_rear_left/predicted", "SeriesLines:names")[1] == [["expected before"]]
    assert drawn_in(rrd, "world/predicted_after/upper_front_left/capsule_0", "Capsules3D:lengths") == [
        False,
        True,
        False,
    ]


def test_errors_that_are_all_zero_are_told_instead_of_drawn(run: RunRecord, tmp_path: Path) -> None:
    flat = [replace(g, best=0.0) if g.phase == "diagnosis" else g for g in run.generations]
    write_rrd(replace(run, generations=flat), tmp_path / "zero.rrd")
    text = rows_of(tmp_path / "zero.rrd", "texts/zero/diagnosis", "TextDocument:text")[1][0][0]
    assert text == "It was 0 in each of the 5 generations of diagnosis."
    told = "\n".join(contents_of(tmp_path / "zero.rrd", blueprint=True))
    assert "'texts/zero/diagnosis'" in told.replace("'/texts", "'texts")
    assert "search/error" not in told


def test_a_believed_error_follows_the_generations_of_its_pass(rrd: Path) -> None:
    at = rows_of(rrd, "search/error/believed", "BarChart:abscissa")[1][0][0]["buffer"]
    own = rows_of(rrd, "search/error/diagnosis_1", "BarChart:abscissa")[1][0][0]["buffer"]
    assert rows_of(rrd, "search/error/believed", "BarChart:values")[1][0][0]["buffer"] == [0.15]
    assert at[0] > own[-1]


def test_commands_are_those_of_the_hardware(run: RunRecord, rrd: Path) -> None:
    _, values = rows_of(rrd, "commands/knee_rear_left", "Scalars:scalars")
    column = run.robot.motor_names.index("knee_rear_left")
    for k in range(len(NAMES)):
        own = np.array([v[0] for v in values[k * (STEPS + 1) : (k + 1) * (STEPS + 1) - 1]])
        np.testing.assert_array_equal(own, trial(run, k, HARDWARE).log.commands[:, column])


def test_trials_stand_where_an_mcap_recording_puts_them(run: RunRecord, rrd: Path) -> None:
    clock = RunClock()
    starts = [clock.trial(k, round((STEPS - 1) * 1e7)) / 1e9 for k in range(len(NAMES))]
    times, states = rows_of(rrd, "trial", "StateChange:state")
    assert [t for t, s in zip(times, states, strict=True) if s] == pytest.approx(starts)
    travelled = [trial(run, k, HARDWARE).log.travel_m for k in range(len(NAMES))]
    assert [s[0] for s in states if s] == [f"{n}: {d:.2f} m" for n, d in zip(NAMES, travelled, strict=True)]


@pytest.mark.parametrize(("source", "aside"), [("measured", 0.0), ("predicted", BESIDE_M)])
def test_parts_are_where_kinematics_puts_them(run: RunRecord, rrd: Path, source: str, aside: float) -> None:
    times, places = rows_of(rrd, f"world/{source}/lower_rear_left", "Transform3D:translation")
    _, turns = rows_of(rrd, f"world/{source}/lower_rear_left", "Transform3D:quaternion")
    log = trial(run, 0, HARDWARE if source == "measured" else PREDICTION).log
    assert log.base_pose is not None
    assert log.joints is not None
    expected = part_poses(run.robot, log.base_pose, log.joints)["lower_rear_left"]
    own = times < PERIOD_S - 0.5
    rows = np.round(times[own] / 0.01).astype(int)
    assert {0, STEPS - 1} <= set(rows.tolist())
    assert 25 <= len(rows) / (STEPS * 0.01) <= 50
    place = np.array([p[0] for p in places])[own]
    np.testing.assert_allclose(place, expected[rows, :3] + [0.0, aside, 0.0], atol=1e-6)
    np.testing.assert_allclose(np.array([q[0] for q in turns])[own], expected[rows, 3:], atol=1e-6)


def drawn_in(rrd: Path, entity: str, component: str) -> list[bool]:
    """Whether a solid is there in each trial."""
    times, values = rows_of(rrd, entity, component)
    if not len(times):
        return [True] * len(NAMES)
    np.testing.assert_allclose(times, [k * PERIOD_S for k in range(len(NAMES))])
    return [bool(v) for v in values]


def test_lost_parts_are_not_drawn(rrd: Path) -> None:
    capsule, ball = "Capsules3D:lengths", "Ellipsoids3D:half_sizes"
    assert drawn_in(rrd, "world/measured/upper_front_left/capsule_0", capsule) == [True, False, False]
    assert drawn_in(rrd, "world/measured/lower_front_left/sphere_0", ball) == [True, False, False]
    assert drawn_in(rrd, "world/predicted/upper_front_left/capsule_0", capsule) == [True, True, True]
    assert drawn_in(rrd, "world/predicted/lower_rear_right/sphere_0", ball) == [True, True, False]
    assert drawn_in(rrd, "world/measured/lower_rear_right/sphere_0", ball) == [True, True, True]


def test_a_part_without_a_truth_is_drawn_whole(run: RunRecord, tmp_path: Path) -> None:
    secret = replace(run, metadata={"scenario": "3"})
    write_rrd(secret, tmp_path / "secret.rrd")
    assert drawn_in(tmp_path / "secret.rrd", "world/measured/upper_front_left/capsule_0", "Capsules3D:lengths") == [
        True,
        True,
        True,
    ]
    text = rows_of(tmp_path / "secret.rrd", "texts/result", "TextDocument:text")[1][0][0]
    assert "not known" in text


def test_the_camera_goes_along_with_the_robot_and_leans_to_the_prediction(run: RunRecord, rrd: Path) -> None:
    times, points = rows_of(rrd, "world/camera_focus", "Points3D:positions")
    for k in range(len(NAMES)):
        own = (times > k * PERIOD_S - 0.01) & (times < (k + 1) * PERIOD_S - 0.5)
        rows = np.round((times[own] - k * PERIOD_S) / 0.01).astype(int)
        bodies = [trial(run, k, source).log.base_pose for source in (HARDWARE, PREDICTION)]
        assert bodies[0] is not None
        assert bodies[1] is not None
        focus = np.array([p[0] for p in points])[own]
        lean = np.clip((bodies[1][rows, 0] - bodies[0][rows, 0]) / 2, -LOOK_AHEAD_M, LOOK_AHEAD_M)
        np.testing.assert_allclose(focus[:, 0], bodies[0][rows, 0] + lean, atol=1e-6)
        np.testing.assert_allclose(focus[:, 1], bodies[0][rows, 1] + BESIDE_M / 2, atol=1e-6)
        assert np.ptp(focus[:, 2]) == 0.0, "bobbing of the body must not shake the picture"


def test_the_floor_is_marked_at_every_metre_of_the_way(run: RunRecord, tmp_path: Path) -> None:
    first = trial(run, 0, HARDWARE)
    assert first.log.base_pose is not None
    far = first.log.base_pose.copy()
    far[:, 0] += np.linspace(0.0, 2.3, len(far))
    write_rrd(replace(run, trials=[replace(first, log=replace(first.log, base_pose=far))]), tmp_path / "far.rrd")
    labels = rows_of(tmp_path / "far.rrd", "world/marks/labels", "Points3D:labels")[1][0]
    assert labels == ["start", "1 m", "2 m", "3 m"]


def test_the_track_ends_where_the_body_went(run: RunRecord, rrd: Path) -> None:
    times, strips = rows_of(rrd, "world/measured/track", "LineStrips3D:strips")
    last = strips[np.searchsorted(times, PERIOD_S - 0.5) - 1][0]
    pose = trial(run, 0, HARDWARE).log.base_pose
    assert pose is not None
    np.testing.assert_allclose(np.array(last)[-1, :2], pose[-1, :2], atol=1e-6)
    np.testing.assert_allclose(np.array(last)[0, :2], pose[0, :2], atol=1e-6)


def test_feet_are_coloured_while_they_touch(run: RunRecord, rrd: Path) -> None:
    times, colours = rows_of(rrd, "world/measured/lower_rear_left/sphere_0", "Ellipsoids3D:colors")
    shown = np.array([c[0] >> 8 for c in colours])
    for k in range(len(NAMES)):
        log = trial(run, k, HARDWARE).log
        at = np.searchsorted(times, k * PERIOD_S + log.times_s + 1e-6) - 1
        green, dark = (c[0] << 16 | c[1] << 8 | c[2] for c in (TOUCHING, FOOT))
        np.testing.assert_array_equal(shown[at], np.where(log.channel("touch_rear_left") > 0, green, dark))


def test_a_colour_that_changes_is_not_hidden_by_a_static_one(rrd: Path) -> None:
    times, _ = rows_of(rrd, "world/measured/lower_rear_left/sphere_0", "Ellipsoids3D:colors")
    assert len(times) > 3


def test_lanes_tell_when_a_foot_is_on_the_floor(run: RunRecord, rrd: Path) -> None:
    times, states = rows_of(rrd, "touch/rear_left/measured", "StateChange:state")
    log = trial(run, 1, HARDWARE).log
    at = np.searchsorted(times, PERIOD_S + log.times_s + 1e-6) - 1
    assert [states[i][0] for i in at] == ["ground" if v > 0 else "air" for v in log.channel("touch_rear_left")]
    assert not states[np.searchsorted(times, 2 * PERIOD_S - 0.5) - 1], "between two trials there is no state"


def test_search_curves(run: RunRecord, rrd: Path) -> None:
    for where, phase, passes in (("distance/repair", "repair", 3), ("error/diagnosis", "diagnosis", 1)):
        last = -1.0
        for p in range(passes):
            values = rows_of(rrd, f"search/{where}_{p + 1}", "BarChart:values")[1][0][0]
            axis = rows_of(rrd, f"search/{where}_{p + 1}", "BarChart:abscissa")[1][0][0]
            best = [g.best for g in run.generations if g.phase == phase and g.pass_index == p]
            assert values["buffer"] == best
            assert np.diff(axis["buffer"]).tolist() == [1.0] * (len(best) - 1)
            assert axis["buffer"][0] > last
            last = axis["buffer"][-1]


def test_bars_have_colours_that_mean_nothing_else_and_the_text_says_which(run: RunRecord, rrd: Path) -> None:
    shades = [rows_of(rrd, f"search/distance/repair_{p + 1}", "BarChart:color")[1][0][0] for p in range(3)]
    coded = [sum(v << shift for v, shift in zip((*c, 255), (24, 16, 8, 0), strict=True)) for c in PASSES]
    assert shades == [coded[0], coded[1], coded[0]]
    text = rows_of(rrd, "texts/result", "TextDocument:text")[1][0][0]
    assert "**Grey bars**: the best of each generation, from 0" in text and "**violet**: the error of what was" in text


def test_a_line_at_zero_tells_bars_below_it_from_bars_above(run: RunRecord, rrd: Path, tmp_path: Path) -> None:
    """Gaits that go backwards at first. The line is a bar of next to no height, from the first generation to the last."""
    shown = rows_of(rrd, "texts/result", "TextDocument:text")[1][0][0]
    assert not any("search/distance/zero" in line for line in contents_of(rrd)) and "white line" not in shown
    back = [replace(g, best=g.best - 1.0) if g.phase == "repair" else g for g in run.generations]
    write_rrd(replace(run, generations=back), tmp_path / "back.rrd")
    best = [g.best for g in back if g.phase == "repair"]
    assert min(best) < 0
    height, across, begins = (
        rows_of(tmp_path / "back.rrd", "search/distance/zero", f"BarChart:{part}")[1][0][0]
        for part in ("values", "widths", "abscissa")
    )
    assert 0 < height["buffer"][0] < 0.05 * (max(0.0, *best) - min(best)) and begins["buffer"] == [0.0]
    ends = [
        rows_of(tmp_path / "back.rrd", f"search/distance/repair_{p}", "BarChart:abscissa")[1][0][0] for p in (1, 2, 3)
    ]
    assert across == max(e["buffer"][-1] for e in ends) + 1
    assert not any("search/error/zero" in line for line in contents_of(tmp_path / "back.rrd"))
    assert "a **white line** is at 0" in rows_of(tmp_path / "back.rrd", "texts/result", "TextDocument:text")[1][0][0]


def test_the_first_lines_tell_what_was_found_how_sure_and_what_next(run: RunRecord, rrd: Path) -> None:
    text = rows_of(rrd, "texts/result", "TextDocument:text")[1][0][0]
    first = [line for line in text.splitlines() if line][1:5]
    last = max((h for h in run.hypotheses if h.final), key=lambda h: h.pass_index)
    assert first[0] == f"**Believed in the end: {story.told(last.terms)}.**"
    best = max((t for t in run.trials if t.source == HARDWARE and t.index >= 2), key=lambda t: t.log.travel_m)
    assert first[1].startswith(f"Best trial: {best.name}, {best.log.travel_m:.2f} m")
    foreseen = trial(run, max(t.index for t in run.trials), PREDICTION).log.travel_m
    assert f"by {last.error:.3g} (0 is exact); it foresaw {foreseen:.2f} m" in first[2]


def test_the_text_tells_distances_beliefs_and_truth(run: RunRecord, rrd: Path) -> None:
    text = rows_of(rrd, "texts/result", "TextDocument:text")[1][0][0]
    for k, name in enumerate(NAMES):
        expected = trial(run, k, PREDICTION).log.travel_m
        line = next(line for line in text.splitlines() if line.startswith(f"| {name} |"))
        assert f"{trial(run, k, HARDWARE).log.travel_m:.2f}" in line
        assert f"{expected:.2f}" in line
    explained = trial(run, 1, HINDSIGHT).log.travel_m
    assert f"| {trial(run, 1, PREDICTION).log.travel_m:.2f} | {explained:.2f} |" in text
    assert "- Diagnosis 1 (error 0.15, as evolved 0.2): part lost at lower rear right" in text
    assert "**Truth: part lost at upper front left**" in text
    assert "cut short" not in text
    details = rows_of(rrd, "texts/details", "TextDocument:text")[1][0][0]
    assert "| evolved | 0.9 | nothing changed |" in details
    assert "| pruned (believed) | 0.15 | part lost at lower rear right |" in details


def test_the_blueprint_is_in_the_file_and_names_its_views(rrd: Path) -> None:
    reader = RrdReader(rrd)
    assert [s.application_id for s in reader.recordings()] == [APPLICATION]
    assert [s.application_id for s in reader.blueprints()] == [APPLICATION]
    told = "\n".join(contents_of(rrd, blueprint=True))
    for name in ("Feet on the floor", "angle front left", "Commands (rad)", "Result", "Diagnosis: least error"):
        assert name in told
    assert "world/camera_focus" in told
    assert "run_time" in told


def test_equal_runs_give_equal_recordings(rrd: Path, tmp_path: Path) -> None:
    again = tmp_path / "again.rrd"
    write_rrd(sample_run(), again)
    assert contents_of(again) == contents_of(rrd)
    assert contents_of(again, blueprint=True) == contents_of(rrd, blueprint=True)
    assert RrdReader(again).recordings() == RrdReader(rrd).recordings()


def test_the_mcap_alone_gives_the_same_recording(run: RunRecord, rrd: Path, tmp_path: Path) -> None:
    with RunWriter(tmp_path / "run.mcap", run.robot, run.metadata) as writer:
        for t in run.trials:
            writer.trial(t)
        for g in run.generations:
            writer.generation(g)
        writer.hypotheses(run.hypotheses)
    write_rrd(read_run(tmp_path / "run.mcap"), tmp_path / "again.rrd")
    assert contents_of(tmp_path / "again.rrd") == contents_of(rrd)


def test_another_run_has_another_id(run: RunRecord, rrd: Path, tmp_path: Path) -> None:
    other = replace(run, metadata=run.metadata | {"seed": "1"})
    write_rrd(other, tmp_path / "other.rrd")
    ids = {RrdReader(p).recordings()[0].recording_id for p in (rrd, tmp_path / "other.rrd")}
    assert len(ids) == 2


def test_a_slope_shows_where_gravity_pulls(run: RunRecord, tmp_path: Path) -> None:
    slope = json.dumps([{"effect": "floor_tilt", "target": "floor", "sideways_deg": 20.0}])
    tilted = replace(run, metadata={"truth": slope})
    write_rrd(tilted, tmp_path / "slope.rrd")
    times, vectors = rows_of(tmp_path / "slope.rrd", "world/measured/gravity", "Arrows3D:vectors")
    arrow = np.array(vectors[np.searchsorted(times, PERIOD_S + 0.5)][0])
    model = run.robot.with_world(tilt_x_rad=np.radians(20.0))
    np.testing.assert_allclose(arrow / np.linalg.norm(arrow), np.array(gravity_vector(model)) / 9.81, atol=1e-6)
    assert vectors[0] == [], "before the change the floor is level"


def test_hardware_that_knows_neither_poses_nor_predictions(run: RunRecord, tmp_path: Path) -> None:
    bare = [
        replace(t, log=replace(t.log, base_pose=None, joints=None, torques=None))
        for t in run.trials
        if t.source == HARDWARE
    ]
    path = tmp_path / "bare.rrd"
    write_rrd(replace(run, trials=bare, hypotheses=[], generations=[]), path)
    _, places = rows_of(path, "world/measured/body", "Transform3D:translation")
    np.testing.assert_allclose([p[0] for p in places], [run.robot.start_position_m] * len(places), atol=1e-6)
    # Angle sensors tell how the hips stand, so the legs still move.
    _, turns = rows_of(path, "world/measured/upper_rear_left", "Transform3D:quaternion")
    assert np.ptp([q[0][2] for q in turns]) > 0.01


def test_rows_without_numbers_are_left_out(run: RunRecord, tmp_path: Path) -> None:
    first = trial(run, 0, HARDWARE)
    assert first.log.base_pose is not None
    holes = first.log.base_pose.copy()
    holes[40:80] = np.nan
    broken = replace(first, log=replace(first.log, base_pose=holes))
    write_rrd(replace(run, trials=[broken]), tmp_path / "holes.rrd")
    times, places = rows_of(tmp_path / "holes.rrd", "world/measured/body", "Transform3D:translation")
    assert np.isfinite([p[0] for p in places]).all()
    assert not ((times >= 0.4) & (times < 0.8)).any()


def test_a_run_that_ended_before_its_first_trial(run: RunRecord, tmp_path: Path) -> None:
    write_rrd(replace(run, trials=[], complete=False), tmp_path / "early.rrd")
    assert "cut short" in rows_of(tmp_path / "early.rrd", "texts/result", "TextDocument:text")[1][0][0]


def test_a_failure_leaves_the_old_file_and_no_part(
    run: RunRecord, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "run.rrd"
    path.write_bytes(b"old")

    def fail(*_: object) -> None:
        raise ValueError("on purpose")

    monkeypatch.setattr("ee_dist.viewing.channels.send_commands", fail)
    with pytest.raises(ValueError, match="on purpose"):
        write_rrd(run, path)
    assert path.read_bytes() == b"old"
    assert [p.name for p in tmp_path.iterdir()] == ["run.rrd"]


def test_an_effect_that_is_not_loaded_here_is_still_told(run: RunRecord, tmp_path: Path) -> None:
    foreign = json.dumps([{"effect": "sticky_oil", "target": "knee_rear_left", "amount": 0.5}])
    write_rrd(replace(run, metadata={"truth": foreign}), tmp_path / "foreign.rrd")
    text = rows_of(tmp_path / "foreign.rrd", "texts/result", "TextDocument:text")[1][0][0]
    assert "sticky oil at knee rear left (amount 0.5)" in text


def test_amounts_are_told_as_titles_and_other_verbs_tell_them() -> None:
    jam, slower = term("joint_jam", "knee_rear_left", loss=0.5), Term("decay_altered", "G3", (("change", -0.25),))
    assert story.told((jam,)) == words.told(jam) == "joint jam at knee rear left (loss 50 %)"
    assert story.told((jam, slower)).endswith("; decay altered at G3 (change -25 %)"), "those of other systems too"


def test_the_sample_loses_what_it_should(run: RunRecord) -> None:
    # Guards the tests above: they mean something only if truth and belief differ.
    lost = {apply(run.robot, LOST_LEG).lost, apply(run.robot, LOST_FOOT).lost}
    assert len(lost) == 2
