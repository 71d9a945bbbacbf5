"""task=recover, the main job: break the robot, let it find out what happened, and restore its function."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from importlib import import_module
from pathlib import Path
from threading import Thread
from typing import Any

import numpy as np
from rich.box import SIMPLE
from rich.console import Console
from rich.table import Table

from ee_dist.discrepancy.words import percent
from ee_dist.effects.catalogue import Hypothesis, apply
from ee_dist.evaluation.jobs import Counts
from ee_dist.evaluation.physical import PhysicalRobot
from ee_dist.recording.records import DIAGNOSIS, MAP, POLISHED, REPAIR
from ee_dist.recording.writer import RunWriter
from ee_dist.recovery.doubt import Doubt, doubt
from ee_dist.recovery.kinds import subject_of
from ee_dist.recovery.loop import Recovery, recover
from ee_dist.recovery.metrics import RollingMean
from ee_dist.recovery.observer import Observers
from ee_dist.recovery.repertoire import Repertoire
from ee_dist.recovery.subject import Subject
from ee_dist.robots.model import Robot
from ee_dist.tasks.compose import config_folder
from ee_dist.tasks.config import Config, ConfigError, ScenarioConfig, one_of
from ee_dist.tasks.observers import Beliefs, Measured, Recorder
from ee_dist.tasks.outcome import Gaits, Score, score
from ee_dist.tasks.progress import PassProgress, starting
from ee_dist.tasks.results.commands import with_seeds
from ee_dist.tasks.run_digest import ResultDigest
from ee_dist.tasks.scene import drawn
from ee_dist.tasks.summary import (
    Stopwatch,
    config_digest,
    config_yaml,
    hypothesis_list,
    package_version,
    write_summary,
)
from ee_dist.tasks.terminal import terminal
from ee_dist.tasks.unfinished import remembered
from ee_dist.tasks.wiring import build_system, engine_maker, evaluator_name, evaluator_of, hardware_of
from ee_dist.viewing.story import share_text, told

GAITS = ("walking", "any")
"""What counts as function restored: a distance that was walked, or, as in the paper, any."""
NEIGHBOURS = 300
"""Roughly how many neighbours a step of polish tries."""
WORKERS = {"ray": "starting Ray and its workers, about five seconds", "serial": "starting the engine"}
QUICK = (
    "Budget quick shows that every part works. Its gaits hardly evolve: shares of intact, and so this verdict, "
    "say little. Without budget=quick it is the paper's."
)


@dataclass
class Options:
    name: str = "recover"
    gaits: str = "walking"

    def __post_init__(self) -> None:
        one_of("task.gaits", self.gaits, GAITS)


LIMITED = (
    "The models know none of the limits of hardware.range_share, hardware.speed and hardware.acceleration: where a controller "
    "asks for more, what it gets instead looks like a fault of the robot, and a gait goes less far than predicted."
)


def run(config: Config, options: Options, out: Path) -> None:
    """Write recovery.mcap, recovery.rrd and summary.json into ``out`` and print the result."""
    console, watch = terminal(), Stopwatch()
    own, noise = config.hardware.address, config.noise or 0.0
    if config.scenario is None and not own:
        raise ConfigError(_which(config.system is None))
    scenario = config.scenario or ScenarioConfig(title=f"a robot at {own}, of which nothing is known")
    plan = config.budget.plan()
    truth = scenario.hidden() if config.scenario else None
    hidden = truth or ()
    robot = build_system(config)
    if own and isinstance(robot, Robot) and not (robot.free_base and robot.world.has_floor):
        raise ConfigError(
            f"hardware.address={own}: {robot.name} stands on no floor or on a fixed base, and what is restored here is how far a "
            "robot goes; what is wrong with this one says task=trial with the same address, and then task=explain"
        )
    subject = subject_of(robot)
    metric = config.metric.build(subject.function)
    apply(robot, hidden)  # A wrong target must be said before hours of work, not after.
    hardware = engine_maker(config, alone=True)()
    seeds = np.random.SeedSequence(config.seed)
    search_seed, intact_seed, changed_seed = seeds.spawn(3)
    intact = PhysicalRobot(hardware, robot, (), intact_seed, noise)
    changed = PhysicalRobot(hardware, robot, hidden, changed_seed, noise)
    body = hardware_of(config, robot)
    first, later = remembered("intact", body or intact, robot), remembered("changed", body or changed, robot)
    metadata = {
        "task": "recover",
        "version": package_version(),
        "seed": str(config.seed),
        "engine": config.engine.name,
        "metric": config.metric.name,
        "budget": config.budget.name,
        "scenario": scenario.label,
        "title": scenario.title,
        "config_digest": config_digest(config, options),
    }
    console.print(f"Scenario {scenario.label}: {scenario.title}. Seed {config.seed}, budget {config.budget.name}, "
                  f"{config.engine.name}.", highlight=False)  # fmt: skip
    quick, limited = config.budget.name == "quick", body is not None and config.hardware.limits().moves
    if limited:
        console.print(LIMITED, highlight=False)
    path = out / "recovery.mcap"
    digest = ResultDigest()
    beliefs, gaits, measured = Beliefs(), Gaits(robot, hidden), Measured()
    repertoire = config.repair.build()
    passes = {
        REPAIR: plan.compensating_trials + 1,
        DIAGNOSIS: plan.compensating_trials,
        MAP: int(repertoire is not None),
    }
    share = metric.steps(plan.steps) * plan.compensating_trials / 2
    weights = {
        REPAIR: plan.repair.population * plan.repair.generations * float(plan.steps) / 2,
        DIAGNOSIS: plan.diagnosis.population * plan.diagnosis.generations * share / 4,
        POLISHED: plan.polish * NEIGHBOURS * share / 2,
        # Nothing in a map's pass is a copy of what was simulated before.
        MAP: config.repair.map_passes * plan.repair.population * plan.repair.generations * float(plan.steps) / 2,
    }
    with starting(console, WORKERS[evaluator_name(config)]):
        evaluator = evaluator_of(config)
    with (
        RunWriter(path, robot, metadata, {"config.yaml": config_yaml(config, options).encode()}) as writer,
        PassProgress(console, passes, weights, subject) as progress,
    ):
        # Slow to load, and needed only later: done while the first controllers run.
        Thread(target=_load, args=("scipy.stats", "ee_dist.viewing.scenes"), daemon=True).start()
        observer = Observers(Recorder(writer), digest, beliefs, gaits, measured, progress)
        result = recover(robot, first, later, metric, plan, evaluator, search_seed, observer, repertoire)
        # After the search: nothing of it, nor of what it is said to have cost, depends on the doubt.
        counts = evaluator.counts.copy()
        yardstick = metric if isinstance(metric, RollingMean) else RollingMean()
        (doubt_seed,) = seeds.spawn(1)
        last = doubt(
            robot,
            result.hypotheses[-1],
            measured.trials[:1],
            measured.trials[1:],
            yardstick,
            evaluator,
            noise,
            doubt_seed,
        )
        refused = gaits.compensating if options.gaits == "walking" else ()
        final = score(result.intact, result.trials, result.hypotheses[-1], hidden, refused)
        verdict = verdict_of(gaits.cheats, final, truth is not None)
        known = {} if truth is None else {"truth": json.dumps([t.as_dict() for t in truth])}
        told_too = {"verdict": verdict}
        if cautions := [LIMITED] * limited + [QUICK] * quick:
            told_too["caution"] = " ".join(cautions)
        if scenario.number > 0:
            told_too["again"] = with_seeds(out, scenario.number)
        writer.finish({"result_digest": digest.hex, "doubt": json.dumps(last.as_dict()), **known, **told_too})
    hardware.close()
    summary = write_summary(out, "recover", config, options, watch, digest.hex, {
        "scenario": scenario.name or scenario.number,
        "title": scenario.title,
        "metric": config.metric.name,
        "budget": config.budget.name,
        subject.key: {"intact": result.intact, "after": result.after, "trials": result.trials},
        subject.expected_key: result.expected,
        "hypotheses": [hypothesis_list(h) for h in result.hypotheses],
        "fitness": digest.fitness,
        "diagnosis_error": result.errors,
        "diagnosis_stages": beliefs.stages,
        "dominants": digest.dominants,
        "truth": None if truth is None else hypothesis_list(truth),
        "recovered_fraction": final.recovered_fraction,
        "counted_fraction": final.counted_fraction,
        "restored": final.restored,
        "verdict": verdict,
        "gaits": {"counted": options.gaits, "no_gait": [list(c) for c in gaits.cheats]},
        "diagnosis": None if truth is None else _diagnosis(final),
        "doubt": last.as_dict(),
        "evaluations": {"asked": counts.asked, "simulated": counts.simulated, "steps": counts.steps,
                        "asked_steps": counts.asked_steps},
        "repair": _repair(config.repair.name, result.before_change, counts, repertoire),
    })  # fmt: skip
    recording = drawn(path)
    wall, _ = watch.read()
    _print(console, subject, result, truth, verdict, last)
    if quick:
        console.print(QUICK, highlight=False)
    saved = 1 - counts.simulated / max(counts.asked, 1)
    console.print(
        f"\n{counts.asked:,} evaluations asked, {counts.simulated:,} simulated ({percent(saved)} saved), "
        f"{counts.steps / 1e6:.1f} million {subject.noun}-steps, {wall:.0f} s. Digest {digest.hex[:16]}.",
        highlight=False,
    )
    for label, file in (("recording", path), ("rerun", recording), ("summary", summary)):
        console.print(f"  {label:<10}{os.path.relpath(file)}", highlight=False, soft_wrap=True)
    console.print(
        f"Look at it: python -m ee_dist task=view log={os.path.relpath(path)}", highlight=False, soft_wrap=True
    )


def _repair(name: str, before: Counts, whole: Counts, repertoire: Repertoire | None) -> dict[str, Any]:
    """Which repair, and what was simulated before the change (of that: for a map) and after it."""
    found = {"name": name, "before": asdict(before), "after": asdict(whole.since(before)), "map": None}
    if repertoire is not None and repertoire.intact:
        kinds = [e for e in repertoire.intact if e.allowed]
        best = kinds[0].score if kinds else None
        found["map"] = {**asdict(repertoire.cost), "kinds": len(kinds), "best": best}
    return found


def _diagnosis(final: Score) -> dict[str, Any]:
    return {"found": final.found, "true": final.true, "invented": final.invented, "right": final.right}


def _load(*modules: str) -> None:
    for name in modules:
        import_module(name)


def _which(of_robots: bool) -> str:
    """The paper's situations have numbers; those of other systems have names."""
    names = [p.stem for p in (config_folder() / "scenario").glob("*.yaml") if p.stem.isdigit() == of_robots]
    found = sorted(names, key=lambda n: (int(n) if of_robots else 0, n))
    return f"which scenario? add one, such as +scenario={8 if of_robots else found[0]}; there are: {', '.join(found)}"


