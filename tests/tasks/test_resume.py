"""A run that was stopped goes on with ``resume=`` and ends as an undisturbed one does; no trial is made twice."""

from __future__ import annotations

import json
import re
import shutil
import tracemalloc
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from ee_dist.__main__ import _what_is_kept
from ee_dist.discrepancy import improve as improving
from ee_dist.effects import catalogue, laws
from ee_dist.evaluation.jobs import Counts
from ee_dist.evaluation.journal import MAGIC, Journal, JournaledEvaluator
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.tasks.wiring import close_evaluators

FAST = ("+scenario=8", "evaluator=serial", "engine=mujoco", "budget.compensating_trials=1", "budget.polish=1")
(OWN_EFFECT, _) = re.findall(
    r"^```python\n(.*?)^```$",
    (Path(__file__).parents[2] / "docs" / "own_effect.md").read_text(),
    re.MULTILINE | re.DOTALL,
)


@pytest.fixture
def stopping(monkeypatch):
    """``stopping(n)``: the run ends at its n-th call of the evaluator, in the middle of whatever it does."""
    real, calls, due = SerialEvaluator.evaluate, [0, 10**9], [lambda: False]

    def evaluate(self, jobs):
        calls[0] += 1
        if calls[0] == calls[1] or due[0]():
            raise RuntimeError("the power went")
        return real(self, jobs)

    monkeypatch.setattr(SerialEvaluator, "evaluate", evaluate)

    def stop(after: int = 10**9, when=lambda: False) -> None:
        close_evaluators()  # what a new process would not have
        calls[:], due[:] = [0, after], [when]

    stop.calls = calls
    yield stop
    close_evaluators()


def test_a_stopped_run_goes_on_and_ends_with_the_same_bytes(cli, tiny, tmp_path, stopping, monkeypatch):
    made: list[int] = []
    real = PhysicalRobot.trial
    monkeypatch.setattr(PhysicalRobot, "trial", lambda self, *a: (made.append(self.trials), real(self, *a))[1])
    stopping(10**9)
    assert cli(*tiny, *FAST, f"hydra.run.dir={tmp_path}/whole").status == 0
    assert len(made) == 3
    made.clear()
    out = tmp_path / "run"
    statuses = []
    where = f"hydra.run.dir={out}"
    for after in (2, 1, 3, 2, 3, 10**9):
        stopping(after)
        outcome = cli(*tiny, *FAST, where)
        statuses.append(outcome.status)
        where = f"resume={out}"
    assert statuses == [1, 1, 1, 1, 1, 0]
    assert len(made) == 3, "a trial was made twice"
    whole, resumed = (json.loads((tmp_path / n / "summary.json").read_text()) for n in ("whole", "run"))
    assert resumed["evaluations"] == whole["evaluations"]
    assert resumed["result_digest"] == whole["result_digest"]
    assert (out / "recovery.mcap").read_bytes() == (tmp_path / "whole" / "recovery.mcap").read_bytes()
    assert not (out / "unfinished").exists()
    again = cli(*tiny, *FAST, where)
    assert (again.status, len(made)) == (0, 3)
    assert "finished already" in again.out


def test_what_cannot_be_resumed_is_said_in_one_line(cli, tiny, tmp_path, stopping):
    out = tmp_path / "run"
    stopping(2)
    assert cli(*tiny, *FAST, f"hydra.run.dir={out}").status == 1
    kept = sorted(p.name for p in (out / "unfinished").iterdir())
    assert kept == ["run.json", "simulated.bin"]
    stopping(10**9)
    for arguments, said in (
        ((*tiny, *FAST, "seed=3", f"resume={out}"), "the run there has other settings (seed=0)"),
        ((*tiny, *FAST, f"resume={tmp_path}/nowhere"), "no run was begun there"),
        ((*tiny, *FAST, f"hydra.run.dir={out}"), "the same command and resume="),
    ):
        outcome = cli(*arguments)
        assert outcome.status == 2
        (line,) = outcome.err.strip().splitlines()
        assert said in line
        assert sorted(p.name for p in (out / "unfinished").iterdir()) == kept
    assert not (tmp_path / "nowhere").exists()
    content = json.loads((out / "unfinished" / "run.json").read_text())
    content["versions"]["mujoco"] = "0.1"
    (out / "unfinished" / "run.json").write_text(json.dumps(content))
    assert "it was begun with mujoco 0.1, here is" in cli(*tiny, *FAST, f"resume={out}").err
    (out / "unfinished" / "run.json").write_text("[" * 9)
    assert "is damaged" in cli(*tiny, *FAST, f"resume={out}").err


