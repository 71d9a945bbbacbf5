"""Ray's library in a process of its own: whatever ends that process, the run hears of it, wherever it is. Without Ray."""

from __future__ import annotations

import contextlib
import os
import shutil
import signal
import subprocess
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import psutil
import pytest
from rerun.error_utils import catch_and_log_exceptions

from ee_dist import __main__
from ee_dist.evaluation import ray_apart, ray_watch
from ee_dist.evaluation.ray_apart import RayApart, abandon_ray, stop_ray
from ee_dist.evaluation.ray_session import EvaluatorError, RayGoneError, RayLostError
from ee_dist.tasks.summary import Stopwatch

STAND_IN = """
import json, os, subprocess, sys, threading, time
sys.path[:] = json.loads(sys.argv[1])
from ee_dist.evaluation import ray_process, ray_session
class Odd(Exception):
    def __init__(self, one, two):
        super().__init__(one)
class Desk:
    joined = False
    def know(self, plugins): pass
    def make(self, make_engine, workers, chunk, address, folder):
        if address and not self.joined:
            ray_session.knock(address)
        self.joined = True  # as Ray does, it goes on with what it has joined
        return make_engine
    def close(self, name): pass
    def stop(self): pass
    def evaluate(self, name, jobs): return [getattr(self, job.what)() for job in jobs], 2.5
    def work(self): return os.getpid()
    def die(self): os._exit(1)
    def die_soon(self): threading.Timer(0.2, self.die).start()
    def fail(self): raise ValueError("nothing there")
    def fail_oddly(self): raise Odd("here", "there")
    def stall(self):
        head = subprocess.Popen(["./raylet", "600"])
        time.sleep(1.0)
        head.kill()
        time.sleep(600)
ray_process.Desk = Desk
ray_process.main(int(sys.argv[2]))
"""


def job(what: str) -> SimpleNamespace:
    return SimpleNamespace(what=what, rollout=SimpleNamespace(steps=7))


@pytest.fixture
def apart(monkeypatch):
    """An evaluator whose process does as the jobs say."""
    monkeypatch.setattr(ray_apart, "BEGIN", STAND_IN)
    monkeypatch.setattr(ray_watch, "TAKE_S", 0.1)
    abandon_ray()
    yield RayApart(3)
    abandon_ray()


def test_it_answers_and_counts(apart):
    first, second = apart.evaluate([job("work"), job("work")])
    assert first == second == ray_apart._process.process.pid
    assert (apart.counts.asked, apart.counts.simulated, apart.counts.steps) == (2, 2, 14)


def test_what_the_workers_took_is_processor_time_of_the_run(apart):
    watch = Stopwatch()
    apart.evaluate([job("work")])
    assert 2.5 <= watch.read()[1] < 5.0


def test_a_watch_tells_one_time(apart):
    watch = Stopwatch()
    first = watch.read()
    apart.evaluate([job("work")])
    assert watch.read() == first


def test_its_end_without_a_word_is_told_at_once_and_nothing_is_left(apart):
    process, folder = ray_apart._process.process, Path(ray_apart._process.guard.folder)
    assert folder.is_dir()
    for _ in range(2):
        with pytest.raises(RayLostError, match="Ray is lost: the process that speaks to it has ended"):
            apart.evaluate([job("die")])
    abandon_ray()
    assert process.poll() is not None and not folder.exists()


def test_a_run_that_is_busy_elsewhere_is_told_of_its_end(apart):
    apart.evaluate([job("die_soon")])
    with pytest.raises(RayGoneError, match="has ended"):
        time.sleep(60)


def test_a_picture_that_is_being_made_swallows_no_such_end(apart):
    """Rerun's library makes a warning of what is raised in it."""

    @catch_and_log_exceptions()
    def draw() -> None:
        time.sleep(60)

    apart.evaluate([job("die_soon")])
    with pytest.raises(RayGoneError, match="has ended"):
        draw()


def test_a_ray_that_goes_outside_of_any_run_is_one_line_too(monkeypatch, capsys):
    """Between two runs of a sweep, or while Hydra ends one."""

    def gone(overrides: list[str]) -> None:
        raise RayGoneError("Ray is lost: its process raylet has ended")

    monkeypatch.setattr(__main__, "check_flags", gone)
    monkeypatch.setattr(sys, "argv", ["ee_dist", "+scenario=8"])
    assert __main__.main() != 0
    assert capsys.readouterr().err == "ee_dist: Ray is lost: its process raylet has ended\n"


def test_a_lost_raylet_is_seen_where_rays_library_is_stuck(apart, tmp_path, monkeypatch):
    """It waits a minute for a head that is gone, and lets nothing else go on in its process."""
    sleep = shutil.which("sleep")
    assert sleep
    shutil.copy(sleep, tmp_path / "raylet")
    abandon_ray()
    monkeypatch.chdir(tmp_path)
    with pytest.raises((RayGoneError, RayLostError), match="its process raylet has ended"):
        RayApart(3).evaluate([job("stall")])


def test_what_is_raised_there_is_raised_here_and_it_goes_on(apart):
    with pytest.raises(ValueError, match="nothing there"):
        apart.evaluate([job("fail")])
    with pytest.raises(EvaluatorError, match="Odd: here"):
        apart.evaluate([job("fail_oddly")])
    assert apart.evaluate([job("work")])


def test_signals_for_the_run_are_not_for_it(apart):
    process = ray_apart._process.process
    assert os.getsid(process.pid) != os.getsid(0)
    for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
        process.send_signal(number)
    assert apart.evaluate([job("work")]) == [process.pid]


def test_after_its_end_another_one_is_begun(apart):
    with pytest.raises(RayLostError):
        apart.evaluate([job("die")])
    again = RayApart(3)
    assert again.evaluate([job("work")])
    again.close()
    stop_ray()
    with pytest.raises(RayLostError, match="it was ended"):
        again.evaluate([job("work")])


def test_another_address_is_another_ray(apart):
    """A sweep over ``ray.address`` went on with the first one's, and an address where nobody answers began a run."""
    first = ray_apart._process.process
    with pytest.raises(EvaluatorError, match="no Ray cluster answers there"):
        RayApart(3, address="127.0.0.1:1")
    assert first.poll() is not None
    assert ray_apart._process is None, "what has joined nothing goes on knocking"
    assert RayApart(3).evaluate([job("work")]) != [first.pid]


RUN = f"""
import sys, time
from ee_dist.evaluation import ray_apart
ray_apart.BEGIN = {STAND_IN!r}
ray_apart.RayApart(3, address=sys.argv[1] or None)
print(ray_apart._process.process.pid, flush=True)
time.sleep(600)
"""


@pytest.mark.parametrize("address", ["", "auto"])
def test_it_ends_with_a_run_that_is_killed(address):
    """Of a cluster of others nobody guards anything."""
    with subprocess.Popen([sys.executable, "-c", RUN, address], stdout=subprocess.PIPE, text=True) as run:
        assert run.stdout is not None
        pid = int(run.stdout.readline())
        run.kill()
    with contextlib.suppress(psutil.NoSuchProcess):
        psutil.wait_procs([psutil.Process(pid)], timeout=10)
    assert not psutil.pid_exists(pid) or psutil.Process(pid).status() == psutil.STATUS_ZOMBIE
