"""The whole story in a real browser: open, compare, explain, add, slide, the error falls, keep; and the kept model, compared
by the command line, has the error that the page said."""

from __future__ import annotations

import json
import os
import re
import shlex
import signal
import subprocess
import sys
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

pytest.importorskip("nicegui", reason="needs the extra 'workbench'")

from nicegui.version import __version__
from page_driver import Bench, Person

from ee_dist.viewing.browser import BrowserError, chromium
from ee_dist.workbench.drawing import plotly
from ee_dist.workbench.guard import Guard
from ee_dist.workbench.pages.slider import Slider

try:
    chromium()
except BrowserError as error:
    pytest.skip(str(error), allow_module_level=True)

NUMBER = "parseFloat(document.querySelector('.number').innerText)"
UNCOVERED = """(() => {
  const e = [...document.querySelectorAll("input[aria-label^='Add an effect']")].find((e) => e.offsetParent);
  scrollTo(0, 0); const r = e.getBoundingClientRect();
  return e.contains(document.elementFromPoint(r.x + r.width / 2, r.y + r.height / 2)); })()"""
CURVE = (
    "[...document.querySelectorAll('.js-plotly-plot')].find((p) => p.offsetParent && p.data?.[0]?.name === 'measured')"
)
UNIT = f"{CURVE}.layout.yaxis.title.text.match(/[(]([^)]*)[)]$/)[1]"
POINTS = (
    "[...document.querySelectorAll('.js-plotly-plot')].filter((p) => p.offsetParent && p.data?.[0]?.mode === 'markers')"
    ".map((p) => p.layout.yaxis.title.text)"
)
ROWS = 500
FOUND = "document.body.innerText.includes('Ranked, with 95 % intervals')"


SLIDER = """(async () => {
  const { data, methods } = (await import('%s')).default, told = [];
  const slider = { ...data.call({ begin: 0 }), ...methods, $emit: (...what) => told.push(what) };
  const rest = () => new Promise((done) => setTimeout(done, 200));
  for (const value of [1, 2, 3]) slider.move(value);
  slider.show(9);
  const held = slider.value;
  slider.release(3);
  slider.show(9);
  const free = slider.value;
  await rest();
  slider.move(4); slider.move(5);
  await rest();
  return [told, held, free]; })()"""


def refused(address: str, **headers: str) -> int:
    try:
        with urlopen(Request(address, headers=headers)) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def pointed_at(person: Person) -> None:
    """The robot goes to the instant under the mouse: what rerun's viewer would be told, here by one that only listens."""
    person.evaluate(
        "(() => { const f = document.createElement('iframe'); f.className = 'robot'; document.body.append(f);"
        "f.contentWindow._handle = { viewer_control: (b) => { window.asked = [...b]; return Promise.resolve(); } };"
        "window.robotOn = ['run_time', 300]; })()"
    )
    x, y, width, height = person.wait(
        "(() => { const r = document.querySelector('.nsewdrag').getBoundingClientRect(); "
        "return [r.x, r.y, r.width, r.height]; })()"
    )
    person.mouse("mouseMoved", x + width / 2, y + height / 2)
    asked = person.wait("window.asked")
    # Field 6 of the request; in it the timeline by its name, and a time in nanoseconds.
    assert bytes(asked[:15]) == b"\x32" + bytes([len(asked) - 2]) + b"\x12\x0a\x0a\x08run_time\x1a" and asked[16] == 8
    assert 300.5 < sum((b & 127) << (7 * k) for k, b in enumerate(asked[17:])) / 1e9 < 301.5
    person.evaluate("document.querySelector('iframe.robot').remove()")