def _print(
    console: Console,
    subject: Subject,
    result: Recovery,
    truth: Hypothesis | None,
    verdict: str,
    last: Doubt,
) -> None:
    table = Table(box=SIMPLE, padding=(0, 1, 0, 0), pad_edge=False)
    table.add_column("trial")
    table.add_column(subject.heading.replace(" ", "\n"), justify="right")
    table.add_column("of\nintact", justify="right")
    table.add_column("diagnosis\nerror", justify="right")
    table.add_column(f"what the {subject.noun} believed", overflow="fold")

    def share(value: float) -> str:
        return share_text(value, result.intact) or "-"

    table.add_row("intact", f"{result.intact:.2f}", "100 %", "", "nothing is wrong")
    table.add_row("after the change", f"{result.after:.2f}", share(result.after), "", "")
    for k, reached in enumerate(result.trials):
        table.add_row(
            f"{k + 1}", f"{reached:.2f}", share(reached), f"{result.errors[k]:.5f}", lines(result.hypotheses[k])
        )
    table.add_section()
    table.add_row("truth", "", "", "", "not known" if truth is None else lines(truth))
    console.print(table)
    console.print(verdict, highlight=False)
    console.print(last.words, highlight=False)


def verdict_of(cheats: Sequence[tuple[str, ...]], final: Score, known: bool) -> str:
    """What came out, in the words of the terminal, the recording, its scene and the summary; ``known``: whether the truth is."""
    restored = "restored" if final.restored else "not restored"
    diagnosis = f" Diagnosis: {named(final.found, final.true, final.invented)}." if known else ""
    best = _share(final.recovered_fraction)
    return f"Function {restored}: best trial {best} of intact.{_unwalked(cheats, final)}{diagnosis}"


def named(found: int, true: int, invented: int) -> str:
    """How a diagnosis came out."""
    others = f"{invented} false one{'s' if invented > 1 else ''}" if invented else "nothing else"
    return f"{found} of {true} true effect{'' if true == 1 else 's'} at {'its' if true == 1 else 'their'} place, and {others}"


def _unwalked(cheats: Sequence[tuple[str, ...]], final: Score) -> str:
    """Which trials went forward by something else than a gait, and what that means for the verdict."""
    names = ("intact", "after the change", *(f"trial {k + 1}" for k in range(len(cheats))))
    told = [f"{name} {' and '.join(c)}" for name, c in zip(names, cheats, strict=False) if c]
    if not told:
        return ""
    counted = ""
    if final.counted_fraction != final.recovered_fraction:
        best = final.counted_fraction
        counted = f" Best that walks: {_share(best)}." if math.isfinite(best) else " None walks."
    return f" No gait: {', '.join(told)}.{counted}"


def _share(fraction: float) -> str:
    return f"{100 * fraction:.0f} %" if math.isfinite(fraction) else "no share"


def lines(hypothesis: Hypothesis) -> str:
    """A line for each term, in the words of every other place that tells it."""
    return "\n".join(told((t,)) for t in hypothesis) or told(())
