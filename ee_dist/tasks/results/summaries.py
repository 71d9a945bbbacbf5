"""The parts of summary.json that compare, explain and improve document: the same keys whatever the way of comparing."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.accounts.of_improve import rivals
from ee_dist.discrepancy.compare import Comparison
from ee_dist.discrepancy.evidence.intervals import ParameterReport
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.evidence.left import Leftover
from ee_dist.discrepancy.explain import Explanation
from ee_dist.discrepancy.importance import shares
from ee_dist.discrepancy.ladder import Improvement, Rung
from ee_dist.discrepancy.last_word import LastWord
from ee_dist.discrepancy.meters import AtLimit
from ee_dist.discrepancy.plan import ENOUGH, PlannedTrial
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.search.candidates import Proposal
from ee_dist.discrepancy.search.fitted import Model
from ee_dist.effects.catalogue import Hypothesis
from ee_dist.tasks.summary import hypothesis_list
from ee_dist.trials.log import Array


def common(problem: Problem, account: Account, floor: float, source: str, model: Hypothesis) -> dict[str, Any]:
    """What all three say."""
    whole, sure = (float(energy.sum()) for energy in (problem.floor, problem.sure))
    return {
        "way": problem.way,
        "error_definition": problem.error_definition,
        "natural": {"name": problem.natural_name, "unit": problem.natural_unit},
        "noise_floor": floor,
        "noise_floor_natural": problem.natural(floor),
        "noise_floor_sure": floor * math.sqrt(sure / whole) if whole else floor,
        "noise_floor_source": source,
        "model_terms": hypothesis_list(model),
        "headline": account.headline,
        "words": account.words,
    }


def of_read(read: Sequence[tuple[Path, str]]) -> dict[str, Any]:
    """What explain and improve read, by name and by the seal of the truth beside it: ``Measurements.read``."""
    return {"measured": [{"file": str(file), "seal": seal or None} for file, seal in read]}


def of_comparison(
    problem: Problem, found: Comparison, account: Account, model: Hypothesis, left: Sequence[Leftover]
) -> dict[str, Any]:
    return {
        **common(problem, account, found.noise_floor, found.floor_source, model),
        "error": found.error,
        "error_natural": problem.natural(found.error),
        "channels": [
            {"name": c.name, "unit": c.unit, "rmse": c.rmse, "normalised": c.normalised, "worst_trial": c.worst_trial,
             "worst_from_s": c.worst_from_s, "worst_to_s": c.worst_to_s} for c in found.channels
        ],
        "regimes": [{"name": r.name, "error": r.error, "share": r.share, "values": r.values} for r in found.regimes],
        "trials": [
            {"name": t, "error": e, "error_natural": problem.natural(e)}
            for t, e in zip(problem.trials, found.trial_errors, strict=True)
        ],
        "parted_s": found.parted_s,
        "at_limit": of_at_limit(found.at_limit),
        "left": of_left(left),
    }  # fmt: skip


def of_explanation(
    problem: Problem,
    found: Explanation,
    account: Account,
    ahead: PlannedTrial | None,
    confidence: float | None,
    word: LastWord | None = None,
) -> dict[str, Any]:
    worth = ahead is not None and ahead.separation >= ENOUGH
    return {
        **common(problem, account, found.noise_floor, found.floor_source, found.before),
        "verdict": found.verdict,
        "confidence": confidence,
        "baseline_error": found.baseline_error,
        "baseline_error_natural": problem.natural(found.baseline_error),
        "refitted_error": found.refitted_error,
        "candidates": [of_judged(problem, c) for c in found.candidates],
        "parameters": of_parameters(found.after, found.parameters),
        "at_limit": of_at_limit(found.at_limit),
        "left": of_left(found.left),
        "last_word": None if word is None else of_last_word(word),
        "next_trial": {**ahead.excitation.as_dict(), "separation": ahead.separation} if ahead and worth else None,
    }


def of_parameters(terms: Hypothesis, reports: Sequence[ParameterReport]) -> list[dict[str, Any]]:
    """How sure the fitted values of a model of these ``terms`` are."""
    told = hypothesis_list(terms)
    return [
        {
            **told[p.term],
            "name": p.name,
            "value": p.value,
            "interval": [p.low, p.high],
            "flag": p.flag,
            "doubt": p.doubt,
        }
        for p in reports
    ]


def of_judged(problem: Problem, c: Judged) -> dict[str, Any]:
    """One candidate. A proposal of several terms is named by its first; ``terms`` has all of them."""
    terms = hypothesis_list(c.terms)
    return {
        **terms[0],
        "terms": terms,
        "name": c.name,
        "error_fit": c.error_fit,
        "error_heldout": c.error_heldout,
        "error_heldout_natural": problem.natural(c.error_heldout),
        "error_without": c.error_without,
        "held_out": c.held_out,
        "gain_heldout": c.gain,
        "explained": c.explained,
        "interval": list(c.interval),
        "rank": c.rank,
        "tied_with": c.tied_with,
        "earned": c.earned,
        "why_not": c.why_not,
    }


def of_left(left: Sequence[Leftover]) -> list[dict[str, Any]]:
    return [{"trial": g.trial, "channel": g.channel, "deviations": g.z, "slow": g.trend} for g in left]


def of_at_limit(found: Sequence[AtLimit]) -> list[dict[str, Any]]:
    return [{"joint": a.joint, "limit": a.limit, "unit": a.unit, "share": a.share, "assumed": a.assumed} for a in found]


def of_rung(problem: Problem, found: Improvement, r: Rung) -> dict[str, Any]:
    added = hypothesis_list(r.added)
    first = added[0] if added else {"effect": None, "target": None, "values": {}}
    return {
        **first,
        "name": r.name,
        "added": added,
        "dropped": list(r.dropped),
        "error_fit": r.error_fit,
        "error_heldout": r.error_heldout,
        "error_heldout_natural": problem.natural(r.error_heldout),
        "held_out": r.held_out,
        "interval": list(r.interval),
        "tied_with": r.tied_with,
        "alternatives": [_of_rival(p, u) for p, u in rivals(found, r, problem.robot)],
    }


def _of_rival(proposal: Proposal, u: Array) -> dict[str, Any]:
    """As a candidate: of several terms its first, and ``terms`` has all."""
    terms = hypothesis_list(Model(proposal.parts).hypothesis(u))
    return {**terms[0], "name": proposal.name, "terms": terms}


def _place(name: str) -> dict[str, str]:
    effect, _, target = name.partition("@")
    return {"effect": effect, "target": target}


def of_last_word(word: LastWord) -> dict[str, Any]:
    """How far the models are from trials that were held out from all of it."""
    problem = word.problem
    return {
        "error_before": word.before,
        "error_before_natural": problem.natural(word.before),
        "error_after": word.after,
        "error_after_natural": problem.natural(word.after),
        "noise_floor": word.floor,
        "noise_floor_natural": problem.natural(word.floor),
        "trials": [
            {"name": name, "error_before": before, "error_after": after}
            for name, (before, after) in zip(problem.trials, word.by_trial, strict=True)
        ],
        "left": of_left(word.left),
    }


def of_steps(word: LastWord, found: Improvement) -> list[dict[str, Any]]:
    """Each step of the ladder on these trials, which no step was chosen by."""
    return [
        {"name": r.name, "error": s.error, "error_natural": word.problem.natural(s.error)}
        for r, s in zip(found.ladder, word.steps, strict=True)
    ]


def of_improvement(
    problem: Problem, found: Improvement, account: Account, path: str, word: LastWord | None = None
) -> dict[str, Any]:
    return {
        **common(problem, account, found.noise_floor, found.floor_source, found.terms),
        "verdict": found.verdict,
        "explained": found.explained,
        "judged_on": found.judged_on,
        "all_rows": found.all_rows and {"error_before": found.all_rows[0], "error_after": found.all_rows[1]},
        "ladder": [of_rung(problem, found, r) for r in found.ladder],
        "model": path,
        "last_word": None if word is None else {**of_last_word(word), "steps": of_steps(word, found)},
        "parameters": of_parameters(found.terms, found.parameters),
        "worth": [
            {"words": s.text, "terms": hypothesis_list(s.terms), "share": s.worth, "doubted": s.doubted}
            for s in shares(found, problem.robot)
        ],
        "twins": [
            {**entry, "in_place_of": _place(t.name), "terms": hypothesis_list(t.terms)}
            for t, entry in zip(found.twins, hypothesis_list(tuple(t.term for t in found.twins)), strict=True)
        ],
        "stopped": found.stopped,
        "not_earned": [of_judged(problem, c) for c in found.refused],
        "at_limit": of_at_limit(found.at_limit),
        "left": of_left(found.left),
        "calibrated_away": [
            {
                **entry,
                "joint": o.joint,
                "typical": o.typical,
                "times": o.times,
                "deviations": o.deviations,
                "like": list(o.mates),
                "share": o.share,
            }
            for o, entry in zip(found.odd, hypothesis_list(tuple(o.term for o in found.odd)), strict=True)
        ],
    }
