"""What counts as right: the place, a group as a whole, any of what is tied, and nothing besides."""

from __future__ import annotations

import pytest

from ee_dist.effects.catalogue import Term
from ee_dist.robots.quadruped_lab import quadruped_lab
from ee_dist.robots.servo_pendulum import servo_pendulum
from ee_dist.tasks.config import ConfigError
from ee_dist.tasks.reveal import same_truth, score

ROBOT = quadruped_lab()
JOINTS = ROBOT.motor_names
KNEE = "coulomb_friction@knee_front_left"


def terms(*names: str) -> list[dict[str, str]]:
    return [dict(zip(("effect", "target"), n.split("@"), strict=True)) for n in names]


def hidden(*names: str) -> tuple[Term, ...]:
    return tuple(Term(t["effect"], t["target"]) for t in terms(*names))


def explained(*candidates: tuple[str, ...], tied: tuple[str, ...] = (), verdict: str = "effect") -> dict[str, object]:
    ranked = [{"name": " + ".join(c), "terms": terms(*c), "tied_with": list(tied)} for c in candidates]
    return {"task": "explain", "verdict": verdict, "candidates": ranked}


def improved(
    *steps: tuple[str, ...],
    tied: tuple[str, ...] = (),
    dropped: tuple[str, ...] = (),
    own: tuple[str, ...] = (),
    twins: tuple[tuple[str, str], ...] = (),
):
    ladder = [{"added": terms(*s), "tied_with": list(tied), "dropped": list(dropped)} for s in steps]
    left = [n for s in steps for n in s if n not in dropped]
    alike = [{**terms(twin)[0], "in_place_of": terms(name)[0]} for twin, name in twins]
    start = {"added": [], "dropped": []}
    return {"task": "improve", "model_terms": terms(*own, *left), "ladder": [start, *ladder], "twins": alike}


ALL = "coulomb_friction@all_joints"
NAMED = "coulomb_friction@" + "+".join(JOINTS)
EACH = tuple(f"coulomb_friction@{j}" for j in JOINTS)
OTHER = "motor_weak@hip_rear_left"


@pytest.mark.parametrize(("summary", "truth", "right"), [
    (explained((KNEE,)), (KNEE,), True),
    (explained((OTHER,)), (KNEE,), False),
    (explained((OTHER,), (KNEE,), tied=(KNEE,)), (KNEE,), True),
    (explained((OTHER,), (KNEE,)), (KNEE,), False),
    (explained((ALL,)), (KNEE,), False),
    (explained((ALL,)), (ALL,), True),
    (explained((NAMED,)), (ALL,), True),
    (explained(EACH), (ALL,), True),
    (explained((KNEE,)), (ALL,), False),
    (explained((KNEE, OTHER)), (KNEE,), False),
    (explained((KNEE,)), (KNEE, OTHER), True),
    (explained((KNEE, OTHER)), (KNEE, OTHER), True),
    (explained(verdict="nothing_missing"), (), True),
    (explained(verdict="unexplained"), (), False),
    (explained((KNEE,)), (), False),
    (explained((KNEE,), verdict="unexplained"), (KNEE,), False),
    (improved((KNEE,)), (KNEE,), True),
    (improved((KNEE,), (OTHER,)), (KNEE,), False),
    (improved((KNEE,), (OTHER,)), (OTHER, KNEE), True),
    (improved((ALL,)), (KNEE,), False),
    (improved((ALL,)), (ALL,), True),
    (improved(EACH), (ALL,), True),
    (improved(EACH[:3]), (ALL,), False),
    (improved((OTHER,), tied=(KNEE,)), (KNEE,), True),
    (improved((OTHER,), (KNEE,), dropped=(OTHER,)), (KNEE,), True),
    (improved((OTHER,), twins=((KNEE, OTHER),)), (KNEE,), True),
    (improved((OTHER,), twins=((KNEE, OTHER),)), (ALL,), False),
    (improved((KNEE,), own=(OTHER,)), (KNEE,), True),
    (improved(), (), True),
    (improved((KNEE,)), (), False),
    (improved(), (KNEE,), False),
])  # fmt: skip
def test_right_and_not(summary, truth, right):
    found = score(summary, hidden(*truth), ROBOT)
    assert found.right is right, found
    if not found.right and truth and summary["task"] == "improve":
        assert found.missed or found.invented


