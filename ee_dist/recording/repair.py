"""Makes a sound file of one that was cut short, so that viewers and other programs can open it."""

from __future__ import annotations

from pathlib import Path

from ee_dist.recording.errors import RecordingError
from ee_dist.recording.reader import read_with_order
from ee_dist.recording.records import HypothesisRecord, TrialRecord
from ee_dist.recording.writer import RunWriter


def repair(path: str | Path, output: str | Path | None = None) -> Path:
    """Write what survived in ``path`` to ``output`` and return that; ``path`` itself is left as it is.

    Without ``output``, ``run.mcap.part`` and ``run.mcap`` become ``run.recovered.mcap``. The metadata of the new file
    have ``recovered`` = "true". The file is sound, but its run stays not ``complete``: something of it is missing.
    Raises RecordingError if nothing can be recovered, or nothing has to be.
    """
    source = Path(path)
    target = Path(output) if output is not None else source.with_name(_stem(source.name) + ".recovered.mcap")
    if source.resolve() in (target.resolve(), target.with_name(target.name + ".part").resolve()):
        raise RecordingError(f"{source}: a repair must not write over the file that it reads; name another output")
    run, records = read_with_order(source)
    if run.complete:
        raise RecordingError(f"{source}: complete already; nothing to repair")
    with RunWriter(target, run.robot, run.metadata, run.attachments) as writer:
        for record in records:
            if isinstance(record, TrialRecord):
                writer.trial(record)
            elif isinstance(record, HypothesisRecord):
                writer.hypothesis(record)
            else:
                writer.generation(record)
        writer.finish({"recovered": "true"}, complete=False)
    return target


def _stem(name: str) -> str:
    return name.removesuffix(".part").removesuffix(".mcap")
