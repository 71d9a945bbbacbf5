"""A plan as people and programs read it: words, table of the terminal, summary.json and page."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table as Shown

from ee_dist.basics.names import listed
from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.plan import ENOUGH, Parting, Plan, PlannedTrial
from ee_dist.discrepancy.words import placed, plain, told_all
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.robots.model import Robot
from ee_dist.robots.ranges import command_unit
from ee_dist.tasks.summary import hypothesis_list
from ee_dist.trials.family import Limits
from ee_dist.viewing import plan_figures as figures
from ee_dist.viewing.report import Page, Section, Table

Explanations = Sequence[tuple[str, Hypothesis]]
CSV = "plan.csv"
UNITS = "Amplitudes are shares of half the range of each joint, separations are in standard deviations."
SHOWN = 10
"""Trials in the tables."""


def account_of(
    robot: Robot,
    found: Plan,
    explanations: Explanations,
    trial: str,
    fitted: bool,
    left_out: int = 0,
    every_s: float = 0.0,
    real: bool = False,
) -> Account:
    """What to record, what it is expected to tell, what stays alike, and how to do it. ``fitted``: whether the values were
    let come nearer to one another, as far as measurements leave them open. ``every_s``: time between readings of the sensors,
    where they are read more seldom than rows are; ``real``: whether these are logs of a robot that nobody here drives."""
    best, names = found.best, [placed(n) for n, _ in explanations]
    e, closest = best.excitation, f"{names[found.closest[0]]} from {names[found.closest[1]]}"
    what = f"{e.told(robot).replace('_', ' ')} for {e.seconds:g} s at amplitude {e.amplitude:g}, seed {e.seed}"
    pairs = listed(f"{names[a]} from {names[b]}" for a, b in found.alike)
    distance = f"{best.separation:.1f} standard deviations, {ENOUGH:g} are enough"
    if found.enough:
        head = f"Record next: {what}. It should tell {closest} ({distance})."
        # What stays open belongs beside what is promised, not among the words below.
        head += f" No trial within these limits tells {pairs}." if found.alike else ""
        sure = f"How sure: {len(found.trials)} trials were simulated for {len(names)} explanations; {_deciding(found)} decide."
        advice = f"Next: send {CSV} to the robot, and import its log beside the others (task=import)." if real else ""
    else:
        head = f"No trial within these limits is expected to tell {closest}; the best is {what} ({distance})."
        sure = f"How sure: {len(found.trials)} trials were simulated for {len(names)} explanations."
        advice = "Next: allow more (task.seconds, task.amplitude), or measure a channel that shows the difference."
    lines = [
        "What their values may still make up for, within what was measured already, counts as no difference."
        if fitted
        else "Their values count as certain, as they were fitted: a trial may promise more than it keeps.",
        f"The commands, for a robot of your own: {CSV}. On a simulated one: {trial}",
    ]
    lines.append(UNITS)
    if every_s:
        lines.append(
            f"Predicted of sensors that are read every {1000 * every_s:.3g} ms, as in the measurements: read more often, they "
            "tell more."
        )
    if left_out > 0:
        lines.append(f"{left_out} more that were tied are left out: the first {len(names)} are to be told apart.")
    return Account(head, f"Tied: {listed(names)}.", sure, tuple(lines), found.all_told, advice)


def _deciding(found: Plan) -> str:
    return "the two most similar that can be told apart" if found.alike and found.enough else "the two most similar"


def show_plan(console: Console, robot: Robot, found: Plan) -> None:
    of = _shown_of(robot, found)
    table = Shown(title=f"Trials within the limits, by what they tell apart{of and f' ({of})'}", title_justify="left")
    for name in ("motion", "seconds", "amplitude", "seed", "separation", ""):
        table.add_column(name, justify="left" if name in ("motion", "") else "right")
    for row in _rows(robot, found):
        table.add_row(*row)
    console.print(table)


def _rows(robot: Robot, found: Plan) -> list[list[str]]:
    """The best of each motion and size first, up to SHOWN."""
    kept: dict[tuple[str, float], PlannedTrial] = {}
    for t in found.trials:
        kept.setdefault((t.excitation.told(robot), t.excitation.amplitude), t)
    return [
        [t.excitation.told(robot).replace("_", " "), f"{t.excitation.seconds:g}", f"{t.excitation.amplitude:g}",
         str(t.excitation.seed), "" if t.harm else f"{t.separation:.1f}",
         t.harm or ("enough" if t.separation >= ENOUGH else "not enough")]
        for t in list(kept.values())[:SHOWN]
    ]  # fmt: skip


def _shown_of(robot: Robot, found: Plan) -> str:
    """That a table does not show all, where it does not."""
    shown, count = len(_rows(robot, found)), len(found.trials)
    return f"{shown} of {count}, of each motion and size the best" if shown < count else ""


def of_plan(
    found: Plan, explanations: Explanations, folder: Path, files: Sequence[Path], limits: Limits, account: Account
) -> dict[str, Any]:
    """The part of summary.json that is the plan's own."""
    names = [n for n, _ in explanations]
    pairs = list(combinations(names, 2))

    def trial(t: PlannedTrial) -> dict[str, Any]:
        return {
            **t.excitation.as_dict(),
            "separation": t.separation,
            "enough": t.separation >= ENOUGH,
            "harm": t.harm,
            "pairs": [
                {"one": one, "other": other, "separation": s}
                for (one, other), s in zip(pairs, t.separations, strict=True)
            ],
        }

    return {
        "explained": str(folder),
        "measured": [str(f) for f in files],
        "limits": asdict(limits),
        "explanations": [{"name": n, "terms": hypothesis_list(h)} for n, h in explanations],
        "enough_from": ENOUGH,
        "enough": found.all_told,
        "alike": [[names[a], names[b]] for a, b in found.alike],
        "best": trial(found.best),
        "trials": [trial(t) for t in found.trials],
        "headline": account.headline,
        "words": account.words,
    }


