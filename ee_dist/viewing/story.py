"""The run in words: distances, hypotheses beside the truth, and how to read the screen. Markdown."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from typing import Any

from ee_dist.discrepancy import words
from ee_dist.effects.catalogue import EVERY, Hypothesis, Term, from_dict
from ee_dist.effects.effect import EffectError
from ee_dist.recording.records import (
    DIAGNOSIS,
    EVOLVED,
    EVOLVING,
    HARDWARE,
    HINDSIGHT,
    PREDICTION,
    REPAIR,
    STAGES,
    GenerationRecord,
    HypothesisRecord,
    RunRecord,
    TrialRecord,
)
from ee_dist.recovery.doubt import Doubt, doubt_from
from ee_dist.recovery.kinds import subject_of
from ee_dist.recovery.subject import Subject
from ee_dist.robots.system import System

TOLD = ("truth", "doubt", "verdict", "caution", "again")
"""What recordings say of themselves in sentences, or what sentences are made of."""
INTACT = "intact"
"""Name of the trial before the change."""


def guide(robot: System, hindsight: bool) -> str:
    """How to read the screen, for this robot."""
    said = [
        f"**Blue**: what the {subject_of(robot).noun} did.",
        "**Orange**: what its model expected, before the trial.",
    ]
    if hindsight:
        said.append("**Violet**: the same trial on the model of the diagnosis that followed.")
    if any(s.kind == "touch" for s in robot.sensors):
        said.append("**Green**: a foot whose sensor reports the floor.")
    return " ".join([*said, "Press play: the trials run one after another."])


def below_zero(records: Sequence[GenerationRecord]) -> bool:
    """Whether any bar stands below zero."""
    return any(math.isfinite(r.best) and r.best < 0 for r in records)


def bars_guide(run: RunRecord) -> list[str]:
    """How to read the bars of the search; nothing where there are none."""
    phases = {g.phase for g in run.generations if g.best}
    if not phases.intersection((REPAIR, DIAGNOSIS)):
        return []
    believed = "; **violet**: the error of what was believed" if DIAGNOSIS in phases and beliefs(run) else ""
    line = "; a **white line** is at 0" if below_zero(run.generations) else ""
    return [
        f"**Grey bars**: the best of each generation, from 0; light and dark take turns, pass by pass{believed}{line}.",
        "",
    ]


def truth_of(run: RunRecord) -> Hypothesis | None:
    """The hidden change, where the recording tells it; None where nobody knows."""
    text = run.metadata.get("truth")
    if not text:
        return None
    return tuple(_term(entry) for entry in json.loads(text))


def doubt_of(run: RunRecord) -> Doubt | None:
    """Whether something is wrong that the last belief does not say; None where the recording does not tell."""
    try:
        return doubt_from(json.loads(run.metadata["doubt"]))
    except (KeyError, TypeError, ValueError):
        return None


def _term(entry: dict[str, Any]) -> Term:
    try:
        return from_dict(entry)
    except EffectError:
        # An effect of a user's own file that is not loaded here: still worth showing.
        values = tuple((k, float(v)) for k, v in entry.items() if k not in ("effect", "target"))
        return Term(str(entry.get("effect", "?")), str(entry.get("target") or ""), values)


def beliefs(run: RunRecord) -> dict[int, HypothesisRecord]:
    """What the loop believed after each diagnosis pass, and acted on; of a pass that was cut off, nothing."""
    return {r.pass_index: r for r in run.hypotheses if r.final}


def diagnosed_after(pass_index: int) -> str:
    """The last trial that a diagnosis pass has seen: the first comes after that in which the change showed."""
    return "after the change" if pass_index == 0 else f"after trial {pass_index}"


def evolved(run: RunRecord) -> dict[int, HypothesisRecord]:
    """The best of the last population of each diagnosis pass: where polish and prune began."""
    return {r.pass_index: r for r in run.hypotheses if r.stage == EVOLVED and r.rank == 0 and not r.final}


def told(hypothesis: Hypothesis | None) -> str:
    """A hypothesis in words."""
    if hypothesis is None:
        return "not known"
    # An effect of a user's own file that is not loaded here: nothing is known of its units.
    said = (words.told(t) if t.effect in EVERY else str(t).replace("_", " ") for t in hypothesis)
    return "; ".join(said) or "nothing changed"


def hardware_trials(run: RunRecord) -> list[TrialRecord]:
    """The trials on hardware, in the order of their index."""
    return sorted((t for t in run.trials if t.source == HARDWARE), key=lambda t: t.index)


def intact_value(subject: Subject, trials: Sequence[TrialRecord]) -> float | None:
    """How well the system did before the change."""
    return next((subject.value(t.log) for t in trials if t.name == INTACT), None)


def share_text(value: float, intact: float | None) -> str:
    """A value as a share of that of the intact system."""
    return f"{100 * value / intact:.0f} %" if intact and intact > 0 else ""


def title_of(run: RunRecord) -> str:
    """A name for the recording."""
    told_of = [f"{key} {run.metadata[key]}" for key in ("scenario", "metric", "seed") if run.metadata.get(key)]
    return ", ".join(told_of).replace("_", " ") or run.robot.name


def finding(run: RunRecord) -> list[str]:
    """What came out, before anything else: the last belief, how well it does with it, how sure, what its terminal concluded and
    warned of, what next."""
    trials, believed, subject = hardware_trials(run), beliefs(run), subject_of(run.robot)
    if not believed or len(trials) < 3:
        return []
    last, intact, compensating = believed[max(believed)], intact_value(subject, trials), trials[2:]
    best = max(compensating, key=lambda t: subject.value(t.log))
    reached = subject.value(best.log)
    share = share_text(reached, intact)
    of = f", {share} of the intact {subject.noun}'s {subject.measure(intact)}" if share and intact is not None else ""
    lines = [
        f"**Believed in the end: {told(last.terms)}.**",
        f"Best trial: {best.name}, {subject.measure(reached)}{of}.",
        f"How sure: with it the model differs from the trials by {last.error:.3g} (0 is exact)",
    ]
    foreseen = {t.index: t for t in run.trials if t.source == PREDICTION}.get(trials[-1].index)
    if foreseen is not None:
        went = subject.measure(subject.value(trials[-1].log))
        lines[-1] += (
            f"; it foresaw {subject.measure(subject.value(foreseen.log))} for the last trial, which went {went}"
        )
    lines[-1] += "."
    if verdict := run.metadata.get("verdict"):
        # The best trial may have been no gait: without this, its share of intact would read like a success.
        lines.append(verdict)
    if doubt := doubt_of(run):
        lines.append(f"**{doubt.words}**" if doubt.said else doubt.words)
    if caution := run.metadata.get("caution"):
        lines.append(caution)
    if again := run.metadata.get("again"):
        lines.append(f"Next, how much of it is luck: `{again}`")
    return [text for line in lines for text in (line, "")]


def result_text(run: RunRecord) -> str:
    """The first thing to read: what is to be seen, what happened, what was believed, how far the robot went."""
    trials, subject = hardware_trials(run), subject_of(run.robot)
    intact = intact_value(subject, trials)
    said = {(t.source, t.index): t for t in run.trials}
    after = any(source == HINDSIGHT for source, _ in said)
    lines = [
        f"### {title_of(run)}",
        "",
        *finding(run),
        guide(run.robot, after),
        "",
        *bars_guide(run),
        f"**{subject.meaning}{f' ({subject.unit})' if subject.unit else ''}**",
        "",
    ]
    lines += ["| trial | measured | of intact | expected before | explained after |", "|---|---|---|---|---|"]
    for t in trials:
        models = [said.get((source, t.index)) for source in (PREDICTION, HINDSIGHT)]
        told_of = ["" if m is None else f"{subject.value(m.log):.2f}" for m in models]
        reached = subject.value(t.log)
        lines.append(f"| {t.name} | {reached:.2f} | {share_text(reached, intact)} | {' | '.join(told_of)} |")
    believed, truth, start = beliefs(run), truth_of(run), evolved(run)
    if believed or truth is not None:
        # Not a table: the viewer cuts its rows instead of folding them.
        lines += ["", "**What it believed had changed**", ""]
        for k, r in sorted(believed.items()):
            began = f", as evolved {start[k].error:.3g}" if k in start else ""
            lines.append(f"- Diagnosis {k + 1} (error {r.error:.3g}{began}): {told(r.terms)}")
        lines.append(f"- **Truth: {told(truth)}**")
    if not run.complete:
        lines += ["", "*This recording was cut short: the run did not reach its end.*"]
    return "\n".join(lines)


def details_text(run: RunRecord) -> str:
    """Everything that the recording says about itself, for the tab behind the first one."""
    lines = ["# About this run", "", "| key | value |", "|---|---|"]
    lines += [f"| {key} | {value} |" for key, value in sorted(run.metadata.items()) if key not in TOLD]
    last = [h for h in run.hypotheses if h.final or h.stage != EVOLVING]
    for pass_index in sorted({h.pass_index for h in last}):
        lines += ["", f"## Diagnosis {pass_index + 1}: its last population, and what was made of the best", ""]
        lines += ["| stage | error | hypothesis |", "|---|---|---|"]
        own = sorted(
            (h for h in last if h.pass_index == pass_index), key=lambda h: (STAGES.index(h.stage), h.final, h.rank)
        )
        lines += [f"| {h.stage}{' (believed)' if h.final else ''} | {h.error:.4g} | {told(h.terms)} |" for h in own]
    return "\n".join(lines)
