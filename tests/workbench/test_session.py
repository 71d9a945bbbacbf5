"""The session behind the page: what a hand does to a model, how it is undone, and that its numbers are task=compare's."""

from __future__ import annotations

import contextlib
import io
import os
import signal
import time
from dataclasses import fields, replace

import numpy as np
import pytest

from ee_dist.discrepancy.evidence.intervals import ParameterReport
from ee_dist.effects.catalogue import term
from ee_dist.effects.effect import EffectError
from ee_dist.tasks import compare, trial
from ee_dist.tasks.config import Config, ConfigError, EngineConfig, EvaluatorConfig, RobotConfig
from ee_dist.workbench import saved, verbs
from ee_dist.workbench.bench import FIT, HAND, Step
from ee_dist.workbench.results import Compared, Improved
from ee_dist.workbench.session import Session
from ee_dist.workbench.verbs import Ended, Request
from ee_dist.workbench.worker import BUSY

FRICTION = "coulomb_friction@servo"
PLAN = ["multisine:seconds=2,amplitude=0.5,seed=1"]


@pytest.fixture
def session(recording, tmp_path):
    found = Session(Config(engine=EngineConfig("mujoco")), "auto", tmp_path / "bench")
    found.load(str(recording), None)
    found.begin()
    yield found
    found.close()


def compared(session: Session, model) -> float:
    asked = Config(engine=EngineConfig("mujoco"), evaluator=EvaluatorConfig("serial"))
    config = replace(asked, measured=str(session.measured.files[0]), model=str(model))
    with contextlib.redirect_stdout(io.StringIO()):
        return compare.run(config, compare.Options(rerun=False), session.folder / "by_command")[1].error


def test_a_slider_lowers_the_error_and_undo_brings_it_back(session):
    start = session.seen.found.error
    session.add(FRICTION)
    assert session.seen.found.error == pytest.approx(start)  # at neutral it does nothing
    place = session.place()
    errors = [session.slide(0, {"torque_nm": v}, place, FRICTION).error for v in (0.03, 0.08, 0.13)]
    assert errors == sorted(errors, reverse=True) and errors[-1] < 0.3 * start
    assert session.seen.found.error == pytest.approx(start)  # nothing is settled while the hand is on it
    session.release()
    assert session.seen.found.error < 0.3 * start
    assert [s.error_heldout is None for s in session.bench.ladder] == [False, True]
    session.slide(0, {"torque_nm": 0.12}, place, FRICTION)
    session.release()  # the same slider again: one step back with the moves before
    assert session.undo() and dict(session.bench.entries[0].term.values) == {"torque_nm": 0.0}
    assert session.undo() and session.bench.entries == () and session.seen.found.error == pytest.approx(start)
    assert not session.undo()


def test_the_error_on_the_page_is_that_of_compare(session):
    session.add(FRICTION, {"torque_nm": 0.09})
    path = session.file_of(session.bench.terms)
    assert compared(session, path) == session.seen.found.error
    assert f"model={os.path.relpath(path)}" in session.commands[-1] and "task=compare" in session.commands[-1]


def test_terms_go_off_and_on(session):
    bare = session.seen.found.error
    session.add(FRICTION, {"torque_nm": 0.13})
    good = session.seen.found.error
    session.switch(0, False, FRICTION)
    assert session.seen.found.error == pytest.approx(bare) and session.bench.terms == ()
    session.switch(0, True, FRICTION)
    assert session.seen.found.error == good
    session.add(FRICTION, {"torque_nm": 0.1})
    assert len(session.bench.entries) == 1 and session.bench.entries[0].origin == HAND
    session.remove(0, FRICTION)
    assert session.bench.entries == ()


