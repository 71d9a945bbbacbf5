"""HDF5: data sets as columns, groups in their names; groups that are called trials and are built alike are trials."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers.arrays import TRIAL, recorded
from ee_dist.measurements.readers.needs import needed
from ee_dist.measurements.readers.options import Options, bounded
from ee_dist.measurements.table import WIDEST, Recorded


def read_hdf5(file: Path, options: Options) -> tuple[Recorded, ...]:
    """Raises MeasurementError. Links to other files are not followed, and nothing is read from beside the file."""
    h5py = needed("h5py", "hdf5", file)
    try:
        with h5py.File(file, "r") as source:
            arrays, notes = _arrays(h5py, source, file)
    except MeasurementError:
        raise
    except FileNotFoundError:
        raise
    except Exception as error:  # The library raises OSError, RuntimeError, KeyError, ... for what is damaged.
        raise MeasurementError(
            f"{file}: not an HDF5 file, or cut short: {' '.join(str(error).split())[:120]}"
        ) from None
    if not arrays:
        raise MeasurementError(f"{file}: no data sets of numbers in it{'; ' + notes[0] if notes else ''}")
    trials: dict[str, dict[str, Any]] = {}
    rest: dict[str, Any] = {}
    for path, array in arrays.items():
        parts = path.split("/")
        place = next((k for k, p in enumerate(parts[:-1]) if TRIAL.match(p)), None)
        if place is None:
            rest[".".join(parts)] = array
        else:
            trials.setdefault("/".join(parts[: place + 1]), {})[".".join(parts[place + 1 :])] = array
    if len(trials) > 1 or (trials and not rest):
        names = sorted(trials, key=lambda t: [int(p) if p.isdigit() else p for p in _pieces(t)])
        return tuple(
            recorded(file, n.rsplit("/", 1)[-1], trials[n], notes if not k else ()) for k, n in enumerate(names)
        )
    merged = rest | {f"{t.replace('/', '.')}.{k}": a for t, group in trials.items() for k, a in group.items()}
    return (recorded(file, "", merged, notes),)


def _pieces(name: str) -> list[str]:
    import re

    return re.findall(r"\d+|\D+", name)


def _arrays(h5py: Any, source: Any, file: Path) -> tuple[dict[str, Any], tuple[str, ...]]:
    """Every data set of numbers by its path; each object once, whatever links to it."""
    found: dict[str, Any] = {}
    notes: list[str] = []
    total = 0.0

    def visit(path: str, item: Any) -> None:
        nonlocal total
        if not isinstance(item, h5py.Dataset) or path.startswith("#refs#"):
            return
        if item.external or item.is_virtual:
            notes.append(f"{path}: left out, its numbers stand in other files")
            return
        if (texts := _texts(h5py, source, item)) is not None:
            found[path] = texts
            return
        numeric = item.dtype.kind in "fiub"
        if not numeric and item.dtype.names is None:
            return
        if item.attrs.get("MATLAB_class", b"") in (b"char", b"cell"):
            return
        # The library takes memory for whole pieces, whatever it then finds of them.
        pieces = item.chunks or ()
        if pieces and len(pieces) != item.ndim:
            raise MeasurementError(
                f"{file}: {path}: its pieces have {len(pieces)} dimensions and it has {item.ndim}: damaged"
            )
        bounded(file, float(np.prod(pieces, dtype=float)) * item.dtype.itemsize)
        total += float(np.prod(item.shape, dtype=float)) * item.dtype.itemsize
        bounded(file, total)
        if item.dtype.names is not None and item.ndim == 1:
            rows = item[()]
            for n in item.dtype.names:
                if rows[n].dtype.kind in "fiub":
                    found[f"{path}/{n}"] = rows[n]
        elif numeric:
            found[path] = item[()]

    source.visititems(visit)
    return found, tuple(notes)


def _texts(h5py: Any, source: Any, item: Any) -> Any:
    """The texts of a cell of MATLAB's, which refers to arrays of characters in the same file; None for anything else."""
    if item.attrs.get("MATLAB_class", b"") != b"cell" or not h5py.check_ref_dtype(item.dtype) or item.size > WIDEST:
        return None
    cells = [source[r] for r in item[()].ravel() if r]
    if not cells or not all(c.attrs.get("MATLAB_class", b"") == b"char" and c.size <= WIDEST for c in cells):
        return None
    return np.array(["".join(map(chr, c[()].T.ravel())) for c in cells])
