"""Plotly for the browser, as the installed package has it: sent in one piece, and made to be read once."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from functools import cache
from importlib.util import find_spec
from pathlib import Path

ADDRESS = "/plotly.js"
"""Where the page asks for it; the charts' own script has the same."""
GIVEN, END = "self : this, () => {", "}));"
"""How the library begins and ends: a function, given to another that calls it."""


@dataclass(frozen=True)
class Script:
    """``tag``: another one where the text is."""

    content: bytes
    tag: str


@cache
def plotly() -> Script:
    """What is served at ADDRESS. 5 MB."""
    # To import the package for its place would take a third of a second.
    found = find_spec("plotly")
    assert found is not None and found.submodule_search_locations, "plotly is among the requirements"
    path = Path(found.submodule_search_locations[0]) / "package_data" / "plotly.min.js"
    content = read_once(path.read_text(encoding="utf-8")).encode()
    return Script(content, f'"{hashlib.sha256(content).hexdigest()[:16]}"')


def read_once(text: str) -> str:
    """A browser that meets a function looks for its end first, and reads it again when it is called: a quarter of a second for
    this one. In brackets it is taken for one that is called at once. A library that is laid out otherwise stays as it is."""
    head, given, body = text.partition(GIVEN)
    if not given or not body.endswith(END):
        return text
    return f"{head}{given.replace('() =>', '(() =>')}{body.removesuffix(END)}}})));"
