"""What a study reads from the recordings of runs: one run of each metric to show, and where logs of damages part."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.discrepancy.words import percent
from ee_dist.effects.catalogue import Hypothesis, apply, term
from ee_dist.effects.targets import motors
from ee_dist.engines.contract import Rollout
from ee_dist.engines.drivers import Network
from ee_dist.evaluation.jobs import Evaluator, Job, Whole
from ee_dist.recording.errors import RecordingError
from ee_dist.recording.reader import read_run
from ee_dist.recording.records import RunRecord
from ee_dist.recovery.doubt import doubt
from ee_dist.recovery.metrics import RollingMean
from ee_dist.robots.model import Robot
from ee_dist.tasks.results.study_table import DISTANCE, ROLLING
from ee_dist.trials.noise import channel_range
from ee_dist.viewing.parting_figures import NEARLY, Parting, apart_after
from ee_dist.viewing.run_figures import Told, told_of
from ee_dist.viewing.story import INTACT, beliefs, hardware_trials

SHOWN = 5
"""The situation of which one run is shown, as in the paper; else the first that has a run of each metric."""
LOG = "recovery.mcap"
MOST = 10
"""Controllers whose logs are simulated: three rollouts each."""
WEAKER = (0.1, 0.2)
FAILING = 0.5

Summaries = Sequence[Mapping[str, Any]]


def recorded(summary: Mapping[str, Any]) -> RunRecord | None:
    """The recording of a run; None where there is none that can be read."""
    try:
        return read_run(Path(summary["folder"]) / LOG)
    except (KeyError, OSError, RecordingError):
        return None


def pair_to_show(summaries: Summaries) -> list[Mapping[str, Any]]:
    """A run of each metric on one situation, of the smallest seed that both have; of one metric alone, one run."""
    metrics = [m for m in (ROLLING, DISTANCE) if any(s["metric"] == m for s in summaries)]
    runs: dict[tuple[Any, ...], dict[str, Mapping[str, Any]]] = {}
    for s in summaries:
        runs.setdefault((s["scenario"], s["seed"], s["engine"], s["budget"]), {})[s["metric"]] = s
    whole = [key for key, own in runs.items() if all(m in own for m in metrics)]
    if not whole:
        return [runs[min(runs, key=_first)][m] for m in metrics if m in runs[min(runs, key=_first)]]
    return [runs[min(whole, key=_first)][m] for m in metrics]


def _first(key: tuple[Any, ...]) -> tuple[Any, ...]:
    scenario, *rest = key
    return (scenario != SHOWN, isinstance(scenario, str), scenario, *map(str, rest))


def shown(summaries: Summaries) -> list[tuple[Mapping[str, Any], Told]]:
    """The runs to show, read from their recordings; none where one of them has no recording."""
    there = [s for s in summaries if (Path(s.get("folder", "")) / LOG).is_file()]
    chosen = [(s, recorded(s)) for s in pair_to_show(there)] if there else []
    return [(s, told_of(run)) for s, run in chosen if run is not None and len(hardware_trials(run)) > 2]


def controllers(summaries: Summaries) -> list[tuple[str, Robot, Network, int]]:
    """(engine, robot, intact controller, steps) of recordings, each controller once, in the order of the seeds."""
    found: dict[str, tuple[str, Robot, Network, int]] = {}
    seen: set[tuple[Any, ...]] = set()
    for s in sorted(summaries, key=lambda s: (s["engine"], s["seed"])):
        # Before the change runs of one seed are the same, whatever happens to the robot then.
        key = (s["engine"], s["seed"], s["budget"])
        if key in seen or len(found) >= MOST or (run := recorded(s)) is None:
            continue
        trial = next((t for t in hardware_trials(run) if t.name == INTACT), None)
        if trial is None or not isinstance(trial.driver, Network):
            continue
        seen.add(key)
        found.setdefault(trial.driver.key, (s["engine"], run.robot, trial.driver, len(trial.log)))
    return list(found.values())


def doubted(summary: Mapping[str, Any], evaluator: Evaluator) -> dict[str, Any] | None:
    """The doubt of a run that was made before runs told theirs, by its recording; None where that cannot be read. Of noise the
    intact trial alone tells."""
    run = recorded(summary)
    believed = {} if run is None else beliefs(run)
    if run is None or not believed:
        return None
    trials = [(t.driver, t.log) for t in hardware_trials(run)]
    last, seed = believed[max(believed)].terms, np.random.SeedSequence(0)
    return doubt(run.robot, last, trials[:1], trials[1:], RollingMean(), evaluator, 0.0, seed).as_dict()


def damages(robot: Robot) -> tuple[Hypothesis, Hypothesis, Hypothesis] | None:
    """Two nearly equal damages and a different one at the same leg: its motor 10 and 20 % weaker, its touch sensor failing by
    half. None of a robot without motors, touch and angle sensors."""
    touch = next((s for s in robot.sensors if s.kind == "touch"), None)
    if touch is None or not any(s.kind == "angle" for s in robot.sensors):
        return None
    joint = robot.joint_of(touch.target).name
    if joint not in motors(robot):
        return None
    first, second = ((term("motor_weak", joint, loss=loss),) for loss in WEAKER)
    return first, second, (term("sensor_failing", touch.name, loss=FAILING),)


def parting(robot: Robot, controller: Network, steps: int, evaluator: Evaluator) -> Parting | None:
    """What the angle sensors say under each of three damages, and after how many steps their logs are apart."""
    hypotheses = damages(robot)
    if hypotheses is None:
        return None
    logs = evaluator.evaluate([Job(Rollout(apply(robot, h), controller, steps), Whole()) for h in hypotheses])
    angles = [k for k, s in enumerate(robot.sensors) if s.kind == "angle"]
    limits = np.array([NEARLY * channel_range(robot, robot.sensors[k]) for k in angles])
    first, second, other = (log.sensors[:, angles] for log in logs)
    near, far = apart_after(first, second, limits), apart_after(first, other, limits)
    names = [h[0].target.replace("_", " ") for h in hypotheses]
    return Parting(
        (
            f"{names[0]} {percent(WEAKER[0])} weaker",
            f"{names[1]} {percent(WEAKER[1])} weaker",
            f"{names[2]} failing by {percent(FAILING)}",
        ),
        robot.sensors[angles[0]].name,
        np.stack([log[:, 0] for log in (first, second, other)]),
        near,
        far,
    )