def another_channel(person: Person) -> None:
    """By a key: the curves, and soon after them the points below, are of another channel."""
    unit = person.evaluate(UNIT)
    assert person.wait(f"{POINTS}.length > 2 && {POINTS}") == [f"residual ({unit})"] * 3
    person.evaluate("document.activeElement.blur()")
    person.key("ArrowDown", 40)
    other = person.wait(f"{UNIT} !== '{unit}' && {UNIT}")
    person.wait(f"{POINTS}.length === 3 && {POINTS}.every((title) => title === 'residual ({other})')")


def slid(person: Person, bench: Bench) -> None:
    """A slider tells where it is let go of last, whatever it has not told by then, and stays under the hand."""
    found = person.evaluate(SLIDER % f"{bench.address}_nicegui/{__version__}/components/{Slider.component.key}")
    told = [["moved", 1], ["released", 3], ["moved", 4], ["moved", 5]]
    assert found == [told, 3, 9]


def left_in_the_middle(bench: Bench, person: Person) -> None:
    """A page that is closed with a hand on a slider: what it had set is compared, and every page shows it."""
    before = person.wait(NUMBER)
    with Person() as other:
        other.go(bench.address)
        other.wait(NUMBER)
        other.open("Add")
        x, y, width, height = other.wait(
            "(() => { const r = [...document.querySelectorAll('.q-slider')].map((e) => e.getBoundingClientRect())"
            ".find((r) => r.width); return r && [r.x, r.y, r.width, r.height]; })()"
        )
        other.mouse("mousePressed", x + 0.8 * width, y + height / 2)
        other.mouse("mouseMoved", x + 0.9 * width, y + height / 2)
        other.wait(f"{NUMBER} > {1.1 * before}")
        assert person.evaluate(NUMBER) == before
    person.wait(f"{NUMBER} > {1.1 * before}")
    person.wait(f"{CURVE}.data[0].x.length === {ROWS}")


def test_the_story(recording: Path, tmp_path: Path) -> None:
    with Bench(tmp_path, f"measured={recording}", "engine=mujoco", "hydra.run.dir=bench") as bench:
        with Person() as person:
            with Person() as first:
                first.go(bench.address)
                first.waits_for("The model is off")
                # A search whose process is killed is told, and begun again.
                first.key("2", 50, "2")
                first.click("What is missing?")
                first.waits_for("s so far")
                os.kill(bench.searcher, signal.SIGKILL)
                first.waits_for("nothing is lost: start it again")
                first.click("What is missing?")
                first.waits_for("s so far")
                # Another browser shows the same session, and has it when this one is closed in the middle of a search.
                person.go(bench.address)
                start = person.wait(NUMBER)
                person.wait("document.querySelectorAll('.js-plotly-plot .main-svg').length > 4")
                pointed_at(person)
                another_channel(person)
                # Nothing that was measured is offered to be sent elsewhere.
                buttons = person.evaluate("[...document.querySelectorAll('.modebar-btn')].map((b) => b.dataset.title)")
                assert set(buttons) == {"Zoom", "Pan", "Box Select", "Zoom in", "Zoom out", "Reset axes"}
                person.open("Explain")
                # Where the machine is slower with a page than with a search, it has ended already.
                person.wait(f"document.body.innerText.includes('s so far') || {FOUND}")
            person.wait(FOUND)
            assert "coulomb friction at servo" in person.text()
            # By hand: its values were found by the search; now the slider is moved away, and back.
            person.click("Add", "button")
            person.waits_for("Effects in the model")
            person.wait(f"{NUMBER} < {0.3 * start}")
            person.evaluate("document.querySelector('.q-slider [tabindex]').focus()")
            good = person.wait(NUMBER)
            for _ in range(6):
                person.key("PageUp", 33)
            person.wait(f"{NUMBER} > {1.1 * good}")
            person.wait(f"{CURVE}.data[0].x.length === {ROWS}")  # every row again, once the hand rests
            person.click("Undo", "button")
            person.wait(f"Math.abs({NUMBER} - {good}) < 0.02")
            slid(person, bench)
            left_in_the_middle(bench, person)
            person.click("Undo", "button")
            person.wait(f"Math.abs({NUMBER} - {good}) < 0.02")
            person.open("Watch")
            person.waits_for("by hand: coulomb friction at servo")
            person.open("Keep")
            person.click("Keep the model")
            person.waits_for("task=compare says")
            line = re.findall(r"python -m ee_dist (task=compare .*model\.yaml.*)", person.text())[-1]
            said = float(re.search(r"\(error ([\d.]+)\)", person.text())[1])
            overflow = person.evaluate("document.documentElement.scrollWidth - innerWidth")
            assert overflow <= 0
            person.go(bench.address, width=400)
            person.waits_for("measured")
            person.wait("document.querySelectorAll('.js-plotly-plot .main-svg').length > 4")
            assert person.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
            # The curves stay in sight beside the sliders, and cover nothing before the page is scrolled.
            person.open("Add")
            person.wait(UNCOVERED)
            # What it would say if the workbench went away.
            assert "task=workbench log=bench goes on with it" in person.evaluate(
                "document.querySelector('#popup').textContent"
            )
            assert person.complaints() == ()
            assert person.asked_outside(bench.address) == []
        assert refused(bench.address) == 200
        assert refused(f"{bench.address}plotly.js", **{"If-None-Match": plotly().tag}) == 304
        assert refused(bench.address, Origin="http://evil.example") == 403
        assert refused(bench.address, Host="evil.example") == 403
        assert refused(f"{bench.address}files/model.yaml") == 200
        assert refused(f"{bench.address}files/..%2f..%2ferrors.txt") == 404
        assert bench.end() == 130
        assert "kept in bench" in bench.said() and len(bench.said().strip().splitlines()) == 1
    # The last of the command lines that the page gives, as it stands there.
    command = [sys.executable, "-m", "ee_dist", *shlex.split(line), "hydra.run.dir=again"]
    subprocess.run(command, cwd=tmp_path, env=bench.environment, capture_output=True, check=True)
    again = json.loads((tmp_path / "again" / "summary.json").read_text())
    assert f"{again['error']:.6g}" == f"{said:.6g}"


