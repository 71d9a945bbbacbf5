"""From measurements to rows of the table."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from benchmarks.table import Row

LABEL = {"pybullet": "PyBullet", "mujoco": "MuJoCo"}


def step_rows(engine: str, robots: int, processes: int, found: Mapping[str, float]) -> list[Row]:
    """Rollout against bare engine step."""
    group = f"{LABEL[engine]}: a robot-step ({robots} robots a batch, {processes} processes at once)"
    rows = [
        Row(group, "bare engine step, torques replayed", found["bare_cpu_us"], "us of a core"),
        Row(group, "our rollout", found["rollout_cpu_us"], "us of a core", found["ratio_cpu"], "bare step", "<= 1.3"),
        Row(group, "our rollout, by wall time", found["rollout_wall_us"], "us", found["ratio_wall"], "bare step"),
    ]
    if "one_call_cpu_us" in found:
        one = found["one_call_cpu_us"]
        note = "no Python between steps: open loop only"
        rows.append(
            Row(
                group,
                "bare, a whole rollout a call",
                one,
                "us of a core",
                one / found["bare_cpu_us"],
                "bare step",
                note=note,
            )
        )
    return rows


def profile_rows(engine: str, robots: int, found: Mapping[str, float]) -> list[Row]:
    """Where the time of a rollout goes."""
    group = f"{LABEL[engine]}: where the time of a robot-step goes ({robots} robots a batch)"
    total = max(found["in all"], 1e-12)
    return [Row(group, name, us, "us of a core", us / total, "all") for name, us in found.items()]


def run_rows(run: Mapping[str, Any], bare: Mapping[str, float] | None, cores: int) -> list[Row]:
    """A whole run of scenario 8."""
    workers = run["workers"]
    number = run.get("scenario", 8)
    group = f"{LABEL[run['engine']]}: scenario {number}, budget {run['budget']}, workers: {workers}"
    header = run["whole_steps"] - run["asked_steps"]
    cache = run["asked_steps"] - run["steps"]
    whole = max(run["whole_steps"], 1)
    rows = [
        Row(group, "wall time", run["wall_s"], "s"),
        Row(group, "processor time, all processes", run["cpu_s"], "s"),
        Row(group, "robot-steps of all evaluations asked for", run["whole_steps"] / 1e6, "million"),
        Row(group, "saved by stopping at the header", header / 1e6, "million", header / whole, "all"),
        Row(group, "saved by the cache", cache / 1e6, "million", cache / whole, "all"),
        Row(group, "simulated", run["steps"] / 1e6, "million", run["steps"] / whole, "all"),
        Row(group, "peak memory, all processes", run["memory_mb"], "MB"),
        Row(group, "start to first generation", run["first_progress_s"], "s", aim="<= 10"),
        Row(group, "the same, processor time", run["first_progress_cpu_s"], "s"),
    ]
    if bare:
        busy = min(workers, cores)
        wall = run["steps"] * bare["bare_wall_us"] * 1e-6 / busy
        cpu = run["steps"] * bare["bare_cpu_us"] * 1e-6
        limit = "steps x bare step"
        rows += [
            Row(
                group,
                "wall time against the limit",
                run["wall_s"],
                "s",
                run["wall_s"] / wall,
                f"{limit} / cores",
                "<= 1.25",
            ),
            Row(group, "processor time against the limit", run["cpu_s"], "s", run["cpu_s"] / cpu, limit, "<= 1.25"),
        ]
    return [r for r in rows if r.value is not None]


def speed_up_rows(runs: Sequence[Mapping[str, Any]]) -> list[Row]:
    """1 worker against 2, by wall time of the part that workers share and of the whole."""
    rows = []
    for engine in dict.fromkeys(r["engine"] for r in runs):
        by = {r["workers"]: r for r in runs if r["engine"] == engine}
        if {1, 2} <= set(by):
            one, two = by[1], by[2]
            group = f"{LABEL[engine]}: 1 and 2 workers"
            whole = one["wall_s"] / two["wall_s"]
            rows.append(Row(group, "whole run", two["wall_s"], "s", whole, "1 worker"))
            starts = [r["first_progress_s"] or 0.0 for r in (one, two)]
            after = (one["wall_s"] - starts[0]) / max(two["wall_s"] - starts[1], 1e-9)
            rows.append(Row(group, "after the start", two["wall_s"] - starts[1], "s", after, "1 worker", ">= 1.8"))
            same = one["digest"] == two["digest"]
            rows.append(Row(group, "same digest", float(same), "", aim=">= 1"))
    return rows


def peer_rows(peer: str, cost: Mapping[str, Any], runs: Sequence[Mapping[str, Any]], shared: bool) -> list[Row]:
    """A peer program on the work of each run. Its sample is scaled to the evaluations that the run asked for.

    On a machine that others use, the aim is judged by processor time: run and sample had different neighbours.
    """
    group = f"{peer}, measured on {cost['evaluations']} evaluations and scaled"
    per_wall, per_cpu = cost["wall_s"] / cost["steps"], cost["cpu_s"] / cost["steps"]
    rows = [Row(group, "a robot-step", per_cpu * 1e6, "us of a core")]
    for run in runs:
        if run["workers"] != max(r["workers"] for r in runs):
            continue
        name, aim = LABEL[run["engine"]], ">= 10" if run["engine"] == "pybullet" else ">= 30"
        wall, cpu, header = run["whole_steps"] * per_wall, run["whole_steps"] * per_cpu, run["asked_steps"] * per_cpu
        rows += [
            Row(
                group,
                f"all evaluations, against our run on {name}",
                wall,
                "s",
                wall / run["wall_s"],
                "our wall time",
                "" if shared else aim,
            ),
            Row(
                group,
                "the same, processor time",
                cpu,
                "s",
                cpu / run["cpu_s"],
                "our processor time",
                aim if shared else "",
            ),
            Row(
                group, "the same, if it stopped at the header", header, "s", header / run["cpu_s"], "our processor time"
            ),
        ]
    return rows


def explain_rows(found: Mapping[str, Any]) -> list[Row]:
    """explain over the whole catalogue."""
    group = f"{LABEL[found['engine']]}: explain over the whole catalogue, {found['trials']} trials"
    said = f"it said: {found['verdict']}, {found['first']}"
    return [
        Row(group, "wall time", found["wall_s"], "s", aim="<= 60" if found["engine"] == "mujoco" else "", note=said),
        Row(group, "processor time", found["cpu_s"], "s"),
        Row(group, "peak memory", found["memory_mb"], "MB"),
    ]
