"""What explains with numbers that no data tell apart gives way to what explains plainly; friction by load is no way to shrink a
residual along with the force that it is a share of."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from linear_problem import ROBOT, Linear
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.evidence.holdout import HeldOut, windows
from ee_dist.discrepancy.evidence.judge import VAGUE, judge, ranked, tied
from ee_dist.discrepancy.examine import Current
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.candidates import Proposal, candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.told import told_only
from ee_dist.effects.catalogue import term
from ee_dist.robots.model import Robot
from ee_dist.tasks.results.tables import TIED_STANDING, kind_of, standing


def judged(explained: float, vague: bool) -> object:
    """The least of a judgement that a ranking looks at."""
    cut = SimpleNamespace(by_unit=lambda e: e)
    one = SimpleNamespace(
        name=f"{explained}", explained=explained, vague=vague, why_not="", held=np.full(20, 1000.0 * (1 - explained)),
        outcome=SimpleNamespace(fits=(), cut=cut), dispersion=1.0,
        proposal=SimpleNamespace(size=4 if vague else 1, guess=False, parts=()),
        tied_with=[], rank=0, sure=0.0,
    )  # fmt: skip
    return Following(one)


class Following:
    """Has ``earned`` and ``stands`` follow ``why_not``."""

    def __init__(self, one: SimpleNamespace) -> None:
        self.__dict__.update(one.__dict__)
        self.gain = self.explained

    @property
    def earned(self) -> bool:
        return not self.why_not

    @property
    def stands(self) -> bool:
        return self.earned or self.why_not == VAGUE


def test_the_same_and_more_is_no_other_explanation() -> None:
    """Friction by load is not to be told apart from friction by load and by its square."""
    alone, both, other = judged(0.8999, vague=False), judged(0.9, vague=False), judged(0.8998, vague=False)
    one, two = SimpleNamespace(name="load"), SimpleNamespace(name="square")
    for j, parts in ((alone, (one,)), (both, (one, two)), (other, (two,))):
        j.proposal = SimpleNamespace(size=len(parts), guess=False, parts=parts)  # type: ignore[attr-defined]
        j.sure = 1000.0  # type: ignore[attr-defined]
    order = ranked([both, alone, other])  # type: ignore[list-item]
    assert order[0] is alone and order[0].tied_with == ["0.8998"]


def test_less_of_the_same_is_no_other_explanation() -> None:
    """Of friction by load and by its square, which is none, the first alone is no rival."""
    third, both, alone = judged(0.9, vague=False), judged(0.8999, vague=False), judged(0.8998, vague=False)
    one, two, other = (SimpleNamespace(name=n) for n in ("load", "square", "com"))
    for j, parts, size in ((third, (other,), 3), (both, (one, two), 2), (alone, (one,), 3)):
        j.proposal = SimpleNamespace(size=size, guess=False, parts=parts)  # type: ignore[attr-defined]
        j.sure = 1000.0  # type: ignore[attr-defined]
    for none in (False, True):
        both.none_in_it = none  # type: ignore[attr-defined]
        order = ranked([third, both, alone])  # type: ignore[list-item]
        assert order[0] is both and order[0].tied_with == (["0.9"] if none else ["0.9", "0.8998"])


@pytest.mark.parametrize(("plain", "named"), [(0.3, 0.3), (0.2, 0.9)])
def test_a_vague_explanation_gives_way_to_a_plain_one_that_explains_as_much_for_each_number(
    plain: float, named: float
) -> None:
    vague, other = judged(0.9, vague=True), judged(plain, vague=False)
    order = ranked([vague, other])  # type: ignore[list-item]
    assert order[0].explained == named
    assert vague.why_not == (VAGUE if plain == named else "")  # type: ignore[attr-defined]


def test_what_is_vague_and_explains_as_much_may_be_true_and_is_named_as_tied() -> None:
    vague, plain, less = judged(0.9, vague=True), judged(0.8999, vague=False), judged(0.5, vague=False)
    order = ranked([vague, plain, less])  # type: ignore[list-item]
    assert [j.explained for j in order[:2]] == [0.8999, 0.5]
    assert order[0].tied_with == ["0.9"]
    assert not vague.earned  # type: ignore[attr-defined]
    assert [kind_of(j, order[0]) for j in order] == ["best", "earned", "tied"]
    assert standing(order[2], order[0]) == f"{TIED_STANDING}, but {VAGUE}"


def test_a_law_of_two_numbers_is_vague_where_the_two_cannot_be_told_apart() -> None:
    problem = Linear(())
    rng, rows = np.random.default_rng(0), len(problem.trial_of)
    part, mask = candidate(problem.robot, "friction_asymmetry", ROBOT.motor_names[0]), np.ones(rows, dtype=bool)
    one, other, noise = rng.standard_normal((3, rows))
    said = {}
    for name, second in (("alike", one + 1e-4 * other), ("apart", other)):
        slopes = 30.0 * np.stack([one, second], axis=1)
        fit = Fit(Model((part,)), np.array([0.3, 0.3]), float(noise @ noise), noise, slopes, mask)
        found = HeldOut(windows(problem), noise, 1.0, (fit, fit))
        said[name] = judge(problem, 2.0 * noise, found, Proposal((part,)), fit.model, 10).vague
    assert said == {"alike": True, "apart": False}


def arm_with(share: float) -> tuple[Robot, object]:
    sample = samples()["arm"]
    hidden = tuple(term("load_friction", m, share=share) for m in sample.robot.motor_names) if share else ()
    trials = tuple(replace(t) for t in measure(sample, hidden))
    return sample.robot, problem_by("force_balance", trials, sample.robot)


def test_friction_by_load_does_not_shrink_what_is_left() -> None:
    robot, problem = arm_with(0.0)
    heavier = (term("part_mass", "upper", change=0.8), term("part_mass", "lower", change=0.8))
    rubbing = tuple(term("load_friction", m, share=0.75) for m in robot.motor_names)
    wrong, shrunk = problem.residuals([heavier, (*heavier, *rubbing)])  # type: ignore[attr-defined]
    assert error(shrunk) > error(wrong)


def test_friction_by_load_is_found_at_its_size() -> None:
    robot, problem = arm_with(0.3)
    model = Model(tuple(candidate(robot, "load_friction", m) for m in robot.motor_names))
    fit = fit_one(Search(problem), model, [np.full(2, 0.1)])  # type: ignore[arg-type]
    assert [t.values[0][1] for t in fit.hypothesis] == pytest.approx([0.3, 0.3], rel=0.1)


def test_of_two_with_the_same_mark_one_stays_and_says_it_all() -> None:
    sample = samples()["arm"]
    problem = problem_by("open_loop", measure(sample, (term("zero_offset", "elbow", offset_rad=0.1),)), sample.robot)
    zero, torque, friction = (
        candidate(sample.robot, e, "elbow") for e in ("zero_offset", "offset_torque", "viscous_friction")
    )
    # Within so little either may be anything, if the other makes up for it.
    torque = replace(torque, bounds=tuple((0.2 * low, 0.2 * high) for low, high in torque.bounds))
    search, parts = Search(problem), (zero, torque, friction)
    fit = fit_one(search, Model(parts), [np.array([0.15, 0.5, 0.01])])
    told = told_only(search, Current(parts, fit.u), 0, windows(problem), 100, open_only=True)
    left, gone = told.then, told.gone
    assert gone == ("offset_torque@elbow",)
    assert zero.values(left.u[:1])["offset_rad"] == pytest.approx(0.1, abs=0.01), "it says it all"
    assert told_only(search, left, 0, windows(problem), 100, open_only=True).gone == ()


def test_what_leaves_many_times_as_much_is_no_tie_however_few_the_pieces() -> None:
    """Of two pieces an interval of the difference holds nearly anything."""
    better, worse = judged(0.9, vague=False), judged(0.3, vague=False)
    worse.held = np.array([90.0, 20000.0])  # type: ignore[attr-defined]
    better.held = np.array([100.0, 1900.0])  # type: ignore[attr-defined]
    assert not tied(better, worse)  # type: ignore[arg-type]
    worse.held = np.array([90.0, 6000.0])  # type: ignore[attr-defined]
    assert tied(better, worse)  # type: ignore[arg-type]
