"""A run that is told to leave, or is killed: one line, the status of the signal, nothing left over."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from ee_dist.evaluation import ray_folder
from ee_dist.evaluation.ray_folder import MARK, Guard
from ee_dist.recording.reader import read_run

LONG = (
    "+scenario=8", "engine=mujoco", "budget=quick", "budget.population=60", "budget.generations=4", "hydra.run.dir=out",
)  # fmt: skip


def started(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-m", "ee_dist", *LONG, *arguments],
        cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env={**os.environ, "LEAVING": str(folder)},
    )  # fmt: skip


def until(process: subprocess.Popen[str], words: str) -> None:
    assert process.stdout is not None
    while words not in (line := process.stdout.readline()):
        assert line, "the run ended before it got there"


def relatives(folder: Path) -> dict[int, str]:
    """Processes that were started below a run, and are still there: by the environment; some of Ray's write over theirs, and
    are found as children of others."""
    found = {}
    for process in psutil.process_iter():
        with contextlib.suppress(psutil.Error, OSError):
            marked = f"LEAVING={folder}".encode() in Path(f"/proc/{process.pid}/environ").read_bytes()
            if marked and process.pid != os.getpid():
                for one in (process, *process.children(recursive=True)):
                    found[one.pid] = one.name()
    return found


@pytest.mark.parametrize(("number", "why"), [(signal.SIGINT, "Ctrl-C"), (signal.SIGTERM, "asked to end")])
def test_one_line_the_status_of_the_signal_and_what_was_recorded(tmp_path, number, why):
    with started(tmp_path, "evaluator=serial") as process:
        until(process, "hardware, after the change")
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 128 + number
    (line,) = err.strip().splitlines()
    assert line.startswith(f"ee_dist: stopped ({why}); kept in out: recovery.mcap.part")
    run = read_run(tmp_path / "out" / "recovery.mcap.part")
    assert not run.complete
    assert [t.name for t in run.trials if t.source == "hardware"] == ["intact", "after the change"]


def test_while_it_loads_nothing_was_begun(tmp_path):
    with started(tmp_path) as process:
        time.sleep(0.3)  # Python itself has started by then, and hydra has not been loaded
        process.send_signal(signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode in (130, -signal.SIGINT)
    assert process.returncode < 0 or "nothing was begun" in err
    assert not (tmp_path / "out").exists()


GUARDED = """
import subprocess, sys, time
from ee_dist.evaluation.ray_folder import Guard
guard = Guard()
subprocess.Popen([sys.executable, "-c", "import time; time.sleep(600)"], env=guard.environment)
open(guard.folder + "/session.log", "w").close()
print(guard.mark, guard.folder, flush=True)
time.sleep(600)
"""


LOADING = """
import os, signal, sys
from ee_dist import __main__
from ee_dist.tasks import view
def load(*_):
    try:
        os.kill(os.getpid(), signal.SIGTERM)
    except KeyboardInterrupt as stop:
        raise ImportError("initialization failed") from stop