def test_what_a_page_tells_late_or_twice_changes_nothing_else(session):
    session.add(FRICTION, {"torque_nm": 0.09})
    session.add("viscous_friction@servo", {"damping_nm_s_rad": 0.001})
    place = session.place()
    session.remove(0, FRICTION)
    session.remove(0, FRICTION)  # the same click once more, or that of another tab
    session.switch(0, False, FRICTION)
    assert session.slide(0, {"torque_nm": 0.1}, place, FRICTION) is None
    assert [(e.name, e.on) for e in session.bench.entries] == [("viscous_friction@servo", True)]
    assert session.bench.value(0, FRICTION, "torque_nm") is None and not session.gripped
    before = session.bench, session.undoable
    session.release()  # of a hand that held nothing
    assert (session.bench, session.undoable) == before


def test_what_takes_long_is_not_simulated_while_a_hand_is_on_a_slider(session, monkeypatch):
    session.add(FRICTION)
    place = session.place()
    assert session.at_pauses and session.slide(0, {"torque_nm": 0.05}, place, FRICTION).error is not None
    monkeypatch.setattr("ee_dist.workbench.sight.MANY_ROWS", 100)
    moved = session.slide(0, {"torque_nm": 0.1}, place, FRICTION)
    assert not session.at_pauses and moved.error is None and moved.trial_error > 0
    session.release()
    assert session.seen.terms == session.bench.terms and session.seen.found.error == pytest.approx(
        moved.trial_error, rel=0.2
    )


def test_values_keep_to_their_bounds_and_names_to_the_catalogue(session):
    session.add(FRICTION)
    with pytest.raises(ValueError, match="lies outside"):
        session.slide(0, {"torque_nm": 99.0}, session.place(), FRICTION)
    with pytest.raises(EffectError, match="did you mean"):
        session.add("coulomb_frction@servo")
    assert session.attempt(session.add, "gremlin@servo").result() is None
    assert "no effect named 'gremlin'" in session.notice


def test_curves_and_clouds_are_of_the_place_asked_for(session):
    trial, channel = session.place()
    series = session.sight.series((), (trial, channel))
    log = session.measured.trials[trial].log
    np.testing.assert_array_equal(series.measured, log.sensors[:, channel])
    clouds = session.sight.clouds(session.seen.residual, (trial, channel))
    assert {"position", "speed", "command"} <= {c.against for c in clouds}
    assert all(len(c.x) == len(c.residual) == len(c.times_s) for c in clouds)


def test_what_helps_only_the_fit_is_refused_in_sight(session):
    session.add("stribeck_friction@servo")
    values = (("torque_nm", 0.01), ("speed_rad_s", 1.0))
    names = [p.name for p in session.bench.entries[0].candidate.effect.parameters]
    fitted = term("stribeck_friction", "servo", **dict(zip(names, (v for _, v in values), strict=False)))
    reports = (ParameterReport(0, names[0], 0.01, -0.02, 0.04, "not told from neutral"),)
    step = Step("stribeck friction at servo", 8.0, 9.5, "windows", "its gain on held-out data is no more than luck")
    found = Improved("", (), (fitted,), reports, (step,), session.folder)
    request = Request(verbs.ADD, session.config, "auto", session.folder, "stribeck_friction@servo")
    session.say(BUSY)
    session._after(request, Ended())
    assert session.notice == ""  # what was said while a search was under way goes with it
    session._after(request, Ended(found))
    entry = session.bench.entries[0]
    assert not entry.on and entry.origin == FIT and entry.intervals == ((names[0], -0.02, 0.04),)
    assert "no more than luck" in session.notice and session.bench.ladder[-1].refused
    assert session.bench.terms == ()


def until(true, seconds=60.0):
    deadline = time.monotonic() + seconds
    while not true():
        assert time.monotonic() < deadline
        time.sleep(0.05)


def test_a_search_that_is_killed_or_cancelled_loses_nothing(session):
    session.add(FRICTION, {"torque_nm": 0.05})
    before = session.bench
    session.start(verbs.EXPLAIN)
    os.kill(session.worker.pid, signal.SIGKILL)
    until(lambda: session.progress is None and "nothing is lost" in session.notice)
    session.start(verbs.EXPLAIN)
    session.cancel()
    until(lambda: "cancelled" in session.notice)
    assert session.bench is before and session.explained is None and session.progress is None


