"""Pages from templates that escape whatever is put into them, and figures that offer nothing but to be looked at."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup
from plotly.offline import get_plotlyjs

BUTTONS = [["toImage", "zoom2d", "pan2d", "resetScale2d"]]
"""All that a figure offers: nothing that sends it anywhere."""
FIGURE = {
    "displaylogo": False,
    "responsive": True,
    "displayModeBar": "hover",
    "modeBarButtons": BUTTONS,
    "showSendToCloud": False,
}
"""Settings of every figure on a page."""


@cache
def _environment() -> Environment:
    loader = PackageLoader("ee_dist.viewing", "templates")
    return Environment(loader=loader, autoescape=True, undefined=StrictUndefined)


def rendered(name: str, **values: Any) -> str:
    """A template with its style and the plotting library inside: the page opens without a network."""
    environment = _environment()
    style = environment.get_template("report.css").render()
    page = environment.get_template(name)
    return page.render(style=Markup(style), plotting=Markup(get_plotlyjs()), **values)


def script(name: str) -> Markup:
    """A script of ours, as it is."""
    environment = _environment()
    assert environment.loader is not None
    source, _, _ = environment.loader.get_source(environment, name)
    return Markup(source)
