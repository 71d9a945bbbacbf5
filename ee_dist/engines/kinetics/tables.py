"""Networks of one structure as arrays: who binds where is shared, the numbers are a row each."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from ee_dist.networks.model import GeneNetwork, Link
from ee_dist.trials.log import Array

Index = NDArray[np.intp]


def structure_key(network: GeneNetwork) -> Hashable:
    """Networks with equal keys share one structure and may differ in all numbers."""

    def names(links: tuple[Link, ...]) -> tuple[str, ...]:
        return tuple(k.regulator for k in links)

    genes = tuple(
        (g.name, tuple((names(m.activators), names(m.deactivators), m.complex) for m in g.modules))
        for g in network.genes
    )
    return genes, tuple(d.gene for d in network.drives)


@dataclass(frozen=True)
class Structure:
    """Genes G, modules Q in the order of their genes, links K in the order of their modules.

    ``first_module`` (G + 1,): gene g has the modules from first_module[g] to first_module[g + 1]; ``first_link`` (Q + 1,)
    and ``first_deactivator`` (Q,) likewise; ``regulator`` (K,) is the gene whose protein binds; ``complex`` (Q,);
    ``first_state`` (G + 1,) into the activations; ``stimulated`` (M,) the gene of each stimulus.
    """

    first_module: Index
    first_link: Index
    first_deactivator: Index
    regulator: Index
    complex: NDArray[np.bool_]
    first_state: Index
    stimulated: Index


def structure_of(network: GeneNetwork) -> Structure:
    place = {name: k for k, name in enumerate(network.gene_names)}
    modules = [m for g in network.genes for m in g.modules]
    links = [k for g in network.genes for k in g.links]

    def firsts(counts: Sequence[int]) -> Index:
        return np.concatenate([[0], np.cumsum(counts, dtype=np.intp)]).astype(np.intp)

    first_link = firsts([len(m.activators) + len(m.deactivators) for m in modules])
    return Structure(
        first_module=firsts([len(g.modules) for g in network.genes]),
        first_link=first_link,
        first_deactivator=np.array(
            [f + len(m.activators) for f, m in zip(first_link, modules, strict=False)], dtype=np.intp
        ),
        regulator=np.array([place[k.regulator] for k in links], dtype=np.intp),
        complex=np.array([m.complex for m in modules], dtype=bool),
        first_state=firsts([len(g.activations) for g in network.genes]),
        stimulated=np.array([place[d.gene] for d in network.drives], dtype=np.intp),
    )


def numbers_of(network: GeneNetwork) -> tuple[Array, Array, Array]:
    """Rates (G, 4), links (K, 2) as level of half binding and steepness, activations of all states."""
    rates = [(g.transcription, g.decay, g.translation, g.protein_decay) for g in network.genes]
    links = [(k.half, k.steepness) for g in network.genes for k in g.links]
    states = [a for g in network.genes for a in g.activations]
    return np.array(rates), np.array(links).reshape(-1, 2), np.array(states)
