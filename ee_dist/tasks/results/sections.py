"""The parts of the pages of compare, explain and improve, from what they found, whatever the way of comparing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.accounts.of_explain import shown_gain, told_gain
from ee_dist.discrepancy.compare import Comparison, by_trial, circumstances, has_values, heat, span_of, trial_name
from ee_dist.discrepancy.compare import rows_of as rows_at
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.last_word import HELD_APART, LastWord
from ee_dist.discrepancy.problem import Problem, joined
from ee_dist.discrepancy.words import percent, placed, plain
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis
from ee_dist.robots.ranges import unit_at
from ee_dist.tasks.results.labels import IMPROVED, MODEL, axis_of, drawn, excess_share
from ee_dist.tasks.results.tables import (
    TIED_STANDING,
    WITHOUT,
    candidate_label,
    kind_of,
    last_word_rows,
    regimes_of,
    standing,
)
from ee_dist.tasks.results.values import Kind
from ee_dist.trials.log import Array
from ee_dist.viewing import report_figures as figures
from ee_dist.viewing.curves import MOST as POINTS
from ee_dist.viewing.curves import Overlay, browser, rows_of, thinned
from ee_dist.viewing.report import Section, Table

RANKED = {"best": "best", "tied": TIED_STANDING, "earned": "earned its place too"}
"""What the bars of candidates are, by kind, but for those that were refused, which are hatched."""
MARK = "mark of what was found"
MARKS = 2
"""Effects whose mark is told in words."""
COEFFICIENT = "coefficient"
"""What a quantity is that has no name but its unit."""
PAD_S = 0.6
"""Shown before and after the stretch that proves most, at least."""
Models = Sequence[tuple[str, Hypothesis]]
"""(label, terms): the model, and perhaps the improved one."""


def curves(problem: Problem, residual: Array, models: Models) -> list[Overlay]:
    """Every channel of every trial, with the error that the first of the models leaves there."""
    rms = by_trial(problem, residual)
    later = [
        {(s.trial, s.channel): s.predicted for s in joined(problem.whole.series(terms))} for _, terms in models[1:]
    ]
    return [
        Overlay(
            plain(problem.channels[s.channel]),
            trial_name(problem, s.trial),
            s.unit,
            s.times_s,
            s.measured,
            s.predicted,
            later[0].get((s.trial, s.channel)) if later else None,
            float(rms[s.trial, s.channel]),
        )
        for s in joined(problem.whole.series(models[0][1]))
    ]


def proof_section(
    problem: Problem,
    overlays: Sequence[Overlay],
    residual: Array,
    models: Models,
    after: Array | None = None,
    channel: str = "",
) -> Section | None:
    """The stretch of time in which a channel (or the one asked for) shows most: of what was found, or of what is wrong, as the
    table of channels tells it."""
    width = len(problem.channels)
    excess = heat(problem, residual).ravel() if after is None else _gained(problem, residual, after)
    asked = np.tile([not channel or name == channel for name in problem.channels], len(problem.segments))
    excess = np.where(asked, excess, -np.inf)
    by_name = {(o.channel, o.trial): o for o in overlays}
    for k in np.argsort(-excess):
        segment, place = divmod(int(k), width)
        trial = trial_name(problem, int(problem.trial_of_segment[segment]))
        curve = by_name.get((plain(problem.channels[place]), trial))
        if curve is not None:
            break
    else:
        return None
    begin, end = span_of(problem, segment)
    pad = max(PAD_S, 1.5 * (end - begin))
    rows = np.flatnonzero((curve.times_s >= begin - pad) & (curve.times_s <= end + pad))
    shown = thinned(rows_of(curve, rows) if len(rows) > 1 else curve, POINTS)
    what = "the error is largest" if after is None else "what was found explains most"
    shows = "Where the error is largest" if after is None else "Where it shows most"
    heading = f"{shows}: {curve.channel}, in trial {trial}, {begin:.1f} to {end:.1f} s"
    caption = f"Shaded: where {what}. Below: measured minus predicted."
    return Section(heading, caption, figures.proof(shown, [n for n, _ in models], (begin, end)))


def _gained(problem: Problem, residual: Array, after: Array) -> Array:
    """(segments x channels,) energy that the improved model takes off."""
    gained = residual**2 - after**2
    cell = problem.segment_of * len(problem.channels) + problem.channel_of
    read = np.where(problem.layout.reading, gained, 0.0)
    # What makes a channel rougher, and nothing else, gains in what is compared besides readings.
    weights = read if read.sum() > 0.5 * gained.sum() else gained
    return np.bincount(cell, weights=weights, minlength=len(problem.segments) * len(problem.channels))


def browser_section(overlays: Sequence[Overlay], models: Models) -> Section:
    found = browser(overlays, [n for n, _ in models])
    caption = "Pick a channel and a trial; the arrows go on to the next in the order of their error."
    if found.left_out:
        caption += f" The {found.left_out} with the least error had no room here."
    return Section("Measured and predicted, every channel and trial", caption, browser=found)


def values_section(kinds: Sequence[Kind]) -> Section | None:
    """What the improved model has, by kind of effect; with figures where an effect acts at several places."""
    if not kinds:
        return None
    rows = [
        [
            kind.effect,
            kind.quantity or COEFFICIENT,
            place,
            f"{p.value:.4g}",
            f"{p.low:.4g} to {p.high:.4g}",
            kind.unit,
            p.note,
        ]
        for kind in kinds
        for place, p in kind.at
    ]
    table = Table(["effect", "quantity", "where", "value", "95 % interval", "unit", "note"], rows, (3, 4), whole=True)
    drawn_ = [
        figures.values(k.name, [(place, p.value, p.low, p.high) for place, p in k.at], k.neutral)
        for k in kinds
        if len(k.at) > 1
    ]
    caption = "Its effects, with the 95 % interval of each value."
    if drawn_:
        caption += " Drawn is what acts at several places: a dot is a value, its line the interval; the grey line is no effect."
    return Section(f"The {IMPROVED}", caption, table=table, figures=drawn_)


def heat_section(problem: Problem, residual: Array, after: Array | None = None) -> Section:
    segments = [
        f"{trial_name(problem, int(k))} {s.rsplit('@', 1)[1]}"
        for k, s in zip(problem.trial_of_segment, problem.segments, strict=True)
    ]
    unique = [f"{n}{' ' * segments[:i].count(n)}" for i, n in enumerate(segments)]
    caption = (
        "Each cell is the error of one channel in one window of time. What is near the background is noise, red is what the "
        "model gets wrong: one scale for all channels, whatever the noise of each. A label is when a window begins."
    )
    there = has_values(problem)
    if not there.all():
        caption += " What is blank nobody recorded."
    # Where nobody recorded anything the model is neither right nor wrong: no colour.
    tables = [np.where(there, drawn(problem, heat(problem, r)), np.nan) for r in (residual, after) if r is not None]
    figure = figures.heat_map(
        tables, unique, problem.channels, drawn(problem, 1.0), (MODEL, IMPROVED), axis_of(problem)
    )
    return Section("Where it fails, channel by time", caption, figure)


def signature_section(
    problem: Problem, residual: Array, after: Array | None = None, found: Hypothesis = (), most: int = 3
) -> Section | None:
    """Residuals of the joint channels in which the effects ``found`` show most (without any: of the worst) against
    position, speed, command and load, with the mark that the effects promise."""
    layout = problem.layout
    raw, better = problem.raw(residual), None if after is None else problem.raw(after)
    shown_by = residual**2 if after is None else residual**2 - after**2
    score = np.bincount(
        problem.channel_of[layout.reading], weights=shown_by[layout.reading], minlength=len(problem.channels)
    )
    worst = [int(c) for c in np.argsort(-score) if layout.joint_of_channel[c] is not None and score[c] > 0][:most]
    around = [circumstances(problem, k) for k in range(len(problem.trials))]
    shown = []
    for c in worst:
        j = layout.joint_of_channel[c]
        mine = np.flatnonzero((problem.channel_of == c) & layout.reading)
        name = problem.robot.motor_names[j or 0]
        angle = "m" if problem.robot.joint(name).kind == "slide" else "rad"
        for label, key in (
            (f"position ({angle})", "position"),
            (f"speed ({angle}/s)", "speed"),
            (f"command ({unit_at(problem.robot, name) or angle})", "command"),
            (f"load ({'N' if angle == 'm' else 'N.m'})", "load"),
        ):
            x = np.full(len(mine), np.nan)
            for k in range(len(problem.trials)):
                own = problem.trial_of[mine] == k
                rows = rows_at(problem, k, layout.time_s[mine[own]])
                x[own] = getattr(around[k], key)[rows, j]
            if np.isfinite(x).all() and np.ptp(x) > 0:
                part = figures.Cloud(label, x, raw[mine], None if better is None else better[mine])
                shown.append(figures.cloud(f"{plain(problem.channels[c])} ({layout.units[c]})", part))
    if not shown:
        return None
    caption = "Measured minus predicted, against what the joint did. Thick lines are means. "
    legend = [(MODEL, figures.PREDICTED)]
    if after is None:
        caption += (
            "A law that is missing draws a line here: friction a step at zero speed, a spring a slope over position, play a "
            "gap at zero load."
        )
    else:
        legend += [(IMPROVED, figures.IMPROVED), (MARK, figures.MARK)]
        caption += (
            "The dashed line is the mark of what was found: how the two models differ, whatever was measured. Where it lies on "
            f"the line of the {MODEL}, it is what the robot did."
        )
        caption += "".join(f" {_capital(placed(t.name))}: {CATALOGUE[t.effect].signature}" for t in found[:MARKS])
    return Section("Residual against what the joint did", caption, figures=shown, legend=legend)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def ranking_section(
    problem: Problem, judged: Sequence[Judged], heading: str = "Candidate effects, ranked"
) -> Section | None:
    if not judged:
        return None
    best = judged[0]
    kinds = [kind_of(c, best) for c in judged]
    rows = [
        ["", WITHOUT, problem.told(best.error_without), "", "", ""],
        *([str(c.rank), candidate_label(c, problem.robot), problem.told(c.error_heldout), *told_gain(c),
           standing(c, best)] for c in judged),
    ]  # fmt: skip
    pale = [k for k, kind in enumerate(kinds, start=1) if kind == "not"]
    lead = [k for k, kind in enumerate(kinds, start=1) if kind in ("best", "tied")]
    caption = (
        f"How much of the error above the noise each explains, judged on {best.held_out}, with its 95 % interval. Hatched: "
        "refused, as no better than luck or too little."
    )
    figure = figures.ranking(
        [placed(c.name) for c in judged],
        [shown_gain(c)[0] for c in judged],
        [shown_gain(c)[1:] for c in judged],
        kinds,
    )
    columns = ["rank", "effect", f"{problem.natural_name}, held out", "gain", "95 % interval", "judgement"]
    legend = [(RANKED[k], figures.RANKS[k]) for k in RANKED if k in kinds]
    return Section(heading, caption, figure, Table(columns, rows, (0, 2, 3, 4), lead, pale), legend=legend)


def trials_section(problem: Problem, found: Comparison) -> Section:
    names = [trial_name(problem, k) for k in range(len(problem.trials))]
    rows = [[t, problem.told(e)] for t, e in zip(names, found.trial_errors, strict=True)]
    figure = figures.bars(
        names,
        [drawn(problem, e) for e in found.trial_errors],
        axis_of(problem),
        drawn(problem, found.noise_floor),
    )
    table = Table(["trial", problem.natural_name], rows, (1,))
    return Section("By trial", problem.shared_by_trials, figure, table, legend=[(MODEL, figures.PREDICTED)])


def last_word_section(word: LastWord) -> Section:
    """The models on trials that took no part in the search."""
    head, rows = last_word_rows(word)
    caption = f"Nothing was fitted to these, nor chosen by them. Noise floor: {word.problem.told(word.floor)}."
    caption = " ".join(t for t in (caption, word.problem.shared_by_trials) if t)
    return Section(HELD_APART, caption, table=Table(head, rows, tuple(range(1, len(head)))))


def regimes_section(problem: Problem, found: Comparison) -> Section:
    regimes = sorted(found.regimes, key=lambda r: -r.error)
    rows = [[r.name, problem.told(r.error), excess_share(found, r), percent(r.values)] for r in regimes]
    errors = [drawn(problem, r.error) for r in regimes]
    figure = figures.bars([r.name for r in regimes], errors, axis_of(problem), drawn(problem, found.noise_floor))
    table = Table(["regime", "error", "share of the excess", "share of the data"], rows, (1, 2, 3))
    caption = f"Sorted by what a joint was doing at the time: {regimes_of(problem, found)}.{_more_than_regimes(problem, found)}"
    return Section("By regime", caption, figure, table, legend=[(MODEL, figures.PREDICTED)])


def _more_than_regimes(problem: Problem, found: Comparison) -> str:
    """Why the error of a model is another than that of its regimes, where it is."""
    layout = problem.layout
    counts = ["other channels"] if None in layout.joint_of_channel else []
    counts += [] if layout.reading.all() else ["how much readings scatter and how often they repeat"]
    return (
        f" The error of the {MODEL}, {problem.told(found.error)}, also counts {' and '.join(counts)}." if counts else ""
    )


def channels_section(problem: Problem, found: Comparison, after: Comparison | None = None, most: int = 14) -> Section:
    """Errors of the channels, before and perhaps after, largest first."""
    later = {} if after is None else {c.name: c for c in after.channels}
    rows, first = [], [c for c in found.channels if not later or c.name in later]
    for c in first:
        unit = "" if c.unit == "1" else f" {c.unit}"
        row = [plain(c.name), f"{c.rmse:.3g}{unit}", problem.told(c.normalised)]
        if after is not None:
            row += [f"{later[c.name].rmse:.3g}{unit}", problem.told(later[c.name].normalised)]
        rows.append([*row, c.worst_trial, f"{c.worst_from_s:.1f} to {c.worst_to_s:.1f} s"])
    columns = ["channel", "rmse", "error"] + ([] if after is None else [f"rmse, {IMPROVED}", f"error, {IMPROVED}"])
    table = Table([*columns, "worst trial", "when"], rows, tuple(range(1, len(columns))))
    shown = [c for c in first if c.normalised > 0][:most]
    figure = figures.bars(
        [plain(c.name) for c in shown],
        [drawn(problem, c.normalised) for c in shown],
        axis_of(problem),
        drawn(problem, found.noise_floor),
        None if after is None else [drawn(problem, later[c.name].normalised) for c in shown],
    )
    caption = f"rmse: root mean square of {problem.averaged}, in the channel's own unit. Error: {axis_of(problem)}."
    if len(first) > most:
        caption += f" Bars: the {len(shown)} largest."
    legend = [(MODEL, figures.PREDICTED), *([] if after is None else [(IMPROVED, figures.IMPROVED)])]
    return Section("By channel", caption, figure, table, legend=legend)
