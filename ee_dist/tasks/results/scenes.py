"""The rerun recordings of compare, explain and improve: from typed results to the plain data that the scenes draw."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np

from ee_dist.discrepancy.accounts.account import Account
from ee_dist.discrepancy.accounts.of_explain import shown_gain
from ee_dist.discrepancy.compare import Comparison, compare, trial_name
from ee_dist.discrepancy.evidence.holdout import in_turn
from ee_dist.discrepancy.evidence.judge import Judged
from ee_dist.discrepancy.explain import Explanation
from ee_dist.discrepancy.ladder import Improvement
from ee_dist.discrepancy.last_word import LastWord
from ee_dist.discrepancy.meters import motions
from ee_dist.discrepancy.problem import Problem, Series
from ee_dist.discrepancy.words import placed
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.tasks.results.labels import IMPROVED, MODEL, step_name, unit_of
from ee_dist.tasks.results.labels import drawn as in_unit
from ee_dist.tasks.results.tables import candidate_label, kind_of
from ee_dist.trials.log import SensorLog
from ee_dist.viewing import finding as drawn
from ee_dist.viewing.finding_scene import write_compare_rrd, write_explain_rrd, write_improve_rrd

CANDIDATES = 4
"""Candidates whose predictions can be looked at."""
KINDS = {"best": drawn.BEST, "tied": drawn.TIED, "earned": drawn.EARNED, "not": drawn.REFUSED}


def compare_scene(problem: Problem, found: Comparison, account: Account, model: Hypothesis, path: Path) -> None:
    write_compare_rrd(_finding(problem, found, account, model), path)


def explain_scene(problem: Problem, found: Explanation, account: Account, path: Path) -> None:
    """With the predictions of the first candidates to switch between."""
    shown = found.tied or found.candidates[:CANDIDATES]
    candidates = tuple(_candidate(problem, found, c, c in shown[:CANDIDATES]) for c in found.candidates)
    where = compare(problem, found.base)
    finding = _finding(problem, where, account, found.before)
    write_explain_rrd(replace(finding, candidates=candidates), path)


def improve_scene(
    problem: Problem, found: Improvement, account: Account, model: Hypothesis, path: Path, word: LastWord | None = None
) -> None:
    """Before, after, and the ladder between them; ``word`` is on trials that took no part in it."""
    finding = _finding(problem, compare(problem, found.base), account, model)
    apart = [None] * len(found.ladder) if word is None else [in_unit(word.problem, s.error) for s in word.steps]
    ladder = tuple(
        drawn.Rung(
            step_name(r),
            in_unit(problem, r.error_heldout),
            in_unit(problem, r.error_fit),
            in_turn(r.held_out, word is not None),
            off,
        )
        for r, off in zip(found.ladder, apart, strict=True)
    )
    better = said(problem, IMPROVED, found.terms)
    write_improve_rrd(replace(finding, ladder=ladder, better=better), path)


def said(problem: Problem, label: str, terms: Hypothesis) -> drawn.Account:
    """What a model says of each trial: simulated where the way simulates, else the channels that it compares."""
    simulated = motions(problem, terms)
    series = problem.whole.series(terms)
    logs = []
    for k, (trial, motion) in enumerate(zip(problem.measured, simulated, strict=True)):
        # Of a trial in windows the first, which is what is simulated.
        own: dict[str, Series] = {}
        for s in series:
            if s.trial == k:
                own.setdefault(problem.channels[s.channel], s)
        if motion is None:
            logs.append(_of_series(trial.log, own))
            continue
        sensors, names = np.array(motion.sensors), list(motion.sensor_names)
        for name, s in own.items():
            if name in names and len(s.predicted) == len(sensors):
                sensors[:, names.index(name)] = s.predicted
        logs.append(replace(motion, sensors=sensors))
    moves = all(m is not None for m in simulated)
    return drawn.Account(label, tuple(logs), apply(problem.robot, terms) if moves else None)


def _of_series(measured: SensorLog, own: dict[str, Series]) -> SensorLog:
    """A log of the channels that were compared alone, measured at the instants at which they were."""
    rows = list(own.values())
    first = rows[0]
    return replace(
        measured,
        times_s=first.times_s,
        sensors=np.stack([s.predicted for s in rows], axis=1),
        sensor_names=tuple(own),
        sensor_units=tuple(s.unit for s in rows),
        commands=np.zeros((len(first.times_s), len(measured.motor_names))),
        joints=None,
        torques=None,
        base_pose=None,
        supply_v=None,
        external=None,
    )


def _finding(problem: Problem, where: Comparison, account: Account, model: Hypothesis) -> drawn.Finding:
    names = [trial_name(problem, k) for k in range(len(problem.trials))]
    channels = tuple(
        drawn.ChannelError(
            c.name,
            c.unit,
            in_unit(problem, c.normalised),
            c.rmse,
            c.worst_trial,
            c.worst_from_s,
            c.worst_to_s,
        )
        for c in where.channels
    )
    mine = said(problem, MODEL, model)
    cases: list[drawn.Case] = []
    for name, trial, log in zip(names, problem.measured, mine.logs, strict=True):
        measured = trial.log.without(trial.not_recorded) if trial.not_recorded else trial.log
        if set(log.sensor_names) - set(trial.log.sensor_names):
            k = len(cases)
            own = {
                problem.channels[s.channel]: replace(s, predicted=s.measured)
                for s in problem.series(model)
                if s.trial == k
            }
            measured = _of_series(measured, dict(own))
        cases.append(drawn.Case(name, measured))
    return drawn.Finding(
        f"{problem.robot.name}, {problem.way}".replace("_", " "),
        account.headline,
        problem.robot,
        tuple(cases),
        mine,
        tuple(account.first),
        in_unit(problem, where.noise_floor),
        unit_of(problem),
        channels,
        rms_of=problem.averaged,
        next_command=account.then,
        lead=account.lead,
    )


def _candidate(problem: Problem, found: Explanation, c: Judged, shown: bool) -> drawn.Candidate:
    label = candidate_label(c, problem.robot)
    kind = KINDS[kind_of(c, found.candidates[0])]
    account = said(problem, placed(c.name), (*found.fixed, *c.hypothesis)) if shown else None
    return drawn.Candidate(label, *shown_gain(c), kind, account)
