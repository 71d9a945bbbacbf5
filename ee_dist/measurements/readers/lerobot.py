"""LeRobot's data sets (v3.0; v2.x has the same tables): plain Parquet, one trial an episode, even rows.

``observation.state`` and ``action`` are lists; their names stand in ``meta/info.json``, as does the rate.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.basics.quoted import quoted
from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers.options import Options
from ee_dist.measurements.readers.parquet import columns_of
from ee_dist.measurements.table import WIDEST, Recorded, Table

INFO = Path("meta") / "info.json"
_KEPT = ("frame_index", "episode_index", "timestamp")
TIME = "seconds"


def is_lerobot(folder: Path) -> bool:
    return (folder / INFO).is_file()


def read_lerobot(folder: Path, options: Options) -> tuple[Recorded, ...]:
    """The episodes. Raises MeasurementError."""
    info = _info(folder / INFO)
    features, fps = info["features"], float(info["fps"])
    series = {str(k): f for k, f in features.items() if isinstance(f, Mapping) and _is_series(f)}
    files = sorted((folder / "data").glob("chunk-*/*.parquet"))
    if not files:
        raise MeasurementError(f"{folder}: no data/chunk-*/*.parquet in it; only the description has arrived")
    parts = [columns_of(f, [*series, *_KEPT])[0] for f in files]
    names = [n for n in (*series, *_KEPT) if all(n in p for p in parts)]
    if "episode_index" not in names:
        raise MeasurementError(f"{files[0]}: no column 'episode_index'; is it a LeRobot data set?")
    try:
        whole = {n: np.concatenate([np.asarray(p[n]) for p in parts]) for n in names}
        episodes = whole["episode_index"].astype(int).reshape(-1)
    except (ValueError, TypeError):
        raise MeasurementError(f"{folder}: the files of its data do not have the same columns") from None
    header = {"fps": fps, "robot_type": str(info.get("robot_type") or "unknown"), "format": "lerobot"}
    named = {n: _names(f) for n, f in series.items()}
    starts = np.flatnonzero(np.r_[True, np.diff(episodes) != 0])
    found = []
    for a, b in zip(starts, [*starts[1:], len(episodes)], strict=True):
        columns = {n: v[a:b] for n, v in whole.items() if n != "episode_index"}
        frame = columns.get("frame_index", np.arange(b - a)).astype(float).reshape(-1)
        columns = {TIME: (frame - frame[0]) / fps, **columns}
        table = Table(folder, columns, header, clock=TIME, parts={n: p for n, p in named.items() if p}, rate_hz=fps)
        found.append(Recorded(f"episode {episodes[a]}", (table,)))
    return tuple(found)


def _info(file: Path) -> dict[str, Any]:
    try:
        info = json.loads(file.read_text(encoding="utf-8"))
    except (ValueError, RecursionError, UnicodeDecodeError):
        raise MeasurementError(f"{file}: not JSON; is the data set whole?") from None
    if not isinstance(info, dict) or not isinstance(info.get("features"), dict):
        raise MeasurementError(f"{file}: no 'features' in it; is it a LeRobot data set?")
    fps = info.get("fps")
    if isinstance(fps, bool) or not isinstance(fps, (int, float)) or not 0 < fps < 1e5:
        raise MeasurementError(f"{file}: fps: expected a positive number, not {quoted(fps)}")
    return info


def _is_series(feature: Mapping[str, Any]) -> bool:
    shape = feature.get("shape") or [1]
    numeric = str(feature.get("dtype", "")).startswith(("float", "int"))
    return numeric and isinstance(shape, list) and len(shape) == 1 and isinstance(shape[0], int) and shape[0] <= WIDEST


def _names(feature: Mapping[str, Any]) -> tuple[str, ...]:
    """The names of a list's numbers: a list, or a list inside a mapping or another list."""
    names = feature.get("names")
    while isinstance(names, (Mapping, list)) and len(names) == 1:
        names = next(iter(names.values() if isinstance(names, Mapping) else names))
    width = (feature.get("shape") or [1])[0]
    if isinstance(names, list) and len(names) == width and all(isinstance(n, str) for n in names) and width > 1:
        return tuple(names)
    return ()
