"""Effects on networks, hypotheses about them, what they are for, and their JSON."""

from __future__ import annotations

import json

import numpy as np
import pytest

from ee_dist.effects import CATALOGUE, EffectError, apply, term
from ee_dist.effects.catalogue import EVERY
from ee_dist.evolution.ga import SCALE
from ee_dist.networks.dream4 import dream4
from ee_dist.networks.serial import network_from_json, network_to_json
from ee_dist.recovery.expression import Agreement, wanted_levels
from ee_dist.recovery.genome import LENGTH, decode, first_hypotheses, neighbours
from ee_dist.recovery.kinds import subject_of
from ee_dist.robots.model import RobotError
from ee_dist.robots.quadruped import quadruped
from ee_dist.trials.log import SensorLog

NETWORK = dream4()
GENES = [e for e in EVERY.values() if e.family == "genes"]


@pytest.mark.parametrize("effect", GENES, ids=lambda e: e.name)
def test_an_effect_changes_the_network_and_nothing_else_is_its_target(effect) -> None:
    assert effect.name not in CATALOGUE, "explain looks for effects on robots"
    assert effect.targets(quadruped()) == ()
    for target in effect.targets(NETWORK):
        neutral = effect.transform(NETWORK, target, effect.neutral_values())
        assert (neutral.digest == NETWORK.digest) == bool(effect.parameters)
        changed = apply(NETWORK, [term(effect.name, target, **{p.name: p.upper for p in effect.parameters})])
        assert changed.digest != NETWORK.digest
        assert changed.sensors == NETWORK.sensors


def test_effects_stay_with_their_kind_of_system() -> None:
    with pytest.raises(EffectError, match="motor_weak is an effect on a robot; dream4_size10_1 is a gene network"):
        apply(NETWORK, [term("motor_weak", "knee_front_left", loss=0.5)])
    with pytest.raises(EffectError, match="gene_knockout is an effect on a gene network; quadruped is a robot"):
        apply(quadruped(), [term("gene_knockout", "G1")])
    with pytest.raises(EffectError, match=r"'G11'.*it can act on: G1"):
        apply(NETWORK, [term("gene_knockout", "G11")])


def test_every_fault_can_be_said_at_every_place() -> None:
    genomes = first_hypotheses(1200, np.random.default_rng(0))
    said = {(t.effect, t.target) for g in genomes for t in decode(g, NETWORK)}
    assert said == {(e.name, target) for e in GENES for target in e.targets(NETWORK)}
    changes = [v for g in genomes for t in decode(g, NETWORK) for _, v in t.values]
    assert -0.9 <= min(changes) < -0.8 and 0.9 < max(changes) <= 1.0


def test_what_a_knockout_makes_meaningless_is_left_out() -> None:
    normal = subject_of(NETWORK).normal
    out = term("gene_knockout", "G10")
    idle = [
        term("transcription_altered", "G10", change=0.5),
        term("decay_altered", "G10", change=0.5),
        term("link_lost", "G10>G3"),
        term("link_lost", "G9>G10"),
        term("decay_altered", "G1", change=0.0),
    ]
    assert normal([*idle, out, out], NETWORK) == (out,)
    kept = [term("link_lost", "G1>G4"), term("decay_altered", "G1", change=0.2)]
    assert set(normal([*kept, out], NETWORK)) == {*kept, out}


def test_neighbours_try_every_fault_at_every_place() -> None:
    dormant = np.full(LENGTH, -SCALE, dtype=np.int16)
    around = {(t.effect, t.target) for g in neighbours(dormant, NETWORK) for t in decode(g, NETWORK)}
    assert around == {(e.name, target) for e in GENES for target in e.targets(NETWORK)}


def log_of(levels: np.ndarray) -> SensorLog:
    times = np.arange(len(levels)) * NETWORK.time_step_s
    sensors = np.zeros((len(levels), 4))
    sensors[:, NETWORK.sensor_names.index(NETWORK.wanted.sensor)] = levels
    names, units = NETWORK.sensor_names, ("1",) * 4
    return SensorLog(times, sensors, np.zeros((len(levels), 3)), names, units, NETWORK.motor_names)


def test_agreement_is_the_mean_distance_as_a_share_of_what_is_wanted() -> None:
    function = Agreement(NETWORK.wanted)
    times = np.arange(100) * NETWORK.time_step_s
    wanted = wanted_levels(NETWORK.wanted, times)
    assert np.isnan(wanted[times < 4 * 3600.0]).all() and wanted[-1] == 0.5
    assert wanted[times == 9 * 3600.0] == 0.3 and wanted[times == 10.5 * 3600.0] == pytest.approx(0.4)
    exact = np.nan_to_num(wanted, nan=0.9)
    assert function(log_of(exact)) == 1.0
    mean = np.nanmean(wanted)
    assert function(log_of(exact + 0.1)) == pytest.approx(1 - 0.1 / mean)
    assert function(log_of(np.full(100, np.nan))) == -np.inf
    assert function(log_of(exact[:10])) == -np.inf, "it ended before anything was wanted"


def test_a_network_comes_back_from_its_text_exactly() -> None:
    for network in (NETWORK, apply(NETWORK, [term("link_lost", "G1>G4")])):
        again = network_from_json(network_to_json(network))
        assert again == network and again.digest == network.digest


@pytest.mark.parametrize(
    ("break_", "said"),
    [
        (lambda d: d["gene_network"]["genes"][0].update(decay=-1.0), "G1: a rate per minute: -1"),
        (lambda d: d["gene_network"]["genes"][0].update(activations=[2.0]), "G1: an activation: 2"),
        (lambda d: d["gene_network"].update(time_step_s=0.0), "time_step_s: 0"),
        (lambda d: d["gene_network"]["wiring"].update(source=[0, 0, 7]), "the place of an output"),
        (lambda d: d["gene_network"]["wanted"].update(sensor="level_G44"), "did you mean level_G4"),
        (lambda d: d.pop("version"), "expected a mapping of 'version'"),
        (lambda d: d["gene_network"].pop("genes"), "missing key 'genes'"),
    ],
)
def test_a_damaged_text_is_refused(break_, said) -> None:
    data = json.loads(network_to_json(NETWORK))
    break_(data)
    with pytest.raises(RobotError, match=said):
        network_from_json(json.dumps(data))
