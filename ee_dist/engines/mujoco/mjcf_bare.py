"""MuJoCo's model of an MJCF without what costs memory and says nothing of a motion.

Geometry that only shows, textures and height fields are taken out before anything of them is read.
"""

from __future__ import annotations

import math
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mujoco

from ee_dist.basics.files import real
from ee_dist.basics.quoted import quoted
from ee_dist.engines.mujoco.warned import no_file_of_warnings
from ee_dist.robots.model import RobotError
from ee_dist.robots.xml import XmlError, read_xml

MOST_COPIES = 10_000
"""Elements that one of the elements that make copies may stand for, those around it multiplied."""
MOST_HEIGHTS = 4_000_000
"""Of a height field: MuJoCo takes memory for them while it reads."""
COPIERS = ("replicate", "composite", "flexcomp")
INCLUDES_DEEP = 20
_MESH = mujoco.mjtGeom.mjGEOM_MESH


class MjcfError(RobotError):
    """An MJCF that cannot be used; one line: the file, what is wrong and what would be right."""


def compiled(path: str | Path) -> Any:
    """MuJoCo's model of the file without what only shows. Raises MjcfError."""
    return bare_model(path)[0]


def bare_model(path: str | Path) -> tuple[Any, Counter[int], bool]:
    """The same; by body how many shapes were taken out that touch; and whether the file, or one that it includes, says in what
    steps it is to be simulated. Raises MjcfError."""
    file = Path(path)
    no_file_of_warnings()
    try:
        stepped = _scan(file, file.parent, (), 1)
    except XmlError as error:
        raise MjcfError(str(error)) from None
    try:
        return *_built(file, every_mesh=False), stepped
    except (ValueError, RuntimeError, MemoryError) as first:
        # A sensor may name a mesh that weighs nothing.
        try:
            return *_built(file, every_mesh=True), stepped
        except (ValueError, RuntimeError, MemoryError) as error:
            told = error if "mass" in str(first) or "inertia" in str(first) else first
            raise MjcfError(f"{file}: MuJoCo cannot build it: {' '.join(str(told).split())}") from None


def _scan(file: Path, folder: Path, above: tuple[Path, ...], copies: int) -> bool:
    """Look through a file and all that it names before MuJoCo reads it: whether any names a time step. Raises XmlError."""
    here = real(file)
    if here in above or len(above) > INCLUDES_DEEP:
        raise XmlError(f"{above[0] if above else file}: {file.name} includes itself")
    root, _ = read_xml(file, "an MJCF")
    if not above and root.tag != "mujoco":
        raise XmlError(f"{file}: the outermost element is <{root.tag}>; an MJCF begins with <mujoco>")
    waiting, stepped = [(root, copies)], False
    while waiting:
        element, many = waiting.pop()
        if element.tag in COPIERS:
            many *= _count(element)
            if many > MOST_COPIES:
                raise XmlError(f"{file}: <{element.tag}> stands for more than {MOST_COPIES} elements")
        if element.tag == "hfield" and _product(element, "nrow", "ncol") > MOST_HEIGHTS:
            raise XmlError(
                f"{file}: <hfield> of more than {MOST_HEIGHTS:g} heights, none of which says anything of a motion here"
            )
        name = element.get("file")
        if element.tag in ("include", "model") and name:
            if not real(folder / name).is_relative_to(real(folder)):
                raise XmlError(
                    f"{file}: <{element.tag} file={quoted(name)}> lies outside of its folder; put it beside the file"
                )
            stepped |= _scan(folder / name, folder, (*above, here), many)
        stepped |= element.tag == "option" and element.get("timestep") is not None
        waiting += [(child, many) for child in element]
    return stepped


def _count(element: ET.Element) -> int:
    return _product(element, "count")


def _product(element: ET.Element, *names: str) -> int:
    total = 1.0
    for text in " ".join(element.get(name) or "1" for name in names).split():
        try:
            total *= max(1.0, float(text))
        except ValueError:
            return 1  # MuJoCo says what is wrong
    return int(min(total, 1e9)) if total == total else 1


def _built(file: Path, every_mesh: bool) -> tuple[Any, Counter[int]]:
    taken: list[Any] = []
    m = _bare(file, every_mesh, taken).compile()
    return m, Counter(int(body.id) for body in taken)


def _bare(file: Path, every_mesh: bool, taken: list[Any]) -> Any:
    """The file's specification without what costs memory and says nothing of a motion. Of meshes, those stay that weigh; with
    ``every_mesh`` all that do not only show. ``taken`` gets the body of each shape that touches and does not stay."""
    spec = mujoco.MjSpec.from_file(str(file))
    spec.memory = spec.nstack = spec.njmax = spec.nconmax = -1
    spec.nuserdata = 0
    lost = _lost_meshes(spec, file)
    unwanted = (mujoco.mjtGeom.mjGEOM_HFIELD, mujoco.mjtGeom.mjGEOM_SDF)
    for geom in list(spec.geoms):
        if geom.type in unwanted or (geom.type == _MESH and not _kept(spec, geom, lost, every_mesh)):
            if geom.contype or geom.conaffinity:
                taken.append(geom.parent)
            spec.delete(geom)
        else:
            geom.material = ""
    if not every_mesh:
        for item in (*spec.pairs, *spec.skins):
            spec.delete(item)
    for group in (spec.hfields, spec.numerics, spec.materials, spec.textures):
        for item in list(group):
            spec.delete(item)
    named = {geom.meshname for geom in spec.geoms}
    for mesh in list(spec.meshes):
        if not every_mesh and mesh.name not in named:
            spec.delete(mesh)
        elif mesh.name in lost:
            raise ValueError(f"no mesh {lost[mesh.name]}, and no <inertial> for the body that it is of")
    for item in (*spec.sites, *spec.tendons):
        item.material = ""
    return spec


def _lost_meshes(spec: Any, file: Path) -> dict[str, Path]:
    """Meshes by name whose file is none."""
    folder = file.parent / spec.meshdir
    files = {m.name: folder / (Path(m.file).name if spec.strippath else m.file) for m in spec.meshes if m.file}
    return {name: path for name, path in files.items() if not path.is_file()}


def _kept(spec: Any, geom: Any, lost: Mapping[str, Path], every_mesh: bool) -> bool:
    """Whether a mesh is wanted: because it weighs, or because it touches and all that do are. What weighs on a bolted body moves
    nothing, so that there a lost file is no loss."""
    if _weighs(spec, geom):
        return geom.meshname not in lost or _moves(geom.parent)
    shown_only = not geom.contype and not geom.conaffinity and geom.parent.explicitinertial
    return every_mesh and not shown_only


def _weighs(spec: Any, geom: Any) -> bool:
    """Whether a geom is part of what its body weighs."""
    by_geoms = spec.compiler.inertiafromgeom
    low, high = spec.compiler.inertiagrouprange
    never, always = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_FALSE, mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
    if geom.parent.name == "world" or by_geoms == never or not low <= geom.group <= high:
        return False
    massless = geom.mass == 0 or (math.isnan(geom.mass) and geom.density == 0)
    return not massless and (by_geoms == always or not geom.parent.explicitinertial)


def _moves(body: Any) -> bool:
    """Whether a joint carries the body."""
    while body is not None and not list(body.joints):
        body = body.parent
    return body is not None
