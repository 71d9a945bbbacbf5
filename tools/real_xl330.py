"""XL330: from mass, motor and viscous damping up, each firmware gain held out in turn, in free runs of the whole record."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from real_tables import Page

from ee_dist.discrepancy.examine import STANDARD_EFFORT, Effort
from ee_dist.discrepancy.improve import MOST, improve
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fit import fit_all
from ee_dist.discrepancy.search.fitted import Fit, Model
from ee_dist.discrepancy.search.pool import pool_of
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.model_file import ModelFile, read_model, write_model
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.report import describe

EXAMPLES = Path(__file__).resolve().parents[1] / "docs" / "examples"
JOINT = "servo"
STRUCTURES = {
    "viscous": (),
    "+ Coulomb": ("coulomb_friction",),
    "+ Coulomb, load": ("coulomb_friction", "load_friction"),
    "+ Coulomb, load, quadratic": ("coulomb_friction", "load_friction", "quadratic_friction"),
    "+ Coulomb, load, load Stribeck, quadratic": (
        "coulomb_friction",
        "load_friction",
        "load_stribeck_friction",
        "quadratic_friction",
    ),
    "+ Coulomb, Stribeck": ("coulomb_friction", "stribeck_friction"),
    "+ Coulomb, load, back-driving": ("coulomb_friction", "load_friction", "backdrive_friction"),
}
QUADRATIC = 3
"""Place of the model that further effects are tried on."""
FURTHER = (
    "supply_sag",
    "command_delay",
    "backlash",
    "elastic_transmission",
    "stribeck_friction",
    "load_stribeck_friction",
    "backdrive_friction",
    "friction_asymmetry",
    "deadband",
)
"""Effects of such servos, each tried on top of Coulomb, load and quadratic friction."""


def run(data: Path, out: Path, page: Page, holds: Sequence[int], quick: bool) -> None:
    """The whole account. Raises MeasurementError where the data cannot be read."""
    model = read_model(EXAMPLES / "xl330_model.yaml")
    files = sorted(data.glob("*.json"))
    if not files:
        raise MeasurementError(f"{data}: no recordings (.json) there")
    mapping = read_mapping(EXAMPLES / "xl330.yaml")
    found = [import_file(f, mapping, model.robot, i) for i, f in enumerate(files)]
    (out / "import.txt").write_text(describe([r for _, r in found]) + "\n", encoding="utf-8")
    trials = [MeasuredTrial(r.name, r.log, setup=r.believed, commands_held=True) for r, _ in found]
    page.text(f"{len(trials)} recordings read; what was done to each: {out / 'import.txt'}")
    summary = [_held_out(hold, trials, model, out, page, quick) for hold in holds]
    page.table(
        "Mean absolute position error in free runs over 6 s, mrad, last model of each ladder",
        ("gain held out", "effects found", "fitted gains", "held-out gain"),
        summary,
    )


def _held_out(
    hold: int, trials: Sequence[MeasuredTrial], model: ModelFile, out: Path, page: Page, quick: bool
) -> tuple[str, ...]:
    begin = time.monotonic()
    own = [t for t in trials if _gain(t) == hold]
    if not own:
        raise MeasurementError(
            f"--hold {hold}: no recording at that gain; there are: {sorted({_gain(t) for t in trials})}"
        )
    evaluator = SerialEvaluator(OneJointEngine(1024), 1024)
    problem = FreeRun([t for t in trials if _gain(t) != hold], model.robot, evaluator, 5)
    held = FreeRun(own, model.robot, evaluator, 5)
    page.text(
        f"## kp {hold} held out", "", f"error: {problem.natural_name} over free runs, every recording counting the same"
    )
    effort = Effort(first=6, second=3, final=2, starts=1) if quick else STANDARD_EFFORT
    searched = problem.searched
    ladder = improve(searched, pool_of(searched), model.terms, effort=effort, most=1 if quick else MOST)
    _ladder(hold, ladder, problem, held, page)
    notes = [f"found by tools/real_data.py xl330 with kp {hold} held out"]
    write_model(out / f"model_hold_{hold}.yaml", model.source, model.folder, ladder.terms, notes)
    if not quick:
        _further(_structures(problem, held, model, page)[QUADRATIC], problem, held, model, page)
    seen, unseen = (1e3 * p.mean_absolute(ladder.terms) for p in (problem, held))
    rows = [(n, f"{e:.1f}") for p, es in ((problem, seen), (held, unseen)) for n, e in zip(p.trials, es, strict=True)]
    page.table("Recording by recording, last model, mrad", ("recording", "error"), rows)
    page.text("model: " + "; ".join(map(str, ladder.terms)), f"{time.monotonic() - begin:.0f} s")
    added = ", ".join(r.name for r in ladder.ladder if r.added) or "none"
    return f"kp {hold}", added, f"{seen.mean():.1f}", f"{unseen.mean():.1f}"


def _gain(trial: MeasuredTrial) -> int:
    match = re.match(r"kp (\d+)", trial.name)
    if not match:
        raise MeasurementError(f"trial {trial.name!r}: its name does not begin with its gain, such as 'kp 400'")
    return int(match.group(1))


def _mrad(problem: FreeRun, hypothesis: Hypothesis) -> float:
    return float(1e3 * problem.mean_absolute(hypothesis).mean())


def _ladder(hold: int, found: Improvement, problem: FreeRun, held: FreeRun, page: Page) -> None:
    """The steps, each fitted anew on all that may be seen, beside what the data do not tell from them."""
    rows = [
        (
            r.name,
            f"{_mrad(problem, r.terms):.1f}",
            f"{1e3 * problem.natural(r.error_heldout):.1f}",
            r.held_out,
            f"{_mrad(held, r.terms):.1f}",
            ", ".join(r.tied_with) or "-",
            ", ".join(r.dropped) or "-",
        )
        for r in found.ladder
    ]
    page.table(
        f"The ladder, kp {hold} held out, mrad",
        ("step", "fitted gains", "held out while fitting", "what that was", f"kp {hold}", "not told from", "dropped"),
        rows,
    )
    refused = [j for j in (found.last.judged if found.last else []) if not j.earned]
    page.table(
        "What did not earn a place at the end, mrad held out while fitting",
        ("effect", "held out", "gain of the error's square", "why not"),
        [(j.name, f"{1e3 * problem.natural(j.error_heldout):.1f}", f"{j.gain:+.0%}", j.why_not) for j in refused],
    )
    page.text(f"verdict: {found.verdict}, {found.explained:.0%} of what is above the noise; {found.stopped}")


def _structures(problem: FreeRun, held: FreeRun, model: ModelFile, page: Page) -> list[Fit]:
    """Nested friction models of the literature, fitted on the same gains."""
    base = [candidate(model.robot, t.effect, t.target) for t in model.terms]
    starts = []
    for added in STRUCTURES.values():
        parts = Model((*base, *(candidate(model.robot, e, JOINT) for e in added)))
        starts.append((parts, np.where(parts.upper > 0, 0.02, 0.0)))
    fits = fit_all(Search(problem.searched), starts)
    rows = [
        (name, f"{_mrad(problem, f.hypothesis):.1f}", f"{_mrad(held, f.hypothesis):.1f}")
        for name, f in zip(STRUCTURES, fits, strict=True)
    ]
    page.table("Friction models given by hand, mrad", ("model", "fitted gains", "held-out gain"), rows)
    return fits


def _further(fit: Fit, problem: FreeRun, held: FreeRun, model: ModelFile, page: Page) -> None:
    """What each further effect changes when it is added to the last model and all is refitted nearby."""
    inside = {c.name for c in fit.model.parts}
    names = [n for n in FURTHER if f"{n}@{'supply' if n == 'supply_sag' else JOINT}" not in inside]
    extra = [candidate(model.robot, n, "supply" if n == "supply_sag" else JOINT) for n in names]
    starts = [(fit.model, fit.u)]
    starts += [(Model((*fit.model.parts, c)), np.concatenate([fit.u, np.where(c.upper > 0, 0.02, 0.0)])) for c in extra]
    fits = fit_all(Search(problem.searched), starts)
    before = [_mrad(p, fits[0].hypothesis) for p in (problem, held)]
    rows = [("(the same refit, nothing added)", f"{before[0]:.1f}", "", f"{before[1]:.1f}", "", "")]
    for f in fits[1:]:
        now = [_mrad(p, f.hypothesis) for p in (problem, held)]
        rows.append(
            (
                f.hypothesis[-1].effect,
                f"{now[0]:.1f}",
                f"{now[0] - before[0]:+.1f}",
                f"{now[1]:.1f}",
                f"{now[1] - before[1]:+.1f}",
                ", ".join(f"{k} {v:.3g}" for k, v in f.hypothesis[-1].values),
            )
        )
    page.table(
        "Each further effect on top of Coulomb, load and quadratic friction, all refitted, mrad",
        ("effect", "fitted gains", "change", "held-out gain", "change", "its value"),
        rows,
    )
