"""Opening a recording never blocks and never crashes, with a screen or without."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from ee_dist.viewing import viewer
from ee_dist.viewing.headless import ViewerError


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(viewer, "has_display", lambda: True)


def test_without_a_screen_it_says_what_to_run(
    rrd: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("sys.platform", "linux")
    monkeypatch.delenv("DISPLAY", raising=False)
    monkeypatch.delenv("WAYLAND_DISPLAY", raising=False)
    monkeypatch.setattr(viewer, "viewer_binary", lambda: pytest.fail("no viewer may start"))
    assert viewer.open_viewer(rrd) is False
    assert f"rerun {rrd}" in capsys.readouterr().out


@pytest.mark.skipif(os.name != "posix", reason="the stand-in for the viewer is a shell script")
@pytest.mark.usefixtures("screen")
def test_with_a_screen_the_viewer_starts_and_is_not_waited_for(
    rrd: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    stand_in = tmp_path / "viewer"
    stand_in.write_text(
        f"#!/bin/sh\nwhile [ ! -e {tmp_path}/seen ]; do sleep 0.02; done\n"
        f'echo "$1" > {tmp_path}/asked.tmp\nmv {tmp_path}/asked.tmp {tmp_path}/asked\n'
    )
    stand_in.chmod(0o755)
    monkeypatch.setattr(viewer, "viewer_binary", lambda: stand_in)
    assert viewer.open_viewer(rrd) is True
    # The stand-in runs until it sees this: had it been waited for, we would not be here.
    (tmp_path / "seen").touch()
    for _ in range(500):
        if (tmp_path / "asked").exists():
            break
        time.sleep(0.02)
    assert (tmp_path / "asked").read_text().strip() == str(rrd)


@pytest.mark.usefixtures("screen")
def test_a_viewer_that_is_not_there_is_a_message(
    rrd: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def missing() -> Path:
        raise ViewerError("the rerun viewer is not installed")

    monkeypatch.setattr(viewer, "viewer_binary", missing)
    assert viewer.open_viewer(rrd) is False
    assert "not installed" in capsys.readouterr().out


@pytest.mark.usefixtures("screen")
def test_a_recording_that_is_not_there_is_a_message(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert viewer.open_viewer(tmp_path / "none.rrd") is False
    assert "no such recording" in capsys.readouterr().out
