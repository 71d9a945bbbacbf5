"""What Keep lists: what this session wrote, and apart from it what lay in its folder before."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

pytest.importorskip("nicegui", reason="needs the extra 'workbench'")

from ee_dist.tasks.folder import claimed
from ee_dist.workbench.pages.keep import listed


def test_what_was_there_before_an_overwrite_is_told_from_what_this_session_wrote(tmp_path: Path) -> None:
    """A report of an earlier session tells of another model, under a name that sounds like this one's."""
    with claimed(tmp_path, {"config.yaml": "a: 1"}, False):
        (tmp_path / "explain").mkdir()
        (tmp_path / "explain" / "report.html").write_text("old")
        (tmp_path / "model.yaml").write_text("old")
        assert listed(tmp_path) == [(tmp_path / "explain" / "report.html", False), (tmp_path / "model.yaml", False)]
    for old in tmp_path.rglob("*"):
        os.utime(old, (1e9, 1e9))
    with claimed(tmp_path, {"config.yaml": "a: 2"}, True):
        (tmp_path / "model.yaml").write_text("new")
        assert listed(tmp_path) == [(tmp_path / "model.yaml", False), (tmp_path / "explain" / "report.html", True)]
