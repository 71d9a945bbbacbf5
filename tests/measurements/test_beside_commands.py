"""Joints that move before they are told to, long after, or as another is told: columns that were exchanged, or two clocks."""

from __future__ import annotations

import numpy as np
import pytest
from measurement_files import JOINTS, motion, robot_file

from ee_dist.measurements.commanded import beside_their_commands
from ee_dist.measurements.report import in_one_line
from ee_dist.robots.describe import load_robot

STEP_S = 0.01


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory):
    robot, _ = load_robot(robot_file(tmp_path_factory.mktemp("chain")))

    def lines(commands: np.ndarray, positions: np.ndarray) -> list[str]:
        return list(beside_their_commands(robot, commands, dict(zip(JOINTS, positions.T, strict=True)), STEP_S))

    return lines


def shifted(values: np.ndarray, rows: int) -> np.ndarray:
    """The same, so many rows later."""
    return values[np.clip(np.arange(len(values)) - rows, 0, len(values) - 1)]


def test_a_log_in_order_is_told_nothing_of(told) -> None:
    m = motion()
    assert not told(m["g"], m["q"])
    assert not told(m["q"], m["q"])


def test_commands_and_positions_exchanged(told) -> None:
    m = motion()
    (line,) = told(m["q"], m["g"])
    assert line.startswith("commands: the joints are 40 ms ahead") and "exchanged" in line


def test_commands_of_another_clock(told) -> None:
    m = motion()
    (line,) = told(shifted(m["g"], 40), m["q"])
    assert "ms ahead" in line and "clocks" in line
    rng = np.random.default_rng(0)
    smooth = np.cumsum(np.cumsum(rng.standard_normal((400, 2)), axis=0), axis=0)
    wander = smooth - np.linspace(0, 1, 400)[:, None] * smooth[-1]
    (line,) = told(wander, shifted(wander, 80))
    assert "800 ms behind" in line


def test_positions_of_two_joints_exchanged(told) -> None:
    m = motion()
    lines = told(m["g"], m["q"][:, ::-1])
    assert sum("exchanged columns" in line for line in lines) == 2


def test_released_drives_are_told_nothing_of(told) -> None:
    m = motion()
    gone = m["q"].copy()
    gone[100:120] = np.nan
    assert not told(gone, m["g"])


def test_commands_that_stay_are_one_line() -> None:
    still = [f"command of j{k} (c{k}): stuck at 0 for the whole record" for k in range(4)]
    other = "position_j0 (q0): clipped?"
    found = in_one_line([still[0], other, *still[1:]])
    assert found == ["commands of 4 joints stay as they are for the whole record, first command of j0", other]
    assert in_one_line([*still[:2], other]) == [*still[:2], other]


def test_joints_that_move_against_one_another_are_told_by_where_they_are(told) -> None:
    """Of two that mirror each other either looks as if its sign were swapped."""
    swing = 0.4 * np.sin(np.arange(300) * 0.05)
    commands = np.stack([0.5 + swing, -0.5 - swing], axis=1)
    lines = told(commands, commands[:, ::-1] + 1e-3)
    assert len(lines) == 2 and all("it lies where" in line and "exchanged columns?" in line for line in lines)
    assert JOINTS[1] in lines[0] and JOINTS[0] in lines[1]
    assert not any("it lies where" in line for line in told(commands, commands + 0.05))
    still = commands.copy()
    still[:, 1] = 0.3
    assert not any(
        "it lies where" in line for line in told(np.stack([still[:, 1], still[:, 0]], axis=1), still[:, [1, 1]])
    )
