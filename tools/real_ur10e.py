"""A UR10e without and with a payload: what the product found beside an expert's least squares and what is known.

Reads what the commands of docs/real_data.md wrote: two imports, the ladder on the unloaded record, the explanation on the
loaded one. ``cut`` are the rows that the authors of the data kept, as times.
"""

from __future__ import annotations

import json
from itertools import groupby
from pathlib import Path

import numpy as np
from least_squares import LeastSquares, least_squares
from real_tables import Page

from ee_dist.discrepancy.evidence.holdout import cross_fit, windows
from ee_dist.discrepancy.measured_trial import MeasuredTrial
from ee_dist.discrepancy.problem import Mask
from ee_dist.discrepancy.search.candidates import known, values_of
from ee_dist.discrepancy.search.fit import fit_one
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.discrepancy.search.search import Search
from ee_dist.discrepancy.ways.force_balance.problem import ForceBalance
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.effects.model_file import read_model
from ee_dist.recording.reader import read_run
from ee_dist.trials.log import Array

CUT_S = {"unloaded": (2.032, 52.104), "loaded": (3.206, 53.302)}
"""Rows 195 to 4966 and 308 to 5071 of the files."""
AUTHORS = ((21.3, 12.5), (20.2, 13.3), (10.4, 5.0), (3.6, 2.0), (2.5, 2.7), (3.0, 2.3))
"""Viscous (N.m.s/rad) and Coulomb (N.m) friction of joints 1 to 6 as published."""
LOAD_KG, FLANGE = 2.805, "wrist_3_link"


def run(folder: Path, page: Page) -> None:
    """``folder`` holds unloaded, loaded, friction, load: the folders of the commands."""
    free, heavy = (_problem(folder / name) for name in ("unloaded", "loaded"))
    kept = {"unloaded": _kept(free, "unloaded"), "loaded": _kept(heavy, "loaded")}
    terms = read_model(folder / "friction" / "model.yaml").terms
    expert = least_squares(free, windows(free), rows=kept["unloaded"])
    _errors(free, kept["unloaded"], terms, expert, page)
    _friction(free, terms, expert, page)
    content = json.loads((folder / "load" / "summary.json").read_text(encoding="utf-8"))
    plain = least_squares(heavy, windows(heavy), FLANGE, rows=kept["loaded"])
    _payload(content, plain, page)


def _problem(folder: Path) -> ForceBalance:
    record = read_run(folder / "measured.mcap")
    return ForceBalance([MeasuredTrial(t.name, t.log, t.driver) for t in record.trials], record.robot)


def _kept(problem: ForceBalance, name: str) -> Mask:
    first, last = CUT_S[name]
    return np.asarray((problem.layout.time_s >= first) & (problem.layout.time_s <= last))


def _errors(problem: ForceBalance, kept: Mask, terms: Hypothesis, expert: LeastSquares, page: Page) -> None:
    """Force errors on the rows that the authors kept, fitted and held out by windows."""

    def told(residual: Array) -> str:
        return f"{100 * problem.natural(float(np.sqrt(np.mean(residual[kept] ** 2)))):.1f}"

    rows = [("the maker's URDF", "0", told(problem.residuals([()])[0]), told(problem.residuals([()])[0]))]
    search, cut = Search(problem), windows(problem)
    # The model in the order in which effect=auto made it: what stands together is one step.
    steps = [list(group) for _, group in groupby(terms, key=lambda t: t.effect)]
    for k, step in enumerate(steps):
        so_far = tuple(t for s in steps[: k + 1] for t in s)
        parts = tuple(known(problem.robot, t) for t in so_far)
        fit = fit_one(search, Model(parts), [values_of(parts, so_far)])
        held = cross_fit(search, [(fit.model, fit.u)], cut)[0].residual
        name = step[0].effect.replace("_", " ")
        where = f"each of {len(step)} joints" if len(step) > 2 else ", ".join(t.target for t in step)
        rows.append((f"+ {name}, {where}", str(len(fit.u)), told(fit.residual), told(held)))
    rows.append(("least squares of an expert", str(expert.count), told(expert.residual), told(expert.heldout)))
    page.table("Unloaded: force left over, % of the torque", ("model", "numbers fitted", "fitted", "held out"), rows)


def _friction(problem: ForceBalance, terms: Hypothesis, expert: LeastSquares, page: Page) -> None:
    drives = apply(problem.robot, terms).drives
    rows = [
        (d.joint, f"{d.viscous:.1f}", f"{e[2]:.1f}", f"{a[0]:.1f}", f"{d.coulomb:.1f}", f"{e[1]:.1f}", f"{a[1]:.1f}")
        for d, e, a in zip(drives, expert.joints, AUTHORS, strict=True)
    ]
    head = ("joint", "viscous, N.m.s/rad", "least squares", "authors", "Coulomb, N.m", "least squares", "authors")
    page.table("Friction by joint", head, rows)


def _payload(content: dict, plain: LeastSquares, page: Page) -> None:  # type: ignore[type-arg]
    rows = []
    for c in content["candidates"][:4]:
        rows.append((c["name"], str(c["rank"]), f"{c['gain_heldout']:.0%}", ", ".join(c["tied_with"]) or "-"))
    page.table("Loaded: what is missing, on top of the model above", ("effect", "rank", "gain held out", "tied"), rows)
    best = content["candidates"][0]["values"]
    x, y, z = plain.load[1:] / plain.load[0]
    table = [("least squares", f"{plain.load[0]:.3f}", f"{x:.3f}", f"{y:.3f}", f"{z:.3f}")]
    if "mass_kg" in best:
        mine = (best["x_m"], best["y_m"], best["z_m"])
        table.insert(0, ("explain", f"{best['mass_kg']:.3f}", *(f"{v:.3f}" for v in mine)))
        apart = float(np.linalg.norm(np.array(mine) - plain.load[1:] / plain.load[0]))
        off = best["mass_kg"] / LOAD_KG - 1
        page.text(f"mass {off:+.1%} of {LOAD_KG} kg, centre {100 * apart:.1f} cm from least squares")
    page.table(f"The payload in the frame of {FLANGE}", ("by", "mass, kg", "x, m", "y, m", "z, m"), table)
