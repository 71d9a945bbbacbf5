"""A long record on the command line: stretches of it are searched, all of it is shown, and every output says so."""

from __future__ import annotations

import json

import pytest

from ee_dist.discrepancy.ways.open_loop import stretches
from ee_dist.discrepancy.weighed_up import ALL_ROWS

PLAN = "task.excitations=['multisine:seconds=24,amplitude=0.3,seed=1','slow_sines:seconds=24,amplitude=0.3,seed=2']"
HIDDEN = "+hidden=[{effect: coulomb_friction, target: servo, torque_nm: 0.06}]"


def test_what_a_search_goes_by_is_told_everywhere(cli, monkeypatch: pytest.MonkeyPatch) -> None:
    made = cli("task=trial", "robot=servo_pendulum", "engine=mujoco", HIDDEN, PLAN, "task.noise=0.0005")
    assert made.status == 0, made.err
    monkeypatch.setattr(stretches, "MOST", 5000)
    monkeypatch.setattr(stretches, "FEWEST", 4)
    asked = ("task=explain", f"measured={made.runs()[0]}", "engine=mujoco", "task.only=[coulomb_friction]")
    found = cli(*asked, "evaluator=serial")
    assert found.status == 0, found.err
    (run,) = found.runs()
    summary = (run / "summary.json").read_text()
    for text in (found.out, summary, (run / "report.html").read_text()):
        said = " ".join(text.split())
        assert (
            "So that the search ends, it goes by 16 of the 48 s, in 4 stretches" in said
            and "compare takes all of it" in said
        )
    assert json.loads(summary)["verdict"] == "effect"
    apart = cli(*asked, "evaluator=ray", "evaluator.workers=2", "task.rerun=false")
    assert apart.status == 0, apart.err
    assert apart.summary()["result_digest"] == found.summary()["result_digest"], "whoever simulates them"


def test_what_a_model_explains_is_judged_by_all_rows_where_a_search_took_stretches(
    cli, monkeypatch: pytest.MonkeyPatch
) -> None:
    made = cli("task=trial", "robot=servo_pendulum", "engine=mujoco", HIDDEN, PLAN, "task.noise=0.0005")
    monkeypatch.setattr(stretches, "MOST", 5000)
    monkeypatch.setattr(stretches, "FEWEST", 4)
    asked = ("task=improve", f"measured={made.runs()[0]}", "engine=mujoco", "evaluator=serial", "task.rerun=false")
    found = cli(*asked, "effect=coulomb_friction@servo")
    assert found.status == 0, found.err
    summary = found.summary()
    before, after = summary["all_rows"]["error_before"], summary["all_rows"]["error_after"]
    assert after < 0.2 * before
    line = f"{ALL_ROWS}: model {before:.3g}, improved model {after:.3g}"
    page = (found.runs()[0] / "report.html").read_text()
    for text in (found.out, page, " ".join(summary["words"])):
        assert line in " ".join(text.split())
    assert f"judged on {summary['judged_on']}" in " ".join(summary["words"])
