"""A recording that rerun cannot end is given up, in bounded time: its writer may be gone, and it waits for that for ever."""

from __future__ import annotations

import threading
from pathlib import Path

import pytest

from ee_dist.viewing import stream


class Stuck:
    """Does not come back from what it is told; the file does not grow."""

    def __init__(self) -> None:
        self.flushed = 0

    def flush(self, timeout_sec: float) -> None:
        self.flushed += 1
        raise RuntimeError("timeout")

    def disconnect(self) -> None:
        threading.Event().wait(60)


def test_what_rerun_does_not_end_is_given_up(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stream, "STALLED_S", 0.05)
    monkeypatch.setattr(stream, "GIVEN_UP", [])
    stuck, part = Stuck(), tmp_path / "a.rrd.part"
    part.write_bytes(b"half")
    with pytest.raises(RuntimeError, match="timeout"):
        stream._flushed(stuck, part)  # type: ignore[arg-type]
    assert stuck.flushed == 2, "once more, in case it is only slow"
    with pytest.raises(RuntimeError, match="does not let go"):
        stream._ended(stuck)  # type: ignore[arg-type]
    assert len(stream.GIVEN_UP) == 1 and stream.GIVEN_UP[0] is stuck
    stream._ended(stuck)  # type: ignore[arg-type]  # and nobody waits again
