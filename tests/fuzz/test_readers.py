"""Every reader against cut, bit-flipped, spliced, foreign and cunningly wrong files: an answer or one line, never a crash.

The fast suite draws a few of each; ``EE_DIST_FUZZ=100000 pytest tests/fuzz`` as many as one likes, and ``tools/fuzz.py`` for as
long as one likes, with bounds of time and memory. Each failure found is kept in the folder ``found``.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path
from random import Random

import pytest

# Under every import mode of pytest.
sys.path.insert(0, str(Path(__file__).parent))

from damage import FOREIGN, damaged
from kinds import OURS
from samples import SAMPLES, place
from samples import sample as sample_of

COUNT = int(os.environ.get("EE_DIST_FUZZ", "8"))
NAMES = sorted(SAMPLES)
FOUND = sorted(p for p in (Path(__file__).parent / "found").rglob("*") if p.is_file())


@pytest.fixture(autouse=True)
def elsewhere(tmp_path_factory, monkeypatch):
    """A working folder into which no reader writes anything."""
    folder = tmp_path_factory.mktemp("working")
    monkeypatch.chdir(folder)
    yield
    assert not list(folder.iterdir())


def look(folder: Path, name: str, target: str, content: bytes) -> None:
    """Read the sample with one of its files replaced. Any error but ours, in one line, fails."""
    sample = sample_of(name)
    path = folder / sample.main
    (folder / target).write_bytes(content)
    for read in sample.readers:
        try:
            read(path)
        except sample.allowed as error:
            text = str(error)
            if isinstance(error, OURS):
                assert "\n" not in text, text
                assert len(text) < 2000, text


@pytest.mark.parametrize("name", NAMES)
def test_the_files_themselves_are_read(tmp_path, name):
    sample = sample_of(name)
    path = place(sample, tmp_path)
    for read in sample.readers:
        if read.__name__ != "repaired":  # it is whole
            read(path)


@pytest.mark.parametrize("name", NAMES)
def test_foreign_files(tmp_path, name):
    sample = sample_of(name)
    place(sample, tmp_path)
    for content in Random(name).sample(FOREIGN, min(len(FOREIGN), COUNT)):
        look(tmp_path, name, sample.targets()[0], content)


@pytest.mark.parametrize("name", NAMES)
def test_damaged_files(tmp_path, name):
    sample = sample_of(name)
    others = tuple(next(iter(sample_of(n).files.values())) for n in ("URDF", "NumPy", "JSON", "CSV"))
    place(sample, tmp_path)
    for seed in range(COUNT):
        rng = Random(f"{name} {seed}")
        target = rng.choice(sample.targets())
        look(tmp_path, name, target, damaged(rng, sample.files[target], others))
        (tmp_path / target).write_bytes(sample.files[target])


@pytest.mark.parametrize("file", FOUND, ids=lambda p: p.name)
def test_what_failed_once(tmp_path, file):
    """In a folder by the name of the reader; named by a number and the path of what was damaged, ``/`` as ``+``."""
    name = next(n for n in NAMES if n.replace(" ", "_").replace(",", "") == file.parent.name)
    sample = sample_of(name)
    place(sample, tmp_path)
    look(tmp_path, name, file.name.split("__", 1)[1].replace("+", "/"), file.read_bytes())
