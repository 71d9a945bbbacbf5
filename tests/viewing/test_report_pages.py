"""Reports in a real browser: narrow and wide, light and dark, no complaint, no request, nothing wider than the window."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from ee_dist.viewing import report_figures as figures
from ee_dist.viewing.browser import HeadlessBrowser
from ee_dist.viewing.curves import NUMBERS, Overlay, browser, thinned
from ee_dist.viewing.report import Page, Section, Table, write_page

DRAWN = (
    "(async () => { const box = document.querySelector('.picked'); const from = Date.now();"
    "while (!box.data && Date.now() - from < 60000) await new Promise((done) => setTimeout(done, 20)); })()"
)
LONG = "coulomb friction at knee front right, and play at the hip of the other side"


def curve(k: int, rows: int = 5000) -> Overlay:
    t = np.linspace(0.0, 4.0, rows)
    return Overlay(f"channel {k}", f"{k % 3}. trial", "rad", t, np.sin(t + k), np.sin(t), np.sin(t + 0.9 * k), float(k))


def full_page() -> Page:
    """A page with every kind of part that a report has."""
    rng = np.random.default_rng(0)
    x, noise = rng.uniform(-1, 1, 3000), rng.normal(0, 0.05, 3000)
    clouds = [
        figures.cloud("position knee", figures.Cloud(f"over {k}", x, np.sign(x) + noise, noise)) for k in range(4)
    ]
    heat = [rng.uniform(0, 6, (70, 12)), rng.uniform(0, 1, (70, 12))]
    windows, channels = [f"sway floor {k}" for k in range(70)], [f"position_knee_front_right_{k}" for k in range(12)]
    ranks = figures.ranking(
        [LONG, "b", "c"], [0.9, 0.5, 0.1], [(0.8, 0.95), (0.4, 0.6), (-0.2, 0.2)], ["best", "tied", "not"]
    )
    table = Table(
        ["effect", "value, in units", "judgement"], [[LONG, "1,5", 'a "b"'], ["c", "2", LONG]], (1,), (0,), (1,)
    )
    curves = [curve(k) for k in range(6)]
    return Page(
        "Explain: quadruped lab",
        "7 trials of /a/very/long/path/without/any/space/that/does/not/fit/a/narrow/window/trial.mcap",
        f"Missing: {LONG}. Nothing else is left above the noise.",
        ["first", "second"],
        "good",
        ["Error: model 1.12", "How sure: 93 %"],
        "python -m ee_dist task=improve measured='logs/with a space/and/a/very/long/name/trial.mcap' effect=auto",
        Section("Where", "what", figures.proof(curves[1], ["model", "improved"], (1.0, 2.0))),
        [("1.12", "error"), ("position knee front right", "worst channel"), ("0.8", "noise floor")],
        [
            Section("Ranked", "of all", ranks, table),
            Section("All", "curves", browser=browser(curves, ["model", "improved"])),
            Section("Clouds", figures=clouds, legend=[("before", "red")]),
            Section("Heat", figure=figures.heat_map(heat, windows, channels)),
            Section(
                "Ladder",
                figure=figures.ladder(["as it was", LONG], [2.0, 1.0], [2.1, 1.1], ["", "windows"], 0.9),
                folded=True,
            ),
            Section("Bars", figure=figures.bars(channels, list(range(12)), "error", 0.9, list(range(12)))),
        ],
        [("compare", "../compare/report.html")],
        [("Noise floor", "what a perfect model leaves")],
        "foot",
    )


def test_a_heat_map_of_no_error_at_all_shows_every_row() -> None:
    """As a right model leaves of sensors without noise."""
    figure = figures.heat_map([np.zeros((3, 2))], ["a", "b", "c"], ["one", "other"])
    assert list(figure.data[0].y) == ["one", "other"]


@pytest.fixture(scope="module")
def page(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_page(full_page(), tmp_path_factory.mktemp("page") / "report.html")


@pytest.mark.parametrize(("width", "dark"), [(1280, False), (400, True)], ids=["wide-light", "narrow-dark"])
def test_a_page_is_quiet_and_fits(window: HeadlessBrowser, page: Path, width: int, dark: bool) -> None:
    seen = window.look(page, width, dark=dark)
    assert seen.complaints == () and seen.asked == () and seen.overflow == 0
    drawn = window.evaluate("document.querySelectorAll('.js-plotly-plot').length")
    assert drawn == 10, "all figures, the folded one and the browser's own"
    background = window.evaluate("getComputedStyle(document.body).backgroundColor")
    shade = sum(map(int, re.findall(r"\d+", background)[:3])) / 3
    assert shade < 60 if dark else shade > 200
    text = window.evaluate("getComputedStyle(document.querySelector('.xtick text')).fill")
    ink = sum(map(int, re.findall(r"\d+", text)[:3])) / 3
    assert ink > 180 if dark else ink < 90, "figures follow"


def test_the_bar_of_colours_is_close_above_the_map(window: HeadlessBrowser, page: Path) -> None:
    window.look(page, 1280)
    bar, tall, top, map_top = window.evaluate(
        "(() => { const bar = document.querySelector('.colorbar'), plot = bar.closest('.plot');"
        "const box = (e) => e.getBoundingClientRect(), at = (s) => box(plot.querySelector(s));"
        "return [box(bar).top, box(bar).height, box(plot).top, at('.heatmaplayer').top]; })()"
    )
    assert 0 <= bar - top < 12, "no empty stretch above it"
    assert bar + tall < map_top < top + 1.5 * figures.BAR_ROOM


def test_what_would_be_wrong_is_seen(window: HeadlessBrowser, tmp_path: Path) -> None:
    bad = tmp_path / "bad.html"
    bad.write_text(
        "<body><div style='width: 3000px'>wide</div><img src='http://127.0.0.1:9/x.png'>"
        "<script>console.error('told'); throw new Error('thrown')</script></body>"
    )
    seen = window.look(bad, 400)
    assert seen.overflow == 3000 + 8 - 400 and seen.asked == ("http://127.0.0.1:9/x.png",)
    assert any("told" in c for c in seen.complaints) and any("thrown" in c for c in seen.complaints)


def test_any_channel_can_be_picked_and_a_table_saved(window: HeadlessBrowser, page: Path) -> None:
    window.open(page, 1280)
    window.evaluate("document.querySelector('.browser').scrollIntoView()")
    window.evaluate(DRAWN)
    shown = "document.querySelector('.picked').data[0].y[0]"
    assert window.evaluate(shown) == pytest.approx(np.sin(5), abs=1e-4), "the worst is shown first"
    pick = (
        "(async () => { const c = document.querySelector('.channel');"
        "c.value = [...c.options].find((o) => o.text === 'channel 2').value;"
        "c.dispatchEvent(new Event('change')); await new Promise((r) => setTimeout(r, 100));"
        f"return [{shown}, document.querySelector('.trial').selectedOptions[0].text] }})()"
    )
    value, trial = window.evaluate(pick)
    assert value == pytest.approx(np.sin(2), abs=1e-4) and trial == "2. trial"
    save = (
        "(async () => { let kept; URL.createObjectURL = (blob) => { kept = blob; return '#'; };"
        "HTMLAnchorElement.prototype.click = function () {}; document.querySelector('button.csv').click();"
        "return await kept.text(); })()"
    )
    lines = window.evaluate(save).lstrip("\ufeff").split("\r\n")
    assert lines[0] == 'effect,"value, in units",judgement' and lines[1].endswith('"1,5","a ""b"""')


