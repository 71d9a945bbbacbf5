"""The folder of a run: nothing of a user's is deleted, nothing whole is overwritten, two runs never share one."""

from __future__ import annotations

import contextlib
import errno
import resource
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

from ee_dist.evaluation.journal import Journal
from ee_dist.recording.reader import read_run
from ee_dist.tasks.compose import LONGEST_NAME, folder_name
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.folder import LOCK, claimed, free_name, kept, missing
from ee_dist.tasks.wiring import close_evaluators

FAST = ("evaluator=serial", "engine=mujoco", "budget.compensating_trials=1")


def tree(folder: Path) -> dict[str, bytes | None]:
    return {str(p.relative_to(folder)): p.read_bytes() if p.is_file() else None for p in sorted(folder.rglob("*"))}


@pytest.mark.parametrize("mistake", ["seed=-1", "metric.header=3"])
@pytest.mark.parametrize("content", ["config", "config/notes.txt", ""])
def test_a_mistake_deletes_nothing_that_the_run_did_not_make(cli, tmp_path, mistake, content):
    proj = tmp_path / "proj"
    proj.mkdir()
    if content.endswith(".txt"):
        (proj / content).parent.mkdir(parents=True)
        (proj / content).write_text("mine")
    elif content:
        (proj / content).mkdir()
    before = tree(proj)
    assert cli("+scenario=8", mistake, f"hydra.run.dir={proj}").status == 2
    assert proj.is_dir()
    assert tree(proj) == before


def test_a_mistake_leaves_no_folder_that_was_not_there(cli, tmp_path):
    assert cli("+scenario=8", "seed=-1", f"hydra.run.dir={tmp_path}/one/two").status == 2
    assert not (tmp_path / "one").exists()
    sweep = ("-m", "+scenario=8", "seed=-1", f"hydra.sweep.dir={tmp_path}/sweep")
    assert cli(*sweep).status == 2
    assert not (tmp_path / "sweep").exists(), "nor a sweep that fails at once"


def test_results_are_not_overwritten_unless_told_so(cli, tmp_path, tiny):
    out = tmp_path / "run"
    ask = ("+scenario=8", *FAST, *tiny, "budget.generations=1", f"hydra.run.dir={out}")
    assert cli(*ask).status == 0
    before = tree(out)
    again = cli(*ask, "seed=1")
    assert again.status == 2
    (line,) = again.err.strip().splitlines()
    assert "holds something already (config, recovery.mcap, recovery.rrd and 1 more)" in line
    assert "overwrite=true" in line
    assert tree(out) == before
    late = cli("task=view", "log=nowhere.mcap", f"hydra.run.dir={out}", "overwrite=true")
    assert late.status == 2
    assert tree(out) == before, "a mistake puts back the settings that it replaced"
    assert cli(*ask, "seed=1", "overwrite=true").status == 0
    assert read_run(out / "recovery.mcap").metadata["seed"] == "1"


def test_what_an_earlier_run_left_is_told_from_what_this_one_wrote(cli, tmp_path):
    trial = cli("task=trial", "robot=servo_pendulum", "engine=mujoco", f"hydra.run.dir={tmp_path}/t")
    assert trial.status == 0, trial.err
    ask = ("task=compare", f"measured={tmp_path}/t/trial.mcap", "engine=mujoco", f"hydra.run.dir={tmp_path}/c")
    assert "of an earlier run" not in cli(*ask).out
    listed = [line for line in cli(*ask, "task.rerun=false", "overwrite=true").out.splitlines() if "earlier" in line]
    assert len(listed) == 1 and "compare.rrd  (of an earlier run)" in listed[0]


@pytest.mark.parametrize(("arguments", "said"), [
    (["hydra.run.dir="], "hydra.run.dir=: which folder?"),
    (["-m", "hydra.sweep.dir="], "hydra.sweep.dir=: which folder?"),
])  # fmt: skip
def test_a_folder_without_a_name_is_refused(cli, arguments, said):
    outcome = cli(*arguments, "+scenario=8")
    assert outcome.status == 2
    assert said in outcome.err
    assert not list(outcome.folder.iterdir())


def test_two_runs_never_write_into_one_folder(tmp_path):
    folder = tmp_path / "run"
    with claimed(folder, {"config.yaml": "a: 1\n"}, overwrite=False):
        assert "process" in (folder / LOCK).read_text()
        with pytest.raises(ConfigError, match="another run writes there now \\(process"):  # noqa: SIM117
            with claimed(folder, {"config.yaml": "a: 2\n"}, overwrite=True):
                pytest.fail("two runs in one folder")
        assert (folder / "config" / "config.yaml").read_text() == "a: 1\n"
    assert not (folder / LOCK).exists()


