"""Reads MATLAB's files in a process of its own: SciPy's parser ends its process (a segmentation fault) on some damaged ones.

    python matlab_apart.py MOST_BYTES

Paths come in, one a line; for each goes out the length of an answer (8 bytes, little end first) and the answer, an archive of
NumPy: ``said`` is JSON, the rest are arrays that it names by their number. It ends when nobody asks any more.
"""

import contextlib
import io
import json
import resource
import struct
import sys
from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.io import loadmat, whosmat

DEEPEST = 6


def answer(path: str, most_bytes: int) -> bytes:
    arrays: list[Any] = []
    try:
        said = _content(path, most_bytes, arrays)
    except NotImplementedError:
        said = {"newer": True}
    except OSError as error:
        said = {"errno": error.errno, "error": str(error)}
    except Exception as error:  # The parser raises what it stumbles upon.
        said = {"error": str(error) or type(error).__name__}
    out = io.BytesIO()
    np.savez(out, said=np.frombuffer(json.dumps(said).encode(), np.uint8), **{str(k): a for k, a in enumerate(arrays)})
    return out.getvalue()


def _content(path: str, most_bytes: int, arrays: list[Any]) -> dict[str, Any]:
    size = _size(path)
    if size > most_bytes:
        return {"size": size}
    content = loadmat(path, simplify_cells=True, verify_compressed_data_integrity=True)
    flat: dict[str, Any] = {}
    trials: dict[str, list[Mapping[str, Any]]] = {}
    _flatten({k: v for k, v in content.items() if not k.startswith("__")}, "", flat, trials, 0)
    if not trials:
        return {"trials": [["", _told(flat, arrays)]]}
    name, runs = max(trials.items(), key=lambda item: len(item[1]))
    told = []
    for k, run in enumerate(runs):
        inner: dict[str, Any] = {}
        _flatten(run, "", inner, {}, 0)
        told.append([f"{name} {k + 1}", _told(inner, arrays)])
    return {"trials": told}


def _size(path: str) -> float:
    """Bytes of all arrays; 0 where SciPy cannot tell, as beside an object of MATLAB's (a timeseries), which has no shape: then
    what this process may take at most is the bound."""
    try:
        return 8 * sum(float(np.prod(shape, dtype=float)) for _, shape, _ in whosmat(path))
    except TypeError:
        return 0.0


def _flatten(data: Mapping[str, Any], before: str, into: dict[str, Any], trials: dict[str, Any], depth: int) -> None:
    for key, value in data.items():
        name = f"{before}{key}"
        if isinstance(value, Mapping) and depth < DEEPEST:
            _flatten(value, f"{name}.", into, trials, depth + 1)
        elif (
            isinstance(value, (list, np.ndarray))
            and len(np.shape(value)) == 1
            and len(value)
            and all(isinstance(v, Mapping) for v in value)
        ):
            trials[name] = list(value)
        elif isinstance(value, (str, int, float, bool)) or (
            isinstance(value, np.ndarray) and value.dtype.kind in "fiub"
        ):
            into[name] = value
        elif (texts := _texts(value)) is not None:
            into[name] = texts


def _texts(value: Any) -> tuple[str, ...] | None:
    """The texts of a cell or of an array of characters; None where there are others."""
    cells = np.ravel(np.asarray(value, dtype=object)).tolist() if isinstance(value, (list, np.ndarray)) else []
    return tuple(cells) if cells and all(isinstance(c, str) for c in cells) else None


def _told(flat: Mapping[str, Any], arrays: list[Any]) -> dict[str, Any]:
    """Names to [number of an array], to {"texts": [...]}, or to a text or number as it is."""
    told: dict[str, Any] = {}
    for name, value in flat.items():
        if isinstance(value, np.ndarray):
            told[name] = [len(arrays)]
            arrays.append(value)
        elif isinstance(value, tuple):
            told[name] = {"texts": value}
        else:
            told[name] = value
    return told


def main() -> None:
    most_bytes = int(sys.argv[1])
    with contextlib.suppress(ValueError, OSError):
        resource.setrlimit(resource.RLIMIT_AS, (4 * most_bytes, 4 * most_bytes))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    for line in sys.stdin:
        found = answer(json.loads(line), most_bytes)
        sys.stdout.buffer.write(struct.pack("<Q", len(found)) + found)
        sys.stdout.buffer.flush()


if __name__ == "__main__":
    main()
