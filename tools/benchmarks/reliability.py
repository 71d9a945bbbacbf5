"""How well the confidence in a verdict foretells whether it is right: the rule fitted to cases, and cases foretold by it."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import astuple
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table
from scipy.optimize import minimize

from ee_dist.discrepancy.confidence import FEWEST, RULE, Rule, Signs, foretold
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, UNEXPLAINED
from ee_dist.trials.log import Array

RIDGE, FOLDS, BINS, DRAWS = 5.0, 10, 5, 1000
"""How much a large weight costs, in log likelihood of signs with unit variance; parts of a cross validation; groups of a
reliability diagram; how often chance is drawn."""
Found = dict[str, Any]


def read(files: Sequence[Path]) -> list[Found]:
    """Cases of some files."""
    return [json.loads(line) for path in files for line in path.read_text(encoding="utf-8").splitlines()]


def fitted(cases: Sequence[Found]) -> Rule:
    """The rule that makes these cases most likely, large weights held down by a ridge."""
    named = [c for c in cases if c["verdict"] == EFFECT]
    x = np.array([astuple(Signs(**c["signs"])) for c in named])
    y = np.array([c["right"] for c in named], dtype=float)
    mean, spread = x.mean(axis=0), x.std(axis=0) + 1e-9
    z = (x - mean) / spread

    def cost(w: Array) -> float:
        odds = w[0] + z @ w[1:]
        return float(np.logaddexp(0.0, np.where(y > 0, -odds, odds)).sum() + 0.5 * RIDGE * (w[1:] @ w[1:]))

    w = minimize(cost, np.zeros(x.shape[1] + 1)).x
    weights = w[1:] / spread
    other = {v: [c["right"] for c in cases if c["verdict"] == v] for v in (NOTHING_MISSING, UNEXPLAINED)}
    return Rule(
        round(float(w[0] - weights @ mean), 3),
        Signs(*(round(float(v), 3) for v in weights)),
        round(max(c["misfit"] for c in named), 1),
        {v: (len(right), sum(right)) for v, right in other.items()},
    )


def told(case: Found, rule: Rule) -> float | None:
    """What the rule says of a case."""
    if case["verdict"] == EFFECT:
        return foretold(Signs(**case["signs"]), rule) if case["misfit"] <= rule.misfit else None
    cases, right = rule.counted[case["verdict"]]
    return (right + 1) / (cases + 2) if cases >= FEWEST else None


def crossed(cases: Sequence[Found]) -> list[float | None]:
    """What is said of each case by the others' rule, a tenth of the cases left out in turn."""
    fold = np.random.default_rng(0).permutation(len(cases)) % FOLDS
    rules = [fitted([c for c, f in zip(cases, fold, strict=True) if f != k]) for k in range(FOLDS)]
    return [told(c, rules[k]) for c, k in zip(cases, fold, strict=True)]


def off(p: Array, y: Array) -> float:
    """Expected calibration error over groups of as many cases each (Naeini et al. 2015)."""
    return float(sum(len(g) * abs(p[g].mean() - y[g].mean()) for g in _groups(p)) / len(p))


def _groups(p: Array) -> list[Any]:
    return np.array_split(np.argsort(p, kind="stable"), BINS)


def report(fit: Sequence[Found], judge: Sequence[Found]) -> None:
    """The rule, as confidence.py holds it, and reliability diagrams: of cases left out of its fit, and of others."""
    console = Console(width=140)
    console.print(fitted(fit))
    _diagram(console, f"{len(fit)} cases, each by the rule of the others", fit, crossed(fit))
    if judge:
        rule = fitted(fit)
        _diagram(console, f"{len(judge)} other cases by the rule above", judge, [told(c, rule) for c in judge])
        _diagram(console, f"{len(judge)} other cases by the rule of the program", judge, [told(c, RULE) for c in judge])
    for by in ("kind", "robot", "noise", "trials"):
        _grid(console, by, [*fit, *judge])


def _diagram(console: Console, title: str, cases: Sequence[Found], said: Sequence[float | None]) -> None:
    pairs = [(p, c["right"]) for p, c in zip(said, cases, strict=True) if p is not None]
    p, y = np.array([q for q, _ in pairs]), np.array([float(r) for _, r in pairs])
    table = Table("said", "were right", "cases", title=title)
    for g in _groups(p):
        table.add_row(f"{100 * p[g].mean():.0f} %", f"{100 * y[g].mean():.0f} %", str(len(g)))
    console.print(table)
    rng = np.random.default_rng(0)
    chance = np.mean([off(p, (rng.random(len(p)) < p).astype(float)) for _ in range(DRAWS)])
    console.print(
        f"expected calibration error {100 * off(p, y):.1f} %; chance alone would give {100 * chance:.1f} %; nothing said of "
        f"{len(cases) - len(p)}; right {100 * y.mean():.0f} %"
    )


def _grid(console: Console, by: str, cases: Sequence[Found]) -> None:
    table = Table(by, "cases", "right", "effect named", "of these right", title=f"by {by}")
    for key, mine in _by(cases, by):
        named = [c["right"] for c in mine if c["verdict"] == EFFECT]
        share = f"{100 * sum(named) / len(named):.0f} %" if named else "-"
        right = f"{100 * sum(c['right'] for c in mine) / len(mine):.0f} %"
        table.add_row(str(key), str(len(mine)), right, str(len(named)), share)
    console.print(table)


def _by(cases: Sequence[Found], name: str) -> Iterator[tuple[Any, list[Found]]]:
    for key, mine in groupby(sorted(cases, key=lambda c: c[name]), key=lambda c: c[name]):
        yield key, list(mine)
