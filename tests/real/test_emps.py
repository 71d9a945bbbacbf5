"""The linear stage on real measurements: published errors and parameters by the published definition, found by the ladder."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from ee_dist.discrepancy.finished import BETTER
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.search.candidates import candidate, candidates
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.free_run.closed_loop import closed_loop
from ee_dist.effects.catalogue import apply
from ee_dist.effects.model_file import read_model
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import read_mapping

ROOT = Path(__file__).parents[2]
DATA = ROOT.parent / "shared" / "data" / "emps" / "train.csv"
EXAMPLES = ROOT / "docs" / "examples"

pytestmark = pytest.mark.skipif(not DATA.is_file(), reason="the EMPS record is not beside the repository")
MODEL = read_model(EXAMPLES / "emps_model.yaml")


@pytest.fixture(scope="module")
def problem() -> ForceBalance:
    record, _ = import_file(DATA, read_mapping(EXAMPLES / "emps.yaml"), MODEL.robot)
    return ForceBalance([MeasuredTrial(record.name, record.log)], MODEL.robot)


def fitted(problem: ForceBalance, *added: str) -> Fit:
    parts = [candidate(MODEL.robot, t.effect, t.target) for t in MODEL.terms]
    model = Model((*parts, *(candidate(MODEL.robot, e, "carriage") for e in added)))
    return fit_one(Search(problem), model, [0.05 * model.upper, 0.005 * model.upper])


@pytest.mark.parametrize(
    ("added", "published", "ours"),
    [
        ((), 0.180, 0.1795),
        (("coulomb_friction",), 0.072, 0.0711),
        (("coulomb_friction", "offset_torque"), 0.04083, 0.0403),
        (("coulomb_friction", "friction_asymmetry"), 0.03112, 0.0304),
    ],
)
def test_published_errors(problem: ForceBalance, added: tuple[str, ...], published: float, ours: float) -> None:
    """Less than published by what the force's own low-pass takes, and the end of the record, where filters have not settled."""
    fit = fitted(problem, *added)
    found = problem.natural(np.sqrt(fit.energy / len(problem.segment_of)))
    assert found == pytest.approx(ours, abs=1e-4) and found == pytest.approx(published, rel=0.03)


def test_published_parameters(problem: ForceBalance) -> None:
    robot = apply(MODEL.robot, fitted(problem, "coulomb_friction", "offset_torque").hypothesis)
    drive = robot.drives[0]
    found = (robot.part("carriage").mass_kg, drive.viscous, drive.coulomb, -drive.offset_torque)
    assert found == pytest.approx((95.11, 203.5, 20.39, -3.165), rel=0.005)
    d = apply(MODEL.robot, fitted(problem, "coulomb_friction", "friction_asymmetry").hypothesis).drives[0]
    sided = (d.viscous + d.viscous_asymmetry, d.viscous - d.viscous_asymmetry, d.coulomb + d.friction_asymmetry)
    assert sided == pytest.approx((166.7, 240.4, 20.14), rel=0.005)


def test_the_ladder_finds_them_in_order_and_stops(problem: ForceBalance) -> None:
    names = ("coulomb_friction", "friction_asymmetry", "offset_torque")
    found = improve(problem, candidates(MODEL.robot, only=names, families=problem.families), MODEL.terms)
    steps = [r.name for r in found.ladder]
    assert steps[2:] == ["coulomb_friction@carriage", "friction_asymmetry@carriage"]
    held = [100 * problem.natural(r.error_heldout) for r in found.ladder[1:]]
    assert held == pytest.approx([17.96, 7.12, 3.05], abs=0.011)
    assert found.last is not None and all(j.why_not for j in found.last.judged)
    assert found.verdict == BETTER, "what is left belongs to places on the screw, which no effect describes"


def test_closed_loop_errors_are_below_the_published(problem: ForceBalance) -> None:
    robot = apply(MODEL.robot, fitted(problem, "coulomb_friction", "offset_torque").hypothesis)
    # A third of the record, to be quick; tools/real_data.py runs all of it.
    trial = MeasuredTrial("first third", problem.measured[0].log.head(8000))
    (found,) = closed_loop([robot], trial, OneJointEngine())
    assert found.position < 0.000138
    assert found.speed < 0.00229
    assert found.acceleration < 0.086
    assert found.force < 0.0585


def test_what_is_left_repeats_with_position(problem: ForceBalance) -> None:
    found = problem.remains(fitted(problem, "coulomb_friction", "friction_asymmetry").hypothesis)
    assert found.rms == pytest.approx(1.67, abs=0.05)
    assert all(r.repeats > 0.9 for r in found.ripples)
    assert found.ripples[0].wavelength == pytest.approx(0.0025, rel=0.05)


def test_what_every_pass_of_a_place_shows_again_is_not_in_the_noise_floor(problem: ForceBalance) -> None:
    # 94 % of what is left while moving repeats: of 3.0 % of the force no more than 0.9 % can be noise.
    assert problem.noise_share == pytest.approx(0.0091, rel=0.1)
