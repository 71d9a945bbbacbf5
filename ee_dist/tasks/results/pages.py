"""The pages of compare, explain and improve, put together from what they found, whatever the way of comparing."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.compare import Comparison, circumstances, heat, rows_of
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.explain import Explanation
from ee_dist.discrepancy.improve import Improvement
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.words import Account, named, placed, plain, told, told_all
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.results.tables import standing
from ee_dist.trials.log import Array
from ee_dist.viewing import report_figures as figures
from ee_dist.viewing.report import Page, Section, Table

THIN = 1500
"""Points of a curve that are drawn."""
CLOUD = 4000
"""Points of a residual cloud that are drawn."""


def overlay_section(
    problem: Problem, residual: Array, models: Sequence[tuple[str, Hypothesis]], most: int = 6
) -> Section:
    """The channels with most to see, each in the trial where it shows most; ``models``: (label, terms), at most two."""
    cells = len(problem.trials) * len(problem.channels)
    where = problem.trial_of * len(problem.channels) + problem.channel_of
    energy = np.bincount(where, weights=residual**2 - problem.floor, minlength=cells)
    said = [{(s.trial, s.channel): s for s in problem.series(terms)} for _, terms in models]
    chosen: list[tuple[int, int]] = []
    for cell in np.argsort(-energy):
        key = (int(cell) // len(problem.channels), int(cell) % len(problem.channels))
        if key in said[0] and key[1] not in [c for _, c in chosen] and len(chosen) < most:
            chosen.append(key)
    items = []
    for key in chosen:
        first = said[0][key]
        step = slice(None, None, max(1, len(first.times_s) // THIN))
        items.append(
            figures.Overlay(
                f"{plain(problem.channels[key[1]])}, {problem.trials[key[0]]}",
                first.unit,
                first.times_s[step],
                first.measured[step],
                first.predicted[step],
                said[1][key].predicted[step] if len(said) > 1 else None,
            )
        )
    caption = (
        "The channels with most to explain, each in the trial where it shows most. "
        "Left what was measured and said, right the difference."
    )
    return Section("Measured and predicted", caption, figures.overlays(items))


def heat_section(problem: Problem, residual: Array, after: Array | None = None) -> Section:
    segments = [
        f"{problem.trials[k]} {s.rsplit('@', 1)[1]}"
        for k, s in zip(problem.trial_of_segment, problem.segments, strict=True)
    ]
    unique = [f"{n}{' ' * segments[:i].count(n)}" for i, n in enumerate(segments)]
    caption = (
        "Each cell is the error of one channel in one window of time. Pale is noise, red is what the model gets wrong."
    )
    tables = [heat(problem, residual)] + ([] if after is None else [heat(problem, after)])
    return Section("Where it fails, channel by time", caption, figures.heat_map(tables, unique, problem.channels))


def signature_section(problem: Problem, residual: Array, after: Array | None = None, most: int = 3) -> Section | None:
    """Residuals of the worst joint channels against position, speed, command and load, before and after."""
    layout = problem.layout
    score = np.bincount(problem.channel_of[layout.reading], weights=residual[layout.reading] ** 2)
    worst = [int(c) for c in np.argsort(-score) if layout.joint_of_channel[c] is not None and score[c] > 0][:most]
    raw, better = problem.raw(residual), None if after is None else problem.raw(after)
    around = [circumstances(problem, k) for k in range(len(problem.trials))]
    panels = []
    for c in worst:
        j = layout.joint_of_channel[c]
        mine = np.flatnonzero((problem.channel_of == c) & layout.reading)
        mine = mine[:: max(1, len(mine) // CLOUD)]
        columns: list[figures.Cloud] = []
        angle = "m" if problem.robot.joint(problem.robot.motor_names[j or 0]).kind == "slide" else "rad"
        for label, key in (
            (f"position ({angle})", "position"),
            (f"commanded speed ({angle}/s)", "speed"),
            (f"command ({angle})", "command"),
            (f"load ({'N' if angle == 'm' else 'N.m'})", "load"),
        ):
            x = np.full(len(mine), np.nan)
            for k in range(len(problem.trials)):
                own = problem.trial_of[mine] == k
                rows = rows_of(problem, k, layout.time_s[mine[own]])
                x[own] = getattr(around[k], key)[rows, j]
            if np.isfinite(x).all():
                columns.append(figures.Cloud(label, x, raw[mine], None if better is None else better[mine]))
        if columns:
            panels.append((f"{plain(problem.channels[c])} ({layout.units[c]})", columns))
    if not panels:
        return None
    caption = (
        "A law that is missing draws a line here: friction a step at zero speed, a spring a slope over position, "
        "play a gap at zero load."
    )
    return Section("Residual against what the joint did", caption, figures.signatures(panels))


def ranking_section(
    problem: Problem, judged: Sequence[Judged], heading: str = "Candidate effects, ranked"
) -> Section | None:
    if not judged:
        return None
    best = judged[0]
    kinds = [_kind(c, best) for c in judged]
    rows = [
        [str(c.rank), told_all(c.terms, problem.robot), problem.told(c.error_heldout), f"{c.gain:.1%}",
         f"{max(c.interval[0], -9.99):.1%} to {c.interval[1]:.1%}", standing(c, best)]
        for c in judged
    ]  # fmt: skip
    lead = [k for k, kind in enumerate(kinds) if kind in ("best", "tied")]
    caption = (
        f"Share of what is above the noise that each takes off data it was not fitted to ({best.held_out}), with its 95 % "
        "interval."
    )
    above = [c.explained / c.gain if c.gain > 0 and np.isfinite(c.gain) else 1.0 for c in judged]
    figure = figures.ranking(
        [placed(c.name) for c in judged],
        [c.explained for c in judged],
        [(c.interval[0] * a, c.interval[1] * a) for c, a in zip(judged, above, strict=True)],
        kinds,
    )
    columns = ["rank", "effect", f"{problem.natural_name}, held out", "gain", "95 % interval", "judgement"]
    return Section(heading, caption, figure, Table(columns, rows, (0, 2, 3, 4), lead))


def _kind(c: Judged, best: Judged) -> str:
    if not c.earned:
        return "not"
    return "best" if c is best else "tied" if c.name in best.tied_with else "earned"


def trials_section(problem: Problem, found: Comparison) -> Section:
    rows = [[t, problem.told(e)] for t, e in zip(problem.trials, found.trial_errors, strict=True)]
    figure = figures.bars(
        [f"{k + 1}. {t}" for k, t in enumerate(problem.trials)],
        found.trial_errors,
        "error (standard deviations)",
        found.noise_floor,
    )
    return Section("By trial", "", figure, Table(["trial", problem.natural_name], rows, (1,)))


def compare_page(
    problem: Problem,
    measured: Measurements,
    found: Comparison,
    account: Account,
    residual: Array,
    remarks: Sequence[str] = (),
) -> Page:
    """The page of compare."""
    regimes = sorted(found.regimes, key=lambda r: -r.error)
    page = _page(problem, measured, "Compare", account, measured.model)
    page.words = [*page.words, *remarks]
    page.tiles = [
        (problem.told(found.error), problem.natural_name),
        (problem.told(found.noise_floor), "noise floor"),
        (plain(found.channels[0].name) if found.channels else "-", "worst channel"),
        (regimes[0].name if regimes else "-", "worst regime"),
    ]
    page.sections.append(overlay_section(problem, residual, [("model", measured.model)]))
    page.sections.append(heat_section(problem, residual))
    if len(problem.trials) > 1:
        page.sections.append(trials_section(problem, found))
    page.sections.append(
        Section(
            "By regime",
            "Joint channels, sorted by what their joint was doing at the time.",
            figures.bars(
                [r.name for r in regimes], [r.error for r in regimes], "error (standard deviations)", found.noise_floor
            ),
            Table(
                ["regime", "error", "share of the excess", "share of the data"],
                [[r.name, f"{r.error:.2f}", f"{r.share:.0%}", f"{r.values:.0%}"] for r in regimes],
                (1, 2, 3),
            ),
        )
    )
    _add(page, signature_section(problem, residual))
    rows = [
        [plain(c.name), f"{c.rmse:.4g} {c.unit}", f"{c.normalised:.2f}", c.worst_trial,
         f"{c.worst_from_s:.1f} to {c.worst_to_s:.1f} s"]
        for c in found.channels
    ]  # fmt: skip
    table = Table(["channel", "rmse", "error", "worst trial", "when"], rows, (1, 2))
    page.sections.append(
        Section("By channel", "Root mean square in the channel's own unit, and in standard deviations.", None, table)
    )
    return page


def explain_page(problem: Problem, measured: Measurements, found: Explanation, account: Account) -> Page:
    """The page of explain."""
    best = found.best
    page = _page(problem, measured, "Explain", account, measured.model)
    page.tiles = [
        (problem.told(found.baseline_error), f"{problem.natural_name} of the model"),
        (problem.told(best.error_heldout) if best else "-", "with the best effect, held out"),
        (problem.told(found.noise_floor), "noise floor"),
        (str(found.tried), "explanations tried"),
    ]
    models = [("model", found.before)] + ([] if best is None else [("with the best effect", found.after)])
    after = None if best is None else problem.residuals([found.after])[0]
    page.sections.append(overlay_section(problem, found.base, models))
    _add(page, ranking_section(problem, found.candidates))
    page.sections.append(heat_section(problem, found.base, after))
    signature = signature_section(problem, found.base, after)
    if signature is not None and best is not None:
        signature.caption += f" Of {plain(best.terms[0].effect)}: {CATALOGUE[best.terms[0].effect].signature}"
    _add(page, signature)
    return page


def improve_page(problem: Problem, measured: Measurements, found: Improvement, account: Account) -> Page:
    """The page of improve."""
    first, last = found.ladder[0], found.ladder[-1]
    page = _page(problem, measured, "Improve", account, measured.model)
    page.tiles = [
        (problem.told(first.error_heldout), f"{problem.natural_name} before"),
        (problem.told(last.error_heldout), "after, held out"),
        (problem.told(found.noise_floor), "noise floor"),
        (str(len(found.terms)), "effects in the model"),
    ]
    models = [("model as it was", measured.model), ("improved model", found.terms)]
    page.sections.append(overlay_section(problem, found.base, models))
    steps = [f"{k}. {placed(r.name)}" if k else r.name for k, r in enumerate(found.ladder)]
    figure = figures.ladder(
        steps, [r.error_fit for r in found.ladder], [r.error_heldout for r in found.ladder], found.noise_floor
    )
    caption = f"Error of each model on {last.held_out}. Everything is fitted anew at each step."
    page.sections.append(Section("The ladder", caption, figure))
    rows = [
        [named(found.terms[p.term]), plain(p.name), f"{p.value:.4g}", f"{p.low:.4g} to {p.high:.4g}", p.flag]
        for p in found.parameters
    ]
    table = Table(["effect", "parameter", "value", "95 % interval", "note"], rows, (2, 3))
    page.sections.append(Section("The model", "What was added, with the interval of each value.", None, table))
    if found.last is not None:
        refused = [c for c in found.last.judged if not c.earned]
        _add(page, ranking_section(problem, refused, "Tried on top of it, and refused"))
    page.sections.append(heat_section(problem, found.base, found.residual))
    _add(page, signature_section(problem, found.base, found.residual))
    return page


def _page(problem: Problem, measured: Measurements, verb: str, account: Account, model: Hypothesis) -> Page:
    count = len(problem.trials)
    believed = "; ".join(told(t) for t in model) or "the robot as described"
    return Page(
        f"{verb}: {plain(problem.robot.name)}",
        f"{count} trial{'s' if count > 1 else ''}, {', '.join(p.name for p in measured.files)}; model: {believed}",
        [account.headline, *account.lines],
        "good" if account.good else "open",
        foot=f"ee_dist. {problem.error_definition[:1].upper()}{problem.error_definition[1:]}.",
    )


def _add(page: Page, section: Section | None) -> None:
    if section is not None:
        page.sections.append(section)
