"""task=reveal: open the sealed truth beside a log, and score an explanation or a model against it if one is given."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ee_dist.basics.names import listed
from ee_dist.basics.quoted import one_line
from ee_dist.discrepancy.explain import EFFECT, NOTHING_MISSING
from ee_dist.discrepancy.words import told
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis
from ee_dist.effects.groups import members_of
from ee_dist.recording.reader import read_run
from ee_dist.robots.model import Robot
from ee_dist.tasks.config import Config, ConfigError
from ee_dist.tasks.explained import KEY, is_there, summary_of
from ee_dist.tasks.seal import FILE, opened
from ee_dist.tasks.summary import Stopwatch, hypothesis_list, write_summary
from ee_dist.tasks.terminal import terminal

Places = frozenset[tuple[str, str]]
"""Effects by the joints, parts or sensors that they act on: an effect on a group is one on each of its members."""


@dataclass
class Options:
    name: str = "reveal"
    explained: str | None = None


@dataclass(frozen=True)
class Score:
    """``right``: all that is true was named at its place, and nothing else. ``named``: what was, each with the alternatives that
    measurements do not tell from it; ``missed`` and ``invented`` as (effect, target)."""

    right: bool
    named: tuple[tuple[str, ...], ...]
    missed: tuple[tuple[str, str], ...] = ()
    invented: tuple[tuple[str, str], ...] = ()


def run(config: Config, options: Options, out: Path) -> None:
    """Print the truth; ``options.explained`` is the folder of an explain or improve run to score."""
    console, watch = terminal(), Stopwatch()
    if not config.log:
        raise ConfigError("log=: whose truth? name the folder of a trial, such as log=logs/trial/...")
    folder = Path(config.log)
    if not folder.exists():
        raise ConfigError(f"log={folder}: no such folder; name that of a trial, such as log=logs/trial/...")
    folder = folder if folder.is_dir() else folder.parent
    logs = sorted(folder.glob("*.mcap"))
    record = read_run(logs[0]) if logs else None
    digest = record.metadata.get("seal") if record else None
    hidden, _ = opened(folder / FILE, digest)
    found = None
    if options.explained:
        summary = summary_of(Path(options.explained))
        found = score(summary, hidden, record.robot if record else None)
        if digest:
            same_truth(summary, digest, f"{KEY}={options.explained}", f"log={config.log}")
    robot = record.robot if record else None
    console.print("The truth: " + ("; ".join(told(t, robot) for t in hidden) or "nothing was changed"), highlight=False)
    if found is not None:
        verdict = "Right." if found.right else "Not right."
        named = ", and ".join(" or ".join(names) for names in found.named)
        console.print(f"Named: {named or 'nothing'}. {verdict}", highlight=False)
    out.mkdir(parents=True, exist_ok=True)
    write_summary(out, "reveal", config, options, watch, digest or "", {
        "truth": hypothesis_list(hidden),
        "right": None if found is None else found.right,
        "named": [] if found is None else [names[0] for names in found.named],
        "alternatives": [] if found is None else [names[1:] for names in found.named],
        "missed": [] if found is None else [{"effect": e, "target": t} for e, t in found.missed],
        "invented": [] if found is None else [{"effect": e, "target": t} for e, t in found.invented],
    })  # fmt: skip


def score(summary: Mapping[str, Any], hidden: Hypothesis, robot: Robot | None) -> Score:
    """What an explain or improve run says against the truth. Raises ConfigError for a summary of another verb."""
    ways = {"explain": _of_explanation, "improve": _of_model}
    task = str(summary.get("task"))
    if task in ways:
        try:
            return ways[task](summary, hidden, robot)
        except (KeyError, TypeError, ValueError, IndexError, AttributeError):
            raise ConfigError(
                f"task.explained: its summary is not as task={task} writes it; it was changed, or is of another version"
            ) from None
    raise ConfigError(f"task.explained: a summary of task={one_line(task)}; expected one of explain or improve")


def same_truth(summary: Mapping[str, Any], seal: str, run: str, log: str) -> None:
    """Raises ConfigError where the ``run`` with this summary read recordings, and none that was sealed with this truth. One truth
    may be sealed beside several logs; what was imported has no seal, and may be of any; earlier versions do not say
    what they read."""
    try:
        read = [(one_line(str(m["file"]), 200), m["seal"]) for m in summary.get("measured", ())]
    except (KeyError, TypeError):
        raise ConfigError(
            f"{run}: its summary does not say what it read as we write it; it was changed: run it again"
        ) from None
    seals = [s for _, s in read]
    if seals and all(seals) and seal not in seals:
        raise ConfigError(
            f"{run}: it is of other measurements ({listed(file for file, _ in read)}), with another truth than {log}; name a run "
            "of explain or improve on that log, or the log that it is of"
        )


def places(terms: Sequence[tuple[str, str]], robot: Robot | None) -> Places:
    """(effect, place) of (effect, target): those of the members where the target is a group."""
    out: set[tuple[str, str]] = set()
    for effect, target in terms:
        allowed = CATALOGUE[effect].targets(robot) if robot is not None and effect in CATALOGUE else ()
        members = members_of(robot, target, allowed) if robot is not None and target not in allowed else ()
        out |= {(effect, m) for m in members or (target,)}
    return frozenset(out)


def _of_explanation(summary: Mapping[str, Any], hidden: Hypothesis, robot: Robot | None) -> Score:
    """The best and what is tied with it are alternatives: right is one that is the truth, or, of a truth of several
    effects, one of these. A tied family says so of each of its places: there the truth may be one of them."""
    verdict = summary["verdict"]
    if not hidden or verdict != EFFECT:
        return Score(
            not hidden and verdict == NOTHING_MISSING,
            tuple((c["name"],) for c in summary["candidates"][:1] if verdict == EFFECT),
            _pairs(hidden),
        )
    best = summary["candidates"][0]
    ties = [c for c in summary["candidates"] if c is best or c["name"] in best["tied_with"]]
    said = [places([(t["effect"], t["target"]) for t in c["terms"]], robot) for c in ties]
    truth = [places([pair], robot) for pair in _pairs(hidden)]
    whole = frozenset().union(*truth)
    families = [s for c, s in zip(ties, said, strict=True) if c is not best and _is_family(c["terms"])]
    right = any(s == whole or s in truth for s in said) or any(t <= s for t in truth for s in families)
    told = frozenset().union(*said)
    missed = tuple(p for p, t in zip(_pairs(hidden), truth, strict=True) if not t <= told)
    return Score(right, (tuple(c["name"] for c in ties),), missed)


def _of_model(summary: Mapping[str, Any], hidden: Hypothesis, robot: Robot | None) -> Score:
    """A model is right that has every true effect, each at its place or tied with one that it has (by itself, or in a family of
    which the values were kept), and none besides that was added."""
    terms = [(t["effect"], t["target"]) for t in summary["model_terms"]]
    steps = [s for s in summary["ladder"] if s["added"]]
    gone = {name for s in steps for name in s["dropped"]}
    added = [(t["effect"], t["target"]) for s in steps for t in s["added"]]
    added = [a for a in added if a in terms and "@".join(a) not in gone]
    named = [*dict.fromkeys(added)]
    by_effect: dict[str, list[Places]] = {}
    for t in terms:
        by_effect.setdefault(t[0], []).append(places([t], robot))
    truth = {pair: places([pair], robot) for pair in _pairs(hidden)}
    ties = {_pair(name): s["added"] for s in steps for name in s["tied_with"]}
    ties |= {(t["effect"], t["target"]): [t["in_place_of"]] for t in summary.get("twins", ())}
    others = [(s["added"], a.get("terms", [a])) for s in steps for a in s.get("alternatives", ())]
    families = [(places([(t["effect"], t["target"]) for t in of], robot), old) for old, of in others if _is_family(of)]
    missed, used = [], set()
    for pair, where in truth.items():
        # One effect on a group is not one of its members, and one for each member is the group.
        inside = [p for p in by_effect.get(pair[0], []) if p <= where]
        if inside and frozenset().union(*inside) == where:
            used |= {t for t in terms if places([t], robot) in inside}
        elif pair in ties:
            used |= {(t["effect"], t["target"]) for t in ties[pair]}
        elif old := next((old for family, old in families if where <= family), None):
            used |= {(t["effect"], t["target"]) for t in old}
        else:
            missed.append(pair)
    invented = tuple(a for a in named if a not in used)
    return Score(not missed and not invented, _told(summary, named), tuple(missed), invented)


def _is_family(terms: Sequence[Mapping[str, Any]]) -> bool:
    """Whether these are one effect at several places, each with a value of its own."""
    return len(terms) > 1 and len({t["effect"] for t in terms}) == 1


def _told(summary: Mapping[str, Any], named: Sequence[tuple[str, str]]) -> tuple[tuple[str, ...], ...]:
    """What was added and stayed, each with what was tied with it then or does as well in the end; what came as one is told as one
    where something is tied with all of it."""
    names = {pair: "@".join(filter(None, pair)) for pair in named}
    present = {"@".join(filter(None, (t["effect"], t["target"]))) for t in summary["model_terms"]}
    told: dict[str, list[str]] = {}
    for step in summary["ladder"]:
        mine = [names[p] for t in step["added"] if (p := (t["effect"], t["target"])) in names]
        others = [n for n in step.get("tied_with", ()) if not is_there(n, present)] if mine else []
        for name in [" + ".join(mine)] if others else mine:
            told.setdefault(name, []).extend(others)
    for twin in summary.get("twins", ()):
        place = twin["in_place_of"]
        told.setdefault("@".join(filter(None, (place["effect"], place["target"]))), []).append(
            "@".join(filter(None, (twin["effect"], twin["target"])))
        )
    return tuple((name, *dict.fromkeys(others)) for name, others in told.items())


def _pairs(hidden: Hypothesis) -> tuple[tuple[str, str], ...]:
    return tuple((t.effect, t.target) for t in hidden)


def _pair(name: str) -> tuple[str, str]:
    effect, _, target = name.partition("@")
    return effect, target