def plan_page(
    robot: Robot,
    found: Plan,
    explanations: Explanations,
    shown: Parting,
    account: Account,
    files: Sequence[Path],
) -> Page:
    best, names = found.best, [placed(n) for n, _ in explanations]
    sensor = robot.sensors[shown.channel]
    around = (shown.from_s, shown.to_s)
    page = Page(
        f"Plan: {plain(robot.name)}",
        f"after {', '.join(f.name for f in files)}; {len(found.trials)} trials were simulated",
        account.headline,
        account.lines,
        "good" if account.good else "open",
        account.first,
        following=account.then,
        tiles=[
            (f"{best.separation:.1f}", f"standard deviations between {_deciding(found)}"),
            (f"{ENOUGH:g}", "are enough to tell them apart"),
            (f"{best.excitation.seconds:g} s", best.excitation.told(robot).replace("_", " ")),
            (str(len(names)), "explanations"),
        ],
        foot="ee_dist. Separations are those that a bootstrap over windows of time would hold to be more than chance.",
    )
    page.proof = Section(
        f"Where they part most: {plain(sensor.name)}, {around[0]:.1f} to {around[1]:.1f} s",
        "What each explanation predicts of this trial; below, its distance from the first of the two that decide (drawn thick). "
        "Where curves lie on one another, dashes let the one below be seen.",
        figures.parted(shown.times_s, shown.curves, names, sensor.unit, around, found.closest),
    )
    rows = _rows(robot, found)
    columns = [
        "motion",
        "seconds",
        "amplitude, of half the range",
        "seed",
        "separation, standard deviations",
        "judgement",
    ]
    pale = [k for k, r in enumerate(rows) if r[-1] == "not enough"]
    of = _shown_of(robot, found)
    caption = f"Predicted distance of {_deciding(found)} on it, in standard deviations."
    caption += f" Shown are {of}; summary.json has all." if of else ""
    page.sections.append(
        Section("Trials within the limits", caption, None, Table(columns, rows, (1, 2, 3, 4), (0,), pale))
    )
    told = [[str(k + 1), told_all(h, robot)] for k, (_, h) in enumerate(explanations)]
    page.sections.append(Section("What is to be told apart", "With the values that suit the measurements so far.", None,
                                 Table(["", "model"], told)))  # fmt: skip
    page.sections += _commands(robot, best)
    return page


def _commands(robot: Robot, best: PlannedTrial) -> list[Section]:
    """Commands by their unit: radians and newton metres have no axis in common."""
    values = best.excitation.commands(robot)
    times = np.arange(len(values)) * robot.time_step_s
    units = [command_unit(robot, d) for d in robot.drives]
    out = []
    for unit in dict.fromkeys(u for u in units if u is not None):
        mine = [k for k, u in enumerate(units) if u == unit]
        names = [plain(robot.motor_names[k]) for k in mine]
        figure = figures.commanded(times, values[:, mine], names, unit)
        out.append(Section(f"Commands ({unit})", f"As {CSV} has them.", figure))
    return out
