"""Topics stamped by clocks that differ, and files whose dates share a clock."""

from __future__ import annotations

from pathlib import Path

import measurement_files as samples
import numpy as np
import pandas as pd
import pytest
import small_logs as logs

from ee_dist.measurements.readers import read


def topics_of(states_ahead_s: float | None, commands_ahead_s: float | None) -> dict[str, list]:  # type: ignore[type-arg]
    m = samples.motion()
    late = m["t"] + 2e-3
    return {
        "/joint_states": logs.states(m["t"], m["q"], ahead_s=states_ahead_s),
        "/joint_command": logs.states(late, m["g"], ahead_s=commands_ahead_s),
    }


@pytest.mark.parametrize(
    ("states_s", "commands_s", "apart_s", "told"),
    [
        (0.3, None, 0.002, "0.3 s further apart"),
        (2.0, None, 0.002, "2 s further apart"),
        (0.3, 0.1, 0.002, "0.2 s further apart"),
        (0.3, 0.3, 0.002, None),
        (0.005, None, -0.003, None),
        (-0.001, 0.004, 0.007, None),
        (500.0, None, 0.002, "500 s off the time of logging"),
    ],
)
def test_topics_are_on_one_clock(
    tmp_path: Path, states_s: float | None, commands_s: float | None, apart_s: float, told: str | None
) -> None:
    """Stamps are taken where they agree with one another, and with the logging of what has none; else none of them are."""
    tables = read(logs.bag(tmp_path, topics_of(states_s, commands_s)))[0].tables
    at = {t.name: t.columns["time"] for t in tables}
    assert at["/joint_command"] - at["/joint_states"] == pytest.approx(apart_s, abs=1e-6)
    notes = [n for t in tables for n in t.notes]
    assert (told in notes[0]) if told else not notes


@pytest.mark.parametrize(("step_ms", "since"), [(10, 1.7e9), (0.1, 0.0)])
def test_dates_of_a_parquet_file_keep_their_epoch_where_numbers_are_fine_enough(
    tmp_path: Path, step_ms: float, since: float
) -> None:
    ns = np.int64(1_700_000_000 * 10**9) + (np.arange(50) * step_ms * 1e6).astype(np.int64)
    pd.DataFrame({"time": pd.to_datetime(ns), "q": np.arange(50.0)}).to_parquet(tmp_path / "a.parquet")
    times = read(tmp_path / "a.parquet")[0].tables[0].numbers("time")
    assert times == pytest.approx(since + np.arange(50) * step_ms / 1e3, abs=1e-6)
