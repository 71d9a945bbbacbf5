"""Opening and closing a rerun recording: fixed identity, fixed blueprint ids, whole files only."""

from __future__ import annotations

import errno
import hashlib
import os
import re
import threading
import uuid
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ee_dist.recording.clock import SECOND_NS, RunClock, offsets_ns
from ee_dist.trials.log import Array, SensorLog

RUN_TIME = "run_time"
"""The timeline of every scene: seconds, trials one after another."""
_SYSTEM = re.compile(r"([^:]*)\(os error (\d+)\)")
"""How rerun words an error of the system."""
STALLED_S = 20.0
"""After so long without a byte written a file is given up."""
GIVEN_UP: list[rr.RecordingStream] = []
"""Recordings that could not be ended: kept, for what is dropped would be waited for, as would be at the end of the process."""
_IDS = uuid.UUID("6b1f3a52-7c1e-5d0a-9f57-1d2c0f6e8a34")


@contextmanager
def recording(
    path: str | Path, application: str, identity: Sequence[str], title: str, blueprint: rrb.Blueprint
) -> Iterator[rr.RecordingStream]:
    """A recording that becomes ``path`` when the block ends well.

    ``identity`` decides its id: equal content, equal id, and a viewer does not mix two runs.
    """
    target = Path(path)
    target.parent.mkdir(parents=True, exist_ok=True)
    part = target.with_name(target.name + ".part")
    name = hashlib.sha256("\x00".join(identity).encode()).hexdigest()[:32]
    # Without the properties that rerun would send by itself: they hold the time of day.
    stream = rr.RecordingStream(application, recording_id=name, send_properties=False)
    _fix_ids(blueprint)
    try:
        with _writing(target):
            stream.save(part)
        stream.send_blueprint(blueprint)
        stream.send_recording_name(title)
        yield stream
        with _writing(target):
            _flushed(stream, part)
            _ended(stream)
        os.replace(part, target)
    except BaseException:
        with suppress(RuntimeError):
            _ended(stream)
        with suppress(OSError):
            part.unlink(missing_ok=True)
        raise


def _flushed(stream: rr.RecordingStream, part: Path) -> None:
    """Waits until all is in the file, as long as it grows: rerun's writer may have ended at a full disk without a word, and who
    waits for it then waits for ever. Raises RuntimeError."""
    size = -1
    while True:
        try:
            stream.flush(timeout_sec=STALLED_S)
            return
        except RuntimeError:
            before, size = size, part.stat().st_size if part.exists() else 0
            if size == before:
                raise


def _ended(stream: rr.RecordingStream) -> None:
    """Lets go of the file, which rerun may wait for ever to do, too. Raises RuntimeError."""
    failed: list[RuntimeError] = []

    def end() -> None:
        try:
            stream.disconnect()
        except RuntimeError as error:
            failed.append(error)

    if stream in GIVEN_UP:
        return
    ending = threading.Thread(target=end, daemon=True)
    ending.start()
    ending.join(STALLED_S)
    if ending.is_alive():
        GIVEN_UP.append(stream)
        raise RuntimeError("rerun does not let go of the file")
    if failed:
        raise failed[0]


@contextmanager
def _writing(target: Path) -> Iterator[None]:
    """Rerun says RuntimeError for what the system refused, such as a full disk; here it is an OSError again."""
    try:
        yield
    except RuntimeError as error:
        found = _SYSTEM.search(str(error))
        number, why = (int(found[2]), found[1].strip()) if found else (errno.EIO, "the disk may be full")
        raise OSError(number, why, str(target)) from error


def times(seconds: Array) -> rr.TimeColumn:
    """A column of run times, rounded to the microsecond so that equal steps stay equal."""
    micro = np.round(np.asarray(seconds) * 1e6).astype(np.int64)
    return rr.TimeColumn(RUN_TIME, duration=(micro * 1000).astype("timedelta64[ns]"))


def seconds_of(log: SensorLog) -> Array:
    """Times (T,) of the rows since the first, s: the same as in an MCAP recording."""
    return offsets_ns(log.times_s) / SECOND_NS


def interval_s(log: SensorLog) -> float:
    """How long a trial lasts on the timeline: to the end of its last step."""
    seconds = seconds_of(log)
    return float(seconds[-1] + seconds[-1] / max(len(seconds) - 1, 1)) if len(seconds) else 0.0


def starts_of(trials: Sequence[tuple[int, Sequence[SensorLog]]]) -> list[float]:
    """When each trial begins, s, on the clock that recordings use: (index, its logs) in, one start for each out.

    In a recording the generations of the search take 10 ms each between trials; here they take none, so that only
    trials and the pauses between them fill the play bar.
    """
    clock = RunClock()
    lengths = [max((int(offsets_ns(g.times_s).max(initial=0)) for g in logs), default=0) for _, logs in trials]
    return [clock.trial(index, length) / SECOND_NS for (index, _), length in zip(trials, lengths, strict=True)]


def log_digest(log: SensorLog) -> str:
    """Content address of a log, for the identity of a recording."""
    state = hashlib.sha256(repr((log.sensor_names, log.motor_names)).encode())
    for array in (log.times_s, log.sensors, log.commands, log.base_pose, log.joints):
        state.update(b"-" if array is None else np.ascontiguousarray(array).tobytes())
    return state.hexdigest()


def _fix_ids(blueprint: rrb.Blueprint) -> None:
    """Give views and containers the same ids in every file: rerun draws them at random."""

    def walk(node: rrb.Container | rrb.View, place: str) -> None:
        node.id = uuid.uuid5(_IDS, place)
        if isinstance(node, rrb.Container):
            for k, child in enumerate(node.contents):
                walk(child, f"{place}/{k}")

    if hasattr(blueprint, "root_container"):
        walk(blueprint.root_container, "root")
