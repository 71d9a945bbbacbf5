"""EMPS: from mass and viscous damping up, by held-out blocks of time; then every published model beside ours."""

from __future__ import annotations

import time
from pathlib import Path

from real_tables import Page

from ee_dist.discrepancy.evidence.holdout import cross_fit, windows
from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import error
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.free_run.closed_loop import closed_loop
from ee_dist.effects.catalogue import apply
from ee_dist.effects.model_file import ModelFile, read_model, write_model
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.report import describe as report

EXAMPLES = Path(__file__).resolve().parents[1] / "docs" / "examples"
JOINT = "carriage"
PUBLISHED = {
    "mass + viscous": ((), "18.0"),
    "+ Coulomb": (("coulomb_friction",), "7.2"),
    "+ offset": (("coulomb_friction", "offset_torque"), "4.083"),
    "+ friction by direction": (("coulomb_friction", "friction_asymmetry"), "3.112"),
}
PUBLISHED_SIMULATION = ("0.0138", "0.229", "8.60", "5.85")
"""Per cent: position, velocity, acceleration, force, with the model with an offset."""


def run(data: Path, out: Path, page: Page) -> None:
    """The whole account. Raises MeasurementError where the data cannot be read."""
    begin = time.monotonic()
    model = read_model(EXAMPLES / "emps_model.yaml")
    record, seen = import_file(
        data / "train.csv" if data.is_dir() else data, read_mapping(EXAMPLES / "emps.yaml"), model.robot
    )
    page.text(report([seen]))
    trial = MeasuredTrial(record.name, record.log)
    problem = ForceBalance([trial], model.robot)
    page.text(f"error: {problem.error_definition}", f"one noise unit is {problem.natural(1.0):.2%} of the force")
    pool = pool_of(problem)
    found = improve(problem, pool, model.terms)
    page.table(
        f"The ladder, found by held-out windows of time ({len(pool)} effects proposed at each step)",
        ("step", "fitted, %", "held out, %", "held out is"),
        [
            (r.name, f"{_percent(problem, r.error_fit):.3f}", f"{_percent(problem, r.error_heldout):.3f}", r.held_out)
            for r in found.ladder
        ],
    )
    refused = [j for j in (found.last.judged if found.last else []) if not j.earned]
    page.table(
        f"What did not earn a place on top of {found.ladder[-1].name}",
        ("effect", "held out, %", "gain of the squared error", "why not"),
        [(j.name, f"{_percent(problem, j.error_heldout):.3f}", f"{j.gain:+.1%}", j.why_not) for j in refused],
    )
    page.text(f"verdict: {found.verdict}, {found.explained:.1%} of what is above the noise; {found.stopped}")
    write_model(out / "model.yaml", model.source, model.folder, found.terms, ["found by tools/real_data.py emps"])
    fits = _published(problem, model, page)
    _parameters(fits, model, page)
    _simulations(fits, model, trial, page)
    page.text("**What is left**", "", *problem.remarks(found.terms))
    page.text(f"{time.monotonic() - begin:.0f} s")


def _percent(problem: ForceBalance, value: float) -> float:
    return 100 * problem.natural(value)


def _published(problem: ForceBalance, model: ModelFile, page: Page) -> dict[str, Fit]:
    """Each published structure fitted to the whole record, as published."""
    search, fits, rows = Search(problem), {}, []
    base = [candidate(model.robot, t.effect, t.target) for t in model.terms]
    for name, (added, published) in PUBLISHED.items():
        parts = Model((*base, *(candidate(model.robot, e, JOINT) for e in added)))
        fit = fit_one(search, parts, [0.05 * parts.upper, 0.005 * parts.upper])
        held = cross_fit(search, [(parts, fit.u)], windows(problem))[0].residual
        fits[name] = fit
        ours = _percent(problem, (fit.energy / len(problem.segment_of)) ** 0.5)
        rows.append((name, f"{ours:.3f}", published, f"{_percent(problem, error(held)):.3f}"))
    page.table("Relative force error, %", ("model", "ours", "published", "held out"), rows)
    return fits


def _parameters(fits: dict[str, Fit], model: ModelFile, page: Page) -> None:
    rows: list[tuple[str, ...]] = []

    def row(name: str, ours: float, published: float) -> None:
        rows.append((name, f"{ours:.2f}", f"{published:.2f}", f"{100 * (ours / published - 1):+.1f} %"))

    drive = _drive(model, fits["+ offset"])
    row("mass, kg (with offset)", apply(model.robot, fits["+ offset"].hypothesis).part("carriage").mass_kg, 95.11)
    row("viscous, N.s/m", drive.viscous, 203.5)
    row("Coulomb, N", drive.coulomb, 20.39)
    row("offset, N (force that the drive must give)", -drive.offset_torque, -3.165)
    drive = _drive(model, fits["+ friction by direction"])
    row("viscous up, N.s/m (by direction)", drive.viscous + drive.viscous_asymmetry, 166.7)
    row("viscous down, N.s/m", drive.viscous - drive.viscous_asymmetry, 240.4)
    row("Coulomb up, N", drive.coulomb + drive.friction_asymmetry, 20.14)
    row("Coulomb down, N", drive.coulomb - drive.friction_asymmetry, 20.63)
    page.table("Parameters", ("parameter", "ours", "published", "difference"), rows)


def _drive(model: ModelFile, fit: Fit):  # type: ignore[no-untyped-def]
    return apply(model.robot, fit.hypothesis).drives[0]


def _simulations(fits: dict[str, Fit], model: ModelFile, trial: MeasuredTrial, page: Page) -> None:
    found = closed_loop([apply(model.robot, f.hypothesis) for f in fits.values()], trial, OneJointEngine())
    rows = [
        (name, f"{100 * e.position:.4f}", f"{100 * e.speed:.3f}", f"{100 * e.acceleration:.2f}", f"{100 * e.force:.2f}")
        for name, e in zip(fits, found, strict=True)
    ]
    rows.append(("published (+ offset)", *PUBLISHED_SIMULATION))
    page.table(
        "Closed-loop simulation of the whole record, relative error, %",
        ("model", "position", "velocity", "acceleration", "force"),
        rows,
    )
