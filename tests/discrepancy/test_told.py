"""What leaves a model in the end: what is not told from neutral, and what is told by slopes alone."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from linear_problem import ROBOT, Linear
from way_samples import Sample, measure, problem_by

from ee_dist.discrepancy import told as telling
from ee_dist.discrepancy.evidence.holdout import PRIOR, travelling
from ee_dist.discrepancy.evidence.intervals import parameters
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.exchanges import nearest
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.search.valley import follow_valley
from ee_dist.discrepancy.told import Told, _left_out, _told, told_only
from ee_dist.discrepancy.torque_scale import STRENGTH
from ee_dist.effects.catalogue import Term, term
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.trials.excitation import Excitation
from ee_dist.trials.noise import with_noise

PENDULUM = with_noise(servo_pendulum(), 1e-3)
SERVO, ARM = PENDULUM.motor_names[0], PENDULUM.parts[1].name
PLAN = tuple(Excitation(k, 3.0, a, n) for k, a, n in (("multisine", 0.5, 1), ("steps", 0.4, 2), ("slow_sines", 0.5, 3)))
FRICTION = (
    term("coulomb_friction", SERVO, torque_nm=0.019),
    term("viscous_friction", SERVO, damping_nm_s_rad=0.0074),
)


def model_of(*terms: Term, more: tuple[tuple[str, str], ...]) -> Model:
    names = [*((t.effect, t.target) for t in terms), *more]
    return Model(tuple(candidate(PENDULUM, effect, target) for effect, target in names))


def search_of(*hidden: Term) -> Search:
    return Search(problem_by("open_loop", measure(Sample(PENDULUM, PLAN, hidden, ()), hidden), PENDULUM))


def settled(search: Search, model: Model) -> Fit:
    """The fit from values away from neutral: on a ridge it ends near where it began along it."""
    start = np.full(sum(c.size for c in model.parts), 0.1)
    (fit,) = follow_valley(search, [(model, start)], search.everything, PRIOR, widths=(0.03,))
    return fit


def ridge() -> tuple[Search, Fit]:
    """One of mass, rotor and spring."""
    mass, spring = (
        term("part_mass", ARM, change=0.021),
        term("parallel_spring", SERVO, stiffness_nm_rad=0.56, rest_rad=-0.17),
    )
    search = search_of(mass, *FRICTION, spring)
    return search, settled(search, model_of(mass, *FRICTION, spring, more=(("rotor_inertia", SERVO),)))


def told(search: Search, fit: Fit) -> Told:
    return told_only(search, Current(fit.model.parts, fit.u), 0, travelling(search.problem)[0], 100)


def test_what_is_not_missed_by_simulation_leaves_though_slopes_tell_it() -> None:
    search, fit = ridge()
    left = told(search, fit)
    assert left.gone == (f"rotor_inertia@{SERVO}",)
    (anew,) = follow_valley(search, [(Model(left.then.parts), left.then.u)], search.everything, PRIOR, widths=(0.03,))
    found = {p.name: p for p in parameters(search.problem, anew)}
    assert found["change"].low <= 0.021 <= found["change"].high


def test_slopes_alone_tell_it(monkeypatch: pytest.MonkeyPatch) -> None:
    """Why it is simulated without."""
    monkeypatch.setattr("ee_dist.discrepancy.told._not_missed", lambda *_: None)
    search, fit = ridge()
    assert told(search, fit).gone == ()


def test_what_is_missed_stays() -> None:
    rotor = term("rotor_inertia", SERVO, added_kg_m2=0.004)
    mass = term("part_mass", ARM, change=0.1)
    search = search_of(mass, rotor, *FRICTION)
    fit = settled(search, model_of(mass, rotor, *FRICTION, more=()))
    left = told(search, fit)
    assert left.gone == () and left.instead == frozenset()


def test_what_could_be_in_the_place_of_what_stayed_is_told() -> None:
    """Mass, rotor and centre of a pendulum are three where its motion has two."""
    shifted = term("com_shifted", ARM, along_x_m=-0.034, along_y_m=0.0, along_z_m=0.057)
    mass = term("part_mass", ARM, change=0.065)
    search = search_of(mass, shifted, *FRICTION)
    fit = settled(search, model_of(mass, shifted, *FRICTION, more=(("rotor_inertia", SERVO),)))
    left = told(search, fit)
    assert len(left.gone) == 1 and left.gone[0] in {f"part_mass@{ARM}", f"rotor_inertia@{SERVO}"}
    assert left.instead == frozenset(left.gone)
    pool = [*fit.model.parts]
    _, unasked, _ = nearest(search, left.then, 0, pool)
    then, twins, _ = nearest(search, left.then, 0, pool, left.instead)
    assert unasked == [] and [t.term.name for t in twins] + [c.name for c in then.parts if c.name in left.gone]


def test_a_weak_motor_is_told_where_small_values_say_it_together() -> None:
    """Mass, rotor and friction larger by one factor are a motor that is weaker by it, if nothing else of it is off."""
    weak, offset = term("motor_weak", SERVO, loss=0.5), term("zero_offset", SERVO, offset_rad=-0.02)
    search = search_of(weak, offset, *FRICTION)
    heavy = (("part_mass", ARM), ("rotor_inertia", SERVO))
    fit = settled(search, model_of(offset, *FRICTION, more=heavy))
    current = Current(fit.model.parts, fit.u)
    then, twins, _ = nearest(search, current, 0, [*fit.model.parts, candidate(PENDULUM, "motor_weak", SERVO)])
    terms = [*(t.term for t in twins), *then.hypothesis]
    (loss,) = {round(t.values[0][1], 2) for t in terms if t.effect == "motor_weak"}
    assert loss == pytest.approx(0.5, abs=0.03)


def test_torques_that_are_all_larger_are_told_where_masses_seem_far_too_small() -> None:
    """Nobody looks for them unasked: hardly any model would not be a little better for some."""
    strong = term("motor_strength", SERVO, change=1.2)
    search = search_of(strong, *FRICTION)
    light = (("part_mass", ARM), ("rotor_inertia", SERVO), ("position_gain", SERVO))
    fit = settled(search, model_of(*FRICTION, more=light))
    mass = next(t for t in fit.hypothesis if t.effect == "part_mass")
    assert mass.values[0][1] < -0.3
    current = Current(fit.model.parts, fit.u)
    then, _, step = nearest(search, current, 0, pool_of(search.problem))
    assert step is not None and step.dropped == (f"part_mass@{ARM}",)
    (change,) = (t.values[0][1] for t in then.hypothesis if t.effect == STRENGTH)
    assert change == pytest.approx(1.2, abs=0.05)
    assert STRENGTH not in {c.effect.name for c in nearest(search, current, 0, fit.model.parts)[0].parts}, "not asked"


def test_a_motor_that_lost_more_than_half_is_called_weak_where_all_else_seems_heavier() -> None:
    """Strength and weakness are one thing, of which the fault is what people know."""
    search = search_of(term("motor_weak", SERVO, loss=0.62), *FRICTION)
    heavy = (("part_mass", ARM), ("com_shifted", ARM))
    fit = settled(search, model_of(*FRICTION, more=heavy))
    current = Current(fit.model.parts, fit.u)
    then, twins, _ = nearest(search, current, 0, pool_of(search.problem))
    terms = [*(t.term for t in twins), *then.hypothesis]
    assert STRENGTH not in {t.effect for t in terms}
    (loss,) = {round(t.values[0][1], 2) for t in terms if t.effect == "motor_weak"}
    assert loss == pytest.approx(0.62, abs=0.03)


@pytest.mark.parametrize(("extra", "apart"), [(0.0, False), (4.0, True)])
def test_masses_go_together_but_for_those_that_nothing_tells_far_from_the_noise(extra: float, apart: bool) -> None:
    """At the noise some without the others would have to stand in for these. Far from it one that is told would keep others at
    their bounds."""
    parts = ROBOT.parts[0].name, *(p.name for p in ROBOT.parts[1:4])
    model = Model(tuple(candidate(ROBOT, "part_mass", p) for p in parts))
    search = Search(Linear((term("part_mass", parts[0], change=0.6),), motions=4, extra=extra))
    (fit,) = follow_valley(search, [(model, np.zeros(4))], search.everything, PRIOR)
    left = told_only(search, Current(fit.model.parts, fit.u), 0, travelling(search.problem)[0], 100)
    assert {c.target for c in left.then.parts} == ({parts[0]} if apart else set(parts))
    assert len(left.gone) == (3 if apart else 0)


def test_what_goes_by_itself_is_asked_for_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Far from the noise only masses, which went together, are asked for once more."""
    asked: list[object] = []
    monkeypatch.setattr(telling, "_left_out", lambda *a: asked.append(a[-1]) or _left_out(*a))
    friction = tuple(candidate(ROBOT, "coulomb_friction", m) for m in ROBOT.motor_names[:3])
    masses = tuple(candidate(ROBOT, "part_mass", p.name) for p in ROBOT.parts[1:3])
    hidden = tuple(c.term(np.full(c.size, 0.5)) for c in (*friction, *masses))
    search = Search(Linear(hidden, motions=4, extra=6.0))
    for parts, times in ((friction, 1), ((*friction, *masses), 2)):
        (fit,) = follow_valley(search, [(Model(parts), np.zeros(len(parts)))], search.everything, PRIOR)
        asked.clear()
        told_only(search, Current(fit.model.parts, fit.u), 0, travelling(search.problem)[0], 100)
        assert len(asked) == times


def test_when_a_sensor_sticks_does_not_tell_that_it_does() -> None:
    """Which moment that is may be plain in noise, of a share that may be none."""
    stuck = candidate(PENDULUM, "sensor_stuck", PENDULUM.sensors[0].name)
    fit: Any = SimpleNamespace(model=Model((stuck,)), u=np.array([0.02, 0.7]))
    assert _told(fit, np.array([0.04, 0.01])) == [0.5]
