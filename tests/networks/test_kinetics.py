"""The engine of gene networks: against published figures, formulas, scipy's solver, and the contract of engines."""

from __future__ import annotations

import pickle
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from ee_dist.effects import apply, term
from ee_dist.engines.contract import EngineError, Rollout
from ee_dist.engines.drivers import Commands, Network, weight_count
from ee_dist.engines.kinetics.engine import KineticsEngine
from ee_dist.networks.dream4 import dream4
from ee_dist.networks.model import Gene, GeneNetwork, NetworkError
from ee_dist.robots.model import Sensor
from ee_dist.robots.quadruped import quadruped
from ee_dist.trials.noise import with_noise

NETWORK = dream4()
SEEING_ALL = replace(NETWORK, sensors=tuple(Sensor(f"level_{g}", "expression", g) for g in NETWORK.gene_names))
STILL = Commands(np.zeros((1, 3)))
FULL = 0.701307
"""The level that DREAM4's file has for a gene at its full level."""
DOUBLE_KNOCKOUTS = {
    ("G7", "G10"): (0.701307, 0.097722, 0.091150, 0.387965, 0.121844, 0.328627, 0.0, 0.701307, 0.701307, 0.0),
    ("G1", "G10"): (0.0, 0.425129, 0.334216, 0.037098, 0.701307, 0.328627, 0.574350, 0.701307, 0.701307, 0.0),
    ("G1", "G7"): (0.0, 0.425129, 0.522210, 0.037098, 0.701307, 0.328627, 0.0, 0.701307, 0.701307, 0.699658),
    ("G3", "G9"): (0.701307, 0.097722, 0.0, 0.387965, 0.121844, 0.328627, 0.701307, 0.701307, 0.0, 0.050294),
    ("G1", "G3"): (0.0, 0.425129, 0.0, 0.037098, 0.701307, 0.328627, 0.701307, 0.701307, 0.701307, 0.699658),
}
"""insilico_size10_1_nonoise_dualknockouts.tsv of the DREAM4 challenge: levels at rest of the genes in their order."""


@pytest.fixture(scope="module")
def engine() -> KineticsEngine:
    return KineticsEngine()


def at_rest(engine: KineticsEngine, network: GeneNetwork) -> np.ndarray:
    (log,) = engine.rollout([Rollout(replace(network, sensors=SEEING_ALL.sensors), STILL, 2)])
    assert log.sensors[0] == pytest.approx(log.sensors[1], abs=1e-9), "at rest nothing changes"
    return log.sensors[0]


def controllers(count: int, network: GeneNetwork = NETWORK) -> list[Network]:
    rng = np.random.default_rng(3)
    length = weight_count(len(network.sensors), len(network.drives))
    return [Network(tuple(float(v) for v in np.round(rng.uniform(-1, 1, length), 2))) for _ in range(count)]


# -- science ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("pair", DOUBLE_KNOCKOUTS)
def test_double_knockouts_come_to_rest_where_the_challenge_published_it(engine: KineticsEngine, pair) -> None:
    found = at_rest(engine, apply(NETWORK, [term("gene_knockout", g) for g in pair]))
    # The published levels are those of a solver that stopped near rest.
    assert FULL * found == pytest.approx(np.array(DOUBLE_KNOCKOUTS[pair]), abs=2e-4)


def taken(level: float, half: float, steepness: float) -> float:
    return (level / half) ** steepness / (1 + (level / half) ** steepness)


