"""The paper's findings on made-up runs in which each holds, does not hold, or cannot be told."""

from __future__ import annotations

import numpy as np
import pytest

from ee_dist.tasks.results.findings import HOLDS, NOT, OPEN, findings
from ee_dist.tasks.results.study_table import against, by_case, row

TEN, THREE = range(10), range(3)
INSIDE = (1, 2, 3, 4, 5, 6, 7, 8)


def runs(
    cases, seeds, metric="rolling_mean", gain=2.0, spread=0.1, restored=True, right=True, believed=(), dominants=9,
    level=0.0, start=0,
):  # fmt: skip
    """Summaries whose last trial goes ``gain`` farther than the one after the change, give or take."""
    rng = np.random.default_rng(start)
    made = []
    for case in cases:
        for seed in seeds:
            after = float(rng.normal(0.5, 0.1)) + level
            made.append({
                "scenario": case, "title": f"case {case}", "metric": metric, "seed": seed, "engine": "mujoco",
                "budget": "paper", "wall_s": 1.0, "restored": restored, "recovered_fraction": 1.0,
                "distance_m": {"intact": 3.0, "after": after, "trials": [1.0, after + gain + float(rng.normal(0, spread))]},
                "result_digest": f"{metric}{case}{seed}", "diagnosis": {
                    "found": int(right), "true": 1, "invented": 0, "right": right},
                "hypotheses": [[{"effect": e, "target": "x", "values": {}} for e in believed]], "truth": [],
                "evaluations": {"asked": 10, "simulated": 5, "steps": 100},
                "dominants": {"diagnosis": [[1, dominants + seed % 3], [1, dominants]]},
            })  # fmt: skip
    return made


def verdict(said, summaries, partings=()):
    """Of the one finding in which these words are, and the numbers of it."""
    rows = [row(s) for s in summaries]
    found = findings(rows, by_case(rows), against(rows), summaries, partings)
    (one,) = [f for f in found if said in f.said]
    assert one.numbers
    return one.verdict


RESTORES = "With rolling means the fourth trial goes farther"
CONTROL = "With the distance metric there is no such difference"


def test_rolling_means_restore():
    assert verdict(RESTORES, runs((*INSIDE, 10), TEN)) == HOLDS
    assert verdict(RESTORES, runs((*INSIDE, 10), THREE)) == OPEN, "three pairs cannot give a p below 0.25"
    bad = runs((1, 3, 4, 5, 6, 7, 8, 10), TEN) + runs((2,), TEN, gain=0.0, start=1)
    assert verdict(RESTORES, bad) == NOT
    loses = runs((1,), TEN) + runs((2,), TEN, gain=-2.0)
    assert verdict(RESTORES, loses) == NOT, "a sure loss is no gain"


def test_the_control_does_not():
    cases = (1, 2, 4, 5, 6)
    assert verdict(CONTROL, runs(cases, TEN, "distance", gain=0.0, start=3)) == HOLDS
    assert verdict(CONTROL, runs(cases, TEN, "distance")) == NOT
    assert verdict(CONTROL, runs(cases, THREE, "distance", gain=0.0)) == OPEN


def test_what_only_correction_hides_is_no_sameness():
    """Ranks 1 and 4 of ten lose: p is 0.02, of five tests 0.1. Neither verdict."""
    summaries = runs((1, 2, 4, 5, 6), TEN, "distance", gain=0.0, start=3)
    for k, s in enumerate(r for r in summaries if r["scenario"] == 1):
        s["distance_m"]["trials"][-1] = s["distance_m"]["after"] + (0.01 * (k + 1) * (-1 if k in (0, 3) else 1))
    rows = [row(s) for s in summaries]
    (line,) = [x for x in by_case(rows) if x["scenario"] == 1]
    assert line["p"] < 0.05 <= line["p_corrected"]
    assert verdict(CONTROL, summaries) == OPEN


def test_nothing_broken():
    guess, improves = "usual last guess is 'nothing changed', rolling", "goes on improving, rolling"
    assert verdict(guess, runs((9,), TEN)) == HOLDS
    assert verdict(guess, runs((9,), TEN, right=False)) == NOT
    assert verdict(guess, runs((9,), THREE)) == OPEN, "3 of 3 may be luck of a share below one half"
    assert verdict(improves, runs((9,), TEN)) == HOLDS
    assert verdict(improves, runs((9,), TEN, gain=-1.0)) == NOT
    assert verdict(improves, runs((9,), TEN, gain=0.0, start=3)) == NOT
    assert verdict(improves, runs((9,), THREE)) == OPEN


