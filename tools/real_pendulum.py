"""A double pendulum under torque control: which friction, by free runs and by a balance of forces, and where the two disagree.

Reads the import that docs/real_data.md makes. Laws are given by hand, so that both ways answer the same question; each is fitted
with one motion held out after the other. Free runs are started anew from the measured state every ``RESTART_S``: a free swing
left to itself for ten seconds is chaotic, and says nothing about anything.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from real_tables import Page

from ee_dist.discrepancy.evidence.holdout import cross_fit, travelling
from ee_dist.discrepancy.evidence.intervals import parameters
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Problem, error
from ee_dist.discrepancy.search.candidates import candidate
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.discrepancy.ways.free_run.problem import FreeRun
from ee_dist.engines.mujoco.engine import MuJoCoEngine
from ee_dist.evaluation.serial import SerialEvaluator
from ee_dist.recording.reader import read_run

LAWS = {
    "nothing": (),
    "viscous": ("viscous_friction",),
    "Coulomb": ("coulomb_friction",),
    "Coulomb and viscous": ("coulomb_friction", "viscous_friction"),
}
RESTART_S = 0.5
START = 0.05
"""Share of the range from which a fit begins."""


def run(folder: Path, page: Page) -> None:
    """``folder`` is that of the import."""
    record = read_run(folder / "measured.mcap")
    trials = [MeasuredTrial(t.name, t.log, t.driver) for t in record.trials]
    windows = FreeRun(trials, record.robot, SerialEvaluator(MuJoCoEngine(1), 1024), windows_s=RESTART_S)
    names = (f"free runs of {RESTART_S:g} s, mrad", "balance of forces, %")
    for name, problem in zip(names, (windows, ForceBalance(trials, record.robot)), strict=True):
        _table(name, problem, page)


def _table(name: str, problem: Problem, page: Page) -> None:
    """A row for each law: errors fitted and held out, and its numbers with their 95 % intervals."""
    search, cut = Search(problem), travelling(problem)[0]
    scale = 1e3 if problem.way == "free_run" else 100.0

    def told(value: float) -> str:
        return f"{scale * problem.natural(value):.1f}"

    rows = []
    for law, effects in LAWS.items():
        parts = tuple(candidate(problem.robot, e, m) for e in effects for m in problem.robot.motor_names)
        if not parts:
            as_it_is = told(error(search.base()))
            rows.append((law, as_it_is, as_it_is, "-"))
            continue
        fit = fit_one(search, Model(parts), [np.full(len(parts), START)])
        held = cross_fit(search, [(fit.model, fit.u)], cut)[0]
        numbers = "; ".join(
            f"{p.value:.3g} ({p.low:.3g} to {p.high:.3g}{', ' + p.flag if p.flag else ''})"
            for p in parameters(problem, fit)
        )
        rows.append((law, told(error(fit.residual)), told(error(held.residual)), numbers))
    head = ("friction of both joints", "fitted", f"held out ({cut.name})", "N.m, N.m.s/rad, joint 1 then 2 (95 %)")
    page.table(name[0].upper() + name[1:], head, rows)
