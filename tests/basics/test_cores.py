"""How many processors a process may use."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from ee_dist.basics.cores import usable

ASK = "from ee_dist.basics.cores import usable; print(usable())"


def asked(before: str = "", **environment: str) -> int:
    out = subprocess.run(
        [sys.executable, "-c", before + ASK],
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return int(out.stdout)


def test_no_more_than_the_machine_has() -> None:
    assert 1 <= usable() <= (os.cpu_count() or 1)


@pytest.mark.skipif(not hasattr(os, "sched_setaffinity"), reason="this system pins no process")
def test_a_process_that_is_pinned_to_one_uses_one() -> None:
    first = min(os.sched_getaffinity(0))
    assert asked(f"import os; os.sched_setaffinity(0, {{{first}}}); ") == 1


def test_a_user_may_say_fewer() -> None:
    assert asked(LOKY_MAX_CPU_COUNT="1") == 1
