"""The main job end to end: the real command line, its files read back."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory
from rerun.chunk import RrdReader

from ee_dist.effects import apply
from ee_dist.effects.catalogue import from_dict
from ee_dist.engines.contract import Rollout
from ee_dist.engines.pybullet.engine import PyBulletEngine
from ee_dist.recording.reader import read_run
from ee_dist.recording.records import DIAGNOSIS, HARDWARE, PREDICTION, REPAIR
from ee_dist.recovery.doubt import doubt_from
from ee_dist.tasks.outcome import Score
from ee_dist.tasks.recover import named, verdict_of
from ee_dist.viewing.story import told

KEYS = {
    "format", "task", "version", "config_digest", "result_digest", "seed", "engine", "wall_s", "cpu_s", "scenario",
    "metric", "distance_m", "hypotheses", "fitness", "diagnosis_error", "truth", "recovered_fraction", "evaluations",
}  # fmt: skip


PASSES = 2
"""Compensating trials, each after a diagnosis: the second is of more trials than the first, as all later ones are."""


@pytest.fixture(scope="module")
def finished(tmp_path_factory, tiny):
    """One small run of scenario 8, as a user starts it."""
    folder = tmp_path_factory.mktemp("run")
    command = [sys.executable, "-m", "ee_dist", "+scenario=8", "evaluator=serial", *tiny, "budget.polish=1",
               f"budget.compensating_trials={PASSES}"]  # fmt: skip
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=300, check=False)
    assert done.returncode == 0, done.stderr
    (summary,) = folder.glob("logs/recover/*/summary.json")
    return summary.parent, done.stdout, json.loads(summary.read_text())


def test_summary_has_the_documented_keys(finished):
    _, _, summary = finished
    assert set(summary) >= KEYS
    assert len(summary["distance_m"]["trials"]) == PASSES
    assert len(summary["hypotheses"]) == PASSES
    assert [len(f) for f in summary["fitness"]] == [3] * (PASSES + 1)
    assert summary["truth"][0] == {"effect": "part_lost", "target": "upper_rear_left", "values": {}}
    counts = summary["evaluations"]
    assert counts["simulated"] < counts["asked"]
    assert counts["steps"] < counts["asked_steps"]


def test_terminal_tells_the_result_and_where_the_files_are(finished):
    folder, out, summary = finished
    for name in ("recovery.mcap", "recovery.rrd", "summary.json"):
        assert name in out
        assert (folder / name).stat().st_size > 0
    assert "after the change" in out
    assert "shares of intact, and so this verdict, say little" in " ".join(out.split()), "of a quick budget"
    assert "truth" in out
    last_lines = " ".join(out.split())
    assert ("Something is wrong that it does not say" in last_lines) == summary["doubt"]["said"]
    assert summary["result_digest"][:16] in out


@pytest.mark.parametrize(
    ("counts", "said"),
    [
        ((3, 3, 0), "3 of 3 true effects at their place, and nothing else"),
        ((2, 3, 1), "2 of 3 true effects at their place, and 1 false one"),
        ((0, 1, 2), "0 of 1 true effect at its place, and 2 false ones"),
    ],
)
def test_what_a_diagnosis_names_is_a_sentence(counts, said):
    assert named(*counts) == said


def test_a_distance_that_was_not_walked_is_no_success_of_the_verdict():
    cheats = ((), (), ("on its back",))
    said = verdict_of(cheats, Score(1.2, float("nan"), False, 1, 1, 0), known=True)
    assert said.startswith(
        "Function not restored: best trial 120 % of intact. No gait: trial 1 on its back. None walks."
    )
    assert said.endswith("Diagnosis: 1 of 1 true effect at its place, and nothing else.")
    assert "Diagnosis" not in verdict_of(cheats, Score(1.2, 0.5, False, 0, 0, 0), known=False), "of what nobody knows"


def test_plain_mcap_lists_every_trial_and_hypothesis(finished):
    folder, _, _ = finished
    counts: dict[str, int] = {}
    with (folder / "recovery.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, channel, _, _ in reader.iter_decoded_messages():
            counts[channel.topic] = counts.get(channel.topic, 0) + 1
        names = {a.name for a in reader.iter_attachments()}
    assert counts["/hardware/trial"] == PASSES + 2, "intact, after the change, the compensating ones"
    assert counts["/prediction/trial"] == PASSES + 2, "each forecast by the pass that chose its controller"
    assert counts["/hindsight/trial"] == PASSES, "each diagnosed"
    assert counts["/hardware/rows"] == (PASSES + 2) * 80
    assert counts["/repair/generation"] == (PASSES + 1) * 3
    assert counts["/diagnosis/generation"] == PASSES * 3
    assert counts["/diagnosis/hypothesis"] >= PASSES * (3 + 1)
    assert {"robot.json", "config.yaml"} <= names


def test_what_the_loop_believed_is_the_same_wherever_it_is_shown(finished):
    """In the summary, in the MCAP by the plain package, in rerun's scene, in the progress and in the terminal's table."""
    folder, out, summary = finished
    believed = [tuple(from_dict({"effect": t["effect"], "target": t["target"], **t["values"]}) for t in h)
                for h in summary["hypotheses"]]  # fmt: skip
    assert len(believed) == PASSES

    with (folder / "recovery.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        messages = [d.decoded_message for d in reader.iter_decoded_messages(topics=["/diagnosis/hypothesis"])]
    final = [m for m in messages if m.final]
    assert [[(t.effect, t.target, [(v.name, v.value) for v in t.values]) for t in m.terms] for m in final] == [
        [(t.effect, t.target, list(t.values)) for t in h] for h in believed
    ]
    assert [m.error for m in final] == summary["diagnosis_error"]
    assert {m.stage for m in messages} == {"evolving", "evolved", "polished", "pruned"}
    stages = [{m.stage: m.error for m in messages if m.pass_index == k and not m.rank and m.stage != "evolving"}
              for k in range(PASSES)]  # fmt: skip
    assert stages == summary["diagnosis_stages"]

    run = read_run(folder / "recovery.mcap")
    acted_on = {t.index: t.believed for t in run.trials if t.source == PREDICTION}
    assert [acted_on[k + 2] for k in range(PASSES)] == believed, "the model of the next controller is the one believed"

    scene = documents(folder / "recovery.rrd")["/texts/result"]
    rows = re.findall(r"^- Diagnosis \d \(error (\S+), as evolved \S+\): (.*)$", scene, re.MULTILINE)
    assert [text for _, text in rows] == [told(h) for h in believed]
    assert [float(error) for error, _ in rows] == pytest.approx(summary["diagnosis_error"], rel=1e-2)

    assert f"**Believed in the end: {told(believed[-1])}.**" in scene
    assert summary["verdict"] in scene and summary["verdict"] in " ".join(out.split()), "and what came out"
    assert summary["verdict"].startswith("Function restored" if summary["restored"] else "Function not restored")
    assert doubt_from(summary["doubt"]).words in scene, "and what it does not say"
    assert ("say little" in out) is ("say little" in scene) is (summary["budget"] == "quick")
    (again,) = re.findall(r"how much of it is luck: `(.+)`", scene)
    words = shlex.split(again)
    asked = yaml.safe_load((folder / "config" / "overrides.yaml").read_text())
    kept = [w for w in asked if not w.startswith(("hydra.", "seed=", "+scenario=", "overwrite="))]
    assert words[3] == "-m" and words[5] == "seed=0,1,2" and words[6:] == kept and "evaluator=serial" in kept

    progress = [line.split("believes: ")[1] for line in out.splitlines() if "believes: " in line]
    assert progress == [told(h) for h in believed]

    *_, head = [line for line in out.splitlines() if "what the robot believed" in line]
    column, folded = head.index("what the robot believed"), []
    for line in out.split(head)[1].split("Function ")[0].splitlines():
        if line[:column].strip() and line[column:].strip():
            folded.append([])
        if line[column:].strip() and folded:
            folded[-1].append(line[column:].strip())
    cells = [" ".join(words) for words in folded if set("".join(words)) != {"─"}]
    assert cells[1 : PASSES + 1] == [told(h).replace("; ", " ") for h in believed], "after the intact robot's"


def test_the_recipes_of_the_page_on_recordings_tell_the_same(finished, tmp_path, monkeypatch, capsys):
    folder, _, summary = finished
    (tmp_path / "run.mcap").write_bytes((folder / "recovery.mcap").read_bytes())
    monkeypatch.chdir(tmp_path)
    page = (Path(__file__).parents[2] / "docs" / "recording.md").read_text()
    recipes = [r for r in re.findall(r"```python\n(.*?)```", page, re.DOTALL) if "run.mcap.part" not in r]
    said: dict[str, object] = {}
    for recipe in recipes:
        exec(recipe, said)
    out = capsys.readouterr().out
    last = [from_dict({"effect": t["effect"], "target": t["target"], **t["values"]}) for t in summary["hypotheses"][-1]]
    assert f"{'; '.join(map(str, last))} {summary['diagnosis_error'][-1]}" in out, "by the plain package"
    assert "\n  ".join(["in the end:", *map(str, last)]) in out, "by this one"


def documents(path):
    """Texts of a rerun recording by entity."""
    found = {}
    for chunk in RrdReader(path).stream().to_chunks():
        batch = chunk.to_record_batch()
        if "TextDocument:text" in batch.schema.names:
            found[chunk.entity_path] = batch.column("TextDocument:text").to_pylist()[0][0]
    return found


def test_the_recorded_trials_are_what_the_hardware_did(finished):
    """A recorded controller on the true model gives the recorded log, bit for bit."""
    folder, _, summary = finished
    run = read_run(folder / "recovery.mcap")
    assert run.complete
    truth = [from_dict(t) for t in json.loads(run.metadata["truth"])]
    hardware = {t.index: t for t in run.trials if t.source == HARDWARE}
    engine = PyBulletEngine()
    for index in (1, PASSES + 1):
        recorded = hardware[index]
        (again,) = engine.rollout([Rollout(apply(run.robot, truth), recorded.driver, len(recorded.log), pose=True)])
        assert again.sensors.tobytes() == recorded.log.sensors.tobytes()
        assert again.base_pose.tobytes() == recorded.log.base_pose.tobytes()
    engine.close()
    assert [round(t.log.base_pose[-1, 0] - t.log.base_pose[0, 0], 12) for t in hardware.values()][2:] == [
        round(m, 12) for m in summary["distance_m"]["trials"]
    ]
    assert {t.index for t in run.trials if t.source == PREDICTION} == set(range(PASSES + 2))
    assert {g.phase for g in run.generations} == {REPAIR, DIAGNOSIS}


def test_view_rebuilds_the_scene_from_the_mcap_alone(finished, cli, tmp_path):
    folder, _, _ = finished
    alone = tmp_path / "alone.mcap"
    alone.write_bytes((folder / "recovery.mcap").read_bytes())
    outcome = cli("task=view", f"log={alone}", "task.open=false")
    assert outcome.status == 0, outcome.err
    (scene,) = outcome.folder.glob("logs/view/*/alone.rrd")
    assert scene.stat().st_size > 10_000
