"""Fuzzing that is led by what a file reached in the code: libFuzzer by way of atheris, beside the damage of ``tests/fuzz``.

Atheris is no dependency of anything: ``pip install atheris`` where it is wanted (it has wheels for Linux and Python up to 3.13).
Half of the files are made by the house's own damage and half by libFuzzer's; both begin with what reached something new.
"""

from __future__ import annotations

import contextlib
import io
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from random import Random

LED_BY = ("ee_dist", "mcap", "rosbags", "yaml", "omegaconf")
"""Packages whose lines lead it. What else reads is compiled, or reads nothing of a user's."""
COMPILED = ("ee_dist.engines.compiled",)
"""Numba compiles its functions, and knows no counters in them."""
LONGEST = 200_000
"""Bytes of a file."""

Damage = Callable[[Random, bytes], bytes]


@contextlib.contextmanager
def watched() -> Iterator[None]:
    """What is imported within it is counted. Ends the program with one line where atheris is not installed."""
    try:
        import atheris
    except ImportError:
        sys.exit("--guided: atheris is not installed; pip install atheris, or leave --guided out")
    with (
        contextlib.redirect_stderr(io.StringIO()),  # a line for each module
        atheris.instrument_imports(include=list(LED_BY), exclude=list(COMPILED)),
    ):
        yield


def lead(files: Sequence[bytes], corpus: Path, seed: int, damage: Damage, take: Callable[[int, bytes], None]) -> None:
    """``take(which of the files, content)`` for ever: it ends the process. What reached something new is kept in ``corpus``."""
    import atheris

    corpus.mkdir(exist_ok=True)
    for which, content in enumerate(files):
        (corpus / f"sample_{which}").write_bytes(bytes([which]) + content)

    def change(data: bytes, longest: int, number: int) -> bytes:
        rng = Random(number)
        which, content = data[:1] or b"\0", data[1:]
        if rng.random() < 0.5:
            return (which + damage(rng, content))[:longest]
        return (which + atheris.Mutate(content, longest - 1))[:longest] if content else which

    def one(data: bytes) -> None:
        take(data[0] % len(files) if data else 0, data[1:])

    options = (
        f"-seed={seed + 1}",
        f"-max_len={LONGEST}",
        "-len_control=0",
        "-rss_limit_mb=0",
        "-timeout=1000",
        "-detect_leaks=0",
    )
    atheris.Setup(["fuzz", *options, f"-artifact_prefix={corpus.parent}/", str(corpus)], one, custom_mutator=change)
    try:
        atheris.Fuzz()
    finally:
        os._exit(1)  # it has no end of its own
