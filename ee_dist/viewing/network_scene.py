"""A run of the loop on a gene network as a rerun recording: who regulates whom, levels, stimuli, the search."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ee_dist.networks.model import Gene, GeneNetwork
from ee_dist.recording.records import RunRecord
from ee_dist.recovery.expression import wanted_levels
from ee_dist.recovery.kinds import subject_of
from ee_dist.viewing import blueprint, channels, palette, search_scene, story
from ee_dist.viewing.channels import Shot
from ee_dist.viewing.palette import Rgb
from ee_dist.viewing.stream import recording, times

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
    course = search_scene.course_of(run)
    layout = search_scene.layout(run, course, _levels(network, course.end_s) if course.trials else None)
    with recording(path, APPLICATION, search_scene.identity_of(run), story.title_of(run), layout) as stream:
        search_scene.send_texts(stream, run)
        if course.trials:
            shots, subject = course.shots, subject_of(network)
            labels = [f"{t.name}: {subject.measure(subject.value(t.log))}" for t in course.trials]
            _send_graph(stream, network, run, course.starts)
            channels.send_sensors(stream, shots, course.models, [])
            _send_wanted(stream, network, shots)
            channels.send_commands(stream, shots)
            channels.send_trial_lane(stream, shots, labels)
        search_scene.send_search(stream, run)


def _send_wanted(stream: rr.RecordingStream, network: GeneNetwork, shots: Sequence[Shot]) -> None:
    place = f"sensors/{network.wanted.sensor}/{WANTED_NAME}"
    series = [(s.start_s, s.measured, wanted_levels(network.wanted, s.measured.times_s)) for s in shots]
    channels.send_scalars(stream, place, series)
    stream.log(place, rr.SeriesLines(colors=palette.TOUCHING, names=WANTED_NAME, widths=2.0), static=True)


def _send_graph(stream: rr.RecordingStream, network: GeneNetwork, run: RunRecord, starts: Sequence[float]) -> None:
    """Genes on a ring and arrows from regulators. In each trial violet: what was believed to have changed before it."""
    names = network.gene_names
    turn = 2 * math.pi / len(names)
    places = [(RING * math.sin(k * turn), -RING * math.cos(k * turn)) for k in range(len(names))]
    believed = story.beliefs(run)
    colours: list[Rgb] = []
    for k in range(len(starts)):
        # The first belief is that of the diagnosis after the second trial, and is acted on in the third.
        record = believed.get(k - 2)
        changed = {g for t in (record.terms if record else ()) for g in t.target.split(">")[-1:]}
        colours += [_colour(network, g, changed) for g in network.genes]
    count = len(starts)
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


def _levels(network: GeneNetwork, end_s: float) -> rrb.Container:
    """Levels, graph and stimuli."""
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
    return rrb.Vertical(first, rrb.Horizontal(graph, rrb.Vertical(*others, stimuli)), row_shares=[2, 5])