view.run = load
sys.argv[1:] = ["task=view", "log=x.mcap", "hydra.run.dir=out"]
sys.exit(__main__.main())
"""


def test_a_library_that_was_being_loaded_makes_no_defect_of_it(tmp_path):
    done = subprocess.run([sys.executable, "-c", LOADING], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 128 + signal.SIGTERM
    assert done.stderr.startswith("ee_dist: stopped (asked to end)") and len(done.stderr.splitlines()) == 1
    assert not (tmp_path / "out" / "error.txt").exists()


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="looks for processes in /proc")
def test_a_killed_run_leaves_no_process_and_no_folder_of_ray(tmp_path):
    with subprocess.Popen([sys.executable, "-c", GUARDED], stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout is not None
        mark, folder = process.stdout.readline().split()
        assert Path(folder).is_dir()
        assert len(marked(mark)) == 1
        process.kill()
    waited = 0
    while (marked(mark) or Path(folder).exists()) and waited < 200:
        time.sleep(0.05)
        waited += 1
    assert not marked(mark)
    assert not Path(folder).exists()


def test_what_a_failed_machine_left_of_ray_is_removed_by_the_next_run(tmp_path, monkeypatch):
    """There the guard ended with its run."""
    monkeypatch.setattr(ray_folder.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(ray_folder, "_SOCKET_PATH", 10**6)
    own = tmp_path / "ee_dist_mine"
    own.mkdir()
    (own / "notes.txt").write_text("mine")
    first = Guard()
    (Path(first.folder) / "session").mkdir()
    second = Guard()
    assert Path(first.folder).is_dir(), "its run goes on"
    first.process.kill()
    first.process.wait()
    os.close(first.lock)
    third = Guard()
    assert not Path(first.folder).exists()
    assert Path(second.folder).is_dir() and (own / "notes.txt").exists()
    for guard in (second, third):
        guard.release()
    assert [p.name for p in tmp_path.iterdir()] == ["ee_dist_mine"]


def test_any_run_removes_it_and_not_only_one_that_starts_ray(cli, tmp_path, monkeypatch):
    monkeypatch.setattr(ray_folder, "_place", lambda: tmp_path)
    left = Guard()
    left.process.kill()
    left.process.wait()
    os.close(left.lock)
    assert cli("task=compare", "measured=nowhere.mcap").status == 2
    assert not Path(left.folder).exists()


@pytest.mark.skipif(not Path("/proc/self/environ").exists(), reason="looks for processes in /proc")
def test_processes_that_lived_on_without_their_guard_are_ended_by_the_next_run(tmp_path, monkeypatch):
    """Ray's agents wait for a minute for a Ray that is gone, and have written their title over their environment."""
    monkeypatch.setattr(ray_folder.tempfile, "gettempdir", lambda: str(tmp_path))
    monkeypatch.setattr(ray_folder, "_SOCKET_PATH", 10**6)
    first, second = Guard(), Guard()
    sleep = shutil.which("sleep")
    assert sleep

    def one(name: str, folder: str, environment: dict[str, str]) -> subprocess.Popen[bytes]:
        with (Path(folder) / "some.log").open("w") as log:
            return subprocess.Popen([name, "600"], executable=sleep, stdout=log, env=environment)

    agent, marked_one = one("ray::Agent", first.folder, {}), one("sleep", str(tmp_path), first.environment)
    reader, other = one("sleep", first.folder, {}), one("ray::Agent", second.folder, second.environment)
    try:
        first.process.kill()
        first.process.wait()
        os.close(first.lock)
        third = Guard()
        for ended in (agent, marked_one):
            assert ended.wait(10) == -signal.SIGKILL
        assert reader.poll() is None and other.poll() is None
        third.release()
        second.release()
        assert other.wait(10) == -signal.SIGKILL
    finally:
        for process in (agent, marked_one, reader, other):
            process.kill()
            process.wait()


def marked(mark: str) -> list[str]:
    assert mark.startswith(MARK)
    found = []
    for process in Path("/proc").iterdir():
        with contextlib.suppress(OSError):
            if process.name.isdigit() and mark.encode() in (process / "environ").read_bytes():
                found.append(process.name)
    return found


@pytest.mark.slow
@pytest.mark.parametrize("moment", ["start", "search"])
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_no_process_of_ray_outlives_its_run(tmp_path, moment, number):
    with started(tmp_path, "evaluator=ray") as process:
        if moment == "search":
            until(process, "hardware, intact")
        else:
            while "gcs_server" not in relatives(tmp_path).values():
                time.sleep(0.05)
        assert len(relatives(tmp_path)) > 2
        process.send_signal(number)
        _, err = process.communicate(timeout=60)
    assert process.returncode == (-number if number == signal.SIGKILL else 128 + number)
    assert len(err.strip().splitlines()) == (0 if number == signal.SIGKILL else 1), err
    time.sleep(2.0)
    assert not relatives(tmp_path)