def test_rest_is_where_the_formula_says_along_a_chain_without_loops(engine: KineticsEngine) -> None:
    levels = dict(zip(NETWORK.gene_names, at_rest(engine, NETWORK), strict=True))

    def activations(name: str) -> tuple[float, ...]:
        return NETWORK.gene(name).activations

    for name in ("G1", "G8", "G9"):
        assert levels[name] == pytest.approx(1.0, abs=1e-9), "nothing regulates it"
    for name in ("G5", "G6", "G10"):
        (link,) = NETWORK.gene(name).links
        share = taken(levels[link.regulator], link.half, link.steepness)
        off, on = activations(name)
        assert levels[name] == pytest.approx(off * (1 - share) + on * share, abs=1e-9)
    one, *both = NETWORK.gene("G2").links
    first = taken(levels["G8"], one.half, one.steepness)
    product = np.prod([(levels[k.regulator] / k.half) ** k.steepness for k in both])
    second = product / (1 + product)
    a0, a1, a2, a3 = activations("G2")
    expected = (
        (1 - first) * (1 - second) * a0 + first * (1 - second) * a1 + (1 - first) * second * a2 + first * second * a3
    )
    assert levels["G2"] == pytest.approx(expected, abs=1e-9)


def test_a_released_gene_decays_as_an_exponential(engine: KineticsEngine) -> None:
    """A stimulus that takes away the whole basal activation of a gene without regulators."""
    (log,) = engine.rollout([Rollout(SEEING_ALL, Commands(np.array([[-1.0, 0.0, 0.0]])), 60)])
    gone = np.exp(-NETWORK.gene("G1").decay * log.times_s / 60.0)
    assert log.channel("level_G1") == pytest.approx(gone, abs=1e-5)


def slopes(network: GeneNetwork, shift: dict[str, float], state: np.ndarray) -> np.ndarray:
    """The equations once more, gene by gene and state by state, as the paper has them: (2, G) flat, per minute."""
    genes = network.genes
    x, y = state.reshape(2, len(genes))
    protein = dict(zip(network.gene_names, y, strict=True))
    made = []
    for g in genes:
        probabilities = []
        for m in g.modules:
            on = [(protein[k.regulator] / k.half) ** k.steepness for k in m.activators]
            off = [(protein[k.regulator] / k.half) ** k.steepness for k in m.deactivators]
            if m.complex:
                whole = 1 + np.prod(on) + (np.prod(on) * np.prod(off) if off else 0.0)
            else:
                whole = np.prod([1 + v for v in on]) * np.prod([1 + v for v in off])
            probabilities.append(np.prod(on) / whole)
        delta = float(np.clip(g.activations[0] + shift.get(g.name, 0.0), 0, 1)) - g.activations[0]
        total = 0.0
        for k, activation in enumerate(g.activations):
            likely = np.prod([p if k >> i & 1 else 1 - p for i, p in enumerate(probabilities)])
            total += likely * float(np.clip(activation + delta, 0, 1))
        made.append(total)
    dx = [g.transcription * f - g.decay * v for g, f, v in zip(genes, made, x, strict=True)]
    dy = [g.translation * v - g.protein_decay * w for g, v, w in zip(genes, x, y, strict=True)]
    return np.array([*dx, *dy])


@pytest.mark.parametrize("hidden", [(), (term("gene_knockout", "G10"), term("decay_altered", "G3", change=1.0))])
def test_levels_under_stimuli_are_those_of_scipys_solver(engine: KineticsEngine, hidden) -> None:
    network, rng = apply(SEEING_ALL, hidden), np.random.default_rng(0)
    commands = rng.uniform(-1, 1, (4, 3)).repeat(3, axis=0)
    (log,) = engine.rollout([Rollout(network, Commands(commands), len(commands))])
    state = engine._rest([network])[0].ravel()
    assert np.abs(slopes(network, {}, state)).max() < 1e-9, "a trial begins at rest"
    for row, command in enumerate(commands[:-1]):
        assert log.sensors[row] == pytest.approx(state[: len(network.genes)], abs=1e-4)
        shift = dict(zip((d.gene for d in network.drives), command, strict=True))
        solved = solve_ivp(
            lambda _, s, u=shift: slopes(network, u, s), (0.0, network.time_step_s / 60.0), state, rtol=1e-7, atol=1e-9
        )
        state = solved.y[:, -1]


# -- the contract of engines -----------------------------------------------------------------------------------------


