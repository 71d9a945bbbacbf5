"""MATLAB's files as columns: structs and arrays of them, old format and new."""

from __future__ import annotations

import io
import json
import struct
import subprocess
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np

from ee_dist.measurements.errors import MeasurementError
from ee_dist.measurements.readers.arrays import recorded
from ee_dist.measurements.readers.hdf5 import read_hdf5
from ee_dist.measurements.readers.options import MOST_BYTES, Options, bounded
from ee_dist.measurements.table import Recorded

PATIENCE_S = 300.0
"""For one file, loading SciPy included."""
_LENGTH = struct.Struct("<Q")
_APART = Path(__file__).with_name("matlab_apart.py")
_reader: list[subprocess.Popen[bytes]] = []
_one_at_a_time = threading.Lock()


def read_mat(file: Path, options: Options) -> tuple[Recorded, ...]:
    """MATLAB's files to version 7 by SciPy, 7.3 by h5py. Structs are columns ``run.q``, arrays of structs trials.

    SciPy reads in a process of its own, which some damaged files end. Raises MeasurementError.
    """
    file.open("rb").close()  # says what is wrong with the file itself
    said, arrays = _asked(file)
    if said.get("newer"):
        return read_hdf5(file, options)
    bounded(file, float(said.get("size", 0)))
    if "error" in said:
        what = " ".join(str(said["error"]).split())[:120]
        raise MeasurementError(f"{file}: not a MATLAB file, or cut short: {what}")
    found = []
    for name, told in said["trials"]:
        columns = {k: _value(v, arrays) for k, v in told.items()}
        if not any(np.asarray(v).dtype.kind in "fiub" for v in columns.values()):
            raise MeasurementError(
                f"{file}: no arrays of numbers in it (timeseries, tables and objects are not read): "
                "save arrays or structs of arrays"
            )
        found.append(recorded(file, name, columns))
    return tuple(found)


def _value(told: Any, arrays: list[Any]) -> Any:
    """What the other process said of an entry: an array by its number, texts, or what it is."""
    if isinstance(told, dict):
        return np.array(told["texts"], dtype=np.str_)
    return arrays[told[0]] if isinstance(told, list) else told


def _asked(file: Path) -> tuple[dict[str, Any], list[Any]]:
    """What the other process found, and the arrays that it names by number. Raises MeasurementError where it died of it."""
    with _one_at_a_time, _process() as process:
        assert process.stdin is not None and process.stdout is not None
        process.stdin.write(json.dumps(str(file.absolute())).encode() + b"\n")
        process.stdin.flush()
        impatience = threading.Timer(PATIENCE_S, process.kill)
        impatience.start()
        try:
            head = process.stdout.read(_LENGTH.size)
            length = _LENGTH.unpack(head)[0] if len(head) == _LENGTH.size else 0
            body = process.stdout.read(length) if length < 4 * MOST_BYTES else b""
        finally:
            impatience.cancel()
        if not length or len(body) < length:
            raise MeasurementError(f"{file}: damaged: what reads MATLAB's files (SciPy) crashed on it; save it again")
    with np.load(io.BytesIO(body), allow_pickle=False) as answer:
        said = json.loads(answer["said"].tobytes())
        return said, [answer[str(k)] for k in range(len(answer.files) - 1)]


@contextmanager
def _process() -> Iterator[subprocess.Popen[bytes]]:
    """The one that reads; kept for the next file, unless it died or somebody interrupted it."""
    if not _reader or _reader[0].poll() is not None:
        command = [sys.executable, "-I", str(_APART), str(MOST_BYTES)]
        pipe, nowhere = subprocess.PIPE, subprocess.DEVNULL
        _reader[:] = [subprocess.Popen(command, stdin=pipe, stdout=pipe, stderr=nowhere, start_new_session=True)]
    process = _reader[0]
    try:
        yield process
    except BaseException:
        process.kill()
        process.wait()
        for stream in (process.stdin, process.stdout):
            with suppress(OSError):
                if stream is not None:
                    stream.close()
        _reader.clear()
        raise