def test_others_bring_the_token_and_what_cannot_be_read_is_told(recording: Path, tmp_path: Path) -> None:
    nonsense, table = tmp_path / "nonsense.mcap", tmp_path / "table.csv"
    nonsense.write_bytes(b"this is no recording" * 9)
    table.write_text("who,what\nyou,me\n")
    with Bench(tmp_path, "task.host=0.0.0.0", "robot=servo_pendulum", "hydra.run.dir=bench") as bench:
        port, token = re.search(r":(\d+)/\?token=(\S+)", bench.address).groups()
        here = f"http://127.0.0.1:{port}/"
        assert refused(here) == 403
        assert refused(f"{here}?token=wrong") == 403
        assert refused(f"{here}?token={token}") == 200
        assert refused(here, Cookie=f"{Guard(None, token).cookie}={token}") == 200
        assert refused(f"{here}?token={token}", Origin="http://evil.example") == 403
        assert refused(f"{here}_nicegui_ws/socket.io/?EIO=4&transport=polling") == 403
        with Person() as person:
            person.go(here)
            person.waits_for("open the address that it printed")
            person.go(f"{here}?token={token}")
            person.waits_for("Drop a file here")
            person.drop(nonsense)
            person.waits_for("expected a recording written by ee_dist")
            person.drop(table)
            person.waits_for("table.csv: ")
            person.drop(recording)
            person.waits_for("The model is off")
            assert token not in person.evaluate("location.href")
        command = [sys.executable, "-m", "ee_dist", "task=workbench", f"task.port={port}", f"measured={recording}"]
        other = subprocess.run(
            command, cwd=tmp_path, env=bench.environment, capture_output=True, text=True, check=False
        )
        assert other.returncode == 2 and "if another workbench is open there" in other.stderr
        assert len(other.stderr.strip().splitlines()) == 1