def test_a_session_goes_on_where_it_ended(session, tmp_path):
    session.add(FRICTION, {"torque_nm": 0.09})
    session.add("viscous_friction@servo", {"damping_nm_s_rad": 0.001})
    session.switch(1, False, "viscous_friction@servo")
    session.close()
    kept = saved.read(session.folder)
    again = Session(session.config, kept.by, tmp_path / "again")
    again.reopen(kept)
    again.begin()
    assert again.bench == session.bench and again.commands == session.commands
    assert again.seen.found.error == session.seen.found.error
    again.close()
    (session.folder / saved.FILE).write_text('{"format": 1, "measured": ["x"]}')
    with pytest.raises(ConfigError, match="no session of the workbench can be read"):
        saved.read(session.folder)


def test_what_explain_refuses_is_refused_when_it_is_added(tmp_path):
    """By measured torques, which nothing need be simulated for: the friction is known, and the motor is as strong as it says."""
    config = Config(
        robot=RobotConfig(name="servo_pendulum"), engine=EngineConfig("mujoco"), evaluator=EvaluatorConfig("serial")
    )
    (tmp_path / "tried").mkdir()
    options = trial.Options(excitations=PLAN, repeats=1, noise=0.002, motor_torque=True)
    with contextlib.redirect_stdout(io.StringIO()):
        trial.run(replace(config, hidden=FRICTION), options, tmp_path / "tried")
    bench = Session(config, "force_balance", tmp_path / "bench")
    bench.load(str(tmp_path / "tried" / "trial.mcap"), None)
    bench.begin()
    bench.add(FRICTION, {"torque_nm": 0.135})
    useless = "parallel_spring@servo"
    request = Request(verbs.ADD, bench._asked(bench.bench.terms), "force_balance", tmp_path / "add", useless, True)
    with contextlib.redirect_stdout(io.StringIO()):
        found = verbs.done(request, lambda *_: None)
    assert found.steps[-1].refused and found.steps[-1].error_heldout is not None
    bench._after(request, Ended(found))
    assert [e.on for e in bench.bench.entries] == [True, False] and bench.notice.startswith("Refused: parallel spring")
    assert bench.bench.ladder[-1].refused == found.steps[-1].refused
    bench.close()


def test_an_effect_that_is_on_the_bench_is_judged_beside_the_model_without_it(session, monkeypatch):
    asked = []
    monkeypatch.setattr(session.worker, "start", asked.append)
    session.add(FRICTION, {"torque_nm": 0.09})
    session.start(verbs.ADD, FRICTION)
    assert asked[0].config.model is None and not asked[0].own
    fitted = term("coulomb_friction", "servo", torque_nm=0.135)
    step = Step("coulomb friction at servo", 0.9, 0.9, "windows")
    session.switch(0, False, FRICTION)
    session._after(asked[0], Ended(Improved("", (), (fitted,), (), (step,), session.folder)))
    assert [(e.on, dict(e.term.values)) for e in session.bench.entries] == [(True, {"torque_nm": 0.135})]


def test_what_was_kept_stays_when_an_empty_bench_is_exported_or_shown(session, monkeypatch):
    asked = []
    monkeypatch.setattr(session.worker, "start", asked.append)
    session.add(FRICTION, {"torque_nm": 0.09})
    path = session.keep()
    text = path.read_text()
    kept, bare = (Compared(*[None] * len(fields(Compared))) for _ in range(2))
    session._after(asked[-1], Ended(kept))
    assert session.kept is kept and session.shown is kept
    session.remove(0, FRICTION)
    session.export("yaml")
    assert path.read_text() == text and "effects: []" not in text
    session.start(verbs.COMPARE)
    session._after(asked[-1], Ended(bare))
    assert session.kept is kept and session.shown is bare
