"""The pages of compare, explain and improve: the finding, the picture that proves it, and the rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from ee_dist.discrepancy.compare import Comparison, compare
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.explain import NOTHING_MISSING, Explanation
from ee_dist.discrepancy.improve import Improvement
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.words import Account, named, placed, plain, told
from ee_dist.effects.catalogue import CATALOGUE
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.results import sections as parts
from ee_dist.tasks.results.glossary import TERMS
from ee_dist.tasks.results.story import Link
from ee_dist.tasks.results.tables import command
from ee_dist.trials.log import Array
from ee_dist.viewing import report_figures as figures
from ee_dist.viewing.report import Page, Section, Table

NAMED = 3
"""Effects that the first screen names."""


def compare_page(
    problem: Problem,
    measured: Measurements,
    found: Comparison,
    account: Account,
    residual: Array,
    remarks: Sequence[str] = (),
    following: Sequence[str] = (),
    links: Sequence[Link] = (),
) -> Page:
    """The page of compare."""
    models = [("model", measured.model)]
    overlays = parts.curves(problem, residual, models)
    regimes = sorted(found.regimes, key=lambda r: -r.error)
    page = _page(problem, measured, "Compare", account, following, links)
    page.words = [*page.words, *remarks]
    page.sure = f"How sure: the noise floor is {problem.told(found.noise_floor)}, {found.floor_source}."
    worst = found.channels[0].name if found.channels else ""
    page.proof = parts.proof_section(problem, overlays, residual, models, channel=worst)
    page.tiles = [
        (problem.told(found.error), problem.natural_name),
        (problem.told(found.noise_floor), "noise floor"),
        (plain(found.channels[0].name) if found.channels else "-", "worst channel"),
        (regimes[0].name if regimes else "-", "worst regime"),
    ]
    page.sections.append(parts.browser_section(overlays, models))
    page.sections.append(parts.channels_section(problem, found))
    page.sections.append(parts.heat_section(problem, residual))
    if len(problem.trials) > 1:
        page.sections.append(parts.trials_section(problem, found))
    page.sections.append(parts.regimes_section(problem, found))
    _add(page, parts.signature_section(problem, residual))
    return page


def explain_page(
    problem: Problem,
    measured: Measurements,
    found: Explanation,
    account: Account,
    following: Sequence[str] = (),
    links: Sequence[Link] = (),
) -> Page:
    """The page of explain."""
    best = found.best
    page = _page(problem, measured, "Explain", account, following, links)
    page.sure = _sure_of(found)
    page.tiles = [
        (problem.told(found.baseline_error), f"{problem.natural_name} of the model"),
        (problem.told(best.error_heldout) if best else "-", "with the best effect, held out"),
        (problem.told(found.noise_floor), "noise floor"),
        (str(found.tried), "explanations tried"),
    ]
    models = [("model", found.before)] + ([] if best is None else [("with the best effect", found.after)])
    after = None if best is None else problem.residuals([found.after])[0]
    overlays = parts.curves(problem, found.base, models)
    page.proof = parts.proof_section(problem, overlays, found.base, models, after)
    _add(page, parts.ranking_section(problem, found.candidates))
    page.sections.append(parts.browser_section(overlays, models))
    signature = parts.signature_section(problem, found.base, after)
    if signature is not None and best is not None:
        signature.caption += f" Of {plain(best.terms[0].effect)}: {CATALOGUE[best.terms[0].effect].signature}"
    _add(page, signature)
    page.sections.append(parts.heat_section(problem, found.base, after))
    page.sections.append(_channels(problem, found.base, after))
    return page


def improve_page(
    problem: Problem,
    measured: Measurements,
    found: Improvement,
    account: Account,
    following: Sequence[str] = (),
    links: Sequence[Link] = (),
) -> Page:
    """The page of improve."""
    first, last = found.ladder[0], found.ladder[-1]
    page = _page(problem, measured, "Improve", account, following, links)
    if len(found.ladder) > 1:
        share = max(0.0, min(found.explained, 1.0))
        page.sure = (
            f"Added: {_added(problem, found)}. How sure: {share:.0%} of what is above the noise is accounted for, judged on "
            f"{last.held_out}."
        )
    page.tiles = [
        (problem.told(first.error_heldout), f"{problem.natural_name} before"),
        (problem.told(last.error_heldout), "after, held out"),
        (problem.told(found.noise_floor), "noise floor"),
        (str(len(found.terms)), "effects in the model"),
    ]
    models = [("model as it was", measured.model), ("improved model", found.terms)]
    overlays = parts.curves(problem, found.base, models)
    page.proof = parts.proof_section(problem, overlays, found.base, models, found.residual)
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
    page.sections.append(parts.browser_section(overlays, models))
    _add(page, parts.signature_section(problem, found.base, found.residual))
    page.sections.append(parts.heat_section(problem, found.base, found.residual))
    page.sections.append(_channels(problem, found.base, found.residual))
    if found.last is not None:
        refused = [c for c in found.last.judged if not c.earned]
        _add(page, parts.ranking_section(problem, refused, "Tried on top of it, and refused"))
    return page


def _added(problem: Problem, found: Improvement) -> str:
    """The first effects that were added, with their final values, and how many more there are."""
    names = {t.name for r in found.ladder for t in r.added}
    new = [told(t, problem.robot) for t in found.terms if t.name in names]
    more = f"; and {len(new) - NAMED} more" if len(new) > NAMED else ""
    return "; ".join(new[:NAMED]) + more


def _channels(problem: Problem, before: Array, after: Array | None) -> Section:
    later = None if after is None else compare(problem, after)
    return parts.channels_section(problem, compare(problem, before), later)


def _sure_of(found: Explanation) -> str:
    """How certain an explanation is, in one sentence."""
    best = found.best
    if best is None:
        if found.verdict == NOTHING_MISSING:
            return f"How sure: {found.tried} explanations were tried, and none gains more than luck."
        return f"How sure: {found.tried} explanations were tried, and none earns its place, although more than noise is left."
    low, high = _above(best)
    count = len(best.tied_with)
    alone = f"{count} other{'s do' if count > 1 else ' does'} as well" if count else "no other does as well"
    return (
        f"How sure: on {best.held_out} it takes off {max(0.0, min(best.explained, 1.0)):.0%} of what is above the noise "
        f"(95 % interval {max(low, -9.99):.0%} to {min(high, 1.0):.0%}); of {found.tried} explanations {alone}."
    )


def _above(c: Judged) -> tuple[float, float]:
    """The interval of a candidate as a share of what is above the noise."""
    scale = c.explained / c.gain if c.gain > 0 and np.isfinite(c.gain) else 1.0
    return c.interval[0] * scale, c.interval[1] * scale


def _page(
    problem: Problem,
    measured: Measurements,
    verb: str,
    account: Account,
    following: Sequence[str],
    links: Sequence[Link],
) -> Page:
    count, model = len(problem.trials), measured.model
    believed = "; ".join(told(t) for t in model) or "the robot as described"
    return Page(
        f"{verb}: {plain(problem.robot.name)}",
        f"{count} trial{'s' if count > 1 else ''} of {', '.join(p.name for p in measured.files)}; model: {believed}; "
        f"compared by {plain(problem.way)}",
        account.headline,
        account.lines,
        "good" if account.good else "open",
        following=command(following) if following else "",
        links=links,
        terms=TERMS,
        foot=f"ee_dist. {problem.error_definition[:1].upper()}{problem.error_definition[1:]}.",
    )


def _add(page: Page, section: Section | None) -> None:
    if section is not None:
        page.sections.append(section)