def test_a_button_turns_the_light_off_and_on(window: HeadlessBrowser, page: Path) -> None:
    window.open(page, 1280)
    click = "document.getElementById('theme').click(), document.documentElement.dataset.theme"
    assert [window.evaluate(click) for _ in range(2)] == ["dark", "light"]


def test_the_mark_of_an_effect_is_what_the_models_differ_by() -> None:
    x = np.linspace(-1, 1, 2000)
    law, noise = 0.3 * np.sign(x), np.random.default_rng(0).normal(0, 0.02, len(x))
    figure = figures.cloud("torque", figures.Cloud("speed", x, law + noise, noise))
    (mark,) = [t for t in figure.data if t.mode == "lines" and t.line.color == figures.MARK]
    (model,) = [t for t in figure.data if t.mode == "lines" and t.line.color == figures.PREDICTED]
    assert mark.line.dash and len(mark.x) > 15
    at = np.array(mark.x)
    away = np.abs(at) > 0.1
    np.testing.assert_allclose(np.array(mark.y)[away], 0.3 * np.sign(at[away]), atol=1e-9)
    np.testing.assert_allclose(np.array(model.y), np.array(mark.y), atol=0.02)  # it lies on what was measured


def test_no_peak_is_lost_when_curves_are_thinned() -> None:
    long = curve(1, 100_000)
    long.measured[31_234] = 50.0
    short = thinned(long, 1000)
    assert len(short.times_s) <= 1000 and short.measured.max() == 50.0
    assert short.times_s[0] == long.times_s[0] and short.times_s[-1] == long.times_s[-1]
    assert (np.diff(short.times_s) > 0).all()


def test_many_curves_have_room_and_the_least_are_left_out() -> None:
    many = [curve(k, 300) for k in range(3000)]
    found = browser(many, ["model", "improved"])
    assert found.left_out == len(many) - len(found.curves) > 0
    assert found.curves[0].channel == "channel 2999", "worst first"
    content = json.loads(found.to_json())
    numbers = sum(len(c["x"]) * (1 + len(c["y"])) for c in content["cells"])
    assert numbers <= NUMBERS and len(found.to_json()) < 6e6


def test_a_value_that_is_missing_is_a_gap() -> None:
    gap = curve(1, 50)
    gap.measured[3] = np.nan
    cell = json.loads(browser([gap], ["model", "improved"]).to_json())["cells"][0]
    assert cell["y"][0][3] is None and cell["y"][1][3] is not None
