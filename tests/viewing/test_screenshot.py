"""Pictures by the real viewer: it must find nothing to complain about, and be gone afterwards."""

from __future__ import annotations

import importlib.util
import struct
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import psutil
import pytest
import rerun as rr
import rerun.blueprint as rrb
from finding_samples import finding

from ee_dist.recording.records import RunRecord
from ee_dist.viewing import headless
from ee_dist.viewing.finding_scene import write_compare_rrd, write_explain_rrd, write_improve_rrd
from ee_dist.viewing.headless import HeadlessViewer, ViewerError, vulkan_devices
from ee_dist.viewing.screenshot import Picture, take_pictures
from ee_dist.viewing.trial_scene import write_trial_rrd

needs_vulkan = pytest.mark.skipif(
    vulkan_devices() == 0, reason="no Vulkan driver on this machine (Debian: mesa-vulkan-drivers libvulkan1)"
)
SIZE = (900, 600)


@pytest.fixture(autouse=True)
def _no_waiting_for_the_greeting(monkeypatch: pytest.MonkeyPatch) -> None:
    # These tests do not look at the corner where the viewer's greeting is.
    monkeypatch.setattr(headless, "GREETING_S", 0.0)


def size_of(png: bytes) -> tuple[int, int]:
    assert png.startswith(b"\x89PNG\r\n\x1a\n")
    width, height = struct.unpack(">II", png[16:24])
    return width, height


def viewers() -> set[int]:
    """Viewers that this process started."""
    return {p.pid for p in psutil.Process().children(recursive=True) if "rerun" in p.name()}


@needs_vulkan
def test_the_scene_of_a_run_has_no_view_errors_and_moves(rrd: Path) -> None:
    before = viewers()
    early, late, strip = [
        *take_pictures(rrd, [0.3, 3.8], size=SIZE),
        *take_pictures(rrd, [0.3], size=SIZE, view="Result"),
    ]
    for picture in (early, late):
        assert picture.reports == ()
        assert size_of(picture.png) == SIZE
        assert len(picture.png) > 30_000, "a picture with so little in it shows no scene"
    assert {"Feet on the floor", "angle rear left", "Result"} <= set(early.views)
    assert early.png != late.png
    assert size_of(strip.png) < SIZE
    assert viewers() == before


@needs_vulkan
@pytest.mark.parametrize("write", [write_compare_rrd, write_explain_rrd, write_improve_rrd])
def test_the_scenes_of_the_verbs_have_no_view_errors(write: Callable[..., None], tmp_path: Path) -> None:
    robot = {write_compare_rrd: "linear_stage", write_explain_rrd: "arm", write_improve_rrd: "servo_pendulum"}[write]
    odd = "python -m ee_dist measured='\u6d4b\u8bd5 #1, na\u00efve.mcap'"
    write(replace(finding(robot), next_command=odd), tmp_path / "scene.rrd")
    (picture,) = take_pictures(tmp_path / "scene.rrd", [0.5], size=SIZE)
    assert picture.reports == ()
    assert len(picture.png) > 30_000
    assert "Result" in picture.views
    assert "Robot and model (play: where the error is largest)" in picture.views


@needs_vulkan
def test_the_scene_of_trials_has_no_view_errors(run: RunRecord, tmp_path: Path) -> None:
    write_trial_rrd(run, tmp_path / "trial.rrd")
    (picture,) = take_pictures(tmp_path / "trial.rrd", [0.5], size=SIZE)
    assert picture.reports == ()
    assert {"Trials", "Robot", "Angle", "Touch", "Commands (rad)"} <= set(picture.views)


@needs_vulkan
def test_what_a_view_complains_about_is_reported(tmp_path: Path) -> None:
    path = tmp_path / "wrong.rrd"
    stream = rr.RecordingStream("wrong", recording_id="wrong", send_properties=False)
    stream.save(path)
    stream.send_blueprint(rrb.Blueprint(rrb.Spatial3DView(origin="/", name="Wrong"), collapse_panels=True))
    stream.log("camera", rr.Pinhole(focal_length=1.0, width=3, height=3), static=True)
    stream.log("camera/image/point", rr.Points3D([[0.0, 0.0, 1.0]]), static=True)
    stream.set_time("run_time", duration=0.0)
    stream.log("other", rr.Points3D([[0.0, 0.0, 0.0]]))
    stream.disconnect()
    (picture,) = take_pictures(path, [0.0], size=(400, 300))
    assert any("pinhole" in r for r in picture.reports)


