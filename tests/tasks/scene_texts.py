"""What a scene says."""

from __future__ import annotations

from pathlib import Path

from rerun.chunk import RrdReader


def text_of(scene: Path) -> list[str]:
    """The texts of a scene."""
    found = []
    for chunk in RrdReader(scene).stream():
        batch = chunk.to_record_batch()
        for name in batch.schema.names:
            if "TextDocument:text" in name:
                found += [t for cell in batch.column(name).to_pylist() for t in cell or []]
    assert found, scene
    return found
