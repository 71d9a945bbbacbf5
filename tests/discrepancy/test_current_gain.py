"""Torques logged as currents whose gain nobody knows: estimated at the import, fitted over all trials with its uncertainty."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from way_samples import measure, problem_by, samples

from ee_dist.discrepancy.improve import improve
from ee_dist.discrepancy.search.candidates import parse
from ee_dist.effects.catalogue import term
from ee_dist.measurements.importer import import_file
from ee_dist.measurements.mapping_file import read_mapping
from ee_dist.measurements.proposal.files import proposal_for
from ee_dist.measurements.proposal.model import FIT, Hints
from ee_dist.measurements.proposal.write import as_yaml

GAIN = {"shoulder": 1.25, "elbow": 0.8}


def test_gains_are_fitted_over_all_trials_beside_friction_with_an_interval() -> None:
    sample = samples()["arm"]
    trials = [
        replace(t, log=replace(t.log, torques=t.log.torques / np.array(list(GAIN.values()))))
        for t in measure(sample, (term("coulomb_friction", "elbow", torque_nm=0.25),))
        if t.log.torques is not None
    ]
    problem = problem_by("force_balance", tuple(trials), sample.robot)
    wanted = [*(f"current_gain@{m}" for m in GAIN), "coulomb_friction@elbow"]
    found = improve(problem, [], (), [parse(sample.robot, name) for name in wanted])
    told = {found.terms[p.term].name: p for p in found.parameters}
    for motor, gain in GAIN.items():
        p = told[f"current_gain@{motor}"]
        assert p.value == pytest.approx(gain, rel=0.02)
        assert p.low < gain < p.high and p.high - p.low < 0.1 * gain and not p.flag
    assert told["coulomb_friction@elbow"].value == pytest.approx(0.25, rel=0.05), "friction in N.m, not in amperes"


def test_an_import_estimates_gains_from_what_the_motion_needs_and_says_so(tmp_path: Path) -> None:
    sample = samples()["arm"]
    log = measure(sample, ())[0].log
    assert log.torques is not None
    table = pd.DataFrame({"time_s": log.times_s})
    for k, (motor, per_ampere) in enumerate({"shoulder": 2.5, "elbow": -0.4}.items()):
        table[f"{motor}_position_rad"] = log.channel(f"position_{motor}")
        table[f"{motor}_velocity_rad_s"] = log.channel(f"velocity_{motor}")
        table[f"{motor}_current_A"] = log.torques[:, k] / per_ampere
        table[f"{motor}_goal_rad"] = log.commands[:, k]
    table.to_csv(tmp_path / "a.csv", index=False)
    left_out = proposal_for([tmp_path / "a.csv"], sample.robot, Hints())
    assert not left_out.questions, "a robot led by its commands is compared without torques"
    assert any("are left out" in n and "task.gains=fit" in n for n in left_out.notes)
    unled = table[[c for c in table if not c.endswith("_goal_rad")]]
    unled.to_csv(tmp_path / "b.csv", index=False)
    asked = proposal_for([tmp_path / "b.csv"], sample.robot, Hints())
    assert any("task.gains=fit" in q for q in asked.questions)
    found = proposal_for([tmp_path / "a.csv"], sample.robot, Hints(gains=FIT))
    assert not found.questions
    assert any("effect=[current_gain@shoulder,current_gain@elbow]" in n for n in found.notes)
    (tmp_path / "m.yaml").write_text(as_yaml(found, "small_arm", "a.csv"))
    record, _ = import_file(tmp_path / "a.csv", read_mapping(tmp_path / "m.yaml"), sample.robot)
    assert record.log.torques is not None
    size = np.std(record.log.torques, axis=0) / np.std(log.torques, axis=0)
    assert size == pytest.approx([1, 1], rel=0.1)
    assert np.corrcoef(record.log.torques[:, 1], log.torques[:, 1])[0, 1] > 0.99, "the sign is turned back"


def test_where_one_gain_cannot_be_estimated_those_of_the_others_are_told(tmp_path: Path) -> None:
    sample = samples()["arm"]
    log = measure(sample, ())[0].log
    assert log.torques is not None
    table = pd.DataFrame({"time_s": log.times_s})
    currents = {"shoulder": log.torques[:, 0] / 2.5, "elbow": np.random.default_rng(0).normal(size=len(log.times_s))}
    for k, motor in enumerate(currents):
        table[f"{motor}_position_rad"] = log.channel(f"position_{motor}")
        table[f"{motor}_velocity_rad_s"] = log.channel(f"velocity_{motor}")
        table[f"{motor}_current_A"] = currents[motor]
        table[f"{motor}_goal_rad"] = log.commands[:, k]
    table.to_csv(tmp_path / "a.csv", index=False)
    found = proposal_for([tmp_path / "a.csv"], sample.robot, Hints(gains=FIT))
    said = next(q for q in found.questions if "cannot be estimated" in q)
    assert "the gains of elbow cannot" in said
    told = said.split("estimated of the others: ")[1]
    assert told.endswith(" at shoulder") and float(told.split()[0]) == pytest.approx(2.5, rel=0.1)
