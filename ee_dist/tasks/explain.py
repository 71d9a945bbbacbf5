"""task=explain: which missing effect explains what was measured, ranked, with held-out evidence and in words."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass, field, replace
from pathlib import Path

from ee_dist.basics.names import listed
from ee_dist.discrepancy.accounts.account import MEND, Account
from ee_dist.discrepancy.accounts.of_explain import explain_account
from ee_dist.discrepancy.at_limit import often_at_limit
from ee_dist.discrepancy.confidence import confidence
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, Explanation, explain
from ee_dist.discrepancy.measured_trial import reading_s
from ee_dist.discrepancy.plan import PlannedTrial, next_trials
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.search import Progress, quiet
from ee_dist.robots.describe import BUILT_IN
from ee_dist.tasks.config import AUTO, Config
from ee_dist.tasks.held_apart import told_of
from ee_dist.tasks.measurements import load, load_held_out, with_known_noise
from ee_dist.tasks.pool import check, chosen
from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.results.commands import asked, command, planning, setting
from ee_dist.tasks.results.pages import explain_page
from ee_dist.tasks.results.scenes import explain_scene
from ee_dist.tasks.results.story import links
from ee_dist.tasks.results.summaries import of_explanation, of_read
from ee_dist.tasks.results.tables import show_account, show_explanation, show_last_word, typed
from ee_dist.tasks.summary import Stopwatch, write_summary
from ee_dist.tasks.terminal import terminal
from ee_dist.tasks.ways import known_way, way_of
from ee_dist.tasks.wiring import evaluator_of
from ee_dist.viewing.report import write_page

MOST_TIED = 5
"""Tied explanations that the next trial is to tell apart."""


@dataclass
class Options:
    name: str = "explain"
    by: str = AUTO
    without: list[str] = field(default_factory=list)
    only: list[str] = field(default_factory=list)
    rerun: bool = True

    def __post_init__(self) -> None:
        known_way(self.by)


def run(config: Config, options: Options, out: Path, told: Progress = quiet) -> tuple[Problem, Explanation, Account]:
    """Write summary.json, report.html and explain.rrd into ``out``; ``told`` hears of the progress. Raises ConfigError,
    LogError, RecordingError."""
    console, watch, measured = terminal(), Stopwatch(), load(config)
    apart = load_held_out(config)
    way = way_of(measured, options.by)
    check(measured.robot, options.without, options.only)
    for remark in measured.remarks:
        console.print(remark, highlight=False, markup=False)
    with SearchProgress(console, told) as progress:
        problem = way.searched(measured, config, progress)
        if problem.doubts:
            # It may decide everything, and a search takes minutes.
            progress.note(f"Before anything is believed: {problem.doubts}")
        pool = chosen(problem, options.without, options.only)
        count = len(measured.trials)
        without = f" (held out from all of it: {listed(measured.held_out)})" if measured.held_out else ""
        console.print(
            f"{count} trial{'s' if count > 1 else ''} of {measured.robot.name}{without}, {len(pool)} candidate explanations, "
            f"{way.name}: {way.why}.",
            highlight=False,
        )
        found = explain(problem, pool, measured.model, progress=progress)
        ahead: PlannedTrial | None = None
        if len(found.tied) > 1 and measured.robot.name in BUILT_IN:
            tied = [(*found.fixed, *c.hypothesis) for c in found.tied[:MOST_TIED]]
            # As noisy and as seldom read as these: what a simulation reads is exact, and read in every row.
            robot, every_s = with_known_noise(measured), reading_s(measured.trials)
            ahead = next(iter(next_trials(robot, tied, evaluator_of(config), every_s=every_s)), None)
    found = replace(found, at_limit=often_at_limit(problem, found.before))
    share = confidence(problem.way, found)
    also = problem.other_errors(found.before, found.after) if found.best else ()
    also = (*also, *problem.spoiled(found.after), *way.instead(bool(found.left)))
    named = found.best if found.verdict == EFFECT else None
    fell = named is not None and named.error_heldout < found.baseline_error
    farther = "" if named is None else problem.farther_off(found.before, found.after, fell)
    word = None if apart is None else told_of(apart, way, config, found.after, problem)
    account = explain_account(problem, found, ahead, planning(out, problem.robot), share, also, word)
    account = account.warned((*measured.remarks, *([f"{farther}."] if farther else [])))
    # A mistake of the description or the mapping is mended there: no model on top of it is of any use.
    if found.verdict != NOTHING_MISSING and account.advice != MEND:
        # Where more than this is missing, the rest is looked for beside it.
        alone = found.verdict == EFFECT and found.best is not None and not account.more
        effect = setting("effect", typed(found.best.terms) if alone and found.best else "auto")
        account = account.followed(command(asked("improve", config, options.by, effect)))
    digest = hashlib.sha256(repr([(c.hypothesis, c.error_heldout) for c in found.candidates]).encode()).hexdigest()
    out.mkdir(parents=True, exist_ok=True)
    told_all = of_read(measured.read) | of_explanation(problem, found, account, ahead, share, word)
    write_summary(out, "explain", config, options, watch, digest, told_all)
    story = links(out, measured.files, config.model)
    write_page(explain_page(problem, measured, found, account, story, word), out / "report.html")
    if options.rerun:
        explain_scene(problem, found, account, out / "explain.rrd")
    show_explanation(console, problem, found)
    show_last_word(console, word)
    wall, _ = watch.read()
    console.print(f"{wall:.0f} s. Digest {digest[:16]}.", highlight=False)
    show_account(console, account, out)
    return problem, found, account
