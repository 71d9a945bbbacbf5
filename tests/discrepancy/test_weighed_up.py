"""How much a model explains is judged by what knows it least."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from ee_dist.discrepancy import weighed_up as module
from ee_dist.discrepancy.finished import BETTER, EXPLAINED
from ee_dist.discrepancy.ladder import Improvement, Rung
from ee_dist.discrepancy.last_word import TRIALS_APART
from ee_dist.discrepancy.weighed_up import ALL_ROWS, share, weighed_up

FLOOR = 1.0


class _Problem:
    """Four values of one record, and stretches of it."""

    def __init__(self, whole: _Problem | None, before: float, after: float) -> None:
        self.whole = whole or self
        self.rows = np.array([[before] * 4, [after] * 4])

    def residuals(self, hypotheses: object) -> np.ndarray:
        return self.rows

    def noise_floor(self) -> tuple[float, str]:
        return FLOOR, "known"


def found(share_held: float, verdict: str = BETTER) -> Improvement:
    rungs = [Rung(n, (), (), 1.0, 1.0, np.ones(1), "blocks") for n in ("as it was", "friction")]
    none = np.zeros(4)
    return Improvement(verdict, share_held, rungs, (), [], none, none, FLOOR, "", [], "", judged_on="blocks")


def test_a_share_is_of_what_is_above_the_noise() -> None:
    assert share(3.0, 1.0, 1.0) == share(3.0, 0.5, 1.0) == 1.0
    assert share(3.0, 3.0, 1.0) == 0.0 and share(3.0, 5.0, 1.0) < 0
    assert share(3.0, 2.0, 1.0) == pytest.approx(5 / 8)
    assert np.isnan(share(1.05, 1.0, 1.0)), "where hardly any was above it"


def test_all_rows_judge_where_the_search_took_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "leftovers", lambda *_: [])
    monkeypatch.setattr(module, "settled", lambda _left, after, floor: after <= 1.1 * floor)
    whole = _Problem(None, 3.0, 2.0)
    told = weighed_up(found(0.95, EXPLAINED), _Problem(whole, 3.0, 1.0), None)  # type: ignore[arg-type]
    assert told.all_rows == (3.0, 2.0) and told.judged_on == ALL_ROWS
    assert told.explained == pytest.approx(5 / 8) and told.verdict == BETTER
    kept = weighed_up(found(0.5), _Problem(whole, 3.0, 1.0), None)  # type: ignore[arg-type]
    assert (kept.explained, kept.judged_on) == (0.5, "blocks"), "what is held out knows it less"
    assert weighed_up(found(0.9), whole, None).all_rows is None  # type: ignore[arg-type]


def test_trials_held_out_from_all_of_it_judge_where_they_say_less() -> None:
    whole = _Problem(None, 3.0, 2.0)
    word = SimpleNamespace(before=4.0, after=3.0, floor=1.0, changed=True)
    told = weighed_up(found(0.95), whole, word)  # type: ignore[arg-type]
    assert told.explained == pytest.approx(7 / 15) and told.judged_on == TRIALS_APART
    silent = SimpleNamespace(before=1.05, after=1.0, floor=1.0, changed=True)
    assert weighed_up(found(0.95), whole, silent).explained == 0.95  # type: ignore[arg-type]
