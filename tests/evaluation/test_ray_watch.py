"""A Ray that is gone: the main thread is told, wherever it is; where it does not listen the last words are said without it."""

from __future__ import annotations

import signal
import threading
import time

import pytest

from ee_dist import leaving
from ee_dist.basics.uncut import trial_on_hardware
from ee_dist.evaluation import ray_watch
from ee_dist.evaluation.ray_watch import Watch


class GoneError(Exception):
    pass


@pytest.fixture
def watching(monkeypatch):
    """``watching(answers, takes_s, unwinds_s)``: a watch that finds these, the last of them for ever, and its last words."""
    made: list[Watch] = []

    def start(answers: list[str | None], takes_s: float = 0.05, unwinds_s: float = 60.0) -> tuple[Watch, list[str]]:
        monkeypatch.setattr(ray_watch, "TAKE_S", takes_s)
        monkeypatch.setattr(ray_watch, "UNWIND_S", unwinds_s)
        left, said = list(answers), []
        watch = Watch(lambda: left.pop(0) if len(left) > 1 else left[0], GoneError, said.append, look_s=0.01)
        made.append(watch)
        watch.start()
        return watch, said

    yield start
    for watch in made:
        watch.stop()


def test_whatever_the_main_thread_does_it_is_interrupted(watching):
    before = signal.getsignal(ray_watch.NUMBER)
    watch, said = watching([None, None, "the raylet"])
    with pytest.raises(GoneError, match="the raylet"):
        time.sleep(60)
    watch.stop()
    watch.join(10)
    assert not said
    assert signal.getsignal(ray_watch.NUMBER) == before


def test_who_does_not_listen_hears_the_last_words_said(watching):
    said_at = threading.Event()
    watch, said = watching(["the GCS"], takes_s=0.01, unwinds_s=0.05)
    watch.farewell = lambda why: (said.append(why), said_at.set())
    with pytest.raises(GoneError):
        time.sleep(60)
    assert said_at.wait(10), "it was told, and did not end"
    assert said == ["the GCS"]


def test_a_trial_on_hardware_is_made_to_its_end_first(watching):
    watch, said = watching(["the raylet"], takes_s=0.01, unwinds_s=0.05)
    silent = []

    def trial() -> None:
        with trial_on_hardware:
            time.sleep(0.5)
            silent.append(watch.taken.is_set() and not said)

    with pytest.raises(GoneError):
        trial()
    assert silent == [True], "the trial was cut, or the last words were said in the middle of it"


def test_who_found_out_by_itself_is_not_interrupted(watching):
    watch, said = watching(["the raylet"], takes_s=60.0)
    watch.taken.set()
    while watch.why is None:
        time.sleep(0.01)
    time.sleep(0.1)
    assert watch.why == "the raylet" and not said


def test_what_interrupts_a_compiled_library_is_told_as_itself(monkeypatch):
    """It may make a Ctrl-C of whatever leaves a run."""
    for name in ("_leaving", "_left"):
        monkeypatch.setattr(leaving, name, getattr(leaving, name))
    with pytest.raises(leaving.Left):
        leaving._unwind(signal.SIGTERM, None)
    told = leaving.told(KeyboardInterrupt())
    assert (told.status, told.why) == (143, "asked to end")


def test_one_answer_that_did_not_come_is_no_loss(watching):
    watch, _ = watching([None, "no answer", None])
    time.sleep(0.3)
    assert watch.is_alive() and watch.why is None