FAMILY = f"coulomb_friction@each of {len(JOINTS)} joints"


@pytest.mark.parametrize(
    ("truth", "right"), [((KNEE,), True), ((KNEE, "supply_sag@"), True), (("speed_limit@knee_front_left",), False)]
)
def test_a_truth_that_lies_in_a_tied_family_is_within_the_names(truth, right):
    """Each joint has a value of its own in it, so that one of them may be all that is wrong; not so where all share one number,
    nor where the family was told first."""
    found = explained((OTHER,), EACH, tied=(FAMILY,))
    found["candidates"][1]["name"] = FAMILY
    assert score(found, hidden(*truth), ROBOT).right is right
    assert score(found, hidden(*truth), ROBOT).named == ((OTHER, FAMILY),)
    assert not score(explained((OTHER,), (ALL,), tied=(ALL,)), hidden(*truth), ROBOT).right
    found["candidates"].reverse()
    found["candidates"][0]["tied_with"] = []
    assert not score(found, hidden(*truth), ROBOT).right


@pytest.mark.parametrize(("truth", "right"), [((KNEE,), True), (("speed_limit@knee_front_left",), False)])
def test_so_it_is_with_what_a_step_of_improve_is_tied_with(truth, right):
    found = improved((OTHER,), tied=(FAMILY,))
    found["ladder"][1]["alternatives"] = [{**terms(EACH[0])[0], "name": FAMILY, "terms": terms(*EACH)}]
    said = score(found, hidden(*truth), ROBOT)
    assert said.right is right and said.named == ((OTHER, FAMILY),)


def test_what_was_missed_and_invented_is_told():
    found = score(improved((ALL,)), hidden(KNEE), ROBOT)
    assert found.missed == (("coulomb_friction", "knee_front_left"),)
    assert found.invented == (("coulomb_friction", "all_joints"),)
    one = servo_pendulum()
    assert score(explained(("load_friction@servo",)), hidden("load_friction@servo"), one).right


def test_what_was_added_is_told_together_and_what_is_tied_as_alternatives():
    found = score(improved((KNEE,), (OTHER,), tied=("zero_offset@knee_rear_left",)), hidden(KNEE, OTHER), ROBOT)
    assert found.named == ((KNEE, "zero_offset@knee_rear_left"), (OTHER, "zero_offset@knee_rear_left"))
    assert score(improved((KNEE,), (OTHER,)), hidden(), ROBOT).named == ((KNEE,), (OTHER,))
    assert score(improved((OTHER,), twins=((KNEE, OTHER),)), hidden(), ROBOT).named == ((OTHER, KNEE),)
    assert score(improved((KNEE, OTHER), tied=(ALL,)), hidden(), ROBOT).named == ((f"{KNEE} + {OTHER}", ALL),)
    # What the model came to have itself is no alternative.
    assert score(improved((KNEE,), (OTHER,), tied=(KNEE, OTHER)), hidden(), ROBOT).named == ((KNEE,), (OTHER,))
    assert score(explained((OTHER,), (KNEE,), tied=(KNEE,)), hidden(KNEE), ROBOT).named == ((OTHER, KNEE),)


def test_an_explanation_of_other_measurements_is_no_answer():
    """By the seals of what it read: one truth may be sealed beside several logs, in folders that were moved since."""
    summary = explained((KNEE,)) | {
        "measured": [{"file": "logs/a/trial.mcap", "seal": "a"}, {"file": "b", "seal": "b"}]
    }
    with pytest.raises(
        ConfigError, match=r"=logs/e: it is of other measurements \(logs/a/trial.mcap, b\).* log=logs/c"
    ):
        same_truth(summary, "c", "task.explained=logs/e", "log=logs/c")
    same_truth(summary, "a", "task.explained=logs/e", "log=logs/c")
    same_truth(explained((KNEE,)), "c", "task.explained=logs/e", "log=logs/c")
    same_truth({"measured": [{"file": "measured.mcap", "seal": None}]}, "c", "task.explained=logs/e", "log=logs/c")
    with pytest.raises(ConfigError, match="it was changed"):
        same_truth({"measured": [1]}, "c", "task.explained=logs/e", "log=logs/c")


def test_a_summary_of_another_verb_is_refused():
    with pytest.raises(ConfigError, match="task=compare; expected one of explain or improve"):
        score({"task": "compare"}, (), ROBOT)
