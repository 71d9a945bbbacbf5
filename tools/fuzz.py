"""Feed damaged files to every reader for as long as told, within bounds of time and memory, and keep each that fails.

    python tools/fuzz.py --minutes 2 --seed 0 --table fuzz.md
    python tools/fuzz.py --minutes 2 --seed 0 --guided --only CSV    # led by what is reached (tools/guided.py)

Each reader runs in a process of its own, which is started again after a crash. A failure is an error that is none of ours, one
that is not one line, a crash, a hang, or more than the bound of seconds or of memory for one file. The samples and the damage
are those of ``tests/fuzz``; a file that failed goes into ``tests/fuzz/found/READER``, where it is a test. Minutes are of the
processor, so that it does not matter what else the machine does.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import os
import resource
import signal
import sys
import tempfile
import time
import traceback
import warnings
from dataclasses import asdict, dataclass, field
from pathlib import Path
from random import Random

FUZZ = Path(__file__).parents[1] / "tests" / "fuzz"
sys.path.insert(0, str(Path(__file__).parents[1]))
sys.path.insert(0, str(FUZZ))

import guided  # noqa: E402

with guided.watched() if "--guided" in sys.argv else contextlib.nullcontext():  # before what reads is imported
    from damage import FOREIGN, damaged
    from kinds import OURS, Sample
    from samples import SAMPLES, place
    from samples import sample as sample_of

SECONDS = 10.0
"""Of the processor, for one file; all samples are smaller than 200 kB."""
STUCK_S = 300.0
"""Without any progress, of real time."""
MEGABYTES = 300.0
"""Of memory, above what the process had before it read the file."""
GIGABYTES = 4
"""Beyond which no memory is given, so that a file that takes all of it fails and nothing else on the machine does."""
SETTLED = 20
"""Files before memory is looked at: libraries are loaded when they are first needed."""
MOST = 20
"""Failures of one reader, after which there is enough to mend."""
TELL_EVERY = 50


@dataclass
class Figures:
    """Of one reader. ``read`` and ``refused`` count calls: some samples have several readers."""

    files: int = 0
    cpu_s: float = 0.0
    read: int = 0
    refused: int = 0
    longest_s: float = 0.0
    most_mb: float = 0.0
    failures: dict[str, str] = field(default_factory=dict)
    led: int = 0
    """Files that reached something new in the code, where that is looked at."""

    def row(self, name: str) -> str:
        return (
            f"| {name} | {self.files} | {self.cpu_s / 60:.1f} | {self.read} | {self.refused} | {self.longest_s:.2f} "
            f"| {self.most_mb:.0f} | {len(self.failures)} |" + f" {self.led} |" * (self.led > 0)
        )


class Labour:
    """One process that reads: what it reads now is in ``now``, its figures are in ``told``, before anything can go wrong."""

    def __init__(
        self, name: str, seed: int, cpu_s: float, folder: Path, figures: Figures, corpus: Path | None = None
    ) -> None:
        self.name, self.seed, self.cpu_s, self.folder, self.figures = name, seed, cpu_s, folder, figures
        self.corpus = corpus

    def run(self) -> None:
        warnings.simplefilter("ignore")
        sample = sample_of(self.name)
        others = tuple(next(iter(sample_of(n).files.values())) for n in ("URDF", "NumPy", "JSON", "CSV"))
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        (self.folder / "files").mkdir()
        path = place(sample, self.folder / "files")
        for read in sample.readers:  # loads what they need
            with contextlib.suppress(sample.allowed):
                read(path)
        signal.signal(signal.SIGPROF, _late)
        most = status_mb("VmSize") * 2**20 + GIGABYTES * 2**30
        resource.setrlimit(resource.RLIMIT_AS, (int(most), int(most)))
        self.started, self.begun, self.first, self.base = (
            time.process_time(), self.figures.cpu_s, self.figures.files, peak_mb(),
        )  # fmt: skip
        if self.corpus is not None:
            files = [sample.files[name] for name in sample.targets()]
            guided.lead(
                files,
                self.corpus,
                self.seed,
                lambda rng, c: _hurt(rng, c, others),
                lambda k, c: self.led(sample, path, k, c),
            )
        while not self.over:
            rng = Random(f"{self.seed} {self.name} {self.figures.files}")
            target = rng.choice(sample.targets())
            self.take(sample, path, target, _hurt(rng, sample.files[target], others))
        self.tell()

    @property
    def over(self) -> bool:
        return self.figures.cpu_s >= self.cpu_s or len(self.figures.failures) >= MOST

    def led(self, sample: Sample, path: Path, which: int, content: bytes) -> None:
        """One file that libFuzzer made; ends the process where it is time."""
        self.take(sample, path, sample.targets()[which], content)
        if self.over:
            self.tell()
            os._exit(0)

    def take(self, sample: Sample, path: Path, target: str, content: bytes) -> None:
        """One file in the place of ``target``, and what became of it."""
        (self.folder / "now").write_bytes(json.dumps([self.figures.files, target]).encode() + b"\n" + content)
        (self.folder / "files" / target).write_bytes(content)
        trouble, seconds = self.read(sample, path)
        mb = peak_mb()
        if self.figures.files < self.first + SETTLED:
            self.base = mb
        elif mb - self.base > MEGABYTES and not trouble:
            trouble = f"memory: {mb - self.base:.0f} MB"
        (self.folder / "files" / target).write_bytes(sample.files[target])
        self.figures.most_mb = max(self.figures.most_mb, mb - self.base)
        self.figures.longest_s = max(self.figures.longest_s, seconds)
        self.figures.files += 1
        self.figures.cpu_s = self.begun + time.process_time() - self.started
        if trouble and (key := _said(trouble)) not in self.figures.failures:
            self.figures.failures[key] = trouble
            keep(self.name, self.figures.files - 1, target, content)
        if trouble or self.figures.files % TELL_EVERY == 0:
            self.tell()

    def read(self, sample: Sample, path: Path) -> tuple[str, float]:
        """What went wrong, if anything, and the seconds that it took."""
        trouble, began = "", time.process_time()
        signal.setitimer(signal.ITIMER_PROF, SECONDS)
        for read in sample.readers:
            try:
                read(path)
                self.figures.read += 1
            except sample.allowed as error:
                self.figures.refused += 1
                if isinstance(error, OURS) and ("\n" in str(error) or len(str(error)) > 2000):
                    trouble = f"not one line: {str(error)[:300]!r}"
            except BaseException as error:
                trouble = "".join(traceback.format_exception(error)[-8:])[-2500:]
        signal.setitimer(signal.ITIMER_PROF, 0)
        return trouble, time.process_time() - began

    def tell(self) -> None:
        part = self.folder / "told.part"
        part.write_text(json.dumps(asdict(self.figures)))
        part.replace(self.folder / "told")


def _hurt(rng: Random, content: bytes, others: tuple[bytes, ...]) -> bytes:
    return rng.choice(FOREIGN) if rng.random() < 0.02 else damaged(rng, content, others)


def peak_mb() -> float:
    """The most that this process had since the last call, MB."""
    most = status_mb("VmHWM")
    Path("/proc/self/clear_refs").write_text("5")
    return most


def status_mb(name: str) -> float:
    return float(Path("/proc/self/status").read_text().split(f"{name}:")[1].split()[0]) / 1024


def _late(*_: object) -> None:
    raise TimeoutError(f"more than {SECONDS:g} s")


def _said(trouble: str) -> str:
    """The same failure in the same words: its last line and where it was raised."""
    lines = [line.strip() for line in trouble.splitlines() if line.strip()]
    places = [line for line in lines if line.startswith("File ")]
    return lines[-1][:60] + (f" {places[-1][-70:]}" if places else "")


def keep(name: str, number: int, target: str, content: bytes) -> None:
    folder = FUZZ / "found" / name.replace(" ", "_").replace(",", "")
    folder.mkdir(parents=True, exist_ok=True)
    (folder / f"{number}__{target.replace('/', '+')}").write_bytes(content)


def fuzz(name: str, seed: int, minutes: float, corpus: Path | None = None) -> Figures:
    """One reader for so long, its process started again where it crashed or hung. ``corpus``: led by what is reached."""
    figures = Figures()
    while figures.cpu_s < 60 * minutes and len(figures.failures) < MOST:
        with tempfile.TemporaryDirectory() as place:
            folder, now = Path(place), Path(place) / "now"
            labour = Labour(name, seed, 60 * minutes, folder, figures, corpus)
            process = multiprocessing.get_context("fork").Process(target=labour.run)
            process.start()
            seen, since = -1, time.monotonic()
            while process.is_alive():
                process.join(1.0)
                stamp = now.stat().st_mtime_ns if now.exists() else -1
                if stamp != seen:
                    seen, since = stamp, time.monotonic()
                elif time.monotonic() - since > STUCK_S:
                    process.kill()
            if (folder / "told").exists():
                figures = Figures(**json.loads((folder / "told").read_text()))
            if process.exitcode:
                if not now.exists():
                    sys.exit(f"{name}: its sample could not be made")
                head, _, content = now.read_bytes().partition(b"\n")
                figures.files, target = json.loads(head)
                figures.failures[f"ended with status {process.exitcode} at {figures.files}"] = ""
                keep(name, figures.files, target, content)
                figures.files += 1
    return figures


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--minutes", type=float, default=1.0, help="of the processor, for each reader")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--guided", action="store_true", help="led by what a file reaches in the code; needs atheris")
    parser.add_argument("--only", nargs="*", default=[], choices=[*SAMPLES, []], help="names of readers")
    parser.add_argument("--table", type=Path, help="append the figures there, as Markdown")
    given = parser.parse_args()
    bad = 0
    for name in given.only or SAMPLES:
        with tempfile.TemporaryDirectory() as place:
            corpus = Path(place) / "corpus" if given.guided else None
            figures = fuzz(name, given.seed, given.minutes, corpus)
            figures.led = len(list(corpus.iterdir())) if corpus is not None else 0
        print(figures.row(name), *(f"  {k}\n{v}" for k, v in figures.failures.items()), sep="\n", flush=True)
        if given.table:
            with given.table.open("a", encoding="utf-8") as file:
                file.write(figures.row(name) + "\n")
        bad += len(figures.failures)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
