"""What improve says: no more than its verdict, and what it cannot tell apart."""

from __future__ import annotations

from types import SimpleNamespace

from account_samples import made_up

from ee_dist.discrepancy.accounts.of_improve import ON_ITS_OWN, improve_account
from ee_dist.discrepancy.evidence.intervals import NEUTRAL, ParameterReport
from ee_dist.discrepancy.finished import BETTER, EXPLAINED
from ee_dist.discrepancy.ladder import Twin
from ee_dist.effects.catalogue import term


def test_a_headline_says_no_more_than_the_verdict() -> None:
    rung = SimpleNamespace(
        added=(term("coulomb_friction", "servo", torque_nm=0.3),), dropped=(), tied_with=[], name="x@y", error_heldout=1.5,
        held_out="motions that were not fitted", alternatives=[],
    )  # fmt: skip
    start = SimpleNamespace(added=(), dropped=(), tied_with=[], error_heldout=5.0, held_out="", name="")
    problem = made_up()
    for verdict, share, said in (
        (EXPLAINED, 1.0, "Nothing else is left above the noise."),
        (EXPLAINED, 0.59, "Nothing else stands out."),
        (BETTER, 0.9979, "More than noise is left on motions that were not fitted: 99.7 % of"),
    ):
        found = SimpleNamespace(
            ladder=[start, rung], left=[], verdict=verdict, explained=share, parameters=[], terms=rung.added, stopped="so",
            noise_floor=1.0, floor_source="told", last=None, odd=[], worth=None, unsure=[], twins=[],
            judged_on=rung.held_out, all_rows=None, at_limit=[], no_farther=(),
        )  # fmt: skip
        account = improve_account(problem, found)  # type: ignore[arg-type]
        assert account.headline.endswith(said) or said in account.headline
        assert not account.planner, "nothing is tied"
        assert account.good is (verdict == EXPLAINED) and ("Nothing" in account.headline) is account.good
    assert ON_ITS_OWN in account.lines, "compare is what it leads on to"
    rung.alternatives = [(SimpleNamespace(name="speed_limit@each of 3 joints"), ())]
    found.ladder = [start, rung]
    assert improve_account(problem, found, "plan it").first[-1].endswith(" plan it")  # type: ignore[arg-type]
    rung.dropped = ("offset_torque@servo",)
    end = SimpleNamespace(**{**vars(start), "dropped": ("rotor_inertia@servo",)})
    found.ladder = [start, rung, end]
    lines = improve_account(problem, found).lines  # type: ignore[arg-type]
    assert account.sure.count("not told from") == 0
    rung.tied_with = ["coulomb_friction@servo", "motor_weak@servo"]
    swapped = improve_account(problem, found)  # type: ignore[arg-type]
    told_apart = "These measurements cannot tell x at y from: motor weak at servo."
    assert told_apart in swapped.lines and "not told from motor weak at servo" in swapped.sure
    heavy, weak = (term("part_mass", "arm", change=c) for c in (1.2, 0.05)), term("motor_weak", "servo", loss=0.5)
    more, less = heavy
    rung.tied_with, rung.added = [], (weak,)
    inertia = term("rotor_inertia", "servo", added_kg_m2=0.002)
    twin = Twin(weak.name, inertia, (more, inertia))
    own = ParameterReport(1, "change", 0.05, 0.04, 0.06, "")
    found.terms, found.parameters, found.twins = (weak, less), [own], [twin]
    rung.dropped = (inertia.name,)
    either = improve_account(problem, found, "plan it")  # type: ignore[arg-type]
    assert (
        "These measurements cannot tell motor weak at servo from: rotor inertia at servo. With that in its place: rotor inertia "
        "at servo (added 0.002 kg.m^2); part mass at arm (change +120 %)." in either.lines
    )
    assert not either.good and "not told from rotor inertia at servo" in either.sure and either.planner == "plan it"
    assert not any("Dropped again" in line for line in either.lines)
    found.ladder, found.twins = [start, SimpleNamespace(**{**vars(rung), "added": (less, weak)})], []
    assert improve_account(problem, found).headline.startswith("Added: motor weak at servo")  # type: ignore[arg-type]
    found.parameters = [own, ParameterReport(0, "loss", 0.5, -0.1, 0.9, NEUTRAL)]
    assert improve_account(problem, found).headline.startswith("Added: part mass at arm")  # type: ignore[arg-type]
    found.ladder = [start, rung, end]
    found.terms, found.parameters, found.twins = (term("coulomb_friction", "servo", torque_nm=0.3),), [], []
    rung.dropped = ("offset_torque@servo",)
    rung.added = (term("viscous_friction", "servo", damping_nm_s_rad=0.1),)
    gone = improve_account(problem, found)  # type: ignore[arg-type]
    assert not any("cannot tell" in line for line in gone.lines) and "not told from" not in gone.sure
    assert "Dropped again: offset torque at servo, which a later effect made useless." in lines
    assert "Left out in the end, since these data do not tell them from neutral: rotor inertia at servo." in lines
    rung.dropped = ("coulomb_friction@all_joints", "coulomb_friction@elbow", "backlash@servo")
    apart = improve_account(problem, found).lines  # type: ignore[arg-type]
    assert "Shared at first, and of other joints or of each by itself since: coulomb friction." in apart
    assert [line for line in apart if line.startswith("Dropped")] == [
        "Dropped again: backlash at servo, which a later effect made useless."
    ]
    rung.dropped = (*(f"part_mass@link_{k}" for k in range(5)), "backlash@servo")
    assert (
        "Dropped again: part mass at 5 places; backlash at servo, which later effects made useless."
        in improve_account(problem, found).lines  # type: ignore[arg-type]
    )
