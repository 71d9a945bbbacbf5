"""A gene network as JSON, and back, exactly: the form of robots (``ee_dist.robots.serial``), of other dataclasses."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from typing import cast

from ee_dist.networks.model import GeneNetwork, NetworkError
from ee_dist.robots.serial import VERSION, built, plain
from ee_dist.robots.untrusted import UntrustedError, json_of

KIND = "gene_network"
FASTEST, HIGHEST, STEEPEST = 1e3, 1e6, 100.0
"""Bounds of what can be: rates per minute, levels, Hill coefficients."""
LONGEST_STEP_S = 1e6


def network_to_json(network: GeneNetwork) -> str:
    """JSON text, one line; equal networks give equal text."""
    return json.dumps({"version": VERSION, KIND: plain(network)}, ensure_ascii=False, allow_nan=False)


def network_from_json(text: str | bytes) -> GeneNetwork:
    """The network that ``network_to_json`` was given. Raises RobotError for what is none, or has a number that cannot be."""
    try:
        data = json_of(text)
    except UntrustedError as error:
        raise NetworkError(f"network: {error}") from error
    if not isinstance(data, Mapping) or set(data) != {"version", KIND} or data["version"] != VERSION:
        raise NetworkError(f"network: expected a mapping of 'version' ({VERSION}) and '{KIND}'")
    return _checked(cast(GeneNetwork, built(GeneNetwork, data[KIND], KIND)))


def _checked(network: GeneNetwork) -> GeneNetwork:
    _within(network.time_step_s, 1e-6, LONGEST_STEP_S, "time_step_s")
    for gene in network.genes:
        for rate in (gene.transcription, gene.decay, gene.translation, gene.protein_decay):
            _within(rate, 0.0, FASTEST, f"{gene.name}: a rate per minute")
        for value in gene.activations:
            _within(value, 0.0, 1.0, f"{gene.name}: an activation")
        for link in gene.links:
            if not math.isinf(link.half):
                _within(link.half, 1e-9, HIGHEST, f"{link.regulator}>{gene.name}: half")
            _within(link.steepness, 0.0, STEEPEST, f"{link.regulator}>{gene.name}: steepness")
    for drive in network.drives:
        _within(drive.strongest, 0.0, 1.0, f"{drive.name}: strongest")
    for _, level in network.wanted.points:
        _within(level, 0.0, HIGHEST, "wanted: a level")
    if sorted(network.wiring.source) != list(range(len(network.drives))):
        raise NetworkError(f"wiring: {network.wiring.source}; expected the place of an output for each stimulus")
    return network


def _within(value: float, low: float, high: float, where: str) -> None:
    if not low <= value <= high:
        raise NetworkError(f"{where}: {value:g}; expected {low:g} to {high:g}")
