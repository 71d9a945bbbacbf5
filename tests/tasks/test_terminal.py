"""Names of a user's robot come out of the terminal as they are, whatever rich would make of them."""

from __future__ import annotations

import fcntl
import os
import pty
import re
import struct
import subprocess
import sys
import termios
from pathlib import Path
from types import SimpleNamespace

import pytest

import ee_dist
from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.results.tables import show_candidates
from ee_dist.tasks.terminal import terminal


@pytest.mark.parametrize("name", ["axis[x]", "axis[/x]", "a:key:b"])
def test_brackets_are_no_markup(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    console = terminal(width=120)
    problem = SimpleNamespace(robot=None, told=str)
    judged = SimpleNamespace(
        rank=1, terms=(), name="a", error_heldout=1.0, error_without=2.0,
        explained=0.5, gain=0.5, interval=(0.4, 0.6), earned=False,
        why_not=f"not at {name}", tied_with=[]
    )  # fmt: skip
    show_candidates(console, problem, [judged], f"Trials of {name}")  # type: ignore[arg-type, list-item]
    console.print(f"The truth: {name}", highlight=False)
    said = capsys.readouterr().out
    assert f"not at {name}" in said and f"Trials of {name}" in said and f"The truth: {name}" in said


def test_a_live_line_takes_no_markup() -> None:
    console = terminal(width=120)
    console._force_terminal = True
    SearchProgress(console)("judging friction@axis[/x]", 0.5)


def test_every_verb_writes_to_this_terminal() -> None:
    files = sorted(Path(ee_dist.__file__).parent.rglob("*.py"))
    assert [f.name for f in files if re.search(r"\bConsole\(", f.read_text(encoding="utf-8"))] == ["terminal.py"]


LIVE = """
import time

from ee_dist.tasks.progress_line import SearchProgress
from ee_dist.tasks.terminal import terminal
console = terminal()
with SearchProgress(console) as progress:
    for k in range(3):
        progress("step 2, examining 5 of 9 explanations by themselves, on the beginning", k / 3, 12.3)
        time.sleep(0.1)  # longer than a turn of the wheel
print("width", console.width)
"""


def in_window(columns: int, told: str | None) -> str:
    """What is written to a window of so many columns, where the environment tells another number of them."""
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 24, columns, 0, 0))
    settings = {k: v for k, v in os.environ.items() if k not in ("COLUMNS", "LINES", "NO_COLOR")}
    settings |= {"TERM": "xterm-256color", "PYTHONPATH": str(Path(ee_dist.__file__).parents[1])}
    settings |= {} if told is None else {"COLUMNS": told}
    child = subprocess.Popen([sys.executable, "-c", LIVE], stdin=theirs, stdout=theirs, stderr=theirs, env=settings)
    os.close(theirs)
    written = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # the child is gone
            break
        if not part:
            break
        written += part
    os.close(ours)
    assert child.wait() == 0, written.decode()
    return written.decode()


@pytest.mark.parametrize(
    ("columns", "told", "width"), [(60, "100", 60), (40, None, 40), (60, "40", 40), (0, "100", 100)]
)
def test_a_live_line_fits_its_window_whatever_width_the_environment_tells(
    columns: int, told: str | None, width: int
) -> None:
    """What is wider than the window wraps there, and is never taken away again."""
    written = in_window(columns, told)
    assert f"width {width}" in written
    rows = re.split(r"[\r\n]+", re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", written))
    assert any("examining" in row for row in rows) and max(map(len, rows)) <= width
