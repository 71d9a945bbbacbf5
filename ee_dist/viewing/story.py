"""The run in words: distances, hypotheses beside the truth, and how to read the screen. Markdown."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import Any

from ee_dist.effects.catalogue import EffectError, Hypothesis, Term, from_dict
from ee_dist.recording.records import HARDWARE, HypothesisRecord, RunRecord, TrialRecord

INTACT = "intact"
"""Name of the trial before the change."""

GUIDE = """\
**Blue**: what the robot did. **Orange**: what its model expected. **Green** foot: its sensor reports the floor. \
Press play: the trials run one after another.\
"""


def truth_of(run: RunRecord) -> Hypothesis | None:
    """The hidden change, where the recording tells it; None where nobody knows."""
    text = run.metadata.get("truth")
    if not text:
        return None
    return tuple(_term(entry) for entry in json.loads(text))


def _term(entry: dict[str, Any]) -> Term:
    try:
        return from_dict(entry)
    except EffectError:
        # An effect of a user's own file that is not loaded here: still worth showing.
        values = tuple((k, float(v)) for k, v in entry.items() if k not in ("effect", "target"))
        return Term(str(entry.get("effect", "?")), str(entry.get("target") or ""), values)


def best_hypotheses(run: RunRecord) -> dict[int, HypothesisRecord]:
    """The best of the last generation of each diagnosis pass."""
    best: dict[int, HypothesisRecord] = {}
    for record in run.hypotheses:
        have = best.get(record.pass_index)
        if have is None or (record.generation, -record.rank) > (have.generation, -have.rank):
            best[record.pass_index] = record
    return best


def told(hypothesis: Hypothesis | None) -> str:
    """A hypothesis in words."""
    if hypothesis is None:
        return "not known"
    return "; ".join(str(t).replace("_", " ") for t in hypothesis) or "nothing changed"


def hardware_trials(run: RunRecord) -> list[TrialRecord]:
    """The trials on hardware, in the order of their index."""
    return sorted((t for t in run.trials if t.source == HARDWARE), key=lambda t: t.index)


def intact_distance(trials: Sequence[TrialRecord]) -> float | None:
    """How far the robot went before the change, m."""
    return next((t.log.travel_m for t in trials if t.name == INTACT), None)


def share_text(trial: TrialRecord, intact: float | None) -> str:
    """Distance as a share of the intact robot's."""
    return f"{100 * trial.log.travel_m / intact:.0f} %" if intact and intact > 0 else ""


def title_of(run: RunRecord) -> str:
    """A name for the recording."""
    told_of = [f"{key} {run.metadata[key]}" for key in ("scenario", "metric", "seed") if run.metadata.get(key)]
    return ", ".join(told_of).replace("_", " ") or run.robot.name


def result_text(run: RunRecord) -> str:
    """The first thing to read: what is to be seen, what happened, what was believed, how far the robot went."""
    trials = hardware_trials(run)
    intact = intact_distance(trials)
    predicted = {t.index: t for t in run.trials if t.source != HARDWARE}
    best = best_hypotheses(run)
    truth = truth_of(run)
    lines = [f"### {title_of(run)}", "", GUIDE, "", "**How far it went forward**", ""]
    lines += ["| trial | measured, m | of intact | predicted, m |", "|---|---|---|---|"]
    for t in trials:
        p = predicted.get(t.index)
        expected = "" if p is None else f"{p.log.travel_m:.2f}"
        lines.append(f"| {t.name} | {t.log.travel_m:.2f} | {share_text(t, intact)} | {expected} |")
    if best or truth is not None:
        lines += ["", "**What it believed had changed**", "", "| diagnosis | error | hypothesis |", "|---|---|---|"]
        lines += [f"| {k + 1} | {r.error:.3g} | {told(r.terms)} |" for k, r in sorted(best.items())]
        lines.append(f"| **truth** | | **{told(truth)}** |")
    if not run.complete:
        lines += ["", "*This recording was cut short: the run did not reach its end.*"]
    return "\n".join(lines)


def details_text(run: RunRecord) -> str:
    """Everything that the recording says about itself, for the tab behind the first one."""
    lines = ["# About this run", "", "| key | value |", "|---|---|"]
    lines += [f"| {key} | {value} |" for key, value in sorted(run.metadata.items()) if key != "truth"]
    final = [h for h in run.hypotheses if h.final]
    for pass_index in sorted({h.pass_index for h in final}):
        lines += ["", f"## Last hypotheses of diagnosis {pass_index + 1}", "", "| error | hypothesis |", "|---|---|"]
        own = sorted((h for h in final if h.pass_index == pass_index), key=lambda h: h.rank)
        lines += [f"| {h.error:.4g} | {told(h.terms)} |" for h in own]
    return "\n".join(lines)
