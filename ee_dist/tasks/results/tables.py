"""Tables of the terminal, rendered from the typed results; each fits 80 columns."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.accounts.of_explain import told_gain
from ee_dist.discrepancy.compare import Comparison, of_all_regimes
from ee_dist.discrepancy.evidence.holdout import in_turn
from ee_dist.discrepancy.evidence.intervals import ParameterReport, called
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.explain import Explanation
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.last_word import HELD_APART, LastWord
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.words import percent, phrase, plain, told_all
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.robots.model import Robot
from ee_dist.tasks.folder import EARLIER, begun_s
from ee_dist.tasks.results.labels import IMPROVED, MODEL, excess_share, step_phrase
from ee_dist.tasks.results.values import kinds_of, within

WITHOUT = "the model without any of these"
"""What the errors of candidates stand against."""
TIED_STANDING = "tied with the best"
Column = tuple[str, bool]
"""Heading, and whether it holds numbers."""


def _table(title: str, columns: Sequence[Column], rows: Sequence[Sequence[str]]) -> Table:
    table = Table(title=title, title_justify="left")
    for name, numeric in columns:
        table.add_column(name, justify="right" if numeric else "left", no_wrap=numeric, overflow="fold")
    for row in rows:
        table.add_row(*row)
    return table


def show_comparison(console: Console, problem: Problem, found: Comparison) -> None:
    rows = [
        (plain(c.name), f"{c.rmse:.3g} {c.unit}", problem.told(c.normalised),
         f"{c.worst_trial}, {c.worst_from_s:.1f} to {c.worst_to_s:.1f} s") for c in found.channels[:8]
    ]  # fmt: skip
    columns = (("channel", False), ("rmse", True), ("error", True), ("worst", False))
    console.print(_table(f"Where it fails: channels (rmse: of {problem.averaged})", columns, rows))
    ordered = sorted(found.regimes, key=lambda r: -r.error)
    rows2 = [(r.name, problem.told(r.error), excess_share(found, r), percent(r.values)) for r in ordered]
    columns = (("regime", False), ("error", True), ("share of excess", True), ("of data", True))
    doing = "Where it fails: regimes, by what a joint was doing at the time"
    console.print(_table(f"{doing} ({regimes_of(problem, found)})", columns, rows2))


def regimes_of(problem: Problem, found: Comparison) -> str:
    """What regimes are regimes of: not of all that the error of a model counts."""
    return f"joints' readings, error {problem.told(of_all_regimes(found.regimes))} in all"


def show_candidates(console: Console, problem: Problem, judged: Sequence[Judged], title: str) -> None:
    if not judged:
        return
    best = judged[0]
    rows = [
        ("", WITHOUT, problem.told(best.error_without), "", ""),
        *((str(c.rank), candidate_label(c, problem.robot), problem.told(c.error_heldout), told_gain(c)[0],
           standing(c, best)) for c in judged),
    ]  # fmt: skip
    columns = (("", True), ("effect", False), ("held out", True), ("gain", True), ("", False))
    console.print(_table(title, columns, rows))


def candidate_label(c: Judged, robot: Robot) -> str:
    """What a candidate is and how much of it. Of one that was refused nobody needs each value: many are told as a range."""
    return told_all(c.terms, robot) if c.earned else phrase(c.terms, robot)


def standing(c: Judged, best: Judged) -> str:
    """How a candidate came out, in words."""
    kind = kind_of(c, best)
    if kind == "tied":
        return f"{TIED_STANDING}, but {c.why_not}" if c.why_not else TIED_STANDING
    return c.why_not or kind


def kind_of(c: Judged, best: Judged) -> str:
    """The same for a picture: best, tied (what is not told for its vague numbers alone, too), earned or not."""
    if c.name in best.tied_with:
        return "tied"
    return "best" if c is best and c.earned else "earned" if c.earned else "not"


def show_ladder(console: Console, problem: Problem, found: Improvement, word: LastWord | None = None) -> None:
    # Errors on motions that were not fitted are no continuation of those on other windows of the same ones.
    several, named = len(found.cuts) > 1, str if word is None else in_turn
    apart = [] if word is None else [[word.problem.told(s.error)] for s in word.steps]
    rows = [
        (step_phrase(r, problem), problem.told(r.error_fit), problem.told(r.error_heldout), *beside,
         *([named(r.held_out)] * several))
        for r, beside in zip(found.ladder, apart or [[]] * len(found.ladder), strict=True)
    ]  # fmt: skip
    # What comes later changes the values of what came first.
    step = "step, with its values then" if sum(bool(r.added) for r in found.ladder) > 1 else "step"
    held = ["held out"] if not apart else ["held out\nin turn", "held out\nfrom all"]
    more = [("what was held out", False)] * several
    columns = ((step, False), ("fitted", True), *((name, True) for name in held), *more)
    of = [f"held out: {cut}" if word is None else in_turn(cut) for cut in found.cuts] if len(found.cuts) == 1 else []
    table = _table("; ".join([f"The ladder: {problem.natural_name}", *of]), columns, rows)
    table.add_section()
    floors = [problem.told(found.noise_floor), *([] if word is None or not apart else [word.problem.told(word.floor)])]
    table.add_row("noise floor", "", *floors)
    console.print(table)
    _show_values(console, found.terms, found.parameters, problem.robot)


def _show_values(console: Console, terms: Hypothesis, reports: Sequence[ParameterReport], robot: Robot) -> None:
    kinds = kinds_of(terms, reports, robot)
    if kinds:
        at = [(k.name, "; ".join(f"{place} {within(p)}" for place, p in k.at)) for k in kinds]
        columns = (("effect", False), ("where, and how much", False))
        console.print(_table(f"Its values, with {called(reports)}", columns, at))


def show_last_word(console: Console, word: LastWord | None) -> None:
    """By trial, how far the models are from what was held out from all of it."""
    if word is None:
        return
    head, rows = last_word_rows(word)
    numeric = [False, *(True for _ in head[1:])]
    table = _table(f"{HELD_APART}: {word.problem.natural_name}", list(zip(head, numeric, strict=True)), rows)
    console.print(table)
    if word.problem.shared_by_trials:
        console.print(word.problem.shared_by_trials, highlight=False, markup=False)


def last_word_rows(word: LastWord) -> tuple[list[str], list[list[str]]]:
    """Columns and rows: each trial, and under several of them all together."""
    told, errors = word.problem.told, list(zip(word.names, word.by_trial, strict=True))
    if len(errors) > 1:
        errors.append(("all", (word.before, word.after)))
    rows = [[name, told(before), *([told(after)] if word.changed else [])] for name, (before, after) in errors]
    return ["trial", MODEL, *([IMPROVED] if word.changed else [])], rows


def show_account(console: Console, account: Account, out: Path) -> None:
    """What speaks for it, the files, and last the finding with how sure it is and the command to type next."""
    for line in account.lines:
        console.print(line, highlight=False, markup=False)
    begun = begun_s(out)
    for file in sorted(p for p in out.iterdir() if p.is_file() and not p.name.startswith(".")):
        stale = f"  ({EARLIER})" if file.stat().st_mtime < begun else ""
        console.print(f"  {os.path.relpath(file)}{stale}", highlight=False, markup=False, soft_wrap=True)
    console.print(account.headline, highlight=False, markup=False, style="bold")
    for line in account.first:
        whole = bool(account.planner) and line.endswith(account.planner)  # a command is for copying
        console.print(line, highlight=False, markup=False, soft_wrap=whole)
    for line in account.last:
        console.print(line, highlight=False, markup=False, soft_wrap=True)


def typed(terms: Hypothesis) -> str:
    """Effects as ``effect=`` of improve takes them, all that a candidate has."""
    return ";".join(t.name for t in terms)


def show_explanation(console: Console, problem: Problem, found: Explanation) -> None:
    show_candidates(console, problem, found.candidates, "Candidate effects, judged on data not fitted")
    _show_values(console, found.after, found.parameters, problem.robot)