def test_a_run_does_not_go_on_with_another_text_of_an_effect_of_ones_own(cli, tiny, tmp_path, stopping):
    out, file = tmp_path / "run", tmp_path / "cogging.py"
    text = OWN_EFFECT
    file.write_text(text)
    ask = (*tiny, *FAST, f"plugins=[{file}]")
    stopping(2)
    assert cli(*ask, f"hydra.run.dir={out}").status == 1
    stopping()
    file.write_text(text.replace("TEETH = 12", "TEETH = 14"))
    outcome = cli(*ask, f"resume={out}")
    assert outcome.status == 2
    (line,) = outcome.err.strip().splitlines()
    assert f"{file} is not as it was when that run began" in line
    assert "put the file back as it was" in line
    # Another place is no other text.
    moved = tmp_path / "moved.py"
    moved.write_text(text)
    file.unlink()
    for registry in (catalogue.registered, laws.LAWS):  # what a new process would not have
        del registry["cogging"]
    ask = (*tiny, *FAST, f"plugins=[{moved}]")
    assert cli(*ask, f"resume={out}").status == 0
    moved.write_text(text.replace("TEETH = 12", "TEETH = 14"))
    outcome = cli(*ask, f"resume={out}")
    assert outcome.status == 2
    assert f"or other texts of {moved}" in outcome.err


