"""A run of the loop on a gene network as a rerun recording: who regulates whom, levels, stimuli, the search."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ee_dist.networks.model import Gene, GeneNetwork
from ee_dist.recording.records import RunRecord, TrialRecord
from ee_dist.recovery.expression import wanted_levels
from ee_dist.recovery.kinds import subject_of
from ee_dist.viewing import blueprint, channels, palette, search_scene, story
from ee_dist.viewing.channels import Shot
from ee_dist.viewing.palette import Rgb
from ee_dist.viewing.search_scene import SAID
from ee_dist.viewing.stream import interval_s, log_digest, recording, starts_of, times
from ee_dist.viewing.text import document

APPLICATION = "ee_dist"
GRAPH = "network"
RING = 220.0
"""Radius of the ring of genes, in the units of the graph."""
WANTED_NAME = "wanted"
SPAN = (-0.05, 1.05)
SHIFT_SPAN = (-1.1, 1.1)


def write_network_rrd(run: RunRecord, path: str | Path) -> None:
    """Write a run as an ``.rrd`` with its blueprint. Equal runs give equal recordings but for rerun's own row ids."""
    network: GeneNetwork = run.robot
    trials = [t for t in story.hardware_trials(run) if len(t.log)]
    said = {(t.source, t.index): t for t in run.trials if len(t.log)}
    beside = [[said[s, t.index] for s in SAID if (s, t.index) in said] for t in trials]
    starts = starts_of([(t.index, [t.log, *(m.log for m in models)]) for t, models in zip(trials, beside, strict=True)])
    models = [SAID[s] for s in SAID if any((s, t.index) in said for t in trials)]
    identity = [network.digest, repr(sorted(run.metadata.items())), *(log_digest(t.log) for t in run.trials)]
    layout = _blueprint(run, network, trials, starts)
    with recording(path, APPLICATION, identity, story.title_of(run), layout) as stream:
        for place, text in (("texts/result", story.result_text(run)), ("texts/details", story.details_text(run))):
            stream.log(place, document(text), static=True)
        if trials:
            shots = [
                Shot(t.name, s, t.log, {SAID[m.source].key: m.log for m in own})
                for t, s, own in zip(trials, starts, beside, strict=True)
            ]
            subject = subject_of(network)
            labels = [f"{t.name}: {subject.measure(subject.value(t.log))}" for t in trials]
            _send_graph(stream, network, run, trials, starts)
            channels.send_sensors(stream, shots, models, [])
            _send_wanted(stream, network, shots)
            channels.send_commands(stream, shots)
            channels.send_trial_lane(stream, shots, labels)
        search_scene.send_search(stream, run)


def _send_wanted(stream: rr.RecordingStream, network: GeneNetwork, shots: Sequence[Shot]) -> None:
    place = f"sensors/{network.wanted.sensor}/{WANTED_NAME}"
    series = [(s.start_s, s.measured, wanted_levels(network.wanted, s.measured.times_s)) for s in shots]
    channels.send_scalars(stream, place, series)
    stream.log(place, rr.SeriesLines(colors=palette.TOUCHING, names=WANTED_NAME, widths=2.0), static=True)


def _send_graph(
    stream: rr.RecordingStream,
    network: GeneNetwork,
    run: RunRecord,
    trials: Sequence[TrialRecord],
    starts: Sequence[float],
) -> None:
    """Genes on a ring and arrows from regulators. In each trial violet: what was believed to have changed before it."""
    names = network.gene_names
    turn = 2 * math.pi / len(names)
    places = [(RING * math.sin(k * turn), -RING * math.cos(k * turn)) for k in range(len(names))]
    believed = story.beliefs(run)
    colours: list[Rgb] = []
    for k, _ in enumerate(trials):
        # The first belief is that of the diagnosis after the second trial, and is acted on in the third.
        record = believed.get(k - 2)
        changed = {g for t in (record.terms if record else ()) for g in t.target.split(">")[-1:]}
        colours += [_colour(network, g, changed) for g in network.genes]
    count = len(trials)
    nodes = rr.GraphNodes.columns(
        node_ids=list(names) * count,
        positions=places * count,
        colors=colours,
        labels=[_label(network, name) for name in names] * count,
        radii=[9.0] * (len(names) * count),
    ).partition([len(names)] * count)
    stream.send_columns(GRAPH, [times(np.array(starts))], nodes)
    edges = [(link.regulator, g.name) for g in network.genes for link in g.links]
    stream.log(GRAPH, rr.GraphEdges(edges=edges, graph_type="directed"), static=True)


def _label(network: GeneNetwork, name: str) -> str:
    stimulated = name in {d.gene for d in network.drives}
    reported = name in {s.target for s in network.sensors}
    notes = [word for word, so in (("stimulated", stimulated), ("reported", reported)) if so]
    return f"{name} ({', '.join(notes)})" if notes else name


def _colour(network: GeneNetwork, gene: Gene, changed: set[str]) -> Rgb:
    if gene.name in changed:
        return palette.HINDSIGHT
    output = next(s.target for s in network.sensors if s.name == network.wanted.sensor)
    if gene.name == output:
        return palette.TOUCHING
    return palette.MEASURED if gene.name in {s.target for s in network.sensors} else palette.GROUND


def _blueprint(
    run: RunRecord, network: GeneNetwork, trials: Sequence[TrialRecord], starts: Sequence[float]
) -> rrb.Blueprint:
    text = rrb.Tabs(
        rrb.TextDocumentView(origin="/texts/result", name="Result"),
        rrb.TextDocumentView(origin="/texts/details", name="Details"),
        active_tab=0,
    )
    search = search_scene.search_views(run)
    if not trials:
        return blueprint.framed(rrb.Horizontal(*search, text))
    end_s = starts[-1] + interval_s(trials[-1].log)
    axis = blueprint.fixed_axis(0.0, end_s)
    output = network.wanted.sensor
    first = blueprint.plot(
        f"/sensors/{output}", f"{output.replace('_', ' ')}: wanted (green), measured", axis, span=SPAN
    )
    others = [
        blueprint.plot(f"/sensors/{s.name}", s.name.replace("_", " "), axis, span=SPAN, legend=False)
        for s in network.sensors
        if s.name != output
    ]
    graph = rrb.GraphView(origin=f"/{GRAPH}", name="Who regulates whom; violet: believed to have changed")
    stimuli = blueprint.plot("/commands", "Stimuli (shift of the basal activation)", axis, span=SHIFT_SPAN)
    left = rrb.Vertical(first, rrb.Horizontal(graph, rrb.Vertical(*others, stimuli)), row_shares=[2, 5])
    right = rrb.Vertical(text, *search, row_shares=[18, 5, 5][: 1 + len(search)])
    whole = rrb.Vertical(
        rrb.Horizontal(left, right, column_shares=[5, 3]), blueprint.chapters(end_s), row_shares=[10, 1]
    )
    return blueprint.framed(whole)
