"""Reports of one story name each other: by what was measured, and by where a model comes from."""

from __future__ import annotations

from pathlib import Path

import yaml

from ee_dist.tasks.results.story import links


def run(folder: Path, task: str, measured: str | list[str] | None, cwd: Path) -> Path:
    (folder / "config").mkdir(parents=True)
    (folder / "report.html").write_text("report")
    (folder / "config" / "config.yaml").write_text(yaml.safe_dump({"task": {"name": task}, "measured": measured}))
    (folder / "config" / "hydra.yaml").write_text(yaml.safe_dump({"hydra": {"runtime": {"cwd": str(cwd)}}}))
    return folder


def test_the_same_measurements_make_a_story(tmp_path: Path) -> None:
    logs = tmp_path / "logs"
    log = logs / "trial" / "trial.mcap"
    other = logs / "other.mcap"
    log.parent.mkdir(parents=True)
    log.write_bytes(b"")
    run(logs / "compare", "compare", "logs/trial", tmp_path)
    run(logs / "zweite Erklärung #2", "explain", [str(other), str(log)], tmp_path)
    run(logs / "elsewhere", "compare", str(other), tmp_path)
    run(logs / "nothing", "recover", None, tmp_path)
    broken = run(logs / "broken", "compare", "logs/trial", tmp_path)
    (broken / "config" / "config.yaml").write_text("[")
    model = run(tmp_path / "far" / "improve", "improve", "logs/trial", tmp_path) / "model.yaml"
    out = run(logs / "now", "improve", str(log), tmp_path)

    found = dict(links(out, [log], model))
    assert found == {
        "where the model comes from (improve)": "../../far/improve/report.html",
        "compare": "../compare/report.html",
        "explain (zweite Erklärung #2)": "../zweite%20Erkl%C3%A4rung%20%232/report.html",
    }


def test_a_run_alone_has_no_story(tmp_path: Path) -> None:
    assert links(tmp_path / "out", [tmp_path / "a.mcap"], tmp_path / "model.yaml") == []