def test_a_killed_run_keeps_no_folder_locked(tmp_path):
    code = (
        "import sys, time; from pathlib import Path; from ee_dist.tasks.folder import claimed\n"
        f"with claimed(Path({str(tmp_path / 'run')!r}), {{'config.yaml': ''}}, False):\n"
        "    print('in', flush=True); time.sleep(60)"
    )
    with subprocess.Popen([sys.executable, "-c", code], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        assert process.stdout.readline() == "in\n"
        with pytest.raises(ConfigError, match="another run"), claimed(tmp_path / "run", {}, True):
            pass
        process.kill()
    assert (tmp_path / "run" / LOCK).exists()
    with claimed(tmp_path / "run", {}, overwrite=True):
        pass
    assert not (tmp_path / "run" / LOCK).exists()


def test_runs_of_one_second_get_folders_of_their_own(tmp_path):
    name = tmp_path / "2026-11-22_01-02-03"
    assert free_name(name) == name
    with claimed(name, {"config.yaml": ""}, overwrite=False):
        assert free_name(name) == tmp_path / "2026-11-22_01-02-03_2"
    assert free_name(name) == tmp_path / "2026-11-22_01-02-03_2"


def test_missing_folders_are_listed_innermost_first(tmp_path):
    assert missing(tmp_path) == ()
    assert missing(tmp_path / "a" / "b") == (tmp_path / "a" / "b", tmp_path / "a")


@pytest.mark.parametrize(("limit", "said", "kept"), [
    (100_000, "recovery.mcap.part: cannot be written (File too large)", {"recovery.mcap.part", "unfinished"}),
    (400_000, "recovery.rrd: cannot be drawn", {"recovery.mcap", "summary.json"}),
])  # fmt: skip
def test_a_full_disk_is_one_line_and_what_was_whole_stays(tmp_path, tiny, limit, said, kept):
    """A limit on the size of files stands for the disk: the recording takes 180 kB, the picture 860 kB."""
    # The limit is set by the program itself: between fork and exec of a process with Ray's threads it may hang.
    limited = (
        f"import resource, runpy; resource.setrlimit(resource.RLIMIT_FSIZE, ({limit}, {limit})); "
        "runpy.run_module('ee_dist', run_name='__main__', alter_sys=True)"
    )
    command = [sys.executable, "-c", limited, "+scenario=8", *FAST, *tiny, "hydra.run.dir=out"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False, timeout=300)
    assert done.returncode == 2
    (line,) = done.stderr.strip().splitlines()
    assert said in line
    assert {p.name for p in (tmp_path / "out").iterdir()} == {*kept, "config"}
    run = read_run(tmp_path / "out" / min(kept - {"unfinished"}))
    assert len(run.trials) >= 2
    assert run.complete == ("summary.json" in kept)


@contextlib.contextmanager
def disk_of(length: int) -> Iterator[None]:
    """No file grows beyond so many bytes, in this process."""
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (length, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)


@pytest.mark.parametrize(("length", "file"), [(5000, "out/robot.xml"), (2000, "out/config/hydra.yaml")])
def test_a_full_disk_leaves_no_half_of_a_file(cli, tmp_path, length, file):
    model = tmp_path / "model.yaml"
    model.write_text("robot: quadruped\neffects: []\n")
    with disk_of(length):
        outcome = cli("task=export", f"model={model}", "hydra.run.dir=out")
    assert outcome.status == 2
    (line,) = outcome.err.strip().splitlines()
    assert line.endswith(f"{file}: File too large; make room on the disk, or choose a folder with hydra.run.dir=FOLDER")
    assert not list(outcome.folder.iterdir())


def test_a_disk_that_fills_up_in_the_search_is_one_line_and_the_run_goes_on_later(cli, tmp_path, tiny, monkeypatch):
    """What was simulated is noted in a file of its own, whose errors are the system's."""
    ask = ("+scenario=8", *FAST, *tiny, "budget.generations=1")
    real, calls = Journal.note, iter(range(1000))

    def note(self: Journal, found: Any) -> None:
        if next(calls) == 1:
            raise OSError(
                errno.ENOSPC, "No space left on device", str(tmp_path / "out" / "unfinished" / "simulated.bin")
            )
        real(self, found)

    monkeypatch.setattr(Journal, "note", note)
    close_evaluators()  # what a run before this one simulated is remembered, and noted no more
    outcome = cli(*ask, f"hydra.run.dir={tmp_path}/out")
    assert outcome.status == 2
    (line,) = outcome.err.strip().splitlines()
    assert "simulated.bin: No space left on device; make room on the disk, or " in line
    assert line.endswith(f"; go on with the same command and resume={tmp_path}/out")
    close_evaluators()
    assert cli(*ask, f"resume={tmp_path}/out").status == 0
    assert read_run(tmp_path / "out" / "recovery.mcap").complete


def test_a_read_only_folder_is_one_line(cli, tmp_path):
    (tmp_path / "file").touch()
    outcome = cli("+scenario=8", f"hydra.run.dir={tmp_path / 'file' / 'run'}")
    assert outcome.status == 2
    (line,) = outcome.err.strip().splitlines()
    assert "choose a folder with hydra.run.dir=FOLDER" in line


def test_a_job_of_a_sweep_has_a_name_that_file_systems_take():
    assert folder_name("+scenario=8,seed=1") == "scenario=8_seed=1"
    long = ",".join(f"budget.population={k}" for k in range(40))
    names = {folder_name(f"{long},seed={seed}") for seed in (1, 2)}
    assert len(names) == 2, "what differs at the end only is not lost"
    assert all(len(n) == LONGEST_NAME and n.startswith("budget.population=0_") for n in names)


def test_what_is_left_and_large_says_how_large(tmp_path):
    (tmp_path / "unfinished").mkdir()
    (tmp_path / "report.html").write_text("small")
    with (tmp_path / "unfinished" / "simulated.bin").open("wb") as file:
        file.truncate(120_400_000)
    assert kept(tmp_path).endswith(": report.html, unfinished (120 MB)")
