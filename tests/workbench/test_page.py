"""The whole story in a real browser: open, compare, explain, add, slide, the error falls, keep; and the kept model, compared
by the command line, has the error that the page said."""

from __future__ import annotations

import contextlib
import io
import json
import re
from pathlib import Path
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

pytest.importorskip("nicegui", reason="needs the extra 'workbench'")

from page_driver import Bench, Person

from ee_dist.tasks import compare
from ee_dist.tasks.config import Config, EngineConfig, EvaluatorConfig
from ee_dist.viewing.browser import BrowserError, chromium

try:
    chromium()
except BrowserError as error:
    pytest.skip(str(error), allow_module_level=True)

NUMBER = "parseFloat(document.querySelector('.number').innerText)"
FOUND = "document.body.innerText.includes('Ranked, with 95 % intervals')"


def refused(address: str, **headers: str) -> int:
    try:
        with urlopen(Request(address, headers=headers)) as answer:
            return int(answer.status)
    except HTTPError as error:
        return error.code


def test_the_story(recording: Path, tmp_path: Path) -> None:
    with Bench(tmp_path, f"measured={recording}", "engine=mujoco", "hydra.run.dir=bench") as bench:
        with Person() as person:
            person.go(bench.address)
            person.waits_for("The model is off")
            start = person.wait(NUMBER)
            person.wait("document.querySelectorAll('.js-plotly-plot .main-svg').length > 4")
            # A closed tab stops nothing: the search goes on, and who comes back finds what it found.
            person.open("Explain")
            person.click("What is missing?")
            person.waits_for("s so far")
            person.go("about:blank")
            person.go(bench.address)
            person.waits_for("measured")
            person.open("Explain")
            person.wait(FOUND)
            assert "coulomb friction at servo" in person.text()
            # By hand: its values were found by the search; now the slider is moved away, and back.
            person.click("Add", "button")
            person.waits_for("Effects in the model")
            person.wait(f"{NUMBER} < {0.3 * start}")
            person.evaluate("document.querySelector('.q-slider [tabindex]').focus()")
            good = person.wait(NUMBER)
            for _ in range(6):
                person.key("PageUp", 33)
            person.wait(f"{NUMBER} > {1.1 * good}")
            person.click("Undo", "button")
            person.wait(f"Math.abs({NUMBER} - {good}) < 0.02")
            person.open("Watch")
            person.waits_for("by hand: coulomb friction at servo")
            person.open("Keep")
            person.click("Keep the model")
            person.waits_for("task=compare says")
            said = float(re.search(r"\(error ([\d.]+)\)", person.text())[1])
            overflow = person.evaluate("document.documentElement.scrollWidth - innerWidth")
            assert overflow <= 0
            person.go(bench.address, width=400)
            person.waits_for("measured")
            person.wait("document.querySelectorAll('.js-plotly-plot .main-svg').length > 4")
            assert person.evaluate("document.documentElement.scrollWidth - innerWidth") <= 0
            assert person.complaints() == ()
            assert person.asked_outside(bench.address) == []
        assert refused(bench.address) == 200
        assert refused(bench.address, Origin="http://evil.example") == 403
        assert refused(bench.address, Host="evil.example") == 403
        assert refused(f"{bench.address}files/model.yaml") == 200
        assert refused(f"{bench.address}files/..%2f..%2ferrors.txt") == 404
        assert bench.end() == 130
        assert "kept in bench" in bench.said() and len(bench.said().strip().splitlines()) == 1
    config = Config(engine=EngineConfig("mujoco"), evaluator=EvaluatorConfig("serial"), measured=str(recording))
    config.model = str(tmp_path / "bench" / "model.yaml")
    with contextlib.redirect_stdout(io.StringIO()):
        compare.run(config, compare.Options(rerun=False), tmp_path / "again")
    again = json.loads((tmp_path / "again" / "summary.json").read_text())
    assert f"{again['error']:.6g}" == f"{said:.6g}"