@needs_vulkan
def test_a_viewer_is_ended_by_an_error_too(rrd: Path) -> None:
    before = viewers()
    seen: list[set[int]] = []

    def look_for_nothing() -> None:
        with HeadlessViewer((400, 300)) as viewer:
            seen.append(viewers() - before)
            viewer.open(rrd)
            viewer.settled_picture("Nothing")

    with pytest.raises(ViewerError, match="no view named 'Nothing'; there are: "):
        look_for_nothing()
    assert [len(s) for s in seen] == [1]
    assert viewers() == before


@needs_vulkan
def test_a_view_behind_another_tab_is_said_to_be_there(rrd: Path) -> None:
    with pytest.raises(ViewerError, match=r"'Commands \(rad\)' is not on the screen"):
        take_pictures(rrd, [0.0], size=(400, 300), view="Commands (rad)")


@pytest.mark.parametrize("content", [b"", b"RR", b"not a recording at all", b"\x89MCAP0\r\n"])
def test_a_file_that_is_no_recording(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "wrong.rrd"
    path.write_bytes(content)
    with pytest.raises(ViewerError, match=r"cannot read .*wrong\.rrd"):
        take_pictures(path, [0.0], size=(400, 300))


def test_a_recording_that_is_not_there(tmp_path: Path) -> None:
    with pytest.raises(ViewerError, match="no such recording"):
        take_pictures(tmp_path / "none.rrd", [0.0], size=(400, 300))


def test_a_viewer_that_stops_at_its_start_says_why(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stand_in = tmp_path / "viewer"
    stand_in.write_text("#!/bin/sh\necho 'Error: No graphics adapter was found' >&2\nexit 1\n")
    stand_in.chmod(0o755)
    monkeypatch.setattr(headless, "viewer_binary", lambda: stand_in)
    with pytest.raises(ViewerError, match="No graphics adapter was found"), HeadlessViewer():
        pytest.fail("it cannot have started")


def test_no_vulkan_loader_means_no_devices(monkeypatch: pytest.MonkeyPatch) -> None:
    def missing(name: str) -> None:
        raise OSError(name)

    monkeypatch.setattr("ctypes.CDLL", missing)
    assert vulkan_devices() == 0


@pytest.fixture
def tool() -> ModuleType:
    path = Path(__file__).parents[2] / "tools" / "screenshot.py"
    spec = importlib.util.spec_from_file_location("screenshot_tool", path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def fake(reports: tuple[str, ...]) -> Callable[..., list[object]]:
    def pictures(_: object, times: list[float], **__: object) -> list[object]:
        return [Picture(t, b"png", reports, ()) for t in times]

    return pictures


def test_the_tool_names_its_files_by_time(tool: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tool, "take_pictures", fake(()))
    assert tool.main(["run.rrd", str(tmp_path / "a" / "one.png")]) == 0
    assert tool.main(["run.rrd", str(tmp_path / "two.png"), "--time", "1", "2.5"]) == 0
    found = sorted(str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*.png"))
    assert found == [str(Path("a") / "one.png"), "two_1.png", "two_2.5.png"]


def test_the_tool_fails_where_a_view_complains(
    tool: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(tool, "take_pictures", fake(("Robot: error: something",)))
    assert tool.main(["run.rrd", str(tmp_path / "x.png")]) == 1
    assert "Robot: error: something" in capsys.readouterr().err


def test_the_tool_says_in_one_line_what_is_wrong(
    tool: ModuleType, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(*_: object, **__: object) -> None:
        raise ViewerError("the rerun viewer is not installed")

    monkeypatch.setattr(tool, "take_pictures", refuse)
    assert tool.main(["run.rrd", str(tmp_path / "x.png")]) == 1
    assert capsys.readouterr().err == "no picture: the rerun viewer is not installed\n"
    with pytest.raises(SystemExit, match="2"):
        tool.main(["run.rrd", str(tmp_path / "x.png"), "--size", "big"])
    assert sys.modules.get("screenshot_tool") is None