@pytest.mark.slow
@pytest.mark.parametrize("verb", [("task=explain",), ("task=improve", "effect=auto", "task.most=1")])
def test_explain_and_improve_go_on_where_they_stopped(cli, tmp_path, stopping, verb):
    log = tmp_path / "log"
    assert cli(
        "task=trial", "robot=servo_pendulum", "+hidden=coulomb_friction@servo", "engine=mujoco", "seed=1",
        "task.excitations=['multisine:seconds=2,seed=1','slow_sines:seconds=2,seed=2']", f"hydra.run.dir={log}",
    ).status == 0  # fmt: skip
    ask = (
        *verb, f"measured={log}", "engine=mujoco", "evaluator=serial", "task.by=open_loop", "task.rerun=false",
        "task.only=[coulomb_friction,viscous_friction]",
    )  # fmt: skip
    stopping()
    assert cli(*ask, f"hydra.run.dir={tmp_path}/whole").status == 0
    calls = stopping.calls[0]
    assert calls > 3, "too short to be stopped in the middle"
    where = f"hydra.run.dir={tmp_path}/run"
    for after in (calls // 2, calls // 3):
        stopping(after)
        assert cli(*ask, where).status == 1
        where = f"resume={tmp_path}/run"
    stopping()
    assert cli(*ask, where).status == 0
    assert stopping.calls[0] < calls, "nothing was remembered"
    whole, resumed = ((tmp_path / n / "summary.json").read_text().replace(f"/{n}", "") for n in ("whole", "run"))
    left_out = ("wall_s", "cpu_s")
    found = [{k: v for k, v in json.loads(text).items() if k not in left_out} for text in (whole, resumed)]
    assert found[0] == found[1]
    assert not (tmp_path / "run" / "unfinished").exists()


def rubbing(cli, log, *more):
    """Two trials of a pendulum with friction that nobody described."""
    assert cli(
        "task=trial", "robot=servo_pendulum", "+hidden=coulomb_friction@servo", "engine=mujoco", "seed=1", *more,
        "task.excitations=['multisine:seconds=1,seed=1','slow_sines:seconds=1,seed=2']", f"hydra.run.dir={log}",
    ).status == 0  # fmt: skip


def test_the_model_that_a_stopped_search_had_reached_can_be_used(cli, tmp_path, stopping):
    log, run = tmp_path / "log", tmp_path / "run"
    rubbing(cli, log)
    same = (f"measured={log}", "engine=mujoco", "evaluator=serial", "task.by=open_loop", "task.rerun=false")
    ask = ("task=improve", "effect=auto", "task.only=[coulomb_friction,viscous_friction]", *same)
    so_far = run / "unfinished" / "model.yaml"
    stopping(when=so_far.exists)
    outcome = cli(*ask, f"hydra.run.dir={run}")
    assert outcome.status == 1 and "held out from all of it" not in outcome.out
    text = so_far.read_text()
    assert text.startswith("# Not the end of the search") and "effect: coulomb_friction" in text
    stopping()
    assert cli("task=compare", *same, f"model={so_far}", f"hydra.run.dir={tmp_path}/compare").status == 0
    assert cli(*ask, f"resume={run}").status == 0
    assert not so_far.parent.exists() and (run / "model.yaml").exists()


def test_a_stopped_search_says_how_far_its_model_is_from_what_was_held_out_from_all_of_it(cli, tmp_path, stopping):
    log, run = tmp_path / "log", tmp_path / "run"
    rubbing(cli, log)
    same = (f"measured={log}", "engine=mujoco", "evaluator=serial", "task.by=open_loop", "task.rerun=false")
    ask = ("task=improve", "effect=auto", "task.only=[coulomb_friction,viscous_friction]", "held_out=[2]", *same)
    so_far = run / "unfinished" / "model.yaml"
    stopping(when=so_far.exists)
    outcome = cli(*ask, f"hydra.run.dir={run}")
    assert outcome.status == 1
    (line,) = (x for x in outcome.out.splitlines() if x.endswith(" on trials that were held out from all of it"))
    off = line.rpartition("; ")[2]
    assert f"{so_far} ({off})" in _what_is_kept(run) and f"held out in turn; {off}" in so_far.read_text()


def test_a_search_that_simulates_nothing_keeps_its_model_too(cli, tmp_path, monkeypatch):
    log, run = tmp_path / "log", tmp_path / "run"
    rubbing(cli, log, "task.motor_torque=true", "task.noise=0.0001")
    same = (f"measured={log}", "engine=mujoco", "evaluator=serial", "task.by=force_balance", "task.rerun=false")
    ask = ("task=improve", "effect=auto", "task.only=[coulomb_friction,viscous_friction]", *same)
    so_far, real, told = run / "unfinished" / "model.yaml", improving.examine, []

    def examine(*args, **how):
        if so_far.exists() or not due:
            told.append(_what_is_kept(run))
            raise RuntimeError("the power went")
        return real(*args, **how)

    monkeypatch.setattr(improving, "examine", examine)
    due = False
    assert cli(*ask, f"hydra.run.dir={run}").status == 1
    assert told.pop() == "nothing was recorded yet, so nothing is kept" and not so_far.parent.exists()
    due = True
    assert cli(*ask, f"hydra.run.dir={run}", "overwrite=true").status == 1
    assert told.pop().endswith(
        f"; the same command and resume={run} begins its search anew; the model so far: {so_far}"
    )
    assert "effect: coulomb_friction" in so_far.read_text()
    assert cli("task=compare", *same, f"model={so_far}", f"hydra.run.dir={tmp_path}/compare").status == 0
    monkeypatch.setattr(improving, "examine", real)
    assert cli(*ask, f"resume={run}").status == 0
    assert not so_far.parent.exists() and (run / "model.yaml").exists()


def test_a_run_that_kept_nothing_to_go_on_from_says_what_begins_it_anew(tmp_path):
    """As a trial that was stopped once its envelope was sealed, before it was made: the same command alone is refused."""
    (tmp_path / "config").mkdir()
    assert _what_is_kept(tmp_path) == "nothing was recorded yet, so nothing is kept"
    (tmp_path / "sealed.json").write_text("{}")
    assert _what_is_kept(tmp_path).endswith(": sealed.json; the same command and overwrite=true begins it anew")


def test_a_sweep_goes_on_where_it_stopped(cli, tiny, tmp_path, stopping):
    sweep = ("-m", *tiny, *FAST[1:], "+scenario=1,9")
    stopping(when=lambda: any((tmp_path / "sweep").rglob("summary.json")))
    assert cli(*sweep, f"hydra.sweep.dir={tmp_path}/sweep").status == 1
    (done,) = (tmp_path / "sweep").rglob("summary.json")
    before = done.stat().st_mtime_ns
    stopping(10**9)
    outcome = cli(*sweep, f"resume={tmp_path}/sweep")
    assert outcome.status == 0, outcome.err
    assert outcome.out.count("finished already") == 1
    assert done.stat().st_mtime_ns == before
    assert len(list((tmp_path / "sweep").rglob("summary.json"))) == 2


class _Numbers:
    """Stands for an evaluator: gives each job a number, an array, or a text that no journal keeps."""

    def __init__(self) -> None:
        self.counts, self.asked = Counts(), 0

    def evaluate(self, jobs):
        self.asked += len(jobs)
        return [(float(j.number), np.arange(3.0) + j.number, "text")[j.number % 3] for j in jobs]

    def close(self) -> None: ...


class _Job:
    class rollout:  # noqa: N801
        steps = 5

    def __init__(self, number: int) -> None:
        self.number, self.key = number, f"{number:064x}"


def test_a_journal_cut_anywhere_gives_its_whole_entries(tmp_path: Path):
    path, jobs = tmp_path / "j.bin", [_Job(k) for k in range(9)]
    with Journal(path) as journal:
        expected = JournaledEvaluator(_Numbers(), journal).evaluate(jobs)
    whole, counts = path.read_bytes(), []
    for length in (*range(0, len(whole), 7), len(whole)):
        path.write_bytes(whole[:length])
        with Journal(path) as journal:
            counts.append(len(journal))
            inner = _Numbers()
            found = JournaledEvaluator(inner, journal).evaluate(jobs)
            assert str(found) == str(expected)
            assert inner.asked == 9 - counts[-1]
            assert journal.keys() == {j.key for j in jobs if j.number % 3 < 2}
        assert path.read_bytes().startswith(MAGIC)
    assert counts == sorted(counts)
    assert (counts[0], counts[-1]) == (0, 6)
    for place in range(len(MAGIC), len(whole), 5):
        path.write_bytes(whole[:place] + bytes([whole[place] ^ 4]) + whole[place + 1 :])
        with Journal(path) as journal:
            assert all(str(journal[j.key]) == str(e) for j, e in zip(jobs, expected, strict=True)
                       if j.key in journal)  # fmt: skip
    shutil.rmtree(tmp_path)


@dataclass(frozen=True, eq=False)
class _Kept:
    means: np.ndarray
    nothing: np.ndarray
    finite: bool


class _ToKept:
    key = "kept"

    def __call__(self, log: object) -> _Kept:
        raise AssertionError


class _Records(_Numbers):
    def evaluate(self, jobs):
        self.asked += len(jobs)
        return [
            _Kept(np.full((3, 2), j.number, dtype=np.float32), np.empty((0, 2), np.float32), j.number > 2) for j in jobs
        ]


def test_a_journal_keeps_what_a_reduction_makes_of_a_log(tmp_path: Path):
    """As open loop does: without it a search of hours would begin anew."""
    path, jobs = tmp_path / "j.bin", [_Job(k) for k in range(5)]
    for job in jobs:
        job.reduction = _ToKept()
    with Journal(path) as journal:
        expected = JournaledEvaluator(_Records(), journal).evaluate(jobs)
    whole = path.read_bytes()
    for length in (*range(0, len(whole), 11), len(whole)):
        path.write_bytes(whole[:length])
        with Journal(path) as journal:
            known, inner = len(journal), _Records()
            found = JournaledEvaluator(inner, journal).evaluate(jobs)
        assert inner.asked == 5 - known
        for a, b in zip(found, expected, strict=True):
            assert (a.means.dtype, a.means.tobytes(), a.nothing.shape, a.finite) == (
                b.means.dtype, b.means.tobytes(), b.nothing.shape, b.finite,
            )  # fmt: skip
    assert known == 5
    for job in jobs:
        job.reduction = len  # which does not say that it gives such a record
    inner = _Records()
    with Journal(path) as journal:
        JournaledEvaluator(inner, journal).evaluate(jobs)
    assert inner.asked == 5


def test_large_values_of_a_journal_stay_in_its_file(tmp_path: Path):
    """Minutes of a log in each of a thousand values would take a gigabyte of memory beside the gigabyte on the disk."""
    values = {f"{k:064x}": np.random.default_rng(k).normal(size=4000) for k in range(200)}
    path = tmp_path / "j.bin"
    tracemalloc.start()
    try:
        with Journal(path) as journal:
            journal.note([*values.items()])
            journal.note([("f" * 64, 0.5)])
            again = {key: journal[key] for key in reversed(values)}
            assert all(np.array_equal(again[key], value) for key, value in values.items())
            journal.note([("e" * 64, np.arange(1000.0))])
            assert (journal["f" * 64], len(journal)) == (0.5, 202) and journal.get("d" * 64) is None
        del again
        before = tracemalloc.get_traced_memory()[0]
        with Journal(path) as journal:
            assert journal.keys() == {*values, "f" * 64, "e" * 64}
            held = tracemalloc.get_traced_memory()[0] - before
    finally:
        tracemalloc.stop()
    assert held < 0.1 * path.stat().st_size