def test_a_log_does_not_depend_on_what_else_is_asked_or_was() -> None:
    models = [NETWORK, *(apply(NETWORK, [term("gene_knockout", g)]) for g in ("G3", "G10"))]
    rollouts = [Rollout(models[k % 3], c, 30 + 10 * (k % 2)) for k, c in enumerate(controllers(12))]
    together = KineticsEngine().rollout(rollouts)
    assert [len(log) for log in together] == [r.steps for r in rollouts]
    small, used = KineticsEngine(largest_batch=3), KineticsEngine()
    used.rollout(rollouts[::-1])
    for others in (small.rollout(rollouts), used.rollout(rollouts), pickle.loads(pickle.dumps(together))):
        for a, b in zip(together, others, strict=True):
            assert a.sensors.tobytes() == b.sensors.tobytes() and a.commands.tobytes() == b.commands.tobytes()
    for r, log in zip(rollouts, together, strict=True):
        (alone,) = KineticsEngine().rollout([pickle.loads(pickle.dumps(r))])
        assert alone.sensors.tobytes() == log.sensors.tobytes()


def test_keys_tell_models_controllers_and_noise_apart(engine: KineticsEngine) -> None:
    first, second = controllers(2)
    noisy = with_noise(NETWORK, 0.02)
    rollouts = [
        Rollout(NETWORK, first, 30),
        Rollout(NETWORK, second, 30),
        Rollout(apply(NETWORK, [term("link_lost", "G1>G4")]), first, 30),
        Rollout(noisy, first, 30, seed=1),
        Rollout(noisy, first, 30, seed=2),
    ]
    assert len({r.key for r in rollouts}) == len(rollouts)
    logs = engine.rollout(rollouts)
    assert len({log.sensors.tobytes() for log in logs}) == len(logs)
    quiet, loud = logs[0].sensors[0], np.array([log.sensors[0] for log in logs[3:]])
    assert 0 < np.abs(loud - quiet).max() < 0.1
    assert Rollout(NETWORK, first, 30, seed=1).key == rollouts[0].key, "without noise a seed decides nothing"


def test_a_command_is_cut_to_what_a_promoter_can_do_and_acts_on_its_gene_alone(engine: KineticsEngine) -> None:
    (log,) = engine.rollout([Rollout(SEEING_ALL, Commands(np.array([[5.0, 5.0, -5.0]])), 40)])
    (cut,) = engine.rollout([Rollout(SEEING_ALL, Commands(np.array([[1.0, 1.0, -1.0]])), 40)])
    assert log.sensors.tobytes() == cut.sensors.tobytes()
    assert log.channel("level_G1") == pytest.approx(1.0), "it is fully active as it is"
    assert log.channel("level_G9")[-1] < 0.01


def test_other_systems_and_other_rollouts_are_refused_in_a_line(engine: KineticsEngine) -> None:
    with pytest.raises(EngineError, match="quadruped is a robot: engine=pybullet or engine=mujoco"):
        engine.rollout([Rollout(quadruped(), STILL, 5)])
    with pytest.raises(EngineError, match="driven by its stimuli alone"):
        engine.rollout([Rollout(NETWORK, STILL, 5, supply_v=np.ones(5))])


# -- the description -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (lambda n: replace(n, genes=(*n.genes, n.genes[0])), "two of that name"),
        (
            lambda n: replace(n, genes=(Gene("G1", 1, 1, 1, 1, (0.5, 0.5)), *n.genes[1:])),
            "1 states of its modules, not 2",
        ),
        (lambda n: replace(n, genes=n.genes[1:]), "a regulator of G2: there is no 'G1'"),
        (lambda n: replace(n, drives=()), "nothing can be commanded"),
        (lambda n: n.without_link("G1>G44"), "did you mean G1>G4"),
        (lambda n: n.with_gene("G44", decay=1.0), "did you mean G4"),
    ],
)
def test_a_network_that_contradicts_itself_is_refused(change, said) -> None:
    with pytest.raises(NetworkError, match=said):
        change(NETWORK)
