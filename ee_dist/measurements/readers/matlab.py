"""MATLAB's files as columns: structs and arrays of them, old format and new."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers.arrays import in_one_line, recorded
from ee_dist.measurements.readers.hdf5 import read_hdf5
from ee_dist.measurements.readers.options import Options, bounded
from ee_dist.measurements.table import Recorded


def read_mat(file: Path, options: Options) -> tuple[Recorded, ...]:
    """MATLAB's files to version 7 by SciPy, 7.3 by h5py. Structs are columns ``run.q``, arrays of structs trials.

    Raises MeasurementError.
    """
    from scipy import io  # slow to load, and needed only here

    try:
        sizes = [float(np.prod(shape, dtype=float)) for _, shape, _ in io.whosmat(str(file))]
        bounded(file, 8 * sum(sizes))
        content = io.loadmat(str(file), simplify_cells=True, verify_compressed_data_integrity=True)
    except NotImplementedError:
        return read_hdf5(file, options)
    except MeasurementError:
        raise
    except OSError as error:
        if error.errno:
            raise
        raise MeasurementError(f"{file}: not a MATLAB file, or cut short: {in_one_line(error)}") from None
    except Exception as error:  # The parser raises what it stumbles upon.
        raise MeasurementError(f"{file}: not a MATLAB file, or cut short: {in_one_line(error)}") from None
    flat: dict[str, Any] = {}
    trials: dict[str, list[dict[str, Any]]] = {}
    _flatten({k: v for k, v in content.items() if not k.startswith("__")}, "", flat, trials, 0)
    if trials:
        name, runs = max(trials.items(), key=lambda item: len(item[1]))
        found = []
        for k, run in enumerate(runs):
            inner: dict[str, Any] = {}
            _flatten(run, "", inner, {}, 0)
            found.append(recorded(file, f"{name} {k + 1}", inner))
        return tuple(found)
    if not any(np.asarray(v).dtype.kind in "fiub" for v in flat.values()):
        raise MeasurementError(
            f"{file}: no arrays of numbers in it (timeseries, tables and objects are not read): save arrays or structs of arrays"
        )
    return (recorded(file, "", flat),)


def _flatten(data: Mapping[str, Any], before: str, into: dict[str, Any], trials: dict[str, Any], depth: int) -> None:
    for key, value in data.items():
        name = f"{before}{key}"
        if isinstance(value, Mapping) and depth < 6:
            _flatten(value, f"{name}.", into, trials, depth + 1)
        elif (
            isinstance(value, (list, np.ndarray))
            and len(np.shape(value)) == 1
            and len(value)
            and isinstance(value[0], Mapping)
        ):
            trials[name] = list(value)
        elif isinstance(value, (str, int, float, bool)) or (
            isinstance(value, np.ndarray) and value.dtype.kind in "fiub"
        ):
            into[name] = value
