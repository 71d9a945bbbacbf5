"""What holds for every test."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from pathlib import Path

import pytest
from hypothesis import settings

from ee_dist.effects import catalogue, laws, plugins
from ee_dist.viewing.browser import BrowserError, HeadlessBrowser, chromium

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN and threading.current_thread() is threading.main_thread():
    # In the background of a shell Ctrl-C is ignored, also by what tests start to see what it does with one.
    signal.signal(signal.SIGINT, signal.default_int_handler)

# How long an example takes says what else the machine does.
settings.register_profile("without a clock", deadline=None)
settings.load_profile("without a clock")

LONGEST = (
    "tasks/test_every_run.py", "workbench/test_page.py", "tasks/test_verbs.py", "discrepancy/test_assumed.py",
    "tasks/test_gene_network.py",
    "recovery/test_loop.py", "real/test_bring_your_robot.py", "tasks/test_study.py", "tasks/test_folders.py",
    "effects/test_effect_catalogue.py", "tasks/test_recover.py", "tasks/test_resume.py", "discrepancy/test_ways.py",
    "tasks/test_repair_gaits.py", "tasks/test_socket_robot.py", "recovery/test_doubt.py", "discrepancy/test_too_much.py",
)  # fmt: skip
"""Files that take the most time. Side by side they begin first: one that begins last is waited for by an idle core."""


def pytest_configure(config: pytest.Config) -> None:
    # By itself xdist begins with the files of the most tests, and those of the fewest are the longest here.
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False
    gone = [name for name in LONGEST if not (Path(__file__).parent / name).is_file()]
    if gone:
        raise pytest.UsageError(f"tests/conftest.py: LONGEST names what is not there: {gone}")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    place = {Path(__file__).parent / name: k for k, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path, len(place)))


@pytest.fixture(autouse=True)
def own_catalogue() -> Iterator[None]:
    """Leaves the catalogue as it was: an effect that one test's plugin registers is a candidate in no other test."""
    registries: tuple[dict, ...] = (catalogue.registered, plugins._plugins, laws.LAWS, laws.TEXTS)
    kept = [dict(registry) for registry in registries]
    yield
    for registry, before in zip(registries, kept, strict=True):
        if registry != before:
            registry.clear()
            registry.update(before)


@pytest.fixture(scope="session")
def window() -> Iterator[HeadlessBrowser]:
    """One browser for all tests that look at pages."""
    try:
        chromium()
    except BrowserError as missing:
        pytest.skip(str(missing))
    with HeadlessBrowser() as found:
        yield found
