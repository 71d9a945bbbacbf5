"""What holds for every test."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator

import pytest
from hypothesis import settings

from ee_dist.effects import catalogue, laws
from ee_dist.viewing.browser import BrowserError, HeadlessBrowser, chromium

if signal.getsignal(signal.SIGINT) is signal.SIG_IGN and threading.current_thread() is threading.main_thread():
    # In the background of a shell Ctrl-C is ignored, also by what tests start to see what it does with one.
    signal.signal(signal.SIGINT, signal.default_int_handler)

# How long an example takes says what else the machine does.
settings.register_profile("without a clock", deadline=None)
settings.load_profile("without a clock")


@pytest.fixture(autouse=True)
def own_catalogue() -> Iterator[None]:
    """Leaves the catalogue as it was: an effect that one test's plugin registers is a candidate in no other test."""
    registries: tuple[dict, ...] = (catalogue._registry, catalogue._plugins, laws.LAWS)
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