@pytest.mark.slow
def test_nothing_of_ray_is_left_by_a_run_that_reaches_its_end(tmp_path):
    temporary = tmp_path / "t"
    temporary.mkdir()
    less = (
        "budget.population=8", "budget.generations=1", "budget.diagnosis_population=8", "budget.diagnosis_generations=1",
        "budget.crossovers=2", "budget.steps=80", "budget.compensating_trials=1", "evaluator=ray", "hydra.run.dir=out",
    )  # fmt: skip
    done = subprocess.run(
        [sys.executable, "-m", "ee_dist", "+scenario=8", "engine=mujoco", "budget=quick", *less],
        cwd=tmp_path, capture_output=True, text=True, check=False,
        env={**os.environ, "LEAVING": str(tmp_path), "TMPDIR": str(temporary)},
    )  # fmt: skip
    assert (done.returncode, done.stderr) == (0, "")
    assert not relatives(tmp_path)
    assert not list(temporary.iterdir()), "asked for its end twice, Ray starts another one"


@pytest.mark.slow
@pytest.mark.parametrize("victim", ["raylet", "gcs_server", "ray::Dashboard"])
def test_a_lost_ray_is_one_line(tmp_path, victim):
    with started(tmp_path, "evaluator=ray") as process:
        until(process, "hardware, intact")
        (pid,) = [pid for pid, name in relatives(tmp_path).items() if name.startswith(victim)]
        os.kill(pid, signal.SIGKILL)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 2
    assert len(err.strip().splitlines()) == 1, err
    line = err.strip()
    assert line.startswith("ee_dist: Ray is lost: its process ")
    assert "kept in out: recovery.mcap.part" in line
    time.sleep(2.0)
    assert not relatives(tmp_path)


@pytest.mark.slow
@pytest.mark.parametrize(("victim", "number"), [("gcs_server", signal.SIGTERM), ("raylet", signal.SIGKILL)])
def test_a_ray_lost_while_it_starts_is_one_line_and_the_command_may_be_given_again(tmp_path, victim, number):
    with started(tmp_path, "evaluator=ray") as process:
        while victim not in relatives(tmp_path).values():
            time.sleep(0.05)
        (pid,) = [pid for pid, name in relatives(tmp_path).items() if name == victim]
        os.kill(pid, number)
        _, err = process.communicate(timeout=120)
    assert process.returncode == 2
    (line,) = err.strip().splitlines()
    assert line.startswith("ee_dist: Ray ")
    assert "nothing was recorded yet" in line or "resume=out" in line
    assert "resume=out" in line or not (tmp_path / "out").exists()
    time.sleep(2.0)
    assert not relatives(tmp_path)


HIT = """
import os, psutil
import ray._private.worker
join = ray._private.worker.connect
def connect(*given, **named):
    (pid,) = [c.pid for c in psutil.Process().children() if c.name() == "raylet"]
    os.kill(pid, int(os.environ["HIT"]))
    return join(*given, **named)
ray._private.worker.connect = connect
"""
JOINING = f"""
import sys
from ee_dist.__main__ import main
from ee_dist.evaluation import ray_apart
ray_apart.BEGIN = ray_apart.BEGIN.replace("; from", "; exec(" + repr({HIT!r}) + "); from", 1)
sys.exit(main())
"""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_raylet_lost_while_rays_library_joins_is_one_line(tmp_path, number):
    """There it ends the process that it is in with status 1, and without a word."""
    surroundings = {**os.environ, "LEAVING": str(tmp_path), "HIT": str(int(number))}
    done = subprocess.run(
        [sys.executable, "-c", JOINING, *LONG, "evaluator=ray"],
        cwd=tmp_path, capture_output=True, text=True, check=False, env=surroundings, timeout=120,
    )  # fmt: skip
    assert done.returncode == 2
    (line,) = done.stderr.strip().splitlines()
    assert line.startswith("ee_dist: Ray ") and "nothing was recorded yet" in line
    assert not (tmp_path / "out").exists()
    time.sleep(2.0)
    assert not relatives(tmp_path)
