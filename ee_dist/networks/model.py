"""A gene regulatory network as immutable data: genes, what binds to their promoters, what may be done to it, what is seen of it.

The kinetics are those of GeneNetWeaver (Marbach and others 2010, PNAS 107, 6286; Schaffter and others 2011, Bioinformatics 27,
2263), in which the networks of the DREAM4 challenge are given. Of gene i, with x its messenger RNA and y its protein::

    dx_i/dt = transcription_i * f_i(y) - decay_i * x_i
    dy_i/dt = translation_i * x_i - protein_decay_i * y_i

f_i, from 0 to 1, is the mean of the activations of the promoter's states, each weighted by its probability: each of the
promoter's modules is active or not, independently of the others (thermodynamics of binding; see ``Module``).

Levels are shares of what a gene makes at full activation, rates are per minute as published, all other times seconds.
"""

from __future__ import annotations

import hashlib
import math
from dataclasses import dataclass, fields, replace
from functools import cached_property
from typing import Any

from ee_dist.basics.names import did_you_mean
from ee_dist.basics.quoted import quoted
from ee_dist.robots.model import RobotError, Sensor, Wiring


class NetworkError(RobotError):
    """A network that contradicts itself, or a name it does not have."""


@dataclass(frozen=True)
class Link:
    """A regulator that binds to a promoter: half of the sites are taken at the level ``half`` of its protein, with Hill
    coefficient ``steepness``. Infinite ``half``: it binds no more."""

    regulator: str
    half: float
    steepness: float


@dataclass(frozen=True)
class Module:
    """A piece of a promoter that is active while all ``activators`` are bound and no complex with the ``deactivators`` is.

    ``complex``: they bind together as one; otherwise each for itself.
    """

    activators: tuple[Link, ...]
    deactivators: tuple[Link, ...] = ()
    complex: bool = False


@dataclass(frozen=True)
class Gene:
    """``activations`` (2**modules,): of the states of its promoter, state s having module m active where bit m of s is 1; the
    first is the basal activation. The four rates are per minute."""

    name: str
    transcription: float
    decay: float
    translation: float
    protein_decay: float
    activations: tuple[float, ...]
    modules: tuple[Module, ...] = ()

    @property
    def links(self) -> tuple[Link, ...]:
        return tuple(link for m in self.modules for link in (*m.activators, *m.deactivators))


@dataclass(frozen=True)
class Stimulus:
    """What a controller commands: a shift of the basal activation of ``gene`` by up to ``strongest`` either way."""

    name: str
    gene: str
    strongest: float = 1.0


@dataclass(frozen=True)
class Wanted:
    """What the network is for: the channel ``sensor`` is to show the levels through ``points``, (time in s, level) in order of
    time, straight between them and constant after the last. What comes before the first is not judged."""

    sensor: str
    points: tuple[tuple[float, float], ...]


@dataclass(frozen=True)
class GeneNetwork:
    """A network with its stimuli, its reporters and what it is wanted for. Implements ``ee_dist.robots.system.System``."""

    name: str
    genes: tuple[Gene, ...]
    drives: tuple[Stimulus, ...]
    sensors: tuple[Sensor, ...]
    wiring: Wiring
    wanted: Wanted
    time_step_s: float = 600.0
    """From one reading of the reporters, and command, to the next."""

    def __post_init__(self) -> None:
        names = [g.name for g in self.genes]
        for g in self.genes:
            if len(g.activations) != 2 ** len(g.modules):
                raise NetworkError(f"{g.name}: {2 ** len(g.modules)} states of its modules, not {len(g.activations)}")
            for link in g.links:
                _known(f"a regulator of {g.name}", link.regulator, names)
        if not self.drives:
            raise NetworkError("no stimulus: nothing can be commanded")
        for what, own in (("gene", names), ("stimulus", self.motor_names), ("sensor", self.sensor_names)):
            for name in own:
                if list(own).count(name) > 1:
                    raise NetworkError(f"{what} {quoted(name)}: there are two of that name")
        for d in self.drives:
            _known(f"stimulus {d.name}", d.gene, names)
        for s in self.sensors:
            _known(f"sensor {s.name}", s.target, names)
        _known("wanted", self.wanted.sensor, [s.name for s in self.sensors])
        times = [t for t, _ in self.wanted.points]
        if not times or times != sorted(set(times)):
            raise NetworkError("wanted: points must be there, in order of time")

    @property
    def motor_names(self) -> tuple[str, ...]:
        return tuple(d.name for d in self.drives)

    @property
    def sensor_names(self) -> tuple[str, ...]:
        return tuple(s.name for s in self.sensors)

    @cached_property
    def gene_names(self) -> tuple[str, ...]:
        return tuple(g.name for g in self.genes)

    @cached_property
    def link_names(self) -> tuple[str, ...]:
        """``regulator>gene`` of every link."""
        return tuple(f"{link.regulator}>{g.name}" for g in self.genes for link in g.links)

    def gene(self, name: str) -> Gene:
        _known("gene", name, self.gene_names)
        return next(g for g in self.genes if g.name == name)

    @cached_property
    def digest(self) -> str:
        """Content address: equal networks, and only they, have equal digests."""
        return hashlib.sha256(repr(tuple(getattr(self, f.name) for f in fields(self))).encode()).hexdigest()

    @cached_property
    def noisy(self) -> bool:
        """Whether a sensor draws random numbers."""
        return any(s.noise or s.dropout for s in self.sensors)

    def with_gene(self, name: str, **changes: Any) -> GeneNetwork:
        self.gene(name)
        return replace(self, genes=tuple(replace(g, **changes) if g.name == name else g for g in self.genes))

    def without_link(self, name: str) -> GeneNetwork:
        """The network in which the regulator of the link ``regulator>gene`` binds no more to the promoter of the gene."""
        _known("link", name, self.link_names)
        regulator, _, target = name.partition(">")

        def cut(links: tuple[Link, ...]) -> tuple[Link, ...]:
            return tuple(replace(k, half=math.inf) if k.regulator == regulator else k for k in links)

        gene = self.gene(target)
        modules = (replace(m, activators=cut(m.activators), deactivators=cut(m.deactivators)) for m in gene.modules)
        return self.with_gene(target, modules=tuple(modules))

    def __getstate__(self) -> dict[str, Any]:
        # Cached look-ups are rebuilt where they are needed.
        return {f.name: getattr(self, f.name) for f in fields(self)}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)


def _known(what: str, name: str, names: Any) -> None:
    if name not in names:
        raise NetworkError(f"{what}: there is no {quoted(name)}; {did_you_mean(name, names)}")
