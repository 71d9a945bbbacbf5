"""What was found, in words, for the terminal, the report and whoever has to mend the robot; and what several verbs say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from ee_dist.basics.names import counted
from ee_dist.discrepancy.evidence.holdout import joint_by_joint, travelling
from ee_dist.discrepancy.evidence.left import SETTLED, Leftover
from ee_dist.discrepancy.last_word import TRIALS_APART, LastWord
from ee_dist.discrepancy.problem import Problem
from ee_dist.discrepancy.words import placed, plain
from ee_dist.effects.catalogue import CATALOGUE, Hypothesis
from ee_dist.effects.groups import members_of
from ee_dist.robots.model import Robot

TWINS = 2
"""Others that a headline names beside the one that was found,"""
FEW = 4
"""and the line below it, where there are more."""
MOSTLY = 0.97
"""Share of what is above the noise from which nobody asks for the rest."""
GRANTED = "The little above the floor is chance, and contacts or reversals that come one row early or late."
SPREAD = (
    "What is left stands out nowhere. All together it is more than noise, and too little to tell apart in any channel."
)
NOISE = "sensor_noise"
THAT_NOISE = "What is left there is this noise itself."
NOTHING_ELSE = "Nothing else is left above the noise."
NOTHING_STANDS_OUT = "Nothing else stands out."
NOTHING_APART = "nothing is left above the noise"
BEYOND = "Nothing else is left beyond what may be noise."
CONTENT = (
    "Next: nothing has to be done. The model explains these measurements; other motions may show what these do not."
)
NO_MOTION_TRIED = "None of the motions tried is expected to tell them apart."
PLAN, PLAN_OTHERS = "Next, to tell them apart:", "To look for other motions:"
PLAN_LATER = "To tell apart what may stay tied then:"
"""Before the command that finds what to record: first of all, or, where no motion tried would help, as what else may be tried, or
where more is missing than what is tied, once that is added."""
NEXT, OR = "Next", "Or go on without"
"""Before the command to type: the only one, or beside that which tells apart what is tied."""
ONE_EACH = (
    "Most joints move in one motion of their own, or each way in one: what is found at a joint is judged on other windows of "
    "that motion. Record each joint, both ways, in two motions or more to have it judged on one that was not fitted."
)
SEVERAL = (
    "No effect does it alone: several may be off together, joint by joint, which improve looks for (below). Else try other "
    "motions, or write the effect that is missing (docs/own_effect.md)."
)
MEND = (
    "First mend the description or the mapping, which has that the wrong way round, and begin again with it: what is fitted on "
    "top can be no surer than that."
)
STUCK = "Next: try other motions, or write the effect that is missing (docs/own_effect.md)."


@dataclass(frozen=True)
class Account:
    """``headline``: what was found, where, how much of it, and whether more is left. ``error``: of the models, beside the
    noise floor. ``sure``: how sure it is. ``advice``: what to do next, where a command does not say it. ``lines``: what speaks
    for it and what stays open. ``good``: whether the question is settled. ``planner``: the command that finds the trial which
    tells apart what is tied, where something is. ``warnings``: what may make all of it wrong. ``then``: the command to type."""

    headline: str
    error: str
    sure: str
    lines: tuple[str, ...]
    good: bool
    advice: str = ""
    planner: str = ""
    warnings: tuple[str, ...] = ()
    more: bool = False
    then: str = ""

    @property
    def first(self) -> list[str]:
        """What comes below the headline before anything else."""
        before = PLAN_OTHERS if self.advice.endswith(NO_MOTION_TRIED) else PLAN_LATER if self.more else PLAN
        planned = f"{before} {self.planner}" if self.planner else ""
        return [line for line in (*self.warnings, self.error, self.sure, self.advice, planned) if line]

    def warned(self, warnings: Sequence[str]) -> Account:
        """The same, and before its own warnings these: what to know of the measurements before any result is read."""
        return replace(self, warnings=(*warnings, *self.warnings))

    def followed(self, command: str) -> Account:
        """The same with the command to type next; without one where the advice is what is next."""
        return self if "Next:" in self.advice else replace(self, then=command)

    @property
    def lead(self) -> str:
        """What stands before the command to type."""
        return OR if self.planner and not self.more and not self.advice.endswith(NO_MOTION_TRIED) else NEXT

    @property
    def last(self) -> list[str]:
        """What comes after the rest of the first screen: a command to type, where there is one."""
        return [f"{self.lead}: {self.then}"] if self.then else []

    @property
    def words(self) -> list[str]:
        """All of it, the headline first."""
        return [self.headline, *self.first, *self.last, *self.lines]


def advised(problem: Problem, advice: str) -> str:
    """The advice, and before it what is to be put right first: what was found to be the wrong way round, where that was found."""
    doubts = "" if advice == MEND else problem.doubts
    return " ".join(t for t in (doubts and f"Before this is believed: {doubts}", advice) if t)


def held_out_notes(problem: Problem) -> list[str]:
    """What to know of what was held out, in lines for people."""
    # Where settings differ these are held out, whatever moves in which motion.
    return [ONE_EACH] if joint_by_joint(problem) and not travelling(problem) else []


def beside_floor(error: float, floor: float, left: bool) -> list[str]:
    """An error that is less than noise would leave needs a word, and one that is more although nothing is ``left``."""
    if error < 0.97 * floor:
        # Declared or estimated: either may be too much.
        return ["The error is below the floor: there is less noise than that, and the floor is an upper bound."]
    if error < floor:
        return ["The error is at the floor, within chance."]
    if error <= 1.03 * floor or left:
        return []
    return [GRANTED if error <= SETTLED * floor else SPREAD]


def unsure_of(places: Sequence[str]) -> str:
    """Behind how sure a finding is: where the floor is only an upper bound, if it is anywhere."""
    return f"; the noise floor is only an upper bound at {_listed_places(places)}" if places else ""


def slower(places: Sequence[str]) -> str:
    """What to do where a force that changes quickly may pass for noise."""
    return (
        "To tell, repeat the motion at a third of its pace: a force that changes quickly along the way, and may pass for noise "
        f"at {_listed_places(places)}, then changes slowly, and noise does not."
    )


def _listed_places(places: Sequence[str]) -> str:
    more = f" and {len(places) - FEW} more" if len(places) > FEW else ""
    return ", ".join(map(plain, places[:FEW])) + more


def was_or_were(count: int) -> str:
    return "was" if count == 1 else "were"


def error_name(problem: Problem) -> str:
    """Its name; with its unit, where that is not told behind each number."""
    unit = f" ({problem.natural_unit})" if problem.natural_unit == "standard deviations" else ""
    return _capital(problem.natural_name) + unit


def before_and_after(problem: Problem, before: float, after: float, floor: float, on: str = "") -> str:
    """The model, the improved one and noise in one line; ``on``: what data, where others follow."""
    what = f"{error_name(problem)}{f' on {on}' if on else ''}"
    told = problem.told
    return f"{what}: model {told(before)}, improved model {told(after)}, noise floor {told(floor)}."


def nothing_else(explained: float, near: bool = True) -> str:
    """That nothing is left, in a headline, where no curve stands out. Only where so much of what is above the noise is
    ``explained`` that nobody asks for the rest, and the error is ``near`` the floor, is nothing left above the noise."""
    return NOTHING_ELSE if near and not unexplained_rest(explained, True) else NOTHING_STANDS_OUT


def unexplained_rest(explained: float, settled: bool) -> str:
    """A word on what is above the noise still, where nothing is said to be left."""
    return "; what it leaves of that stands out nowhere" if settled and explained < MOSTLY else ""


def listed_few(names: Sequence[str]) -> str:
    """Candidates by name, as many as a line holds."""
    more = f" and {len(names) - FEW} more" if len(names) > FEW else ""
    return "; ".join(map(placed, names[:FEW])) + more


def tie_text(what: str, others: Sequence[str]) -> str:
    return f"These measurements cannot tell {what} from: {', '.join(map(placed, others))}."


def left_text(left: Sequence[Leftover], after: bool, on: str = "") -> str:
    """``on``: which trials, where they are others than those of the problem."""
    head = "Even with it, more than noise is left in" if after else "It sits in"
    head = f"On {on} more than noise is left in" if on else head
    # A trial keeps its name, by which it is held out.
    worst = [str(replace(g, channel=plain(g.channel))) for g in left[:3]]
    return f"{head} {counted(curves_of(left), 'curve')}; worst: {'; '.join(worst)}."


def apart_text(word: LastWord) -> str:
    """What the model leaves of the trials that took no part: its error says how much that is, and not where."""
    if word.left:
        return left_text(word.left, word.changed, TRIALS_APART)
    return f"On {TRIALS_APART} {'no curve stands out, and all together are more than noise' if word.more else NOTHING_APART}."


def left_beside_noise(left: Sequence[Leftover], terms: Hypothesis, robot: Robot) -> Sequence[Leftover]:
    """What is left that is not the noise of sensors which ``terms`` found noisier than declared: the floor knows only what is
    declared, and no model foresees a reading's own error."""
    noisy = set[str]()
    for t in terms:
        if t.effect == NOISE:
            noisy |= {t.target, *members_of(robot, t.target, CATALOGUE[t.effect].targets(robot))}
    return [g for g in left if g.trend or g.channel not in noisy]


def curves_of(left: Sequence[Leftover]) -> int:
    """Channels of trials: one may stand out for two reasons."""
    return len({(g.index, g.channel) for g in left})


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
