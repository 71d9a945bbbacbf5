"""The pages and rerun recordings of compare, explain and improve, put together from what they found."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING, Explanation
from ee_dist.discrepancy.improve import Improvement
from ee_dist.discrepancy.locate import Comparison, circumstances, joint_of_channel
from ee_dist.discrepancy.open_loop import OpenLoop
from ee_dist.discrepancy.prediction import rollout_of
from ee_dist.discrepancy.words import placed, plain, told
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.engines.drivers import Commands
from ee_dist.evaluation.jobs import Job, Whole
from ee_dist.recording.records import HARDWARE, PREDICTION, RunRecord, TrialRecord
from ee_dist.tasks.measured import Measurements
from ee_dist.trials.log import Array
from ee_dist.viewing import report_figures as figures
from ee_dist.viewing.report import Page, Section, Table
from ee_dist.viewing.rerun_scene import write_rrd

FOOT = "ee_dist. Errors are in standard deviations of the noise; see docs/tutorial.md."


def write_pictures(problem: OpenLoop, model: Hypothesis, path: Path, task: str) -> None:
    """Measured robot and predicted ghost side by side, with the residuals, as an .rrd."""
    believed = apply(problem.robot, model)
    rollouts = [replace(rollout_of(t, apply(believed, t.setup)), pose=True) for t in problem.measured]
    logs = problem.evaluator.evaluate([Job(r, Whole()) for r in rollouts])
    said = problem.predicted(model)
    run = RunRecord(problem.robot, {"task": task})
    for k, (trial, log, sensors) in enumerate(zip(problem.measured, logs, said, strict=True)):
        driver = trial.driver or Commands(trial.log.commands)
        run.trials.append(TrialRecord(k, trial.name, HARDWARE, driver, trial.log))  # type: ignore[arg-type]
        expected = replace(log, sensors=sensors, sensor_names=trial.log.sensor_names)
        run.trials.append(TrialRecord(k, trial.name, PREDICTION, driver, expected, model))  # type: ignore[arg-type]
    write_rrd(run, path)


def overlay_section(
    problem: OpenLoop, residual: Array, before: Hypothesis, after: Hypothesis | None, most: int = 6
) -> Section:
    """The trials and channels with most to see."""
    energy = []
    for k in range(len(problem.trials)):
        blocks = (problem.blocks(k, residual) ** 2 - problem.block_floor(k)).sum(axis=0)
        energy += [(float(v), k, c) for c, v in enumerate(blocks)]
    chosen: list[tuple[int, int]] = []
    for _, k, c in sorted(energy, reverse=True):
        if c not in [x for _, x in chosen] and len(chosen) < most:
            chosen.append((k, c))
    model = problem.predicted(before)
    better = problem.predicted(after) if after is not None else None
    items = []
    for k, c in chosen:
        log, sensor = problem.measured[k].log, problem.robot.sensors[c]
        items.append(
            figures.Overlay(
                f"{plain(sensor.name)}, {problem.trials[k]}",
                sensor.unit,
                log.times_s,
                log.sensors[:, c],
                model[k][:, c],
                None if better is None else better[k][:, c],
            )
        )
    caption = (
        "The channels with most to explain, each in the trial where it shows most. "
        "Left what was measured and said, right the difference."
    )
    return Section("Measured and predicted", caption, figures.overlays(items))


def heat_section(problem: OpenLoop, residual: Array) -> Section:
    cells = np.zeros((len(problem.segments), len(problem.channels)))
    counts = np.zeros_like(cells)
    np.add.at(cells, (problem.segment_of, problem.channel_of), residual**2)
    np.add.at(counts, (problem.segment_of, problem.channel_of), 1.0)
    heat = np.sqrt(np.divide(cells, counts, out=np.zeros_like(cells), where=counts > 0))
    names = [
        f"{problem.trials[k]} {s.rsplit('@', 1)[1]}"
        for k, s in zip(problem.trial_of_segment, problem.segments, strict=True)
    ]
    unique = [f"{n}{' ' * names[:i].count(n)}" for i, n in enumerate(names)]
    caption = (
        "Each cell is the error of one channel in one window of time. Pale is noise, red is what the model gets wrong."
    )
    return Section("Where it fails, channel by time", caption, figures.heat_map(heat, unique, problem.channels))


def signature_section(problem: OpenLoop, residual: Array, most: int = 3) -> Section | None:
    """Residuals of the worst joint channels against position, speed, command and load."""
    joints = joint_of_channel(problem.robot)
    score = np.zeros(len(joints))
    for k in range(len(problem.trials)):
        score += (problem.blocks(k, residual) ** 2).sum(axis=0)
    worst = [i for i in np.argsort(-score) if joints[i] is not None][:most]
    panels = []
    for i in worst:
        j = joints[i]
        raw = [problem.raw_blocks(k, residual)[:, i] for k in range(len(problem.trials))]
        around = [circumstances(problem, k) for k in range(len(problem.trials))]
        y = np.concatenate(raw)
        columns: list[tuple[str, Array, Array]] = []
        for label, key in (
            ("position (rad)", "position"),
            ("commanded speed (rad/s)", "speed"),
            ("command (rad)", "command"),
            ("load (N.m)", "load"),
        ):
            x = np.concatenate([getattr(a, key)[:, j] for a in around])
            if np.isfinite(x).all():
                columns.append((label, x, y))
        panels.append((plain(problem.channels[i]), columns))
    if not panels:
        return None
    caption = (
        "A law that is missing draws a line here: friction a step at zero speed, a spring a slope over position, "
        "play a gap at zero load."
    )
    return Section("Residual against what the joint did", caption, figures.signatures(panels))


def compare_page(problem: OpenLoop, measured: Measurements, found: Comparison, residual: Array) -> Page:
    """The page of compare."""
    ratio = found.error / found.noise_floor if found.noise_floor else float("inf")
    words = [
        f"The model is off by {found.error:.2f} standard deviations; noise alone would leave {found.noise_floor:.2f}.",
        f"Error: {found.definition}. Noise floor: {found.floor_source}.",
    ]
    parted = [f"{t} at {s:.2f} s" for t, s in found.parted_s.items() if s is not None]
    words.append("Prediction and measurement part: " + ("; ".join(parted) or "nowhere") + ".")
    regimes = sorted(found.regimes, key=lambda r: -r.error)
    page = Page(
        f"Compare: {problem.robot.name}",
        f"{len(problem.trials)} trials, {', '.join(p.name for p in measured.files)}; model: {_model(measured.model)}",
        words,
        "good" if ratio < 1.1 else "open",
        [
            (f"{found.error:.2f}", "error"),
            (f"{found.noise_floor:.2f}", "noise floor"),
            (plain(found.channels[0].name), "worst channel"),
            (regimes[0].name if regimes else "-", "worst regime"),
        ],
        foot=FOOT,
    )
    page.sections.append(overlay_section(problem, residual, measured.model, None))
    page.sections.append(heat_section(problem, residual))
    page.sections.append(
        Section(
            "By regime",
            "Joint channels, sorted by what their joint was doing at the time.",
            figures.bars([r.name for r in regimes], [r.error for r in regimes], "error (standard deviations)"),
            Table(
                ["regime", "error", "share of the excess", "share of the data"],
                [[r.name, f"{r.error:.2f}", f"{r.share:.0%}", f"{r.values:.0%}"] for r in regimes],
                (1, 2, 3),
            ),
        )
    )
    signature = signature_section(problem, residual)
    if signature is not None:
        page.sections.append(signature)
    rows = [
        [
            plain(c.name),
            f"{c.rmse:.4g} {c.unit}",
            f"{c.normalised:.2f}",
            c.worst_trial,
            f"{c.worst_from_s:.1f} to {c.worst_to_s:.1f} s",
        ]
        for c in found.channels
    ]
    table = Table(["channel", "rmse", "error", "worst trial", "when"], rows, (1, 2))
    page.sections.append(
        Section("By channel", "Root mean square in the channel's own unit, and in standard deviations.", None, table)
    )
    return page


def explain_page(problem: OpenLoop, measured: Measurements, found: Explanation, words: Sequence[str]) -> Page:
    """The page of explain."""
    best = found.best
    page = Page(
        f"Explain: {problem.robot.name}",
        f"{len(problem.trials)} trials, {', '.join(p.name for p in measured.files)}; model: {_model(measured.model)}",
        words,
        "good" if found.verdict == NOTHING_MISSING or (found.verdict == EFFECT and not found.left) else "open",
        [
            (f"{found.baseline_error:.2f}", "error of the model"),
            (f"{best.error_heldout:.2f}" if best else "-", "with the best effect, held out"),
            (f"{found.noise_floor:.2f}", "noise floor"),
            (str(found.tried), "explanations tried"),
        ],
        foot=FOOT,
    )
    if found.candidates:
        tied = set(best.tied_with) if best else set()
        kinds = [
            "best" if best and c is best else "tied" if c.name in tied else "earned" if c.earned else "not"
            for c in found.candidates
        ]
        names = [placed(c.name) for c in found.candidates]
        rows = [
            [str(c.rank), told(c.hypothesis[-1], problem.robot), f"{c.error_heldout:.3f}", f"{c.gain:.1%}",
             f"{max(c.interval[0], -9.99):.1%} to {c.interval[1]:.1%}", "earned" if c.earned else c.why_not]
            for c in found.candidates
        ]  # fmt: skip
        lead = [k for k, kind in enumerate(kinds) if kind in ("best", "tied")]
        page.sections.append(
            Section(
                "Candidate effects, ranked",
                "Share of the squared residual that each takes off data it was not fitted to, with its 95 % interval.",
                figures.ranking(
                    names, [c.gain for c in found.candidates], [c.interval for c in found.candidates], kinds
                ),
                Table(
                    ["rank", "effect", "error held out", "gain", "95 % interval", "judgement"], rows, (0, 2, 3, 4), lead
                ),
            )
        )
    after = None if best is None else (*found.before, *best.hypothesis)
    page.sections.append(overlay_section(problem, found.base, measured.model, after))
    page.sections.append(heat_section(problem, found.base))
    signature = signature_section(problem, found.base)
    if signature is not None:
        page.sections.append(signature)
    return page


def improve_page(
    problem: OpenLoop, measured: Measurements, found: Improvement, words: Sequence[str], base: Array
) -> Page:
    """The page of improve."""
    first, last = found.ladder[0], found.ladder[-1]
    names = [
        "model as it was",
        *(" + ".join(plain(f"{t.effect} at {t.target}") for t in r.added) for r in found.ladder[1:]),
    ]
    page = Page(
        f"Improve: {problem.robot.name}",
        f"{len(problem.trials)} trials, {', '.join(p.name for p in measured.files)}; model: {_model(measured.model)}",
        words,
        "good" if last.error_heldout < 1.3 * found.noise_floor else "open",
        [
            (f"{first.error_heldout:.2f}", "error before"),
            (f"{last.error_heldout:.2f}", "error after, held out"),
            (f"{found.noise_floor:.2f}", "noise floor"),
            (str(len(found.terms)), "effects in the model"),
        ],
        foot=FOOT,
    )
    steps = [f"{k}. {n}" if k else n for k, n in enumerate(names)]
    page.sections.append(
        Section(
            "The ladder",
            "Error of each model on data that it was not fitted to. Everything is fitted anew at each step.",
            figures.ladder(
                steps, [r.error_fit for r in found.ladder], [r.error_heldout for r in found.ladder], found.noise_floor
            ),
        )
    )
    rows = [
        [
            told(found.terms[p.term]).split(" (")[0],
            plain(p.name),
            f"{p.value:.4g}",
            f"{p.low:.4g} to {p.high:.4g}",
            p.flag,
        ]
        for p in found.parameters
    ]
    table = Table(["effect", "parameter", "value", "95 % interval", "note"], rows, (2, 3))
    page.sections.append(Section("The model", "What was added, with the interval of each value.", None, table))
    page.sections.append(overlay_section(problem, base, measured.model, found.terms))
    page.sections.append(heat_section(problem, found.residual))
    return page


def _model(terms: Hypothesis) -> str:
    return "; ".join(told(t) for t in terms) or "the robot as described"
