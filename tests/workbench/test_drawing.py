"""The library of the charts: as installed, and made to be read once."""

from __future__ import annotations

from ee_dist.workbench.drawing import GIVEN, plotly, read_once


def test_the_installed_library_is_laid_out_so_that_a_browser_reads_it_once():
    text = plotly().content.decode()
    assert GIVEN not in text and "self : this, (() => {" in text[:1000] and text.endswith("})));")
    assert len(plotly().tag) == 18


def test_one_that_is_laid_out_otherwise_stays_as_it_is():
    for text in ("export default 1;", "(f(typeof self ? self : this, () => {\n})", "}));"):
        assert read_once(text) == text
