"""The pages of compare, explain and improve: the finding, the picture that proves it, and the rest."""

from __future__ import annotations

from collections.abc import Sequence

from ee_dist.basics.names import listed
from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.compare import Comparison, compare
from ee_dist.discrepancy.evidence.holdout import in_turn
from ee_dist.discrepancy.explain import Explanation
from ee_dist.discrepancy.importance import added
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.last_word import HELD_APART, TRIALS_APART, LastWord
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.words import phrase, plain
from ee_dist.tasks.measurements import Measurements
from ee_dist.tasks.results import sections as parts
from ee_dist.tasks.results.glossary import TERMS
from ee_dist.tasks.results.labels import IMPROVED, MODEL, axis_of, drawn, refused_heading, step_tick
from ee_dist.tasks.results.story import Link
from ee_dist.tasks.results.values import kinds_of
from ee_dist.trials.log import Array
from ee_dist.viewing import report_figures as figures
from ee_dist.viewing.report import Page, Section


def compare_page(
    problem: Problem,
    measured: Measurements,
    found: Comparison,
    account: Account,
    residual: Array,
    remarks: Sequence[str] = (),
    links: Sequence[Link] = (),
) -> Page:
    """The page of compare."""
    models = [(MODEL, measured.model)]
    overlays = parts.curves(problem, residual, models)
    regimes = sorted(found.regimes, key=lambda r: -r.error)
    page = _page(problem, measured, "Compare", account, links)
    page.words = [*page.words, *remarks]
    worst = found.channels[0].name if found.channels else ""
    page.proof = parts.proof_section(problem, overlays, residual, models, channel=worst)
    page.tiles = [
        (problem.told(found.error), f"{problem.natural_name}, {MODEL}"),
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
    links: Sequence[Link] = (),
    word: LastWord | None = None,
) -> Page:
    """The page of explain; ``word`` is on trials that took no part in it."""
    best = found.best
    page = _page(problem, measured, "Explain", account, links)
    page.tiles = [
        (problem.told(found.baseline_error), f"{problem.natural_name}, {MODEL}"),
        *([(problem.told(best.error_heldout), f"{IMPROVED}, on {best.held_out}")] if best else []),
        *_word_tile(word),
        (problem.told(found.noise_floor), "noise floor"),
        (str(found.tried), "explanations tried"),
    ]
    models = [(MODEL, found.before)] + ([] if best is None else [(IMPROVED, found.after)])
    after = None if best is None else problem.residuals([found.after])[0]
    overlays = parts.curves(problem, found.base, models)
    page.proof = parts.proof_section(problem, overlays, found.base, models, after)
    _add(page, parts.ranking_section(problem, found.candidates))
    _add(page, None if word is None else parts.last_word_section(word))
    _add(page, parts.values_section(kinds_of(found.after, found.parameters, problem.robot)))
    page.sections.append(parts.browser_section(overlays, models))
    _add(page, parts.signature_section(problem, found.base, after, () if best is None else best.terms))
    page.sections.append(parts.heat_section(problem, found.base, after))
    page.sections.append(_channels(problem, found.base, after))
    return page


def improve_page(
    problem: Problem,
    measured: Measurements,
    found: Improvement,
    account: Account,
    links: Sequence[Link] = (),
    word: LastWord | None = None,
) -> Page:
    """The page of improve; ``word`` is on trials that took no part in it."""
    first, last, changed = found.ladder[0], found.ladder[-1], len(found.ladder) > 1
    held = in_turn(last.held_out, word is not None)
    page = _page(problem, measured, "Improve", account, links)
    page.tiles = [
        (problem.told(first.error_heldout), f"{problem.natural_name}, {MODEL}"),
        *([(problem.told(last.error_heldout), f"{IMPROVED}, on {held}")] if changed else []),
        *_word_tile(word),
        (problem.told(found.noise_floor), "noise floor"),
        (str(len(found.terms)), "effects in the model"),
    ]
    models = [(MODEL, measured.model)] + ([(IMPROVED, found.terms)] if changed else [])
    after = found.residual if changed else None
    overlays = parts.curves(problem, found.base, models)
    page.proof = parts.proof_section(problem, overlays, found.base, models, after)
    if changed:
        steps = [f"{k}. {step_tick(r)}" if k else step_tick(r) for k, r in enumerate(found.ladder)]
        figure = figures.ladder(
            steps,
            [drawn(problem, r.error_fit) for r in found.ladder],
            [drawn(problem, r.error_heldout) for r in found.ladder],
            [in_turn(r.held_out, word is not None) for r in found.ladder],
            drawn(problem, found.noise_floor),
            axis_of(problem),
            None if word is None else [drawn(word.problem, s.error) for s in word.steps],
        )
        cuts = found.cuts if word is None else list(map(in_turn, found.cuts))
        caption = f"Error of each model on {', then on '.join(cuts)}. Everything is fitted anew at each step."
        if word is not None:
            caption += f" {HELD_APART}: told at each step, and no step was chosen by it."
        if len(found.cuts) > 1:
            caption += " A line joins what was judged on the same: from one to the next errors cannot be compared."
        page.sections.append(Section("The ladder", caption, figure))
    _add(page, None if word is None else parts.last_word_section(word))
    _add(page, parts.values_section(kinds_of(found.terms, found.parameters, problem.robot)))
    page.sections.append(parts.browser_section(overlays, models))
    _add(page, parts.signature_section(problem, found.base, after, tuple(added(found))))
    page.sections.append(parts.heat_section(problem, found.base, after))
    page.sections.append(_channels(problem, found.base, after))
    _add(page, parts.ranking_section(problem, found.refused, refused_heading(problem, found)))
    return page


def _channels(problem: Problem, before: Array, after: Array | None) -> Section:
    later = None if after is None else compare(problem, after)
    return parts.channels_section(problem, compare(problem, before), later)


def _page(
    problem: Problem,
    measured: Measurements,
    verb: str,
    account: Account,
    links: Sequence[Link],
) -> Page:
    count, model = len(problem.trials), measured.model
    believed = phrase(model, problem.robot) or "the robot as described"
    held = f", held out from all of it: {listed(measured.held_out)}" if measured.held_out else ""
    return Page(
        f"{verb}: {plain(problem.robot.name)}",
        f"{count} trial{'s' if count > 1 else ''} of {', '.join(p.name for p in measured.files)}{held}; model: {believed}; "
        f"compared by {plain(problem.way)}",
        account.headline,
        account.lines,
        "good" if account.good else "open",
        account.first,
        following=account.then,
        lead=account.lead,
        links=links,
        terms=TERMS,
        foot=f"ee_dist. {problem.error_definition[:1].upper()}{problem.error_definition[1:]}.",
    )


def _add(page: Page, section: Section | None) -> None:
    if section is not None:
        page.sections.append(section)


def _word_tile(word: LastWord | None) -> list[tuple[str, str]]:
    """How far the improved model is from trials that took no part, if there are both."""
    if word is None or not word.changed:
        return []
    return [(word.problem.told(word.after), f"{IMPROVED}, on {TRIALS_APART}")]
