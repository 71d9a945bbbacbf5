"""From what the tasks found to the results that travel to the page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.accounts.of_explain import above, taken_off
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.explain import Explanation
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.words import placed
from ee_dist.effects.catalogue import CATALOGUE
from ee_dist.tasks.results.tables import candidate_label, kind_of
from ee_dist.workbench.bench import Step
from ee_dist.workbench.results import Explained, Improved, Ranked

NO_TRACE = "it changes nothing that was measured here"


def of_explanation(problem: Problem, found: Explanation, account: Account, folder: Path) -> Explained:
    best = found.candidates[0] if found.candidates else None
    ranked = tuple(_ranked(problem, found, c, best) for c in found.candidates if best is not None)
    return Explained(account.headline, account.lines, found.verdict, ranked, found.before, found.tried, folder)


def _ranked(problem: Problem, found: Explanation, c: Judged, best: Judged) -> Ranked:
    entry = CATALOGUE[c.terms[0].effect]
    return Ranked(
        c.name,
        candidate_label(c, problem.robot),
        c.terms,
        (*found.fixed, *c.hypothesis),
        c.error_heldout,
        c.explained,
        above(c),
        kind_of(c, best),
        c.why_not,
        taken_off(c),
        entry.physics,
        entry.signature,
    )


def of_improvement(found: Improvement, account: Account, folder: Path, first: int = 1, refused: str = "") -> Improved:
    """``first``: the step of the ladder from which steps are new; ``refused``: why the last of them is."""
    steps = [
        Step(_name(found, k), r.error_fit, r.error_heldout, r.held_out)
        for k, r in enumerate(found.ladder)
        if k >= first
    ]
    if refused and steps:
        last = steps[-1]
        steps[-1] = Step(last.name, last.error_fit, last.error_heldout, last.held_out, refused)
    return Improved(account.headline, account.lines, found.terms, tuple(found.parameters), tuple(steps), folder)


def _name(found: Improvement, step: int) -> str:
    rung = found.ladder[step]
    less = f", without {' and '.join(map(placed, rung.dropped))}" if rung.dropped else ""
    return placed(rung.name) + less


def refusal(candidates: Sequence[Judged]) -> str:
    """Why the only candidate of an explanation did not earn its place; empty where it did."""
    return candidates[0].why_not if candidates else NO_TRACE
