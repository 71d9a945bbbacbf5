"""Effects on a gene network: a gene that is gone, rates that are not what the model says, a regulator that no longer binds."""

from __future__ import annotations

from collections.abc import Mapping

from ee_dist.effects.catalogue import effect
from ee_dist.effects.effect import Parameter
from ee_dist.networks.model import GeneNetwork

REFERENCE = "Marbach and others 2010, PNAS 107, 6286 (the knock-outs and knock-downs of the DREAM challenges)"


def genes(network: GeneNetwork) -> tuple[str, ...]:
    return network.gene_names


def links(network: GeneNetwork) -> tuple[str, ...]:
    return network.link_names


@effect(
    "gene_knockout",
    family="genes",
    targets=genes,
    physics="A gene is not transcribed any more.",
    signature="Its messenger and its protein are gone from the start of a trial, and no stimulus brings them back.",
    reference=REFERENCE,
    of=GeneNetwork,
)
def gene_knockout(network: GeneNetwork, target: str, values: Mapping[str, float]) -> GeneNetwork:
    return network.with_gene(target, transcription=0.0)


def _change(of: str) -> tuple[Parameter, ...]:
    return (
        Parameter("change", "1", -0.9, 1.0, 0.0, f"change of the rate of {of} as a share of the nominal rate", 0.02),
    )


@effect(
    "transcription_altered",
    family="genes",
    targets=genes,
    parameters=_change("transcription"),
    physics="A gene is transcribed faster or slower than the model says, whatever binds to its promoter.",
    signature="The level of the gene is scaled, at rest and under every stimulus.",
    reference=REFERENCE,
    of=GeneNetwork,
)
def transcription_altered(network: GeneNetwork, target: str, values: Mapping[str, float]) -> GeneNetwork:
    rate = network.gene(target).transcription
    return network.with_gene(target, transcription=rate * (1.0 + values["change"]))


@effect(
    "decay_altered",
    family="genes",
    targets=genes,
    parameters=_change("decay of the messenger"),
    physics="The messenger of a gene lives longer or shorter than the model says.",
    signature="The level is scaled the other way, and follows a stimulus faster or slower.",
    reference=REFERENCE,
    of=GeneNetwork,
)
def decay_altered(network: GeneNetwork, target: str, values: Mapping[str, float]) -> GeneNetwork:
    rate = network.gene(target).decay
    return network.with_gene(target, decay=rate * (1.0 + values["change"]))


@effect(
    "link_lost",
    family="genes",
    targets=links,
    physics="A regulator no longer binds to the promoter of a gene, as after a mutation of its site there; it acts on all others "
    "as before.",
    signature="The gene no longer follows that regulator.",
    reference=REFERENCE,
    of=GeneNetwork,
)
def link_lost(network: GeneNetwork, target: str, values: Mapping[str, float]) -> GeneNetwork:
    return network.without_link(target)
