"""The benchmark of robots that are wrong everywhere goes on where it was stopped, and counts by robot and size."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest


def fake(module: Any, made: list[int], stop: int | None = None) -> type:
    class Bench:
        def __init__(self, args: Any) -> None:
            self.args = args

        def case(self, index: int) -> Any:
            if index == stop:
                raise KeyboardInterrupt
            made.append(index)
            hidden = "" if index == 3 else "coulomb_friction at servo"
            return module.Case(index, hidden, within=index != 1, before=10.0, ratio=1.0 + index, held=[1, index > 0])

    return Bench


def test_a_stopped_benchmark_makes_only_what_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    import messy_benchmark as messy

    made: list[int] = []
    out = tmp_path / "cases.jsonl"
    asked = ["messy_benchmark.py", "--cases", "4", "--size", "small", "--out", str(out)]
    monkeypatch.setattr("sys.argv", asked)
    monkeypatch.setattr(messy, "Bench", fake(messy, made, stop=2))
    with pytest.raises(KeyboardInterrupt):
        messy.main()
    monkeypatch.setattr(messy, "Bench", fake(messy, made))
    assert messy.main() == 0
    assert made == [0, 1, 2, 3]
    capsys.readouterr()

    monkeypatch.setattr("sys.argv", [*asked[:3], "--size", "large", *asked[5:]])
    assert messy.main() == 0, "another size is another robot"
    assert made == [0, 1, 2, 3] * 2
    capsys.readouterr()

    monkeypatch.setattr("sys.argv", ["messy_benchmark.py", "--report", str(out)])
    assert messy.main() == 0
    said = capsys.readouterr().out
    assert said.index("servo_pendulum, large") < said.index("servo_pendulum, small")
    found = {line[:30].strip(): float(line[30:]) for line in said.splitlines() if line.startswith("  ")}
    assert found["hidden within names"] == pytest.approx(2 / 3, abs=1e-3)
    assert (found["error over floor, median"], found["intervals hold"]) == (2.5, 0.875)


@pytest.mark.slow
def test_play_that_all_else_had_stood_in_for_is_found_in_its_place() -> None:
    import argparse

    import messy_benchmark as messy

    asked = {
        "robot": messy.ARM,
        "size": "small",
        "by": "open_loop",
        "seed": 48,
        "noise": 0.001,
        "seconds": 4.0,
        "beyond": False,
    }
    case = messy.Bench(argparse.Namespace(**asked)).case(2)
    assert case.truth.startswith("backlash at joint_6") and case.within and not case.wrong
    assert case.ratio < 0.2 * case.before