def test_what_cannot_be_said_is_hard():
    hard = "are hard, distance"
    assert verdict(hard, runs((11, 12, 13), TEN, "distance", restored=False)) == HOLDS
    assert verdict(hard, runs((11, 12, 13), TEN, "distance")) == NOT
    assert verdict(hard, runs((11,), THREE, "distance", restored=False)) == OPEN


def both(cases, more):
    """Runs of both metrics; at the last trial rolling means go farther by ``more``, one number for each seed."""
    ours, control = (
        runs(cases, range(len(more)), metric, spread=0.0, start=1) for metric in ("rolling_mean", "distance")
    )
    for s in ours:
        s["distance_m"]["trials"][-1] += more[s["seed"]]
    return ours + control


def test_rolling_means_are_better_but_not_surely():
    better = "rolling means do better than distances"
    somewhat = [0.5, 0.6, 0.7, 0.8, 0.9, 0.2, -0.4, -0.55, -0.65, -0.1]
    assert verdict(better, both((11, 12), somewhat)) == HOLDS
    assert verdict(better, both((11, 12), [1.0 + 0.1 * k for k in TEN])) == NOT, (
        "it is sure here, which the paper's was not"
    )
    assert verdict(better, both((11, 12), [-x for x in somewhat])) == NOT
    assert verdict(better, both((11,), somewhat) + both((12,), [-x for x in somewhat])) == OPEN
    assert verdict(better, both((11, 12), [0.5, 0.6, 0.7])) == OPEN


def test_dominants():
    many = "many new best hypotheses"
    few = runs(INSIDE, TEN, "distance", dominants=3)
    assert verdict(many, runs(INSIDE, TEN, dominants=9) + few) == HOLDS
    assert verdict(many, runs(INSIDE, TEN, dominants=1) + few) == NOT
    assert verdict(many, runs(INSIDE, TEN, dominants=3) + few) == NOT, (
        "no difference, and enough runs to have shown one"
    )
    assert verdict(many, runs((1,), THREE) + runs((1,), THREE, "distance", dominants=3)) == OPEN


def test_inside_and_outside():
    apart = "told apart by sensor data"
    slope, even = runs((10,), TEN, believed=("floor_tilt",)), runs(INSIDE, TEN, believed=("joint_jam",))
    assert verdict(apart, slope + even) == HOLDS
    assert verdict(apart, slope + runs(INSIDE, TEN, believed=("floor_tilt",))) == NOT
    assert verdict(apart, runs((10,), TEN) + even) == NOT
    assert verdict(apart, runs((10,), THREE, believed=("floor_tilt",)) + even) == OPEN


def test_partings():
    late = "part late"
    some = runs((1,), THREE)
    assert verdict(late, some, [(150 + k, 50) for k in range(8)]) == HOLDS
    assert verdict(late, some, [(50, 150 + k) for k in range(8)]) == NOT
    assert verdict(late, some, [(150, 50)] * 2) == OPEN
    assert verdict(late, some, [(150, 50)]) == OPEN, "one controller is no test"


def test_findings_without_their_runs_are_left_out():
    rows = [row(s) for s in runs((1,), THREE)]
    said = [f.said for f in findings(rows, by_case(rows), against(rows), runs((1,), THREE))]
    assert len(said) == 1 and said[0].startswith(RESTORES)


def test_pairs_are_by_seed():
    ours, control = runs((1,), range(6), start=1), runs((1,), range(3, 9), "distance", start=2)
    (test,) = against([row(s) for s in ours + control]).values()
    assert test.n == 3, "seeds 3, 4, 5 are in both"
    last = {s["seed"]: s["distance_m"]["trials"][-1] for s in ours}
    other = {s["seed"]: s["distance_m"]["trials"][-1] for s in control}
    differences = [last[k] - other[k] for k in (3, 4, 5)]
    assert test.low == pytest.approx(min(differences)) and test.high == pytest.approx(max(differences))
