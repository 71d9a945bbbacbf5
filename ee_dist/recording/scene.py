"""The solids of a robot as a Foxglove scene: once a trial, each in the frame of its part, so that a viewer sees a robot.

A picture, not data, as are the transforms that move it. Hardware is solid, what models say is see-through.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ee_dist.recording.clock import SECOND_NS
from ee_dist.recording.records import HARDWARE, HINDSIGHT, PREDICTION
from ee_dist.recording.schemas import SceneEntity, SceneUpdate
from ee_dist.recording.topics import part_frame
from ee_dist.robots.model import Robot, Shape
from ee_dist.robots.pictured import solids_of, turned

COLOURS = {
    HARDWARE: (0.34, 0.61, 0.90, 1.0),
    PREDICTION: (1.0, 0.65, 0.15, 0.35),
    HINDSIGHT: (0.70, 0.58, 1.0, 0.35),
}
"""Blue, orange, violet (red, green, blue, opacity), as in the scenes of rerun."""


def scene_message(model: Robot, source: str, start_ns: int, length_ns: int) -> Any:
    """The ``SceneUpdate`` of a trial: a solid of a part that the model has lost is not there when the last one's time is over."""
    stamp = {"seconds": start_ns // SECOND_NS, "nanos": start_ns % SECOND_NS}
    lifetime = {"seconds": length_ns // SECOND_NS, "nanos": length_ns % SECOND_NS}
    colour = dict(zip("rgba", COLOURS[source], strict=True))
    entities = []
    for part in model.parts:
        if part.name in model.lost:
            continue
        frame = part_frame(source, part.name)
        solids = _Solids(colour)
        for solid in solids_of(model, part):
            solids.add(solid.shape)
        entities.append(
            SceneEntity(timestamp=stamp, frame_id=frame, id=frame, lifetime=lifetime, frame_locked=True, **solids.kinds)
        )
    return SceneUpdate(entities=entities)


class _Solids:
    """Gathers the primitives of a part. A capsule is a cylinder with a ball at each end."""

    def __init__(self, colour: dict[str, float]) -> None:
        self.colour = colour
        self.kinds: dict[str, list[Any]] = {"cubes": [], "spheres": [], "cylinders": []}

    def add(self, shape: Shape) -> None:
        if shape.kind == "box":
            self._put("cubes", shape, shape.position_m, [2 * half for half in shape.size])
            return
        radius = shape.size[0]
        if shape.kind == "sphere":
            self._put("spheres", shape, shape.position_m, [2 * radius] * 3)
            return
        length = shape.size[1]
        self._put(
            "cylinders", shape, shape.position_m, [2 * radius, 2 * radius, length], bottom_scale=1.0, top_scale=1.0
        )
        if shape.kind == "capsule":
            for sign in (-0.5, 0.5):
                end = np.array(shape.position_m) + turned(shape.rotation, (0.0, 0.0, sign * length))
                self._put("spheres", shape, end.tolist(), [2 * radius] * 3)

    def _put(self, kind: str, shape: Shape, position: Any, size: Any, **more: float) -> None:
        xyz = ("x", "y", "z")
        pose = {
            "position": dict(zip(xyz, position, strict=True)),
            "orientation": dict(zip((*xyz, "w"), shape.rotation, strict=True)),
        }
        self.kinds[kind].append({"pose": pose, "size": dict(zip(xyz, size, strict=True)), "color": self.colour, **more})
