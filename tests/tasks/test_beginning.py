"""Something is said before anything is loaded, to people alone."""

from __future__ import annotations

import io
import os
import pty
import subprocess
import sys

import pytest

from ee_dist.beginning import announce


class Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


@pytest.mark.parametrize(
    ("stream", "arguments", "said"),
    [
        (Terminal(), ["task=explain", "measured=a"], "ee_dist explain: loading\n"),
        (Terminal(), ["+scenario=8"], "ee_dist recover: loading\n"),
        (Terminal(), ["task=explain", "--help"], ""),
        (Terminal(), ["--cfg=job"], ""),
        (io.StringIO(), ["task=explain"], ""),
    ],
)
def test_people_are_told_and_programs_are_not(stream: io.StringIO, arguments: list[str], said: str) -> None:
    announce(arguments, stream)
    assert stream.getvalue() == said


def test_it_is_the_first_thing_that_a_terminal_shows() -> None:
    ours, theirs = pty.openpty()
    with subprocess.Popen([sys.executable, "-m", "ee_dist", "task=view"], stdout=theirs, stderr=theirs) as run:
        os.close(theirs)
        first = os.read(ours, 1000).decode()
        assert run.poll() is None, "said while it still loads"
        run.kill()
    os.close(ours)
    assert first.startswith("ee_dist view: loading")


def test_the_main_job_does_not_wait_for_what_it_may_not_need() -> None:
    """Ray and the filters take seconds to load: whoever uses them does."""
    script = "import sys, ee_dist.__main__, ee_dist.tasks.recover, ee_dist.tasks.trial; print(*sys.modules)"
    loaded = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, check=True).stdout.split()
    assert "ee_dist.tasks.recover" in loaded
    assert not {"ray", "scipy.signal", "scipy.stats", "rerun", "plotly", "mujoco", "pybullet"} & set(loaded)
