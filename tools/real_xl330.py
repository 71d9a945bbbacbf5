"""XL330: from mass, motor and viscous damping up, each firmware gain held out in turn, in free runs of the whole record."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from real_tables import Page

from ee_dist.discrepancy.candidates import candidate, candidates
from ee_dist.discrepancy.fit import Fit, Model
from ee_dist.discrepancy.free_run import FreeRun
from ee_dist.discrepancy.global_fit import search_all
from ee_dist.discrepancy.ladder import Rule, Rung, climb, fit_everything
from ee_dist.discrepancy.measured import MeasuredTrial
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.effects.model_file import ModelFile, read_model, write_model
from ee_dist.engines.one_joint import OneJointEngine
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping import read_mapping
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
    trials = [MeasuredTrial(r.name, r.log, setup=r.believed) for r, _ in found]
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
    problem = FreeRun([t for t in trials if _gain(t) != hold], model.robot, evaluator, 5, effort=0.1 if quick else 1.0)
    held = FreeRun(own, model.robot, evaluator, 5, effort=0.1 if quick else 1.0)
    page.text(
        f"## kp {hold} held out", "", f"error: {problem.natural_name} over free runs, every recording counting the same"
    )
    families = {c.name: c for c in candidates(model.robot) if c.effect.family in ("drive", "world", "body") and c.size}
    proposals = [(c,) for c in families.values()]
    proposals.append((families[f"load_friction@{JOINT}"], families[f"quadratic_friction@{JOINT}"]))
    rungs = climb(problem, model.terms, proposals, Rule(judged=2 if quick else 8, steps=1 if quick else 4))
    _ladder(hold, rungs, problem, held, page)
    last = rungs[-1]
    notes = [f"found by tools/real_data.py xl330 with kp {hold} held out"]
    write_model(out / f"model_hold_{hold}.yaml", model.source, model.folder, last.hypothesis, notes)
    if not quick:
        _further(_structures(problem, held, model, page)[QUADRATIC], problem, held, model, page)
    seen, unseen = (1e3 * p.mean_absolute(last.hypothesis) for p in (problem, held))
    rows = [(n, f"{e:.1f}") for p, es in ((problem, seen), (held, unseen)) for n, e in zip(p.trials, es, strict=True)]
    page.table("Recording by recording, last model, mrad", ("recording", "error"), rows)
    page.text("model: " + "; ".join(map(str, last.hypothesis)), f"{time.monotonic() - begin:.0f} s")
    added = ", ".join(r.added for r in rungs[1:-1]) or "none"
    return f"kp {hold}", added, f"{seen.mean():.1f}", f"{unseen.mean():.1f}"


def _gain(trial: MeasuredTrial) -> int:
    match = re.match(r"kp (\d+)", trial.name)
    if not match:
        raise MeasurementError(f"trial {trial.name!r}: its name does not begin with its gain, such as 'kp 400'")
    return int(match.group(1))


def _mrad(problem: FreeRun, hypothesis: Hypothesis) -> float:
    return float(1e3 * problem.mean_absolute(hypothesis).mean())


def _ladder(hold: int, rungs: Sequence[Rung], problem: FreeRun, held: FreeRun, page: Page) -> None:
    rows = []
    for r in rungs[:-1]:
        best = next((v for v in r.tried if v.name == r.added), None)
        gain = ("", "") if best is None else (f"{best.gain:.0%}", f"{best.t:.1f}")
        rows.append(
            (
                r.added,
                f"{_mrad(problem, r.hypothesis):.1f}",
                f"{1e3 * r.error_heldout:.1f}",
                *gain,
                f"{_mrad(held, r.hypothesis):.1f}",
            )
        )
        for v in r.tried:
            if v.tied:
                fit = fit_everything(problem, v.model, [v.u]).hypothesis
                found = (f"{_mrad(problem, fit):.1f}", f"{1e3 * v.error_heldout:.1f}", f"{v.gain:.0%}", f"{v.t:.1f}")
                rows.append((f"or {v.name}", *found, f"{_mrad(held, fit):.1f}"))
    page.text("'or': not told from the step above by held-out data", "")
    page.table(
        f"The ladder, kp {hold} held out, mrad",
        ("step", "fitted gains", "held out while fitting", "gain there", "t", f"kp {hold}"),
        rows,
    )
    for r in rungs[1:]:
        what = "what else was proposed with it" if r.added != "stopped" else "what did not earn a place at the end"
        page.table(
            f"{r.added}: {what}, mrad held out while fitting",
            ("effect", "held out", "gain", "t", "why not"),
            [(v.name, f"{1e3 * v.error_heldout:.1f}", f"{v.gain:+.0%}", f"{v.t:.1f}", v.why_not) for v in r.tried],
        )


def _structures(problem: FreeRun, held: FreeRun, model: ModelFile, page: Page) -> list[Fit]:
    """Nested friction models of the literature, fitted on the same gains."""
    base = [candidate(model.robot, t.effect, t.target) for t in model.terms]
    starts = []
    for added in STRUCTURES.values():
        parts = Model((*base, *(candidate(model.robot, e, JOINT) for e in added)))
        starts.append((parts, np.where(parts.upper > 0, 0.02, 0.0)))
    fits = search_all(problem, starts, (), _all(problem), generations=45, seeds=(1, 2))
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
    fits = search_all(problem, starts, (), _all(problem), generations=30, seeds=(1,), sigma=0.04)
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


def _all(problem: FreeRun) -> np.ndarray:
    return np.ones(len(problem.segment_of), dtype=bool)
